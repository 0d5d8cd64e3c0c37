"""Two blocks as matrices, as files of other programs, and their natural frequencies by SciPy, for test_import.py."""

import csv
import json
from pathlib import Path

import numpy as np
from scipy import linalg, sparse

MODULUS, RATIO, DENSITY = 210000.0, 0.3, 7.85e-9
FREE, STUCK = 43820.640086, 7795.825673


def block(first, bottom):
    """Block of 3 × 4 × 3 nodes with hexahedra. The distance of nodes is 10 mm, and 5 mm along z."""
    nodes = {
        first + x + 3 * y + 12 * z: np.array([10.0 * x, 10.0 * y, bottom + 5.0 * z]) for z in range(3) for y in range(4) for x in range(3)
    }
    corners = [first + x + 3 * y + 12 * z for z in range(2) for y in range(3) for x in range(2)]
    return nodes, [[n, n + 1, n + 4, n + 3, n + 12, n + 13, n + 16, n + 15] for n in corners]


def hexahedron(at):
    """Stiffness and consistent mass of a C3D8 element with eight integration points."""
    signs = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], float)
    lame, shear = MODULUS * RATIO / (1 + RATIO) / (1 - 2 * RATIO), MODULUS / 2 / (1 + RATIO)
    material = np.zeros((6, 6))
    material[:3, :3] = lame
    material += np.diag([2 * shear] * 3 + [shear] * 3)
    stiffness, mass = np.zeros((24, 24)), np.zeros((24, 24))
    for point in signs / np.sqrt(3):
        terms = 1 + signs * point
        shape = terms.prod(axis=1) / 8
        slopes = np.stack([signs[:, d] * np.delete(terms, d, axis=1).prod(axis=1) / 8 for d in range(3)])
        jacobian = slopes @ at
        weight, slopes = np.linalg.det(jacobian), np.linalg.solve(jacobian, slopes)
        strain = np.zeros((6, 24))
        for d in range(3):
            strain[d, d::3] = slopes[d]
        for row, (a, b) in enumerate(((0, 1), (1, 2), (2, 0)), 3):
            strain[row, a::3], strain[row, b::3] = slopes[b], slopes[a]
        stiffness += weight * strain.T @ material @ strain
        mass += weight * DENSITY * np.kron(np.outer(shape, shape), np.eye(3))
    return stiffness, mass


