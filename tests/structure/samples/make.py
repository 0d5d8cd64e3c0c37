"""Writes a small structure in every format of `fretwear inspect` and `fretwear-import`, and the expected results (`expected.json`).

The structure is a free truss in space with five nodes and ten bars. Node 5 has no mass. The script needs numpy, scipy and
pyyeti, which writes OUTPUT4:

    python tests/structure/samples/make.py
"""

import json
import struct
from itertools import combinations
from pathlib import Path

import numpy as np
import scipy.io
import scipy.linalg
import scipy.sparse as sp
from pyyeti.nastran import op4

HERE = Path(__file__).parent
# Samples for `fretwear-import`.
IMPORTED = HERE / "imported"
NODES = np.array([[0, 0, 0], [1.3, 0.1, 0], [0.2, 0.9, 0.3], [0.4, 0.3, 1.1], [0.9, 0.8, 0.7]])
MASSES = [2.0, 1.5, 0.7, 1.1, 0.0]
MASSLESS = 4


def truss():
    stiffness, mass = np.zeros((15, 15)), np.zeros((15, 15))
    for a, b in combinations(range(5), 2):
        along = (NODES[b] - NODES[a]) / np.linalg.norm(NODES[b] - NODES[a])
        bar = 1e6 * (1 + 0.3 * a + 0.2 * b) * np.outer(along, along)
        for i, j, sign in [(a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)]:
            stiffness[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += sign * bar
    for n, m in enumerate(MASSES):
        mass[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] = m * np.eye(3)
    # A mass matrix entry couples two masses.
    for axis in range(3):
        mass[axis, 3 + axis] = mass[3 + axis, axis] = 0.25
    return (stiffness + stiffness.T) / 2, mass


def condensed(stiffness, mass, keep, away):
    inner = np.linalg.solve(stiffness[np.ix_(away, away)], stiffness[np.ix_(away, keep)])
    return stiffness[np.ix_(keep, keep)] - stiffness[np.ix_(keep, away)] @ inner, mass[np.ix_(keep, keep)]


def frequencies(stiffness, mass, fixed=()):
    free = [i for i in range(15) if i not in fixed]
    keep, away = [i for i in free if i < 3 * MASSLESS], [i for i in free if i >= 3 * MASSLESS]
    k, m = condensed(stiffness, mass, keep, away)
    squares = scipy.linalg.eigh(k, m, eigvals_only=True)
    return [float(np.sqrt(s) / (2 * np.pi)) for s in squares if s > 1.0]


def triangle(matrix):
    """Yields row, column and value of the entries on and below the diagonal, by columns."""
    for j in range(len(matrix)):
        for i in range(j, len(matrix)):
            if matrix[i, j] != 0:
                yield i, j, matrix[i, j]


def matrix_market(k, m):
    for name, matrix in [("K", k), ("M", m)]:
        scipy.io.mmwrite(HERE / f"coordinate_{name}.mtx", sp.coo_matrix(matrix), symmetry="symmetric", precision=17)
    scipy.io.mmwrite(HERE / "general_K.mtx", sp.coo_matrix(k), symmetry="general", precision=17)
    scipy.io.mmwrite(HERE / "array_M.mtx", m, symmetry="general", precision=17)


def node_of(i):
    """Node number of a row. Abaqus numbers its internal nodes -1, -2, …."""
    return -1 if i // 3 == MASSLESS else i // 3 + 1


def abaqus(k, m):
    for name, matrix in [("STIF1", k), ("MASS1", m)]:
        lines = [f"{node_of(i)},{i % 3 + 1}, {node_of(j)},{j % 3 + 1}, {v: .15e}\n" for i, j, v in triangle(matrix)]
        (HERE / f"labels_{name}.mtx").write_text("".join(lines))
    lines = [f"{i + 1:8d} {j + 1:8d} {k[i, j]: .15e}\n" for i in range(15) for j in range(15) if k[i, j] != 0]
    (HERE / "coordinates_stiffness.mtx").write_text("".join(lines))
    # The last freedom is condensed, so the nodes have different freedoms.
    keep = list(range(14))
    k, m = condensed(k, m, keep, [14])
    with open(HERE / "substructure.mtx", "w") as file:
        file.write("**\n** GENERATION OF SUBSTRUCTURE Z7\n*USER ELEMENT, NODES=         5, LINEAR\n** ELEMENT NODES\n")
        file.write("**         11,         12,         13,         14, \n**         15\n")
        file.write("          1,          2,          3\n          5,          1,          2\n")
        for name, matrix in [("STIFFNESS", k), ("MASS", m)]:
            file.write(f"*MATRIX,TYPE={name}\n")
            for i in range(14):
                row = [f"{v: .15E}" for v in matrix[i, : i + 1]]
                lines = [", ".join(row[at : at + 4]) for at in range(0, len(row), 4)]
                file.write(",\n".join(lines) + "\n")


def calculix(k, m):
    for name, matrix in [("sti", k), ("mas", m)]:
        lines = [f"{j + 1} {i + 1} {v: .13e}\n" for i in range(15) for j in range(i + 1) if (v := matrix[i, j]) != 0 or i == j]
        (HERE / f"truss.{name}").write_text("".join(lines))
    (HERE / "truss.dof").write_text("".join(f"{i // 3 + 1}.{i % 3 + 1}\n" for i in range(15)))
    nodes = "".join(f"{n + 1}, {x}, {y}, {z}\n" for n, (x, y, z) in enumerate(NODES))
    (HERE / "truss.inp").write_text(f"*NODE, NSET=ALL\n{nodes}*NSET, NSET=Clamp, GENERATE\n1, 2, 1\n*NSET, NSET=Tip\n4,\n")


def strings(column):
    """Yields the runs of nonzero values: first row (from 0) and values."""
    at = 0
    while at < len(column):
        if column[at] == 0:
            at += 1
            continue
        end = at
        while end < len(column) and column[end] != 0:
            end += 1
        yield at, column[at:end]
        at = end


def op4_single(path, matrices):
    """Writes OUTPUT4 in single precision with big-endian numbers, which the library does not support."""

    def record(data):
        return struct.pack(">i", len(data)) + data + struct.pack(">i", len(data))

    with open(path, "wb") as file:
        for name, matrix in matrices.items():
            n = len(matrix)
            file.write(record(struct.pack(">4i8s", n, -n, 6, 1, name.ljust(8).encode())))
            for j in range(n):
                data = b""
                for row, run in strings(matrix[:, j]):
                    data += struct.pack(f">2i{len(run)}f", len(run) + 1, row + 1, *run)
                if data:
                    file.write(record(struct.pack(">3i", j + 1, 0, len(data) // 4) + data))
            file.write(record(struct.pack(">3if", n + 1, 1, 1, 1.0)))


def nastran(k, m):
    matrices = {"KAA": k, "MAA": m}
    forms = {name: (matrix, 6) for name, matrix in matrices.items()}
    for sparse, name in [("dense", "dense"), ("nonbigmat", "strings"), ("bigmat", "bigmat")]:
        op4.write(IMPORTED / f"{name}_text.op4", forms, binary=False, sparse=sparse)
        op4.write(IMPORTED / f"{name}_binary.op4", forms, binary=True, sparse=sparse, endian="<")
    op4_single(IMPORTED / "single.op4", matrices)
    again = op4.load(IMPORTED / "single.op4", into="dct")
    for key, matrix in matrices.items():
        assert np.allclose(again[key.lower()][0], matrix, rtol=1e-6, atol=1e-6), key

    def number(v, width):
        return f"{v:{width}.9E}".replace("E", "D")

    with open(IMPORTED / "large.pch", "w") as file:
        for name, matrix in [("KAAX", k), ("MAAX", m)]:
            file.write(f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}{'':16s}{15:8d}\n")
            for j in range(15):
                rows = [i for i in range(j + 1) if matrix[i, j] != 0]
                if rows:
                    file.write(f"DMIG*   {name:16s}{j // 3 + 1:16d}{j % 3 + 1:16d}\n")
                for i in rows:
                    file.write(f"*       {i // 3 + 1:16d}{i % 3 + 1:16d}{number(matrix[i, j], 16)}\n")
        file.write("DMIG    VAX            0       9       2       0                       1\n")
        file.write("DMIG*   VAX                            1               0\n*                      1               3 1.000000000D+00\n")
    with open(IMPORTED / "free_fields.bdf", "w") as file:
        file.write("$ numbers of Nastran: no letter before the exponent\nGRID,1,,0.,0.,0.\n")
        for name, matrix in [("K2GG", k), ("M2GG", m)]:
            file.write(f"DMIG,{name},0,6,2,0\n")
            for j in range(15):
                for i in range(j + 1):
                    if matrix[i, j] != 0:
                        value = f"{matrix[i, j]:.15E}".replace("E", "")
                        file.write(f"DMIG,{name},{j // 3 + 1},{j % 3 + 1},,{i // 3 + 1},{i % 3 + 1},{value}\n")
    with open(IMPORTED / "small_fields.bdf", "w") as file:
        # The mass matrix: its numbers fit into eight characters.
        file.write(f"DMIG    MAAX    {0:8d}{1:8d}{1:8d}\n")
        for j in range(12):
            rows = [i for i in range(15) if m[i, j] != 0]
            for at, i in enumerate(rows):
                head = f"DMIG    MAAX    {j // 3 + 1:8d}{j % 3 + 1:8d}{'':8s}" if at == 0 else "+       "
                file.write(f"{head}{i // 3 + 1:8d}{i % 3 + 1:8d}{m[i, j]:<8.6g}\n")


def ansys(k, m):
    """Writes a .full file with unsorted nodes. Node 6 is fixed, so its rows are unit rows of the stiffness."""
    order = [3, 1, 4, 5, 0, 2]
    kinds, place = [], []
    for n in order:
        held = n == 5
        kinds += [-1, -2, -3] if held else [1, 2, 3]
        place += [None] * 3 if held else [3 * n, 3 * n + 1, 3 * n + 2]
    words = []

    def record(values, kind="<i4"):
        data = np.frombuffer(np.asarray(values, kind).tobytes(), "<i4")
        words.extend([len(data), -(2**31) if kind == "<i4" else 0, *data.tolist(), len(data)])

    def matrix(full, unit):
        begin, terms = len(words), 0
        for i, row in enumerate(place):
            if row is None:
                columns, values = [i], [unit]
            else:
                columns = [j for j in range(i + 1, 18) if place[j] is not None and full[row, place[j]] != 0] + [i]
                values = [full[row, place[j]] for j in columns]
            record([j + 1 for j in columns])
            record(values, "<f8")
            terms += len(columns)
        return begin, terms

    header = [0] * 100
    record([4, -1, 100033] + [0] * 97)
    begin = len(words) + 2
    record(header)
    record([1, 2, 3])
    record([n + 1 for n in order])
    stiffness, stiffness_terms = matrix(k, 1.0)
    freedoms = len(words)
    record([3] * 6)
    record(kinds)
    mass, mass_terms = matrix(m, 0.0)
    of_header = [(0, -4), (1, 18), (3, 2), (7, 3), (8, stiffness_terms), (18, stiffness), (26, mass), (32, 6), (33, mass_terms)]
    for at, value in [*of_header, (35, freedoms)]:
        words[begin + at] = value
    (HERE / "truss.full").write_bytes(np.array(words, "<i4").tobytes())


def numpy_and_matlab(k, m):
    sp.save_npz(HERE / "csr_K.npz", sp.csr_matrix(k))
    sp.save_npz(HERE / "csc_M.npz", sp.csc_matrix(m), compressed=False)
    sp.save_npz(HERE / "coo_M.npz", sp.coo_matrix(m))
    np.savez_compressed(HERE / "both.npz", K=k, M=np.asfortranarray(m), note=np.array([1.0, 2.0]))
    np.save(HERE / "dense_K.npy", k)
    np.save(HERE / "dense_M.npy", np.asfortranarray(m).astype("f4"))
    both = {"K": sp.csc_matrix(k), "M": sp.csc_matrix(m), "title": "truss", "x": np.arange(3.0)}
    scipy.io.savemat(IMPORTED / "sparse.mat", both)
    scipy.io.savemat(IMPORTED / "sparse_compressed.mat", both, do_compression=True)
    scipy.io.savemat(IMPORTED / "dense.mat", {"stiffness": k, "mass": m}, do_compression=True)


if __name__ == "__main__":
    K, M = truss()
    # All formats use the same order: node by node, x, y, z.
    matrix_market(K, M)
    abaqus(K, M)
    calculix(K, M)
    nastran(K, M)
    ansys(K, M)
    numpy_and_matlab(K, M)
    clamped = list(range(6))
    expected = {
        "stiffness": K.tolist(),
        "mass": M.tolist(),
        "total_mass": float(M[np.ix_(range(0, 15, 3), range(0, 15, 3))].sum()),
        "free": frequencies(K, M),
        "clamped": frequencies(K, M, clamped),
    }
    (HERE / "expected.json").write_text(json.dumps(expected) + "\n")
