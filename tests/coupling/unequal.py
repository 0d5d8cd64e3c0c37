"""Small rough joints between blocks of unequal height, meshed down to the cells: pressure and shear are coupled.

    python unequal.py FOLDER [--refinements 1 2] [--surfaces a b]     (numpy, scipy, pypardiso, pyarrow)

The model differs from truth.py in the following points. The joint is 14 x 10 mm, the lower block is 6 mm high, and the upper block is
10 mm high. The lower block is fixed to a rigid base. The upper block is fixed to a rigid head, which does not rotate. The script presses
the faces without friction. Then friction acts, and the head moves along x under the same normal load. The head is free along z and fixed
along y.

The bodies are not mirror images: shear changes the gap, and pressure moves the faces along each other. The equations use the nodal forces
p across the joint, the nodal forces q along the joint on the lower block, the compliances A, B and T of both blocks, the heights h, the
approach d and the displacement D of the head:

    gap    g = A p + B q - h - d,          p >= 0, g >= 0, p g = 0, sum p = load
    slip  ds = dD - T dq - B' dp,          |q| <= mu p, ds along q where it is not zero

The script computes each cycle twice. With `solved` pressure, each step solves the two equations in turn until p converges. With `held`
pressure, p stays constant and B is zero. The head moves from rest to +d, -d, +d, -d and +d; the tables contain the last two branches.

    joint.parquet     one row per cycle: amplitude, forces at +d and -d, energy, approach, stiffness at full stick, errors of the solution
    element.parquet   one row per contact element around a node: initial load, loads at +d and at -d, force along x at +d, energy per cycle
    cell.parquet      one row per cell: mean pressures before the motion, at +d and at -d, energy per area and cycle
    surface.json      the same keys as in truth.py

The script keeps the rows of other surfaces and refinements in the folder. One surface with one element per cell takes 5 minutes on one
core. The folder unequal/ contains this refinement.
"""

import argparse
import json
import pathlib
import time

import numpy as np

import plates
import truth

SIZE = (14e-3, 10e-3)
HEIGHTS = (6e-3, 10e-3)
CELLS = (56, 40)
ELEMENT_EDGE = 2e-3
# Rq [m], seed and load [N] of each surface.
SURFACES = {"a": (2e-6, 31, 3500.0), "b": (4e-6, 32, 3500.0)}
# Shares of the friction limit at the amplitudes of the head, and the amplitudes [m] from the first refinement.
FORCES = (0.5, 0.8, 0.97)
AMPLITUDES = {"a": (3.12e-6, 5.42e-6, 8.54e-6), "b": (3.66e-6, 6.25e-6, 8.80e-6)}
# The pressure has converged if an iteration changes it by less than this share of the load.
AT_REST = 1e-5
# Number of nodes per batch in the computation of the compliance.
BATCH = 32
# Nodes with a gap below this multiple of Rq before the motion may come into contact.
NEAR = 0.15


class Pair:
    """The lower block, and the upper block upside down."""

    def __init__(self, refinement):
        self.blocks = [truth.Block(refinement, SIZE, height, CELLS) for height in HEIGHTS]
        self.counts, self.edge = self.blocks[0].counts, self.blocks[0].edge
        self.known = {}

    def apply(self, force):
        """Displacements under n sets of forces q and p, with the shape (n, 3, nx + 1, ny + 1). The displacements are B' p + T q along x
        and y, and A p + B q across the joint."""
        turned = np.array([1, 1, -1])[:, None, None]
        lower, upper = self.blocks
        return turned * lower.apply(turned * force) + upper.apply(force)

    def columns(self, near):
        """Displacements of these nodes under unit forces on the nodes along each axis, with the shape (3, nodes, 3, nodes)."""
        places = np.argwhere(near)
        missing = [tuple(place) for place in places if tuple(place) not in self.known]
        for first in range(0, len(missing), BATCH):
            batch = missing[first : first + BATCH]
            force = np.zeros((3, len(batch), 3, *near.shape))
            for axis in range(3):
                for n, place in enumerate(batch):
                    force[(axis, n, axis, *place)] = 1.0
            found = self.apply(force.reshape(-1, 3, *near.shape)).reshape(force.shape)
            self.known |= {place: found[:, n].copy() for n, place in enumerate(batch)}
        return np.array([self.known[tuple(place)][:, :, near] for place in places]).swapaxes(0, 1)


