"""Reads Nastran files: matrices of OUTPUT4 or DMIG with their grid points, or a mesh of solid elements in bulk data."""

from __future__ import annotations

import re
from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np

from fretwear.importing import Rejected, axes, bulk, child, constraints, folder, nastran_mesh
from fretwear.importing.bulk import Bulk, Card
from fretwear.importing.folder import Structure
from fretwear.importing.nastran_mesh import HARMLESS, READ


#: Digits of a value in a text file: up to EXACT the value is exact, up to SHORT it is in single precision, FULL is double precision.
EXACT, SHORT, FULL = 4, 8, 17


def _role(name: str) -> str | None:
    """Returns the matrix that a name of Nastran denotes, such as K, KAA, KGG, KAAX, M3GG, K4AA or BAAX."""
    match = re.fullmatch(r"(K4|K|M|B)\d?((?:AA|FF|GG|JJ|LL|NN|OO|TT|XX|ZZ)[XEPT]?)?", name.upper())
    return {"K4": "Ks", "K": "K", "M": "M", "B": "C"}[match[1]] if match else None


def _as_written(values: np.ndarray, digits: int, is_single: bool) -> np.ndarray:
    """Returns values in single precision if the file stores this type, or if its text has no more digits."""
    is_short = digits <= SHORT
    if digits <= EXACT or not (is_single or is_short):
        return values
    single = values.astype(np.complex64 if values.dtype.kind == "c" else np.float32)
    # Programs with 64-bit words declare double precision as single precision, so the values decide. The tolerances allow for the
    # rounding of decimal digits.
    return single if np.allclose(single, values, rtol=1e-6 if is_short else 1e-9, atol=0.0) else values


def read_op4(file: str) -> dict[str, Any]:
    """Reads an OUTPUT4 file. Runs in the child process."""
    from pyyeti.nastran import op4
    from scipy import sparse

    names, matrices, forms, kinds = op4.load(file, into="list", sparse=True)
    result: dict[str, Any] = {"names": [str(name) for name in names], "forms": [int(form) for form in forms]}
    with Path(file).open("rb") as opened:
        # A format such as 1P,3E23.16 writes one digit before the decimal point.
        formats = [
            found[1] for line in opened if (found := re.match(rb"[ \d-]{32,48}\w+ *(?:1P,)?\d+[ED]\d+\.(\d+)", line, re.IGNORECASE))
        ]
    digits = [1 + int(decimals) for decimals in formats] if len(formats) == len(names) else [FULL] * len(names)
    for k, matrix in enumerate(matrices):
        matrix = sparse.coo_array(matrix)
        result |= {
            f"{k} at": np.array([matrix.row, matrix.col], np.int64),
            f"{k} values": _as_written(matrix.data, digits[k], kinds[k] in (1, 3)),
            f"{k} shape": np.array(matrix.shape),
        }
    return result


def _add(structure: Structure, name: str, matrix: Any, file: Path, taken: dict[str, str]) -> None:
    role = _role(name)
    if role is None:
        structure.left_out.append(
            f"{file}: the import ignores the matrix {name}, because its name denotes neither stiffness, mass nor damping."
        )
        return
    if role in taken and matrix.count_nonzero():
        raise Rejected(
            f"{file}: the names of the matrices {name} and {taken[role]} both denote {folder.MATRICES[role]}; write only one of them"
        )
    if not matrix.count_nonzero():
        structure.left_out.append(f"{file}: the import ignores the matrix {name}, because the matrix is zero.")
        return
    taken[role] = name
    real, imaginary = folder.complex_parts(role, matrix, f"{file}: {name}")
    structure.matrices[role] = real
    if imaginary is not None:
        if "Ks" in taken:
            raise Rejected(
                f"{file}: the complex matrix {name} and the matrix {taken['Ks']} both give structural damping; give only one of them"
            )
        structure.matrices["Ks"], taken["Ks"] = imaginary, f"{name} (imaginary part)"


def _op4(structure: Structure, file: Path, taken: dict[str, str]) -> None:
    found = child.call("fretwear.importing.nastran:read_op4", {"file": str(file)}, files=[file], library="pyyeti", extra="nastran")
    if not found["names"]:
        raise Rejected(f"{file}: the file has no matrix; write KAA and MAA with OUTPUT4")
    for k, name in enumerate(found["names"]):
        shape = tuple(int(length) for length in found[f"{k} shape"])
        if shape[0] != shape[1] and _role(name):
            raise Rejected(f"{file}: the matrix {name.upper()} has {shape[0]} rows and {shape[1]} columns; it must be square")
        matrix = folder.of_entries(found[f"{k} at"], found[f"{k} values"], shape, f"{file}: {name.upper()}")
        _add(structure, name.upper(), matrix, file, taken)


