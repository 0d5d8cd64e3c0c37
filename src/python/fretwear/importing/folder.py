"""The neutral folder: the format of every imported structure, which `fretwear` reads."""

from __future__ import annotations

import csv
import hashlib
import json
import re
import shutil
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from fretwear.importing import Rejected

LAYOUT, VERSION = "fretwear-structure", 1
#: Names of the matrices, with their meaning.
MATRICES = {"K": "stiffness", "M": "mass", "C": "viscous damping", "Ks": "structural damping"}
#: Largest asymmetry of a matrix that counts as rounding, relative to the largest entry.
ASYMMETRY = 1e-7


@dataclass
class Structure:
    """An imported structure: matrices if `matrices` is not empty, otherwise a mesh of solid elements."""

    files: list[Path]
    labels: list[int] = field(default_factory=list)
    #: Array (nodes, 3) along the global axes.
    positions: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    sets: dict[str, list[int]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    libraries: list[str] = field(default_factory=list)
    #: Node and direction of each row of the matrices. The direction 0 marks a row without a node.
    rows: np.ndarray | None = None
    matrices: dict[str, Any] = field(default_factory=dict)
    #: Elements of a mesh: (type, label, nodes).
    elements: list[tuple[str, int, list[int]]] = field(default_factory=list)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    #: Young's modulus, Poisson's ratio and density of each material.
    materials: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    #: Loss factors of the materials with damping.
    damping: dict[str, float] = field(default_factory=dict)
    #: Loss factor of the whole mesh.
    loss_factor: float = 0.0
    #: Pairs of an element set and its material.
    sections: list[tuple[str, str]] = field(default_factory=list)
    #: Fixed displacements: node and direction, 1 to 3.
    held: set[tuple[int, int]] = field(default_factory=set)
    #: Terms (node, direction, factor) of each equation. The first term depends on the other terms.
    equations: list[list[tuple[int, int, float]]] = field(default_factory=list)
    #: Members of each surface: pairs of an element and its face ("S1"), or pairs of a node and "".
    surfaces: dict[str, list[tuple[int, str]]] = field(default_factory=dict)
    #: Options, slave surface and master surface of each *TIE.
    ties: list[tuple[str, str, str]] = field(default_factory=list)
    pairs: list[tuple[int, int]] = field(default_factory=list)

    @property
    def is_mesh(self) -> bool:
        return not self.matrices

    def set_named(self, name: str, option: str) -> str:
        """Returns the full name of the set that the value `name` of an option selects. Raises Rejected."""
        sets = self.sets | self.surfaces if option in ("--upper", "--lower") else self.sets
        exact = [known for known in sets if known == name]
        found = exact or [known for known in sets if known.upper() == name.upper() or known.upper().endswith(f".{name.upper()}")]
        found = found or [known for known in sets if known.upper() == name.upper().rpartition(".")[2]]
        if len(found) == 1 and sets[found[0]]:
            return found[0]
        if len(found) > 1:
            raise Rejected(f"{option} {name}: several sets have this name ({', '.join(found)}); give one full name")
        known = ", ".join(sorted(sets)[:20]) or "none"
        empty = ", or the set is empty" if found else ""
        raise Rejected(f"{option} {name}: the files have no set of nodes with this name{empty}; the sets are {known}")


def symmetric(matrix: Any, name: str, where: str) -> Any:
    """Returns a real matrix as an exactly symmetric CSR matrix of the same precision.

    Raises Rejected if the matrix is not square, not finite or not symmetric.
    """
    from scipy import sparse

    precision = np.float32 if matrix.dtype == np.float32 else np.float64
    matrix = sparse.csr_array(matrix).astype(float)
    if matrix.shape[0] != matrix.shape[1]:
        raise Rejected(f"{where}: the matrix {name} has {matrix.shape[0]} rows and {matrix.shape[1]} columns; it must be square")
    matrix.sum_duplicates()
    if not np.all(np.isfinite(matrix.data)):
        raise Rejected(f"{where}: the matrix {name} has entries that are not finite; all entries must be finite numbers")
    largest = float(np.abs(matrix.data).max(initial=0.0))
    difference = float(np.abs((matrix - matrix.T).tocsr().data).max(initial=0.0))
    if difference > ASYMMETRY * largest:
        triangles = [sparse.tril(matrix, -1).count_nonzero(), sparse.triu(matrix, 1).count_nonzero()]
        if 0 in triangles:
            raise Rejected(f"{where}: the matrix {name} has entries on only one side of its diagonal; write both triangles")
        raise Rejected(
            f"{where}: the matrix {name} is not symmetric: mirrored entries differ by {difference / largest:.1e} of the largest entry; "
            "give a symmetric matrix"
        )
    matrix = sparse.csr_array((matrix + matrix.T) * 0.5)
    matrix.eliminate_zeros()
    return matrix.astype(precision)


def of_entries(at: np.ndarray, values: np.ndarray, shape: Any, what: str) -> Any:
    """Returns a sparse matrix from its values, with their rows and columns in `at`. Raises Rejected for a wrong shape."""
    from scipy import sparse

    rows, columns = (int(length) for length in shape)
    if at.size and (at.min() < 0 or at[0].max() >= rows or at[1].max() >= columns):
        raise Rejected(f"{what} has an entry outside its {rows} rows and {columns} columns; the file may be damaged")
    # A damaged file may declare many more rows than entries, and such a matrix would need much memory.
    if rows > 1000 + 100 * len(values):
        raise Rejected(f"{what} has {rows} rows but only {len(values)} entries; the file may be damaged")
    return sparse.csr_array((values, (at[0], at[1])), shape=(rows, columns))


def complex_parts(name: str, matrix: Any, where: str) -> tuple[Any, Any | None]:
    """Returns the real part of a matrix, and the imaginary part of a complex stiffness. Only a stiffness may be complex."""
    if matrix.dtype.kind != "c":
        return matrix, None
    imaginary = matrix.imag
    if name != "K" and np.abs(imaginary).max() > 0.0:
        raise Rejected(
            f"{where}: the {MATRICES[name]} matrix is complex; "
            "only a stiffness matrix may be complex, with structural damping as its imaginary part"
        )
    return matrix.real, (imaginary if name == "K" else None)


def check_matrices(structure: Structure, where: str) -> None:
    """Checks that stiffness and mass exist and match the rows, and that each row occurs once. Raises Rejected."""
    for name in ("K", "M"):
        if name not in structure.matrices:
            raise Rejected(
                f"{where}: the files have no {MATRICES[name]} matrix; their matrices are {', '.join(structure.matrices) or 'none'}; "
                "give K and M"
            )
    assert structure.rows is not None
    count = len(structure.rows)
    for name in list(structure.matrices):
        matrix = structure.matrices[name] = symmetric(structure.matrices[name], name, where)
        if matrix.shape[0] != count:
            raise Rejected(
                f"{where}: the matrix {name} has {matrix.shape[0]} rows, but the list of its rows has {count}; both numbers must be equal"
            )
    mass = structure.matrices["M"].diagonal()
    if count == 0 or structure.matrices["K"].nnz == 0 or mass.max(initial=0.0) <= 0.0:
        raise Rejected(f"{where}: the stiffness matrix or the mass matrix is zero; give matrices with entries")
    if mass.min() < 0.0:
        raise Rejected(
            f"{where}: row {int(mass.argmin()) + 1} has the negative mass {mass.min():g} on the diagonal of M; "
            "each mass must be zero or more"
        )
    named, counts = np.unique(structure.rows[structure.rows[:, 1] > 0], axis=0, return_counts=True)
    if (counts > 1).any():
        node, direction = named[counts > 1][0]
        raise Rejected(f"{where}: node {node} has two rows for its direction {direction}; give one row")
    known = set(structure.labels)
    for set_name, nodes in structure.sets.items():
        if lost := set(nodes) - known:
            raise Rejected(f"{where}: the set {set_name} has the node {min(lost)}, which has no position; give the file with this node")
    unknown = sorted({int(node) for node, direction in structure.rows if direction} - known)
    if unknown:
        raise Rejected(
            f"{where}: {len(unknown)} nodes of the matrix rows have no position, such as node {unknown[0]}; give the file with these nodes"
        )


def read_csv(file: Path, *headers: list[str]) -> list[list[str]]:
    """Returns the lines of a CSV file below its header. Raises Rejected if the header is not one of `headers`."""
    try:
        lines = [
            [cell.strip() for cell in line]
            for line in csv.reader(file.read_text(encoding="utf-8-sig").splitlines())
            if "".join(line).strip()
        ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise Rejected(f"fretwear-import cannot read {file} as CSV: {error}") from None
    right = " or ".join(",".join(header) for header in headers)
    if not lines or [cell.lower() for cell in lines[0]] not in list(headers):
        raise Rejected(f"{file}: the first line is {','.join(lines[0]) if lines else 'missing'}; it must be {right}")
    for k, line in enumerate(lines):
        if len(line) != len(lines[0]):
            raise Rejected(f"{file}, line {k + 1}: the line is {','.join(line)}; fretwear-import expects values of {right}")
    return lines[1:]


def csv_tables(structure: Structure, files: list[Path], tables: dict[str, np.ndarray]) -> None:
    """Reads nodes, rows and sets from CSV files. The header of a file determines its contents."""
    headers = {"nodes": ["node", "x", "y", "z"], "rows": ["node", "direction"], "sets": ["set", "node"]}
    for file in files:
        lines = read_csv(file, *headers.values())
        width = len(lines[0]) if lines else 0
        structure.files.append(file)
        try:
            if width == 2 and not re.fullmatch(r"[+-]?\d+", lines[0][0]):
                for name, node in lines:
                    structure.sets.setdefault(name, []).append(int(node))
                continue
            values = np.array([[int(line[0]), *map(float, line[1:])] for line in lines], float).reshape(len(lines), -1)
            if not np.all(np.isfinite(values)):
                raise ValueError("a number is not finite")
            tables["nodes" if width == 4 else "rows"] = values
        except ValueError as error:
            raise Rejected(f"{file}: {error}; the file must contain finite numbers") from None


def read_pairs(structure: Structure, file: Path) -> None:
    lines = read_csv(file, ["upper", "lower"], ["upper_node", "lower_node"], ["upper_node", "lower_node", "area"])
    known = set(structure.labels)
    for line in lines:
        if not all(re.fullmatch(r"\d+", cell) for cell in line[:2]) or not {int(line[0]), int(line[1])} <= known:
            raise Rejected(f"{file}: the pair {','.join(line)} is not valid; give two nodes of the structure")
        structure.pairs.append((int(line[0]), int(line[1])))
    if len(set(structure.pairs)) < len(structure.pairs):
        raise Rejected(f"{file}: the file has a pair twice; each pair must occur once")
    if lines and len(lines[0]) > 2:
        structure.left_out.append(
            f"{file}: the import ignores the column area, because fretwear computes the area of each pair from the nodes."
        )
    structure.files.append(file)


def _table(path: Path, header: str, lines: Iterable[Iterable[object]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(header.split(","))
        writer.writerows(lines)


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "unknown"


def _record(file: Path) -> dict[str, Any]:
    with file.open("rb") as opened:
        digest = hashlib.file_digest(opened, "sha256") if hasattr(hashlib, "file_digest") else hashlib.sha256(opened.read())
    return {"path": str(file), "bytes": file.stat().st_size, "sha256": digest.hexdigest()}


def write(structure: Structure, folder: Path, scene: str, unit: dict[str, str] | None, *, force: bool) -> None:
    """Writes the folder under a temporary name and then renames it, so that `folder` is complete or absent."""
    from fretwear.importing import mesh

    check_new(folder, force)
    folder.parent.mkdir(parents=True, exist_ok=True)
    stage = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    try:
        new = stage / "new"
        new.mkdir()
        if structure.is_mesh:
            mesh.write(structure, new / "mesh.inp")
        else:
            _write_matrices(structure, new)
        if structure.pairs:
            _table(new / "pairs.csv", "upper_node,lower_node", structure.pairs)
        libraries = {name: _version(name) for name in dict.fromkeys([*structure.libraries, "numpy", "scipy"])}
        about = {
            "layout": LAYOUT,
            "version": VERSION,
            "kind": "mesh" if structure.is_mesh else "matrices",
            "unit": unit,
            "written_by": {"program": "fretwear-import", "version": _version("fretwear")},
            "libraries": libraries,
            "files": [_record(file) for file in dict.fromkeys(structure.files)],
            "contents": {file.name: _record(file)["sha256"] for file in sorted(new.iterdir())},
            "left_out": structure.left_out,
        }
        (new / "structure.json").write_text(json.dumps(about, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
        (new / "scene.toml").write_text(scene, encoding="utf-8")
        if folder.exists():
            folder.rename(stage / "old")
        new.rename(folder)
    finally:
        if (stage / "old").exists() and not folder.exists():
            (stage / "old").rename(folder)
        shutil.rmtree(stage, ignore_errors=True)


def check_new(folder: Path, force: bool) -> None:
    if not folder.exists() and not folder.is_symlink():
        return
    if not force:
        raise Rejected(f"{folder} already exists; give another folder, or give --force to replace it")
    if not folder.is_dir() or (any(folder.iterdir()) and not (folder / "structure.json").is_file()):
        raise Rejected(f"{folder} has no structure.json, so --force does not replace it; give another folder")


def _write_matrices(structure: Structure, folder: Path) -> None:
    from scipy import sparse

    assert structure.rows is not None
    for name, matrix in structure.matrices.items():
        sparse.save_npz(folder / f"{name}.npz", sparse.csr_matrix(matrix))
    _table(folder / "rows.csv", "node,direction", structure.rows.tolist())
    order = np.argsort(structure.labels, kind="stable")
    positions = ((structure.labels[k], *(repr(float(value)) for value in structure.positions[k])) for k in order)
    _table(folder / "nodes.csv", "node,x,y,z", positions)
    _table(folder / "sets.csv", "set,node", ((name, node) for name, nodes in structure.sets.items() for node in sorted(set(nodes))))