class Joint(truth.Joint):
    """One surface between two blocks. Vectors refer to the nodes near contact. A vector along the joint has the x components first."""

    def __init__(self, pair, name):
        self.pair, self.name = pair, name
        self.rq, seed, self.load = SURFACES[name]
        self.waves = truth.waves_of(self.rq, seed)
        x, y = (np.linspace(-0.5, 0.5, n + 1) * s for n, s in zip(pair.counts, SIZE))
        self.all_heights = truth.heights(self.waves, x, y)
        ends = lambda n, edge: np.r_[0.5, np.ones(n - 1), 0.5] * edge
        self.area = np.outer(*map(ends, pair.counts, pair.edge))
        # The set of nodes begins with the highest part of the faces and grows until no other node is near contact.
        self.take(self.all_heights >= np.quantile(self.all_heights, 0.7))
        while True:
            self.load_of, self.approach = self.pressed(np.zeros(2 * self.height.size), self.height > np.median(self.height))
            gap = self.gap(self.load_of, np.zeros(2 * self.height.size), self.approach)
            missing = (gap < NEAR * self.rq) & ~self.near
            if not missing.any():
                break
            self.take(self.near | missing)
        self.steepest = truth.power(self.along)

    def take(self, near):
        """Sets the nodes near contact, and computes the compliance between these nodes."""
        self.near, self.height = near, self.all_heights[near]
        size = near.sum()
        matrix = self.pair.columns(near).reshape(3 * size, 3 * size)
        matrix = (matrix + matrix.T) / 2
        self.along, self.coupling, self.across = matrix[:-size, :-size], matrix[-size:, :-size], matrix[-size:, -size:]

    def field(self, values):
        field = np.zeros(self.near.shape)
        field[self.near] = values
        return field

    def gap(self, load, shear, approach):
        """Gaps of all nodes."""
        count = self.height.size
        force = np.array([[self.field(part) for part in (shear[:count], shear[count:], load)]])
        return self.pair.apply(force)[0, 2] - self.all_heights - approach

    def pressed(self, shear, active):
        """Forces across the joint under the load and a given shear, and the approach, by an active set of nodes in contact."""
        height = self.height - self.coupling @ shear
        for _ in range(60):
            nodes = np.flatnonzero(active)
            one = np.ones((len(nodes), 1))
            system = np.block([[self.across[np.ix_(nodes, nodes)], -one], [one.T, np.zeros((1, 1))]])
            *found, approach = np.linalg.solve(system, np.r_[height[nodes], self.load])
            load = np.zeros(len(height))
            load[nodes] = found
            gap = self.across[:, nodes] @ load[nodes] - height - approach
            next_active = np.where(active, load > 0, gap < -truth.NORMAL_GAP * self.rq)
            if (next_active == active).all():
                return load, approach
            active = next_active
        raise RuntimeError(f"{self.name}: the set of nodes in contact did not converge")

    def moved(self, state, displacement, is_solved):
        """The state (load, shear, approach) after a displacement of the head along x, with slip and duality gap of the step."""
        before, shear_before, approach = state
        count = len(before)
        load, shear = before, shear_before
        for iteration in range(60):
            contact = np.flatnonzero(load > 0)
            both = np.r_[contact, contact + count]
            # Two contributions move the nodes in contact: the release of shear at nodes that lose contact, and the change of pressure.
            released = shear_before.copy()
            released[both] = 0.0
            more = (self.along @ released - (load - before) @ self.coupling)[both] if is_solved else 0.0
            compliance = self.along[np.ix_(both, both)]
            limit = truth.FRICTION * load[contact]
            found, slip, gap = self.step(compliance, limit, shear_before[both], displacement, more, shear[both])
            shear = np.zeros(2 * count)
            shear[both] = found
            if not is_solved:
                break
            next_load, approach = self.pressed(shear, load > 0)
            change = np.abs(next_load - load).sum() / self.load
            if change < AT_REST:
                break
            load = next_load
        else:
            raise RuntimeError(f"{self.name}: the pressure did not converge, last change {change:.1e}")
        all_slip = np.zeros(2 * count)
        all_slip[both] = slip
        return (load, shear, approach), all_slip, gap

    def march(self, places, is_solved):
        """States after each position of the head, from rest, with the slip and the duality gap of each step."""
        state, before, out = (self.load_of, np.zeros(2 * len(self.load_of)), self.approach), 0.0, []
        for place in places:
            state, slip, gap = self.moved(state, place - before, is_solved)
            out.append((state, slip, gap))
            before = place
        return out

    def amplitudes(self):
        """The stiffness at full stick, and the amplitudes for the shares of the friction limit at constant pressure."""
        contact = np.flatnonzero(self.load_of > 0)
        both = np.r_[contact, contact + len(self.load_of)]
        unit = np.repeat([1.0, 0.0], len(contact))
        stiffness = np.linalg.solve(self.along[np.ix_(both, both)], unit)[: len(contact)].sum()
        if self.name in AMPLITUDES:
            return stiffness, AMPLITUDES[self.name]
        limit = truth.FRICTION * self.load
        path = np.geomspace(0.1, 1.0, 12) * 3 * limit / stiffness
        reached = [shear[: len(self.load_of)].sum() / limit for (_, shear, _), *_ in self.march(path, False)]
        return stiffness, np.interp(FORCES, reached, path)

    def cells(self, values):
        """Nodal values per area as means over the cells."""
        fine = plates.spread(self.pair, self.field(values).T.ravel())
        refinement = self.pair.counts[0] // CELLS[0]
        return fine.reshape(CELLS[0], refinement, CELLS[1], refinement).mean(axis=(1, 3))

    def solve(self):
        """Rows of all cycles."""
        began = time.time()
        rows = {"joint": [], "element": [], "cell": []}
        count = len(self.load_of)
        stiffness, amplitudes = self.amplitudes()
        steps = truth.STEPS
        for part, amplitude in zip(FORCES, amplitudes):
            branch = np.linspace(1, -1, 2 * steps + 1)[1:]
            places = amplitude * np.r_[np.linspace(1 / steps, 1, steps), branch, -branch, branch, -branch]
            for pressure in ("held", "solved"):
                march = self.march(places, pressure == "solved")
                energy = np.zeros(count)
                for (_, shear, _), slip, _ in march[5 * steps :]:
                    energy += shear[:count] * slip[:count] + shear[count:] * slip[count:]
                load, shear, approach = march[-1][0]
                load_minus, shear_minus, _ = march[-1 - 2 * steps][0]
                shear_before = march[-1 - 4 * steps][0][1]
                # With `held` pressure, the nodes without contact follow the shear freely, so the overlap is not defined.
                outside = self.gap(load, shear, approach)[~self.near] if pressure == "solved" else np.zeros(1)
                key = {"pressure": pressure, "amplitude": amplitude, "part": part}
                rows["joint"].append(key | {
                    "force_plus": shear[:count].sum(), "force_minus": shear_minus[:count].sum(), "energy": energy.sum(),
                    "kt": stiffness, "approach": self.approach, "approach_plus": approach,
                    "contact_area": self.area[self.near][self.load_of > 0].sum(), "gap": max(gap for *_, gap in march),
                    "closed": np.abs(shear - shear_before).sum() / np.abs(shear).sum(), "overlap": max(0.0, -outside.min()),
                })
                fields = {
                    "pressure_pressed": self.load_of, "pressure_plus": load, "pressure_minus": load_minus,
                    "shear_x": shear[:count], "energy": energy,
                }
                cells = {name: self.cells(values) for name, values in fields.items()}
                rows["cell"] += [
                    key | {"i": int(i), "j": int(j)} | {name: field[i, j] for name, field in cells.items()}
                    for i, j in np.argwhere(np.any(list(cells.values()), axis=0))
                ]
                loads = {name: plates.element_loads(field, ELEMENT_EDGE, SIZE) for name, field in cells.items()}
                columns = ("load_pressed", "load_plus", "load_minus", "force_x", "energy")
                rows["element"] += [
                    key | {"i": i, "j": j} | {column: load[i, j] for column, load in zip(columns, loads.values())}
                    for i, j in np.ndindex(loads["energy"].shape)
                ]
                shown = ", ".join(f"{name} {value:.4g}" for name, value in rows["joint"][-1].items() if name != "pressure")
                print(f"{self.name} x{self.pair.counts[0] // CELLS[0]} {pressure}, {count} nodes, "
                      f"{time.time() - began:.0f} s: {shown}", flush=True)
        return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--refinements", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--surfaces", nargs="+", default=list(SURFACES))
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    for refinement in options.refinements:
        pair = Pair(refinement)
        for name in options.surfaces:
            case = {"surface": name, "refinement": refinement}
            rows = Joint(pair, name).solve()
            tables = {table: [case | row for row in found] for table, found in rows.items()}
            plates.write_tables(options.folder, tables, list(case))
    described = {}
    for name, (rq, seed, load) in SURFACES.items():
        k, phase, amplitude = truth.waves_of(rq, seed)
        described[name] = {"rq": rq, "load": load, "amplitude": amplitude, "wave_numbers": k.tolist(), "phases": phase.tolist()}
    joint = {
        "size": SIZE, "heights": HEIGHTS, "cells": CELLS, "element_edge": ELEMENT_EDGE, "youngs_modulus": truth.YOUNG,
        "poisson_ratio": truth.POISSON, "friction_coefficient": truth.FRICTION, "surfaces": described,
    }
    (options.folder / "surface.json").write_text(json.dumps(joint))


if __name__ == "__main__":
    main()