def _rows(data: Bulk, count: int, file: Path) -> np.ndarray:
    """Returns the node and the direction of each row of matrices without row names."""
    for card in data.named("SECONCT"):
        numbers = bulk.ids(card, 0)
        pairs = numbers[2:] if len(numbers) % 2 == 0 else numbers[1:]
        if any("THRU" == str(value).upper() for value in card.fields):
            continue
        if any(a != b for a, b in zip(pairs[::2], pairs[1::2], strict=False)):
            raise card.reject("different node numbers in the superelement", "the .pch file of the superelement with EXTRN")
    externals: list[tuple[int, int]] = []
    for card in data.named("EXTRN"):
        fields = [value for value in card.fields if value != ""]
        for node, directions in zip(fields[::2], fields[1::2], strict=False):
            if not isinstance(node, int) or not re.fullmatch(r"0|[1-6]+", str(directions)):
                raise card.reject(f"the values {node}, {directions}", "pairs of a node and its directions")
            externals += [(node, int(digit)) for digit in str(directions)]
    if externals:
        if externals != sorted(externals):
            raise data.named("EXTRN")[0].reject("nodes that do not ascend", "ascending nodes, like the rows of OUTPUT4")
        rows, source = externals, "EXTRN"
    else:
        points = [number for card in data.named("SPOINT") for number in bulk.ids(card, 0)]
        rows = sorted([(grid, direction) for grid in data.positions for direction in range(1, 7)] + [(point, 0) for point in points])
        source = "the count of six rows per GRID and one row per SPOINT"
    if len(rows) != count:
        raise Rejected(
            f"{file}: the matrices have {count} rows, but {source} gives {len(rows)} rows; give the .pch file with EXTRN, "
            "or write DMIG, which names its rows"
        )
    return np.array(rows, np.int64).reshape(-1, 2)


def _dmig(structure: Structure, data: Bulk, file: Path, taken: dict[str, str]) -> None:
    from scipy import sparse

    heads: dict[str, Card] = {}
    seen: dict[str, set[tuple[Any, ...]]] = {}
    for card in data.named("DMIG"):
        name = str(card.get(0)).upper()
        if card.get(1) == 0:
            if name in heads or any(value != "" for value in card.fields[9:]):
                raise card.reject(
                    f"a second header of {name}, or a header on several lines", "one header DMIG, NAME, 0, ... on one line"
                )
            heads[name] = card
            form, polar = card.get(2), card.get(5)
            if _role(name) and (form not in (1, 6) or polar not in ("", 0) or card.get(3) not in (1, 2, 3, 4)):
                raise card.reject(
                    f"the matrix {name} with form {form} and POLAR {polar or 0}",
                    "form 1 (square) or 6 (symmetric), with real and imaginary parts (POLAR 0)",
                )
            continue
        if name not in heads:
            raise card.reject(f"a column of {name} before its header", "the header DMIG, NAME, 0, ... first")
        column, entries = (card.whole(1), card.whole(2, 0)), card.fields[4:]
        while entries and entries[-1] == "":
            entries.pop()
        for k in range(0, len(entries), 4):
            row = tuple(entries[k : k + 2])
            value = entries[k + 2 : k + 4]
            if (
                len(row) < 2
                or not all(isinstance(part, int) for part in row)
                or not 0 <= row[1] <= 6
                or not value
                or isinstance(value[0], str)
            ):
                raise card.reject(f"the values {entries[k : k + 4]} in a column of {name}", "a node, a direction and a value")
            ends = tuple(sorted([row, column])) if heads[name].get(2) == 6 else (row, column)
            if ends in seen.setdefault(name, set()):
                raise card.reject(f"the entry {row}, {column} of {name} twice", "each entry once")
            seen[name].add(ends)
    found = data.dmig
    if found["dmig"]:
        raise Rejected(f"{file}: pyyeti cannot read the DMIG entries of the file: {found['dmig']}; the file may be damaged")
    tables = [name for name in heads if _role(name)]
    everything = sorted(
        {
            tuple(row)
            for name in tables
            for end in ("rows", "columns")
            for row in found.get(f"{name.lower()} {end}", np.zeros((0, 2))).tolist()
        }
    )
    place = {row: k for k, row in enumerate(everything)}
    structure.rows = np.array(everything, np.int64).reshape(-1, 2)
    for name in heads:
        if name not in tables or f"{name.lower()} at" not in found:
            structure.left_out.append(
                f"{file}: the import ignores the matrix {name}, "
                "because it is empty or its name denotes neither stiffness, mass nor damping."
            )
            continue
        rows, columns = (np.array([place[tuple(row)] for row in found[f"{name.lower()} {end}"].tolist()]) for end in ("rows", "columns"))
        i, j = found[f"{name.lower()} at"]
        values = _as_written(found[f"{name.lower()} values"], found["digits"].get(name, FULL), heads[name].get(3) in (1, 3))
        _add(
            structure,
            name,
            sparse.csr_array((values, (rows[i], columns[j])), shape=(len(everything),) * 2),
            file,
            taken,
        )


