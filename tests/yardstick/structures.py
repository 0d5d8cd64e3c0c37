"""Two small overlapping bars as files of a user: matrices and input decks."""

import io
import sys
from itertools import combinations
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data"))

from make_lap_of_bars import Bar, deck, two_bars  # noqa: E402

# The small model of the matrices.
BARS, SETS = two_bars(cell=(4, 3, 2), cells=(6, 5, 1), lap=3)
# Stiffness of the springs between all corners of a cell [N/mm], and mass of a corner [t].
SPRING, MASS = 7e4, 2e-8


def matrices():
    """Returns the stiffness and the diagonal of the mass, with three rows per node in the order of the nodes."""
    rows = {node: row for row, node in enumerate(node for bar in BARS for node in bar.positions)}
    stiffness, mass = np.zeros((len(rows), 3, len(rows), 3)), np.zeros((len(rows), 3))
    for bar in BARS:
        for corners in bar.elements.values():
            mass[[rows[node] for node in corners]] += MASS
            for a, b in combinations(corners, 2):
                along = np.subtract(bar.positions[a], bar.positions[b])
                spring = SPRING * np.outer(along, along) / (along @ along)
                for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                    stiffness[rows[i], :, rows[j], :] += sign * spring
    return stiffness.reshape(mass.size, mass.size), mass.ravel()


def matrix_market(matrix):
    rows, columns = np.nonzero(np.tril(matrix))
    lines = [f"{i + 1} {j + 1} {float(matrix[i, j])!r}" for i, j in zip(rows, columns)]
    size = len(matrix)
    return "\n".join(["%%MatrixMarket matrix coordinate real symmetric", f"{size} {size} {len(lines)}", *lines]) + "\n"


def nodes():
    positions = [f"{node},{x},{y},{z}" for bar in BARS for node, (x, y, z) in bar.positions.items()]
    return "\n".join(["node,x,y,z", *positions]) + "\n"


def files_by_pairs():
    """Returns Matrix Market files with positions and pairs of nodes."""
    stiffness, mass = matrices()
    pairs = [f"{upper},{lower}" for upper, lower in zip(SETS["TOP"], SETS["BOTTOM"])]
    return {
        "K.mtx": matrix_market(stiffness),
        "M.mtx": matrix_market(np.diag(mass)),
        "nodes.csv": nodes(),
        "pairs.csv": "\n".join(["upper_node,lower_node", *pairs]) + "\n",
    }


def files_by_sets():
    """Returns an NPZ file with positions and the sets of a deck."""
    stiffness, mass = matrices()
    npz = io.BytesIO()
    np.savez_compressed(npz, K=stiffness, M=np.diag(mass))
    return {"bars.npz": npz.getvalue(), "nodes.csv": nodes(), "bars.inp": deck(BARS, SETS)}


def files_of_mesh():
    return {"bars.inp": deck(*two_bars(cell=(4, 3, 2), cells=(6, 5, 2), lap=3))}


def files_of_tied_mesh():
    """Returns a deck with a block of different cells that is tied to the free end of the upper bar."""
    bars, sets = two_bars(cell=(4, 3, 2), cells=(6, 5, 2), lap=3)
    block = Bar("BLOCK", 20_001, (3, 3.5, 1.75), (2, 3, 2), (36, 2.25, 4.25))
    sets["GLUED"] = [node for (i, _, _), node in block.nodes.items() if i == 0]
    tie = ["*SURFACE, NAME=SLAVE, TYPE=NODE", "GLUED", "*SURFACE, NAME=MASTER", "UPPER, S4", "*TIE, NAME=GLUE", "SLAVE, MASTER"]
    return {"bars.inp": deck([*bars, block], sets, tie)}


JOINT = {"upper": "TOP", "lower": "BOTTOM"}
MESH = {"kind": "mesh", "file": "bars.inp", "interface": JOINT}
PAIRS = {"kind": "matrices", "stiffness": "K.mtx", "mass": "M.mtx", "nodes": "nodes.csv", "interface": "pairs.csv", "fixed": "1-12"}
NPZ = {"kind": "matrices", "file": "bars.npz", "nodes": "nodes.csv", "interface": JOINT, "fixed": "CLAMP"}
# For each case: its files, the keys of [structure], and the position of the force.
KINDS = {
    "matrices_by_pairs": (files_by_pairs, PAIRS, str(SETS["SENSOR"][0])),
    "matrices_by_sets": (files_by_sets, NPZ, "TIP"),
    "mesh": (files_of_mesh, MESH, "TIP"),
    "mesh_tied": (files_of_tied_mesh, MESH, "TIP"),
}
