"""Reads ANSYS `.full` files with ansys-mapdl-reader. A `.cdb` file gives the nodes, the components and the node angles."""

from __future__ import annotations

import re
from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np

from fretwear.importing import Rejected, axes, child, folder
from fretwear.importing.folder import Structure

#: Commands of a .cdb file that may change the axes or the positions of nodes after NBLOCK.
CHANGES = re.compile(r"\s*(N|NROTAT|NMODIF|NANG|NORA|TRANSFER|NSCALE|NGEN|LOCAL|CSYS|CS)\s*,(.*)", re.IGNORECASE)


def read_full(file: str) -> dict[str, Any]:
    """Reads a `.full` file. Runs in the child process."""
    from ansys.mapdl.reader.full import FullFile

    # `sort=False` keeps the rows in the order of the file. `sort=True` would also sort the directions.
    full = FullFile(file)
    if equations := int(full._header["ncefull"]):
        raise Rejected(
            f"{file}: the file has {equations} constraint equations, which ansys-mapdl-reader does not apply; "
            "write the matrices without CE and CP"
        )
    rows, stiffness, mass = full.load_km(as_sparse=True, sort=False)
    result: dict[str, Any] = {"rows": np.array(rows, np.int64), "held": np.array(full.const, np.int64).reshape(-1, 2)}
    if stiffness is None or mass is None:
        raise Rejected(
            f"{file}: the file has no {'stiffness' if stiffness is None else 'mass'} matrix; write the file in a modal analysis (WRFULL)"
        )
    for name, matrix in (("K", stiffness), ("M", mass)):
        matrix = matrix.tocoo()
        result |= {
            f"{name} at": np.array([matrix.row, matrix.col], np.int64),
            f"{name} values": np.array(matrix.data, float),
            f"{name} shape": np.array(matrix.shape),
        }
    return result


def _rotation(angles: list[float]) -> np.ndarray:
    """Returns the nodal axes x, y and z as rows, along the global axes.

    The angles in degrees are THXY about z, then THYZ about the new x, then THZX about the new y.
    """
    z, x, y = np.radians(angles)
    about_z = np.array([[np.cos(z), np.sin(z), 0], [-np.sin(z), np.cos(z), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(x), np.sin(x)], [0, -np.sin(x), np.cos(x)]])
    about_y = np.array([[np.cos(y), 0, -np.sin(y)], [0, 1, 0], [np.sin(y), 0, np.cos(y)]])
    return np.asarray(about_y @ about_x @ about_z)


def _widths(text: str, place: str) -> list[int]:
    """Returns the widths of the fields of a Fortran format such as (3i9,6e21.13e3)."""
    found: list[int] = []
    for count, width in re.findall(r"(\d*)[ie](\d+)", re.sub(r"(e\d+\.\d+)e\d+", r"\1", text.lower())):
        found += [int(width)] * int(count or 1)
    if not found or len(found) > 64:
        raise Rejected(
            f"{place}: the format is {text.strip()[:40]!r}; fretwear-import expects a Fortran format such as (3i9,6e21.13e3)"
        )
    return found


def _cut(line: str, widths: list[int]) -> list[str]:
    ends = np.cumsum(widths)
    return [line[end - width : end].strip() for end, width in zip(ends.tolist(), widths, strict=True)]