def _matrices(structure: Structure, data: Bulk, files: list[Path]) -> None:
    taken: dict[str, str] = {}
    op4 = [file for file in files if file.suffix.lower() == ".op4"]
    if op4 and data.named("DMIG"):
        raise Rejected(f"{op4[0]}: {data.named('DMIG')[0].file} contains DMIG matrices too; give either OUTPUT4 or DMIG matrices")
    for file in op4:
        _op4(structure, file, taken)
        structure.files.append(file)
    where = str(op4[0] if op4 else data.named("DMIG")[0].file)
    if op4:
        if "K" not in structure.matrices:
            raise Rejected(
                f"{where}: no matrix has the name of a stiffness matrix; "
                f"the other known matrices are {', '.join(taken.values()) or 'none'}; write KAA and MAA"
            )
        structure.rows = _rows(data, structure.matrices["K"].shape[0], Path(where))
    else:
        _dmig(structure, data, Path(where), taken)
    with_matrices = {card.file for card in data.named("DMIG")}
    others: dict[str, int] = {}
    for card in data.cards:
        is_part = card.name not in READ - {
            "CHEXA",
            "CPENTA",
            "CTETRA",
            "PSOLID",
            "MAT1",
            "MPC",
            "RBE2",
            "SPC",
            "SPC1",
        } and not HARMLESS.fullmatch(card.name)
        if is_part and card.file in with_matrices:
            raise card.reject(
                "a place beside DMIG matrices", "DMIG matrices of the whole structure, in a file without elements and constraints"
            )
        if is_part or HARMLESS.fullmatch(card.name):
            others[card.name] = others.get(card.name, 0) + 1
    structure.left_out += [
        f"The import ignores {name} ({number} ×), because the matrices already contain its effect, or it has none."
        for name, number in others.items()
    ]
    if lines := [line.strip() for line in data.case if re.match(r"\s*[KMB]4?2GG\s*=", line, re.IGNORECASE)]:
        raise Rejected(
            f"the case control has {lines[0]}, which adds a matrix to the matrix of the elements; "
            "write the matrices of the whole structure"
        )
    held, equations, rigid = constraints.selected(structure, data)
    held |= {(terms[0][0], terms[0][1]) for terms, _ in equations}
    held |= {(node, int(digit)) for card in rigid for node in constraints.dependents(card)[2] for digit in constraints.dependents(card)[1]}
    free = [tuple(row) for row in structure.rows.tolist() if tuple(row) in held]  # type: ignore[union-attr]
    if free:
        raise Rejected(
            f"{where}: node {free[0][0]} has a row for its direction {free[0][1]}, which SPC, MPC or RBE2 constrains; "
            "write the matrices of the a-set, or remove the constraint"
        )
    structure.labels, structure.positions = list(data.positions), np.array(list(data.positions.values())).reshape(-1, 3)
    for name, matrix in structure.matrices.items():
        if matrix.shape[0] != len(structure.rows):  # type: ignore[arg-type]
            raise Rejected(
                f"{where}: the matrix {taken[name]} has {matrix.shape[0]} rows, but the matrix {taken['K']} has "
                f"{len(structure.rows)} rows; both numbers must be equal"  # type: ignore[arg-type]
            )
    axes.to_global(structure.matrices, structure.rows, data.axes, where)  # type: ignore[arg-type]
    folder.check_matrices(structure, where)


def read(files: list[Path], options: Namespace) -> Structure:
    structure = Structure([], libraries=["pyyeti"])
    text_files = [file for file in files if file.suffix.lower() != ".op4"]
    data = bulk.read(text_files, structure.files) if text_files else Bulk()
    if not data.positions:
        raise Rejected(
            f"{files[0]}: no GRID entry gives positions of nodes; give the .bdf, .pch or .asm file with the GRID entries too"
        )
    if again := data.named("BEGIN"):
        raise again[0].reject("a second section of bulk data", "one section of bulk data")
    if data.named("DMIG") or len(text_files) < len(files):
        _matrices(structure, data, files)
        nastran_mesh.parameters(structure, data)
    else:
        nastran_mesh.read(structure, data, text_files[0])
    if data.case:
        structure.left_out.append(
            "The import reads only sets and the selection of SPC and MPC from the executive control and the case control."
        )
    known = set(structure.labels)
    for name, nodes in [*data.sets.items(), *((f"SET{card.whole(0)}", bulk.ids(card, 1, data.positions)) for card in data.named("SET1"))]:
        structure.sets[name] = [node for node in nodes if node in known]
        if len(structure.sets[name]) < len(nodes):
            structure.left_out.append(
                f"The import omits {len(nodes) - len(structure.sets[name])} members of {name}, because they are not nodes of the structure."
            )
    return structure
