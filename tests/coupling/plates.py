"""Two free plates that pads press together: distribution of the load over the joint of a structure.

    python plates.py FOLDER [--refinements 1 2]                        (numpy, scipy, pypardiso, pyarrow)

Two equal steel plates of 48 x 36 x 8 mm lie on each other, without supports. Two opposite forces of 10 kN press the plates together; each
force is a uniform pressure on a rectangular pad of an outer face. The contact is frictionless and unilateral. The mesh has eight-node
hexahedra with incompatible modes (as in truth.py), graded in depth. Nodes of the two faces are opposite each other. The script does not
use the program.

The plates and their loads are mirror images. The plane between them therefore stays plane, and the script presses one plate on a rigid
obstacle with half of the heights of the rough face. The refinement is the number of elements per cell and axis; it also divides the
layers in depth. The origin of the coordinates is the centre of the joint. A case is a pad and a surface. The script writes for each case:

    case.parquet      one row per case: the resultant and its position, nodes in contact, the largest pressure, errors of the solution
    cell.parquet      one row per cell with pressure: mean pressure [Pa]
    element.parquet   one row per contact element: load [N] of the square around a node, of 4, 3 or 2 mm; a cell distributes its load to
                      the four nodes around it by bilinear weights
    ring.parquet      one row per ring around the axis of the pad, 3 mm wide: load [N]
    plates.json       sizes, pads, and the waves of the rough surface (as in truth.py)

The script keeps the rows of other cases in the folder. On one core, one case takes half a minute and 1 GB with one element per cell, and
10 minutes and 16 GB with two. The folder plates/ contains the second refinement of the pad `inner`. decks.py writes the plates as decks.
"""

import argparse
import json
import pathlib
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pypardiso
import scipy.sparse as sp

import truth

SIZE = (48e-3, 36e-3)
HEIGHT = 8e-3
CELLS = (96, 72)
YOUNG, POISSON, DENSITY = 210e9, 0.3, 7850.0
LOAD = 10e3
# Growth factor of the layers away from the joint. The first layer is as thick as an element is long.
GROWTH = 1.3
# Centre and sides of each pad [m].
PADS = {
    "inner": ((-6e-3, 0.0), (12e-3, 12e-3)),
    "edge": ((6e-3, 12e-3), (12e-3, 12e-3)),
    "centred": ((0.0, 0.0), (9e-3, 9e-3)),
}
# Rq [m], correlation length [m] and seed of each surface.
SURFACES = {"smooth": None, "rough": (2e-6, 3e-3, 21)}
CASES = [("inner", "smooth"), ("inner", "rough"), ("edge", "smooth"), ("edge", "rough"), ("centred", "smooth")]
ELEMENT_EDGES = (4e-3, 3e-3, 2e-3)
RING = 3e-3
# Number of points per axis and fine element, for the share of an element in a ring.
POINTS = 8
# Tolerance of a negative gap [m].
GAP = 1e-12