def _read_cdb(file: Path, structure: Structure) -> dict[int, np.ndarray]:
    """Reads the nodes and the node components into the structure. Returns the axes of the nodes that have angles."""
    lines = file.read_text(encoding="latin-1").splitlines()
    structure.files.append(file)
    turned: dict[int, np.ndarray] = {}
    positions: dict[int, list[float]] = {}
    others: set[str] = set()
    k = 0
    while k < len(lines):
        line, place = lines[k], f"{file}, line {k + 1}"
        k += 1
        words = [word.strip() for word in line.split(",")]
        if words[0].upper() == "NBLOCK":
            if k >= len(lines):
                raise Rejected(f"{place}: the file ends inside NBLOCK; write the file again with CDWRITE")
            widths = _widths(lines[k], f"{file}, line {k + 1}")
            integers = int(re.match(r"\s*\((\d+)i", lines[k].lower())[1]) if re.match(r"\s*\((\d+)i", lines[k].lower()) else 3  # type: ignore[index]
            k += 1
            while k < len(lines) and re.match(r"\s*\d", lines[k]):
                cells = _cut(lines[k], widths)
                try:
                    node, values = int(cells[0]), [float(cell or 0.0) for cell in [*cells[integers:], *[""] * 6][:6]]
                except ValueError:
                    raise Rejected(
                        f"{file}, line {k + 1}: the line is {lines[k][:60]!r}; fretwear-import expects a node of NBLOCK"
                    ) from None
                positions[node] = values[:3]
                if any(values[3:]):
                    turned[node] = _rotation(values[3:])
                k += 1
            if k >= len(lines) or not re.match(r"\s*(N,\s*R5|-1)", lines[k], re.IGNORECASE):
                raise Rejected(f"{file}, line {k + 1}: NBLOCK does not end with N,R5.3,LOC,-1 or -1; the file may be cut off")
            k += 1
        elif words[0].upper() == "CMBLOCK":
            kind, count = (words + ["", "", ""])[2].upper(), re.match(r"\d+", (words + ["", "", "", ""])[3])
            if not count or k >= len(lines):
                raise Rejected(f"{place}: the line is {line[:60]!r}; fretwear-import expects CMBLOCK, name, NODE or ELEM, and count")
            widths = _widths(lines[k], f"{file}, line {k + 1}")
            numbers: list[int] = []
            k += 1
            while k < len(lines) and len(numbers) < int(count[0]) and re.match(r"[\s\d-]*$", lines[k]):
                numbers += [int(cell) for cell in _cut(lines[k], widths) if re.fullmatch(r"-?\d+", cell)]
                k += 1
            if len(numbers) != int(count[0]):
                raise Rejected(f"{place}: the component {words[1]} has {len(numbers)} of {count[0]} numbers; the file may be cut off")
            if kind.startswith("NODE"):
                members: list[int] = []
                for number in numbers:
                    if number <= 0 and not (members and members[-1] < -number <= members[-1] + len(positions)):
                        raise Rejected(
                            f"{place}: the component {words[1]} has an invalid range to {number} after {members[-1:]}; "
                            "the file may be damaged"
                        )
                    members += [number] if number > 0 else range(members[-1] + 1, -number + 1)
                structure.sets[words[1].upper()] = members
            else:
                structure.left_out.append(f"{file}: the import omits the component {words[1]}, because it contains elements.")
        elif (
            (change := CHANGES.match(line))
            and not (change[1].upper() in ("CSYS",) and change[2].strip() in ("0", ""))
            and not re.match(r"\s*N,\s*UNBL", line, re.IGNORECASE)
        ):
            if change[1].upper() in ("LOCAL", "CS"):
                structure.left_out.append(
                    f"{place}: the import ignores {change[1].upper()}, because only nodes with angles use these axes."
                )
            else:
                raise Rejected(
                    f"{place}: the command {line.strip()[:60]!r} may move or rotate nodes after NBLOCK; "
                    "write the .cdb file with CDWRITE"
                )
        elif command := re.match(r"\s*([A-Z][A-Z0-9]+)\s*(,|$)", line):
            others.add(command[1])
    if others:
        structure.left_out.append(
            f"{file}: the import ignores {', '.join(sorted(others))}, because the matrices already contain their effect."
        )
    if not positions:
        raise Rejected(f"{file}: the file has no NBLOCK; write the file with CDWRITE,DB")
    structure.labels, structure.positions = list(positions), np.array(list(positions.values()))
    for name, nodes in structure.sets.items():
        if lost := [node for node in nodes if node not in positions]:
            raise Rejected(f"{file}: the component {name} has the node {lost[0]}, which is not in NBLOCK; the file may be damaged")
    return turned


def read(files: list[Path], options: Namespace) -> Structure:
    from scipy import sparse

    fulls, decks = ([file for file in files if file.suffix.lower() == suffix] for suffix in (".full", ".cdb"))
    if len(fulls) != 1 or len(decks) > 1:
        raise Rejected(f"{len(fulls)} .full files and {len(decks)} .cdb files are given; give one .full file with its .cdb file")
    file = fulls[0]
    others = [file for file in files if file.suffix.lower() == ".csv"]
    structure = Structure([file], libraries=["ansys-mapdl-reader"])
    if decks:
        turned = _read_cdb(decks[0], structure)
        if options.axes and turned:
            raise Rejected(f"{decks[0]}: node {next(iter(turned))} has angles, which contradict --axes global; remove --axes")
    elif options.axes and others:
        turned = {}
        tables: dict[str, np.ndarray] = {}
        folder.csv_tables(structure, others, tables)
        if "nodes" not in tables or "rows" in tables:
            raise Rejected(
                f"{others[0]}: a .full file without its .cdb file needs a CSV file with the columns node,x,y,z, "
                "and accepts a CSV file with the columns set,node"
            )
        structure.labels, structure.positions = tables["nodes"][:, 0].astype(int).tolist(), tables["nodes"][:, 1:]
        structure.left_out.append("The import assumes nodes without angles, because --axes global is given.")
    else:
        raise Rejected(
            f"{file}: a .full file has neither positions nor angles of nodes; give its .cdb file (CDWRITE,DB), "
            "or give --axes global and a CSV file with the columns node,x,y,z"
        )
    found = child.call("fretwear.importing.ansys:read_full", {"file": str(file)}, files=[file], library="ansys-mapdl-reader", extra="ansys")
    rows = found["rows"]
    if rows.ndim != 2 or rows.shape[1] != 2 or (rows[:, 1] > 5).any() or (rows[:, 1] < 0).any():
        raise Rejected(
            f"{file}: the file has degrees of freedom that are neither displacements nor rotations; give a purely structural model"
        )
    for name in ("K", "M"):
        triangle = folder.of_entries(found[f"{name} at"], found[f"{name} values"], found[f"{name} shape"], f"{file}: {name}")
        upper = sparse.triu(triangle, 1)
        lower = sparse.tril(triangle, -1)
        if upper.count_nonzero() and lower.count_nonzero():
            structure.matrices[name] = triangle
        else:
            structure.matrices[name] = triangle + (upper + lower).T
    held = set(map(tuple, found["held"].tolist()))
    free = np.array([k for k, row in enumerate(rows.tolist()) if tuple(row) not in held], np.int64)
    if held:
        structure.left_out.append(f"{file}: the import omits {len(rows) - len(free)} rows, because the model fixes their displacements.")
    order = free[np.lexsort((rows[free, 1], rows[free, 0]))]
    structure.rows = rows[order] + np.array([0, 1])
    structure.matrices = {name: sparse.csr_array(matrix)[order][:, order] for name, matrix in structure.matrices.items()}
    axes.to_global(structure.matrices, structure.rows, turned, str(file))
    structure.left_out.append(f"{file}: the import omits damping matrices, because ansys-mapdl-reader does not read them.")
    folder.check_matrices(structure, str(file))
    return structure
