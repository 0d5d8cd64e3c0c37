"""Reads MATLAB `.mat` files: versions 4 and 5 with SciPy, version 7.3 with h5py. CSV files may add nodes, rows and sets."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np

from fretwear.importing import Rejected, child, folder
from fretwear.importing.folder import Structure

#: Matrix by the name of its variable, in lower case.
ROLES = {
    **dict.fromkeys(("k", "stiffness"), "K"),
    **dict.fromkeys(("m", "mass"), "M"),
    **dict.fromkeys(("c", "b", "d", "damping", "viscous_damping"), "C"),
    **dict.fromkeys(("ks", "k4", "h", "structural_damping"), "Ks"),
}
#: Number of columns of each table.
TABLES = {"nodes": 4, "rows": 2}


def _is_73(file: str) -> bool:
    with Path(file).open("rb") as opened:
        head = opened.read(1024)
    return head.startswith(b"MATLAB 7.3") or b"\x89HDF\r\n\x1a\n" in head


def read_mat(file: str) -> dict[str, Any]:
    """Reads the variables of a file. Runs in the child process."""
    result: dict[str, Any] = {"others": []}

    def add(name: str, value: Any) -> None:
        from scipy import sparse

        if name.lower() not in ROLES | TABLES:
            result["others"].append(name)
        elif sparse.issparse(value):
            value = sparse.coo_array(value)
            result.update(
                {
                    f"{name} at": np.array([value.row, value.col], np.int64),
                    f"{name} values": value.data,
                    f"{name} shape": np.array(value.shape),
                }
            )
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiucb" and value.ndim == 2:
            is_single = value.dtype in (np.float32, np.complex64)
            result[f"{name} dense"] = value if is_single else value.astype(complex if value.dtype.kind == "c" else float)
        else:
            raise Rejected(
                f"{file}: the variable {name} has the type {getattr(value, 'dtype', type(value).__name__)}; "
                "it must be a dense or sparse matrix of numbers"
            )

    if _is_73(file):
        import h5py
        from scipy import sparse

        def number(data: Any) -> Any:
            return data["real"] + 1j * data["imag"] if data.dtype.names else data

        with h5py.File(file, "r") as opened:
            for name, item in opened.items():
                if name.startswith("#"):
                    continue
                if isinstance(item, h5py.Group) and "MATLAB_sparse" in item.attrs:
                    columns = item["jc"][()].astype(np.int64)
                    size = (int(item.attrs["MATLAB_sparse"]), len(columns) - 1)
                    at = item["ir"][()].astype(np.int64) if "ir" in item else np.zeros(0, np.int64)
                    values = number(item["data"][()]) if "data" in item else np.zeros(0)
                    if (
                        at.size
                        and (at.min() < 0 or at.max() >= size[0])
                        or (np.diff(columns) < 0).any()
                        or columns[0] != 0
                        or columns[-1] != len(at)
                    ):
                        raise Rejected(f"{file}: the columns of the sparse matrix {name} do not match its entries; the file may be damaged")
                    add(name, sparse.csc_array((values, at, columns), shape=size))
                elif isinstance(item, h5py.Group):
                    add(name, "struct")
                else:
                    add(name, number(item[()]).T)
        return result
    from scipy import io

    for name, value in io.loadmat(file).items():
        if name.startswith("__"):
            continue
        if isinstance(value, np.ndarray) and value.dtype.names and value.shape == (1, 1):
            for inner in value.dtype.names:
                add(inner, value[0, 0][inner])
        else:
            add(name, value)
    return result


def read(files: list[Path], options: Namespace) -> Structure:
    from scipy import sparse

    mats = [file for file in files if file.suffix.lower() == ".mat"]
    if not mats:
        raise Rejected(f"{files[0]}: no .mat file is given; give the .mat file with the matrices too")
    structure = Structure(list(mats), libraries=["scipy"])
    tables: dict[str, np.ndarray] = {}
    for file in mats:
        is_73 = _is_73(str(file))
        if is_73:
            structure.libraries.append("h5py")
        found = child.call(
            "fretwear.importing.matlab:read_mat", {"file": str(file)}, files=[file], library="h5py" if is_73 else "scipy", extra="matlab"
        )
        structure.left_out += [
            f"{file}: the import ignores the variable {name}, because its name denotes no matrix or table (K, M, C, Ks, nodes, rows)."
            for name in found["others"]
        ]
        names = {key.rsplit(" ", 1)[0] for key in found if key.rsplit(" ", 1)[-1] in ("dense", "values")}
        for name in sorted(names):
            role = ROLES.get(name.lower())
            if role is None:
                tables[name.lower()] = np.real(found[f"{name} dense"]) if f"{name} dense" in found else np.zeros((0, 0))
                continue
            if f"{name} values" in found:
                matrix = folder.of_entries(found[f"{name} at"], found[f"{name} values"], found[f"{name} shape"], f"{file}: {name}")
            else:
                matrix = sparse.csr_array(found[f"{name} dense"])
            real, imaginary = folder.complex_parts(role, matrix, f"{file}: {name}")
            for part, value in ((role, real), *([("Ks", imaginary)] if imaginary is not None else [])):
                if part in structure.matrices:
                    raise Rejected(f"{file}: the variable {name} is a second {folder.MATRICES[part]} matrix; give each matrix once")
                structure.matrices[part] = value
    if "K" not in structure.matrices:
        raise Rejected(f"{mats[0]}: the file has no stiffness matrix K; give the variables K and M, and optionally C and Ks")
    folder.csv_tables(structure, [file for file in files if file not in mats], tables)
    where = str(mats[0])
    for name, width in TABLES.items():
        if name in tables and (
            tables[name].ndim != 2
            or tables[name].shape[1] != width
            or not np.all(np.isfinite(tables[name]))
            or (tables[name][:, 0] % 1).any()
        ):
            raise Rejected(
                f"{where}: the table {name} has the shape {tables[name].shape}; it must have {width} columns of finite numbers, "
                "with node numbers in the first column"
            )
    if "nodes" not in tables:
        raise Rejected(
            f"{where}: the files have no positions of nodes; give a variable nodes with the columns node, x, y and z, "
            "or a CSV file with the columns node,x,y,z"
        )
    structure.labels, structure.positions = tables["nodes"][:, 0].astype(int).tolist(), tables["nodes"][:, 1:]
    if len(set(structure.labels)) < len(structure.labels):
        raise Rejected(f"{where}: the table nodes has a node twice; each node must occur once")
    count, nodes = structure.matrices["K"].shape[0], len(structure.labels)
    if "rows" in tables:
        structure.rows = tables["rows"].astype(np.int64)
        if ((structure.rows[:, 1] < 0) | (structure.rows[:, 1] > 6)).any():
            raise Rejected(f"{where}: the table rows has a direction outside 0 to 6; give 1 to 6, or 0 for a row without a node")
    elif nodes and count in (3 * nodes, 6 * nodes):
        structure.rows = np.array([(node, d + 1) for node in structure.labels for d in range(count // nodes)], np.int64)
        structure.left_out.append(
            f"The import assumes {count // nodes} rows per node, in the order of the nodes, because the files have no table rows."
        )
    else:
        raise Rejected(
            f"{where}: K has {count} rows for {nodes} nodes, which is neither three nor six rows per node; "
            "give a table rows with the columns node and direction"
        )
    folder.check_matrices(structure, where)
    return structure
