"""The neutral folder: what every import is written to, and all that the program reads of it."""

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
#: Names of the matrices, and what they are.
MATRICES = {"K": "stiffness", "M": "mass", "C": "viscous damping", "Ks": "structural damping"}
#: Largest asymmetry of a matrix, over its largest entry, that counts as rounding.
ASYMMETRY = 1e-7


@dataclass
class Structure:
    """What was read. With `matrices` it is a pair of matrices, else a mesh of solids."""

    files: list[Path]
    labels: list[int] = field(default_factory=list)
    #: (nodes, 3), global.
    positions: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    sets: dict[str, list[int]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    libraries: list[str] = field(default_factory=list)
    #: Of matrices: node and direction of each row; 0 where a row is no node's.
    rows: np.ndarray | None = None
    matrices: dict[str, Any] = field(default_factory=dict)
    #: Of a mesh: (type, label, nodes).
    elements: list[tuple[str, int, list[int]]] = field(default_factory=list)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    #: Young's modulus, Poisson's ratio, density.
    materials: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    #: Loss factors of materials that damp.
    damping: dict[str, float] = field(default_factory=dict)
    #: That of all of a mesh.
    loss_factor: float = 0.0
    #: Set of elements, material.
    sections: list[tuple[str, str]] = field(default_factory=list)
    #: Node and direction, 1 to 3.
    held: set[tuple[int, int]] = field(default_factory=set)
    #: Terms (node, direction, factor); the first depends on the others.
    equations: list[list[tuple[int, int, float]]] = field(default_factory=list)
    #: Name: pairs of an element and its face ("S1"), or of a node and "".
    surfaces: dict[str, list[tuple[int, str]]] = field(default_factory=dict)
    #: Options of *TIE, slave, master.
    ties: list[tuple[str, str, str]] = field(default_factory=list)
    pairs: list[tuple[int, int]] = field(default_factory=list)

    @property
    def is_mesh(self) -> bool:
        return not self.matrices

    def set_named(self, name: str, option: str) -> str:
        """The name of a set as it is written, by how somebody gave it. Raises Rejected."""
        sets = self.sets | self.surfaces if option in ("--upper", "--lower") else self.sets
        exact = [known for known in sets if known == name]
        found = exact or [known for known in sets if known.upper() == name.upper() or known.upper().endswith(f".{name.upper()}")]
        found = found or [known for known in sets if known.upper() == name.upper().rpartition(".")[2]]
        if len(found) == 1 and sets[found[0]]:
            return found[0]
        if len(found) > 1:
            raise Rejected(f"{option} {name}: several sets have this name, {', '.join(found)}; give one of them in full")
        known = ", ".join(sorted(sets)[:20]) or "none"
        empty = " (it is empty)" if found else ""
        raise Rejected(f"{option} {name}: there is no set of nodes of this name{empty}; the files have {known}")


def symmetric(matrix: Any, name: str, where: str) -> Any:
    """A real matrix as CSR, exactly symmetric, of its own precision.

    Raises Rejected where it is not square, not finite, or not symmetric.
    """
    from scipy import sparse

    precision = np.float32 if matrix.dtype == np.float32 else np.float64
    matrix = sparse.csr_array(matrix).astype(float)
    if matrix.shape[0] != matrix.shape[1]:
        raise Rejected(f"{where}: {name} has {matrix.shape[0]} rows and {matrix.shape[1]} columns; a square matrix would be right")
    matrix.sum_duplicates()
    if not np.all(np.isfinite(matrix.data)):
        raise Rejected(f"{where}: {name} has entries that are not finite numbers")
    largest = float(np.abs(matrix.data).max(initial=0.0))
    difference = float(np.abs((matrix - matrix.T).tocsr().data).max(initial=0.0))
    if difference > ASYMMETRY * largest:
        triangles = [sparse.tril(matrix, -1).count_nonzero(), sparse.triu(matrix, 1).count_nonzero()]
        if 0 in triangles:
            raise Rejected(f"{where}: {name} has entries on one side of its diagonal only; write both triangles")
        raise Rejected(f"{where}: {name} is not symmetric: mirrored entries differ by {difference / largest:.1e} of the largest entry")
    matrix = sparse.csr_array((matrix + matrix.T) * 0.5)
    matrix.eliminate_zeros()
    return matrix.astype(precision)


def of_entries(at: np.ndarray, values: np.ndarray, shape: Any, what: str) -> Any:
    """A sparse matrix of its entries, rows and columns in `at`. Raises Rejected where these do not fit its shape."""
    from scipy import sparse

    rows, columns = (int(length) for length in shape)
    if at.size and (at.min() < 0 or at[0].max() >= rows or at[1].max() >= columns):
        raise Rejected(f"{what} has an entry outside its {rows} rows and {columns} columns; the file may be damaged")
    # Far fewer entries than rows are a false size, which would only cost memory.
    if rows > 1000 + 100 * len(values):
        raise Rejected(f"{what} has {rows} rows and {len(values)} entries; the file may be damaged")
    return sparse.csr_array((values, (at[0], at[1])), shape=(rows, columns))


def complex_parts(name: str, matrix: Any, where: str) -> tuple[Any, Any | None]:
    """The real part of a matrix and, of a complex one, the imaginary part; only a stiffness may be complex."""
    if matrix.dtype.kind != "c":
        return matrix, None
    imaginary = matrix.imag
    if name != "K" and np.abs(imaginary).max() > 0.0:
        raise Rejected(f"{where}: the {MATRICES[name]} is complex; only a stiffness may be, with structural damping as its imaginary part")
    return matrix.real, (imaginary if name == "K" else None)


def check_matrices(structure: Structure, where: str) -> None:
    """Stiffness and mass are there and fit the rows, and each row stands once."""
    for name in ("K", "M"):
        if name not in structure.matrices:
            raise Rejected(
                f"{where}: there is no {MATRICES[name]} matrix; found {', '.join(structure.matrices) or 'none'}; K and M are needed"
            )
    assert structure.rows is not None
    count = len(structure.rows)
    for name in list(structure.matrices):
        matrix = structure.matrices[name] = symmetric(structure.matrices[name], name, where)
        if matrix.shape[0] != count:
            raise Rejected(f"{where}: {name} has {matrix.shape[0]} rows, and {count} rows are named; both must be the same")
    mass = structure.matrices["M"].diagonal()
    if count == 0 or structure.matrices["K"].nnz == 0 or mass.max(initial=0.0) <= 0.0:
        raise Rejected(f"{where}: stiffness or mass is zero")
    if mass.min() < 0.0:
        raise Rejected(f"{where}: row {int(mass.argmin()) + 1} has the negative mass {mass.min():g} on the diagonal of M")
    named, counts = np.unique(structure.rows[structure.rows[:, 1] > 0], axis=0, return_counts=True)
    if (counts > 1).any():
        node, direction = named[counts > 1][0]
        raise Rejected(f"{where}: node {node} has two rows for its direction {direction}")
    known = set(structure.labels)
    for set_name, nodes in structure.sets.items():
        if lost := set(nodes) - known:
            raise Rejected(f"{where}: the set {set_name} has the node {min(lost)}, which has no position")
    unknown = sorted({int(node) for node, direction in structure.rows if direction} - known)
    if unknown:
        raise Rejected(
            f"{where}: {len(unknown)} nodes of the rows have no position, the first is {unknown[0]}; give the file with the nodes"
        )


def read_csv(file: Path, *headers: list[str]) -> list[list[str]]:
    """The lines of a CSV file below its header, one of those given."""
    try:
        lines = [
            [cell.strip() for cell in line]
            for line in csv.reader(file.read_text(encoding="utf-8-sig").splitlines())
            if "".join(line).strip()
        ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise Rejected(f"{file} cannot be read as CSV: {error}") from None
    right = " or ".join(",".join(header) for header in headers)
    if not lines or [cell.lower() for cell in lines[0]] not in list(headers):
        raise Rejected(f"{file}: its first line is {','.join(lines[0]) if lines else 'missing'}; {right} would be right")
    for k, line in enumerate(lines):
        if len(line) != len(lines[0]):
            raise Rejected(f"{file}, line {k + 1}: found {','.join(line)}; {right} would be right")
    return lines[1:]


def csv_tables(structure: Structure, files: list[Path], tables: dict[str, np.ndarray]) -> None:
    """Nodes, rows and sets of CSV files, by their headers."""
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
            raise Rejected(f"{file}: {error}; numbers would be right") from None


def read_pairs(structure: Structure, file: Path) -> None:
    lines = read_csv(file, ["upper", "lower"], ["upper_node", "lower_node"], ["upper_node", "lower_node", "area"])
    known = set(structure.labels)
    for line in lines:
        if not all(re.fullmatch(r"\d+", cell) for cell in line[:2]) or not {int(line[0]), int(line[1])} <= known:
            raise Rejected(f"{file}: found the pair {','.join(line)}; two nodes that the structure has would be right")
        structure.pairs.append((int(line[0]), int(line[1])))
    if len(set(structure.pairs)) < len(structure.pairs):
        raise Rejected(f"{file}: it has a pair twice; each pair once would be right")
    if lines and len(lines[0]) > 2:
        structure.left_out.append(f"{file}: the column area; the program finds the area of each pair from the nodes.")
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
    """Writes the folder beside its place, and renames it: it is there whole, or not at all."""
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
        raise Rejected(f"{folder} exists; give another folder, or --force to replace it")
    if not folder.is_dir() or (any(folder.iterdir()) and not (folder / "structure.json").is_file()):
        raise Rejected(f"{folder} is no folder of an import (it has no structure.json), and --force does not replace it")


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