class Plate:
    """One plate, with its joint at z = 0 and its material below; layer 0 is at the joint."""

    def __init__(self, refinement):
        self.counts = tuple(refinement * c for c in CELLS)
        self.edge = tuple(s / n for s, n in zip(SIZE, self.counts))
        thickness = [self.edge[0]]
        while sum(thickness) < HEIGHT:
            thickness.append(thickness[-1] * GROWTH ** (1 / refinement))
        self.layers = np.array(thickness) * HEIGHT / sum(thickness)
        nx, ny = self.counts
        self.nodes = np.arange((nx + 1) * (ny + 1) * (len(self.layers) + 1)).reshape(-1, ny + 1, nx + 1)
        self.x = np.linspace(-0.5, 0.5, nx + 1) * SIZE[0]
        self.y = np.linspace(-0.5, 0.5, ny + 1) * SIZE[1]
        self.stiffness = self.assemble()
        self.face = 3 * self.nodes[0].ravel() + 2
        # These degrees of freedom prevent rigid motions in the plane.
        corner, along = self.nodes[0, 0, 0], self.nodes[0, 0, -1]
        self.still = [3 * corner, 3 * corner + 1, 3 * along + 1]
        self.solver = pypardiso.PyPardisoSolver(mtype=2)
        self.is_analysed = False

    def assemble(self):
        """Stiffness matrix; the degrees of freedom are 3 n + axis."""
        nx, ny = self.counts
        size = 3 * self.nodes.size
        total = sp.csr_matrix((size, size))
        for k, layer in enumerate(self.layers):
            matrix = truth.element_matrix(*self.edge, layer, YOUNG, POISSON)
            # The z axis points to the joint, so the upper corners of an element are in layer k.
            corners = [
                self.nodes[k + 1 - (n >> 2 & 1), n >> 1 & 1 : ny + (n >> 1 & 1), n & 1 : nx + (n & 1)].ravel() for n in range(8)
            ]
            dofs = (3 * np.array(corners).T[:, :, None] + np.arange(3)).reshape(-1, 24).astype(np.int32)
            places = (np.repeat(dofs, 24, axis=1).ravel(), np.tile(dofs, 24).ravel())
            total = total + sp.csr_matrix((np.tile(matrix.ravel(), len(dofs)), places), shape=(size, size))
        return total

    def pad_force(self, pad):
        """Nodal forces of the load as a uniform pressure on the pad, towards the joint."""
        centre, sides = PADS[pad]
        inside = [
            np.abs((nodes[1:] + nodes[:-1]) / 2 - c) < s / 2 for nodes, c, s in zip((self.x, self.y), centre, sides)
        ]
        faces = np.outer(inside[1], inside[0])
        assert np.isclose(faces.sum() * self.edge[0] * self.edge[1], sides[0] * sides[1]), "the faces of the elements must tile the pad"
        share = np.zeros(self.nodes.shape[1:])
        for part in (share[1:, 1:], share[1:, :-1], share[:-1, 1:], share[:-1, :-1]):
            part += faces / 4
        force = np.zeros(self.stiffness.shape[0])
        force[3 * self.nodes[-1].ravel() + 2] = LOAD * share.ravel() / share.sum()
        return force

    def solve_with(self, given, values, force):
        """Displacements under forces, with given displacements of some degrees of freedom."""
        held = np.zeros(len(force), bool)
        held[given] = held[self.still] = True
        u = np.zeros(len(force))
        u[given] = values
        load = np.where(held, u, force - self.stiffness @ u)
        if not self.is_analysed:
            self.upper = sp.triu(self.stiffness, format="csr")
            self.upper.sort_indices()
            self.full = self.upper.data.copy()
            self.row = np.repeat(np.arange(len(force), dtype=np.int32), np.diff(self.upper.indptr))
            self.diagonal = self.upper.indptr[:-1]
        self.upper.data[:] = np.where(held[self.row] | held[self.upper.indices], 0.0, self.full)
        self.upper.data[self.diagonal[held]] = 1.0
        self.solver.set_phase(22 if self.is_analysed else 12)
        self.solver._call_pardiso(self.upper, np.zeros((len(force), 1), order="F"))
        self.is_analysed = True
        self.solver.set_phase(33)
        found = self.solver._call_pardiso(self.upper, np.asfortranarray(load[:, None])).ravel()
        return np.where(held, u, found)

    def press(self, height, force, active):
        """Forces of the nodes of the joint with p >= 0 and g >= 0, by an active set of nodes in contact (Hueber and Wohlmuth 2005).
        Heights are positive towards the other plate. Also returns the nodes in contact, the iterations and the largest overlap."""
        top = -height.ravel() / 2
        active = active.copy()
        for iteration in range(60):
            u = self.solve_with(self.face[active], top[active], force)
            pressing = np.where(active, -(self.stiffness[self.face] @ u), 0.0)
            gap = 2 * (top - u[self.face])
            next_active = np.where(active, pressing > 0, gap < -GAP)
            changed = (next_active != active).sum()
            if changed == 0:
                return pressing, active, iteration, max(0.0, -gap.min())
            active = next_active
        raise RuntimeError(f"{changed} nodes in contact did not converge")


def spread(plate, pressing):
    """Mean pressures of the fine elements along x and y. The pressure of a node is uniform on the elements around the node."""
    nx, ny = plate.counts
    ends = lambda n: np.r_[0.5, np.ones(n - 1), 0.5]
    density = pressing.reshape(ny + 1, nx + 1).T / np.outer(ends(nx), ends(ny)) / np.prod(plate.edge)
    return (density[1:, 1:] + density[1:, :-1] + density[:-1, 1:] + density[:-1, :-1]) / 4


def element_loads(pressure, edge, sides=SIZE):
    """Loads of the squares around nodes from the mean pressures of cells, by bilinear weights at the centres of the cells."""
    weights = []
    for size, cells in zip(sides, pressure.shape):
        nodes = np.arange(round(size / edge) + 1) * edge
        centres = (np.arange(cells) + 0.5) * size / cells
        weights.append(np.maximum(0.0, 1 - np.abs(nodes[:, None] - centres) / edge))
    return weights[0] @ pressure @ weights[1].T * (sides[0] * sides[1] / pressure.size)


def ring_loads(pressure, centre):
    """Loads of the rings around a centre, from mean pressures of small rectangles."""
    places = [
        (np.arange(POINTS * n) + 0.5) * size / (POINTS * n) - size / 2 - c
        for n, size, c in zip(pressure.shape, SIZE, centre)
    ]
    ring = (np.hypot(places[0][:, None], places[1]) / RING).astype(int)
    part = np.repeat(np.repeat(pressure, POINTS, axis=0), POINTS, axis=1) * (SIZE[0] * SIZE[1] / ring.size)
    return np.bincount(ring.ravel(), part.ravel())