class Blocks:
    """Nodes, rows and matrices of the two blocks. The nodes at z = 0 are fixed."""

    def __init__(self):
        (lower, one), (upper, two) = block(1, 0.0), block(101, 10.0)
        self.nodes, self.elements = lower | upper, one + two
        self.top, self.bottom = list(range(101, 113)), list(range(25, 37))
        labels = sorted(self.nodes)
        at = {label: k for k, label in enumerate(labels)}
        K, M = np.zeros((2, 3 * len(at), 3 * len(at)))
        for element in self.elements:
            places = [3 * at[node] + d for node in element for d in range(3)]
            for whole, part in zip((K, M), hexahedron(np.array([self.nodes[n] for n in element])), strict=True):
                whole[np.ix_(places, places)] += part
        free = [k for k in range(len(K)) if labels[k // 3] > 12]
        self.K, self.M = K[np.ix_(free, free)], M[np.ix_(free, free)]
        self.rows = [(labels[k // 3], k % 3 + 1) for k in free]

    def along(self, axes):
        """K and M with rotated axes for some nodes: {node: rows of directions}."""
        turn = np.eye(len(self.rows))
        at = {row: k for k, row in enumerate(self.rows)}
        for node, directions in axes.items():
            places = [at[(node, d)] for d in (1, 2, 3)]
            turn[np.ix_(places, places)] = directions
        return turn @ self.K @ turn.T, turn @ self.M @ turn.T


def mtx(matrix, rows, label=lambda node: node):
    """Text of *MATRIX OUTPUT with node labels: one triangle of the matrix."""
    lines = [
        f"{label(rows[i][0])},{rows[i][1]}, {label(rows[j][0])},{rows[j][1]}, {matrix[i, j]:.15e}"
        for i, j in zip(*np.nonzero(np.tril(matrix)), strict=True)
    ]
    return "\n".join(lines) + "\n"


def dmig(name, matrix, rows, form=6, kind=2, decimals=9):
    lines = [f"DMIG    {name:<8}{0:>8}{form:>8}{kind:>8}{0:>8}"]
    for j in range(len(rows)):
        part = [i for i in np.flatnonzero(matrix[:, j]) if form != 6 or i >= j]
        if part:
            lines.append(f"DMIG*   {name:<16}{rows[j][0]:>16}{rows[j][1]:>16}")
        for i in part:
            value = matrix[i, j]
            tail = f"{value.imag:>16.{decimals}E}" if kind > 2 else ""
            lines.append(f"*       {rows[i][0]:>16}{rows[i][1]:>16}{value.real:>16.{decimals}E}{tail}".replace("E", "D"))
    return "\n".join(lines) + "\n"


def grid(node, at, cp=0, cd=0):
    return f"GRID*   {node:>16}{cp:>16}{at[0]:>16.9f}{at[1]:>16.9f}\n*       {at[2]:>16.9f}{cd:>16}\n"


class Folder:
    """Neutral folder, read with NumPy, SciPy and csv only."""

    def __init__(self, path):
        self.path = Path(path)
        self.about = json.loads((self.path / "structure.json").read_text())
        if self.about["kind"] == "matrices":
            self.matrices = {file.stem: sparse.load_npz(file).toarray() for file in self.path.glob("*.npz")}
            self.rows = [tuple(map(int, line)) for line in self.table("rows.csv", "node,direction")]
            self.nodes = {int(line[0]): np.array(list(map(float, line[1:]))) for line in self.table("nodes.csv", "node,x,y,z")}
            self.sets = {}
            for name, node in self.table("sets.csv", "set,node"):
                self.sets.setdefault(name, []).append(int(node))
        else:
            self.read_deck()

    def table(self, name, header):
        lines = list(csv.reader((self.path / name).read_text().splitlines()))
        assert ",".join(lines[0]) == header, lines[0]
        return lines[1:]

    def read_deck(self):
        """Reads nodes, elements, sets, fixed displacements and equations of mesh.inp, one keyword at a time."""
        self.nodes, self.elements, self.sets, self.held, self.equations, self.lines = {}, {}, {}, set(), [], []
        word, options, cells = "", {}, []
        for line in (self.path / "mesh.inp").read_text().splitlines():
            if line.startswith("*") and not line.startswith("**"):
                self.lines.append(line)
                word, *rest = [part.strip() for part in line.split(",")]
                options = dict(part.split("=") for part in rest)
                cells = []
            elif not line.startswith("**"):
                values = [part.strip() for part in line.split(",") if part.strip()]
                if word == "*NODE":
                    self.nodes[int(values[0])] = np.array(list(map(float, values[1:])))
                elif word == "*ELEMENT":
                    cells += map(int, values)
                    if not line.rstrip().endswith(","):
                        self.elements[cells[0]] = (options["TYPE"], cells[1:])
                        cells = []
                elif word == "*NSET":
                    self.sets.setdefault(options["NSET"], []).extend(map(int, values))
                elif word == "*BOUNDARY":
                    self.held.add((int(values[0]), int(values[1])))
                elif word == "*EQUATION":
                    if len(values) == 1:
                        self.equations.append([])
                    else:
                        self.equations[-1] += [(int(values[k]), int(values[k + 1]), float(values[k + 2])) for k in range(0, len(values), 3)]

    def frequencies(self):
        """Natural frequencies in rising order, from the matrices or from a mesh of C3D8 with its constraints. Rigid modes are omitted."""
        if self.about["kind"] == "matrices":
            return self.eigen(self.matrices["K"], self.matrices["M"])
        at = {row: k for k, row in enumerate((node, d) for node in sorted(self.nodes) for d in (1, 2, 3))}
        K, M = np.zeros((2, len(at), len(at)))
        for _, nodes in self.elements.values():
            places = [at[(node, d)] for node in nodes for d in (1, 2, 3)]
            for whole, part in zip((K, M), hexahedron(np.array([self.nodes[n] for n in nodes])), strict=True):
                whole[np.ix_(places, places)] += part
        constraints = np.zeros((len(self.held) + len(self.equations), len(at)))
        for k, terms in enumerate([[(*row, 1.0)] for row in sorted(self.held)] + self.equations):
            for node, direction, factor in terms:
                constraints[k, at[(node, direction)]] += factor
        free = linalg.null_space(constraints) if len(constraints) else np.eye(len(at))
        return self.eigen(free.T @ K @ free, free.T @ M @ free)

    @staticmethod
    def eigen(K, M):
        shift = 1e-6 * np.abs(K).max() / np.abs(M).max()
        total = K + shift * M
        values, vectors = np.linalg.eigh(total)
        kept = vectors[:, values > 1e-11 * values.max()] / np.sqrt(values[values > 1e-11 * values.max()])
        inverse = np.linalg.eigvalsh(kept.T @ M @ kept)[::-1]
        squares = 1 / inverse[inverse > 1e-13 * inverse[0]] - shift
        found = np.sqrt(np.abs(squares)) / 2 / np.pi
        return found[found > 0.5]

    def stuck(self, pairs, normal=2):
        """Lowest frequency with 400 and 300 N/µm between the faces. Each rectangle of four pairs has an equal part of the stiffness."""
        at = {row: k for k, row in enumerate(self.rows)}
        here = np.array([self.nodes[upper] for upper, _ in pairs]).round(6)
        a, b = (d for d in range(3) if d != normal)
        xs, ys = np.unique(here[:, a]), np.unique(here[:, b])
        K, cells = self.matrices["K"].copy(), (len(xs) - 1) * (len(ys) - 1)
        for i in range(len(xs) - 1):
            for j in range(len(ys) - 1):
                corners = [pair for pair, p in zip(pairs, here, strict=True) if p[a] in xs[i : i + 2] and p[b] in ys[j : j + 2]]
                assert len(corners) == 4
                for d in range(3):
                    mean = np.zeros(len(K))
                    for upper, lower in corners:
                        mean[at[(upper, d + 1)]], mean[at[(lower, d + 1)]] = 0.25, -0.25
                    K += (400e3 if d == normal else 300e3) / cells * np.outer(mean, mean)
        return self.eigen(K, self.matrices["M"])[0]

    def nearest_pairs(self, upper, lower):
        return [
            (u, min(self.sets[lower], key=lambda node, u=u: np.linalg.norm(self.nodes[node] - self.nodes[u]))) for u in self.sets[upper]
        ]