def case_rows(plate, pad, surface, start):
    """Rows of all tables for a case, and the nodes in contact."""
    began = time.time()
    height = np.zeros(plate.nodes.shape[1:])
    if SURFACES[surface] is not None:
        height = truth.heights(waves_of(surface), plate.x, plate.y).T
    pressing, active, iterations, overlap = plate.press(height, plate.pad_force(pad), start)
    fine = spread(plate, pressing)
    refinement = plate.counts[0] // CELLS[0]
    cells = fine.reshape(CELLS[0], refinement, CELLS[1], refinement).mean(axis=(1, 3))
    places = np.meshgrid(plate.x, plate.y)
    load = pressing.sum()
    resultant = [float(place.ravel() @ pressing / load) for place in places]
    case = {
        "load": float(load), "x": resultant[0], "y": resultant[1], "nodes_in_contact": int(active.sum()),
        "largest_pressure": float(cells.max()), "iterations": iterations, "overlap": float(overlap), "layers": len(plate.layers),
    }
    rings = ring_loads(fine, PADS[pad][0])
    rows = {
        "case": [case],
        "cell": [{"i": int(i), "j": int(j), "pressure": cells[i, j]} for i, j in np.argwhere(cells > 0)],
        "element": [
            {"edge": edge, "i": i, "j": j, "load": value}
            for edge in ELEMENT_EDGES
            for (i, j), value in np.ndenumerate(element_loads(cells, edge))
        ],
        "ring": [{"ring": n, "load": value} for n, value in enumerate(rings)],
    }
    print(f"{pad} {surface} x{refinement}, {time.time() - began:.0f} s: {case}\n"
          f"  rings {np.round(100 * rings / load, 2)[:8]} %", flush=True)
    return rows, active


def waves_of(surface):
    rq, correlation_length, seed = SURFACES[surface]
    return truth.waves_of(rq, seed, correlation_length)


def refined(active, old, new):
    """The nodes of a finer mesh that are nearest to the nodes in contact of a coarser mesh."""
    if old == new:
        return active
    nearest = [np.rint(np.arange(n + 1) * o / n).astype(int) for o, n in zip(old, new)]
    return active.reshape(old[1] + 1, old[0] + 1)[np.ix_(nearest[1], nearest[0])].ravel()


def write_tables(folder, tables, key):
    """Writes the tables, and keeps existing rows with other values in the columns of the key."""
    for table, rows in tables.items():
        of = lambda row: tuple(row[name] for name in key)
        new = set(map(of, rows))
        path = folder / f"{table}.parquet"
        if path.exists():
            rows = rows + [row for row in pq.read_table(path).to_pylist() if of(row) not in new]
        rows = sorted(rows, key=of)
        columns = {name: [row[name] for row in rows] for name in rows[0]}
        pq.write_table(pa.table(columns), path, compression="zstd", compression_level=19)


def described():
    """All parameters of the plates, as the tests read them."""
    surfaces = {}
    for name in SURFACES:
        if SURFACES[name] is not None:
            k, phase, amplitude = waves_of(name)
            surfaces[name] = {
                "rq": SURFACES[name][0], "amplitude": amplitude, "wave_numbers": k.tolist(), "phases": phase.tolist(),
            }
    return {
        "size": SIZE, "height": HEIGHT, "cells": CELLS, "youngs_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY,
        "load": LOAD, "ring": RING, "pads": {pad: {"centre": c, "sides": s} for pad, (c, s) in PADS.items()},
        "surfaces": surfaces,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--refinements", type=int, nargs="+", default=[1, 2])
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    contact = {}
    for refinement in options.refinements:
        began = time.time()
        plate = Plate(refinement)
        print(f"x{refinement}: {plate.stiffness.shape[0]} degrees of freedom, {time.time() - began:.0f} s", flush=True)
        for pad, surface in CASES:
            start = (pad, surface)
            if start not in contact:
                places = np.meshgrid(plate.x - PADS[pad][0][0], plate.y - PADS[pad][0][1])
                contact[start] = (np.hypot(*places) < HEIGHT).ravel(), plate.counts
            rows, active = case_rows(plate, pad, surface, refined(*contact[start], plate.counts))
            contact[start] = active, plate.counts
            case = {"pad": pad, "surface": surface, "refinement": refinement}
            write_tables(options.folder, {table: [case | row for row in found] for table, found in rows.items()}, list(case))
        plate.solver.free_memory(everything=True)
    (options.folder / "plates.json").write_text(json.dumps(described()))


if __name__ == "__main__":
    main()
