"""Small rough joints of two bodies, meshed down to the cells: reference for contact elements and fine contact.

    python truth.py FOLDER [--refinements 1 2] [--surfaces a b c]      (numpy, scipy, pypardiso, pyarrow)

Two equal blocks of 12 x 10 x 8 mm (E 198.4 GPa, nu 0.3) are pressed together over 12 x 10 mm. The lower block is fixed to a rigid base.
The upper block is fixed to a rigid head, which presses the joint with the load and then moves along x. The other faces are free. One face
is rough, and its heights are a sum of waves, so all meshes have the same surface. The mesh has eight-node hexahedra with incompatible
modes (Taylor, Beresford, Wilson 1976), graded in depth. Nodes of the two faces are opposite each other, press with p >= 0, and stick or
slip by Coulomb's vector law. The script does not use the program.

The bodies are mirror images. Shear therefore moves both faces by the same distance across the joint and does not change the pressure. The
normal and the tangential problem each need one block with twice its compliance.

A cycle consists of steps from rest to +d, to -d and back to +d. The last branch is one half of the steady cycle, and the other half is its
mirror image; `closed` is the difference between the state at +d and the state at -d with reversed signs. The script writes for each
refinement (elements per cell and axis), surface and amplitude:

    joint.parquet     one row per cycle: amplitude, force at +d, energy, approach, stiffness at full stick, errors of the solution
    element.parquet   one row per contact element: load, force along x at +d, energy per cycle
    cell.parquet      one row per cell: mean pressure, energy per area and cycle
    backbone.parquet  the force of each element from rest to full sliding
    surface.json      the waves of each surface, and all other parameters of the joints

The script keeps the rows of other surfaces and refinements in the folder. On one core, a surface takes half a minute to four minutes with
one element per cell, and 10 to 60 minutes with two. The folder truth/ contains the result, which `blocks.rs` reads.
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

SIZE = (12e-3, 10e-3)
HEIGHT = 8e-3
CELLS = (48, 40)
ELEMENTS = (6, 5)
YOUNG, POISSON = 198.4e9, 0.3
FRICTION = 0.6
# Growth factor of the layers away from the face. The first layer is as thick as an element is long.
GROWTH = 1.3
WAVES = 80
CORRELATION_LENGTH = 2e-3
# Rq [m], seed, load [N], and the share of the face that the worn surface has lost to a plateau; None for an unworn surface.
SURFACES = {
    "a": (2e-6, 12, 3000.0, None),
    "b": (4e-6, 13, 3000.0, None),
    "c": (6e-6, 14, 3000.0, None),
    "a_worn": (2e-6, 12, 3000.0, 0.5),
    "b_worn": (4e-6, 13, 3000.0, 0.35),
    "c_worn": (6e-6, 14, 3000.0, 0.2),
}
# Shares of the friction limit at the amplitudes of the head. The last amplitude is GROSS times the displacement of full sliding.
FORCES = (0.5, 0.8, 0.97)
GROSS = 1.3
# Amplitudes [m] from the first refinement, so that all refinements have the same motion.
AMPLITUDES = {
    "a": (3.11e-06, 5.27e-06, 7.17e-06, 1.24e-05),
    "b": (3.58e-06, 6.22e-06, 9.16e-06, 1.92e-05),
    "c": (4.68e-06, 9.34e-06, 1.32e-05, 2.04e-05),
    "a_worn": (2.88e-06, 4.68e-06, 6.27e-06, 1.02e-05),
    "b_worn": (3.09e-06, 5.02e-06, 6.69e-06, 1.09e-05),
    "c_worn": (3.24e-06, 5.24e-06, 7.12e-06, 1.13e-05),
}
# Number of steps from rest to the amplitude; a branch has twice as many.
STEPS = 6
# Bound of the relative duality gap of a step, and bound of the gap of the normal contact relative to Rq.
GAP = 1e-4
NORMAL_GAP = 1e-5
# Number of right-hand sides per batch.
BATCH = 64


def element_matrix(a, b, c, young=YOUNG, poisson=POISSON):
    """Stiffness matrix of a box with the edges a, b, c. The bits of the node number n are the position of the corner along x, y, z."""
    g = np.array([-1.0, 1.0]) / np.sqrt(3.0)
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    shear = young / (2 * (1 + poisson))
    elastic = np.diag([2 * shear] * 3 + [shear] * 3)
    elastic[:3, :3] += lame
    signs = np.array([[1 if n >> axis & 1 else -1 for axis in range(3)] for n in range(8)])
    scale = np.array([2 / a, 2 / b, 2 / c])
    k = np.zeros((33, 33))
    for x in g:
        for y in g:
            for z in g:
                point = np.array([x, y, z])
                gradients = np.empty((11, 3))
                for n in range(8):
                    terms = (1 + signs[n] * point) / 2
                    for axis in range(3):
                        others = [terms[o] for o in range(3) if o != axis]
                        gradients[n, axis] = signs[n, axis] / 2 * others[0] * others[1] * scale[axis]
                for axis in range(3):
                    gradients[8 + axis] = 0
                    gradients[8 + axis, axis] = -2 * point[axis] * scale[axis]
                strain = np.zeros((6, 33))
                for n in range(11):
                    gx, gy, gz = gradients[n]
                    strain[:, 3 * n : 3 * n + 3] = [
                        [gx, 0, 0], [0, gy, 0], [0, 0, gz], [gy, gx, 0], [0, gz, gy], [gz, 0, gx],
                    ]
                k += strain.T @ elastic @ strain * (a * b * c / 8)
    own, cross = k[24:, 24:], k[24:, :24]
    return k[:24, :24] - cross.T @ np.linalg.solve(own, cross)


class Block:
    """Compliance of the face of a block on a rigid base, from its four symmetric quarters."""

    def __init__(self, refinement, size=SIZE, height=HEIGHT, cells=CELLS):
        self.counts = tuple(refinement * c for c in cells)
        self.edge = tuple(s / n for s, n in zip(size, self.counts))
        self.half = tuple(n // 2 for n in self.counts)
        thickness = [self.edge[0]]
        while sum(thickness) < height:
            thickness.append(thickness[-1] * GROWTH)
        self.layers = np.array(thickness) * height / sum(thickness)
        matrix = self.assemble()
        self.classes = []
        for a in (1, -1):
            for b in (1, -1):
                free = self.free(a, b)
                upper = sp.triu(matrix[free][:, free], format="csr")
                upper.sort_indices()
                solver = pypardiso.PyPardisoSolver(mtype=2)
                solver.factorize(upper)
                solver.set_phase(33)
                place = np.full(3 * self.nodes.size, -1)
                place[free] = np.arange(len(free))
                self.classes.append((a, b, free, place, upper, solver))
        self.applied = 0

    def assemble(self):
        """Stiffness matrix of the quarter x, y >= 0, with layer 0 at the face; the degrees of freedom are 3 n + axis."""
        mx, my = self.half
        nz = len(self.layers)
        index = np.arange((mx + 1) * (my + 1) * (nz + 1)).reshape(nz + 1, my + 1, mx + 1)
        self.nodes = index
        rows, columns, values = [], [], []
        for k in range(nz):
            stiffness = element_matrix(self.edge[0], self.edge[1], self.layers[k])
            corners = []
            for n in range(8):
                x, y, z = n & 1, n >> 1 & 1, n >> 2 & 1
                # The z axis points to the face, so the upper corner is in layer k.
                corners.append(index[k + 1 - z, y : my + y, x : mx + x].ravel())
            dofs = (3 * np.array(corners).T[:, :, None] + np.arange(3)).reshape(-1, 24)
            rows.append(np.repeat(dofs, 24, axis=1).ravel())
            columns.append(np.tile(dofs, 24).ravel())
            values.append(np.tile(stiffness.ravel(), len(dofs)))
        size = 3 * index.size
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sp.csr_matrix(entries, shape=(size, size))

    def free(self, a, b):
        """Degrees of freedom of a symmetry class: u_z is even (1) or odd (-1) across x = 0 and y = 0."""
        held = np.zeros((self.nodes.size, 3), bool)
        held[self.nodes[-1].ravel()] = True
        for parity, plane, axis in ((a, self.nodes[:, :, 0], 0), (b, self.nodes[:, 0, :], 1)):
            across = [axis] if parity == 1 else [c for c in range(3) if c != axis]
            for c in across:
                held[plane.ravel(), c] = True
        return np.flatnonzero(~held.ravel())

    def apply(self, force):
        """Displacements (n, 3, nx + 1, ny + 1) of the face under n sets of nodal forces of the same shape."""
        mx, my = self.half
        result = np.zeros_like(force)
        self.applied += len(force)
        weight = np.ones((mx + 1, my + 1))
        weight[0, :] /= 2
        weight[:, 0] /= 2
        face_dofs = (3 * self.nodes[0].T[:, :, None] + np.arange(3)).transpose(2, 0, 1)
        for a, b, free, place, upper, solver in self.classes:
            # If u_z is even across x = 0, u_x is odd; if u_z is even across y = 0, u_y is odd.
            sign_x = np.array([-a, a, a])[:, None, None]
            sign_y = np.array([b, -b, b])[:, None, None]
            part = force + sign_x * force[:, :, ::-1, :]
            part = (part + sign_y * part[:, :, :, ::-1]) / 4
            load = np.zeros((3 * self.nodes.size, len(force)), order="F")
            load[face_dofs.ravel()] = (part[:, :, mx:, my:] * weight).reshape(len(force), -1).T
            x = solver._call_pardiso(upper, np.asfortranarray(load[free])).reshape(-1, len(force), order="F")
            face = np.zeros((face_dofs.size, len(force)))
            known = place[face_dofs.ravel()]
            face[known >= 0] = x[known[known >= 0]]
            face = face.T.reshape((len(force),) + face_dofs.shape)
            full = np.empty_like(result)
            full[:, :, mx:, my:] = face
            full[:, :, :mx, my:] = sign_x * face[:, :, :0:-1, :]
            full[:, :, :, :my] = sign_y * full[:, :, :, :my:-1]
            result += full
        return result

    def columns(self, axis, places):
        """Twice the displacement along `axis` of all nodes of the face, under a unit force along `axis` on each of the given nodes. If
        `axis` is (0, 1), displacements along x and y under a unit force along x, then under a unit force along y."""
        axes = (axis,) if np.isscalar(axis) else axis
        nx, ny = self.counts
        found = np.empty((len(axes), len(places), len(axes), nx + 1, ny + 1))
        for n, along in enumerate(axes):
            for first in range(0, len(places), BATCH):
                batch = places[first : first + BATCH]
                force = np.zeros((len(batch), 3, nx + 1, ny + 1))
                force[np.arange(len(batch)), along, batch[:, 0], batch[:, 1]] = 1.0
                found[n, first : first + len(batch)] = 2 * self.apply(force)[:, list(axes)]
        return found


def waves_of(rq, seed, correlation_length=CORRELATION_LENGTH):
    """Wave numbers, phases and the common amplitude of a surface with Gaussian autocorrelation."""
    random = np.random.default_rng(seed)
    k = random.normal(0.0, np.sqrt(2.0) / correlation_length, (WAVES, 2))
    phase = random.uniform(0.0, 2 * np.pi, WAVES)
    return k, phase, rq * np.sqrt(2.0 / WAVES)


def heights(waves, x, y):
    k, phase, amplitude = waves
    angle = k[:, 0, None, None] * x[:, None] + k[:, 1, None, None] * y[None, :] + phase[:, None, None]
    return amplitude * np.cos(angle).sum(axis=0)


class Joint:
    """One surface on one mesh."""

    def __init__(self, block, name):
        self.block, self.name = block, name
        self.rq, seed, self.load, worn = SURFACES[name]
        self.waves = waves_of(self.rq, seed)
        nx, ny = block.counts
        self.x = np.linspace(-0.5, 0.5, nx + 1) * SIZE[0]
        self.y = np.linspace(-0.5, 0.5, ny + 1) * SIZE[1]
        self.cut = cut_of(self.waves, worn)
        self.height = np.minimum(heights(self.waves, self.x, self.y), self.cut)
        ends = lambda n: np.r_[0.5, np.ones(n - 1), 0.5]
        self.area = np.outer(ends(nx) * block.edge[0], ends(ny) * block.edge[1])

    def normal(self):
        """Forces of the nodes under the load with p >= 0 and g >= 0, by an active set of nodes in contact (Hueber and Wohlmuth 2005)."""
        shape = self.height.shape
        height = self.height.ravel()
        known = np.empty((0, height.size))
        number = np.full(height.size, -1)
        # The search starts from the highest part of the face, which exceeds the final contact.
        active = height >= np.quantile(height, 0.75)
        for iteration in range(60):
            new = np.flatnonzero(active & (number < 0))
            number[new] = len(known) + np.arange(len(new))
            places = np.array(np.unravel_index(new, shape)).T
            known = np.vstack([known, self.block.columns(2, places).reshape(len(new), height.size)])
            nodes = np.flatnonzero(active)
            rows = known[number[nodes]]
            # The equation K f - h - d = 0 applies to the nodes in contact, and the sum of their forces is the load.
            system = np.block([[rows[:, nodes], -np.ones((len(nodes), 1))], [np.ones(len(nodes)), 0.0]])
            solution = np.linalg.solve(system, np.r_[height[nodes], self.load])
            force = np.zeros(height.size)
            force[nodes] = solution[:-1]
            approach = solution[-1]
            gap = force[nodes] @ rows - height - approach
            inside = force > 0
            next_active = inside | (gap < -NORMAL_GAP * self.rq)
            if (next_active == active).all():
                break
            active = next_active
        assert (next_active == active).all(), f"{self.name}: the set of nodes in contact did not converge"
        return force.reshape(shape), approach, iteration

    def dense(self, contact):
        """Twice the compliance along x and y between the nodes in contact."""
        found = self.block.columns((0, 1), np.argwhere(contact))[:, :, :, contact]
        size = 2 * contact.sum()
        matrix = found.transpose(0, 1, 2, 3).reshape(size, size)
        return (matrix + matrix.T) / 2

    def step(self, compliance, limit, force, displacement, more=0.0, start=None):
        """Forces after a displacement of the head along x from a state `force`: the minimum of q C q / 2 - q (d + C q0) within the
        friction circles, by accelerated projected gradients. `more` is an additional displacement of the nodes. The search starts from
        `start`, or from the state itself."""
        count = len(limit)
        drive = np.r_[np.full(count, displacement), np.zeros(count)] + compliance @ force + more
        project = lambda q: q / np.tile(np.maximum(1.0, np.hypot(q[:count], q[count:]) / limit), 2)
        steepest = self.steepest
        q = ahead = force if start is None else start
        weight = 1.0
        slip = drive - compliance @ ahead
        for iteration in range(20000):
            new = project(ahead + slip / steepest)
            if ((ahead - new) * (new - q)).sum() > 0:
                weight = 1.0
            next_weight = (1 + np.sqrt(1 + 4 * weight**2)) / 2
            ahead = new + (weight - 1) / next_weight * (new - q)
            q, weight = new, next_weight
            slip = drive - compliance @ ahead
            if iteration % 20 == 0:
                exact = drive - compliance @ q
                size = np.hypot(exact[:count], exact[count:])
                most = (limit * size).sum()
                gap = (most - (q * exact).sum()) / max(most, 1e-300)
                # If nearly no node slips, the duality gap is relative to a thousandth of the work of the drive.
                if most - (q * exact).sum() < GAP * max(most, 1e-3 * abs(displacement) * limit.sum()):
                    break
        return q, exact, gap

    def march(self, places):
        """Moves the head along the positions from rest, and returns forces and slip after each step."""
        count = len(self.limit)
        force, before = np.zeros(2 * count), 0.0
        out = []
        for place in places:
            new, slip, gap = self.step(self.compliance, self.limit, force, place - before)
            out.append((place, new, slip, gap))
            force, before = new, place
        return out

    def solve(self):
        """All cycles of the joint."""
        began = time.time()
        load, approach, iterations = self.normal()
        contact = load > 0
        self.contact = contact
        self.limit = FRICTION * load[contact]
        self.compliance = self.dense(contact)
        self.steepest = np.linalg.norm(self.compliance, 2) if len(self.limit) < 600 else power(self.compliance)
        count = len(self.limit)
        unit = np.r_[np.ones(count), np.zeros(count)]
        stuck = np.linalg.solve(self.compliance, unit)
        stiffness = stuck[:count].sum()
        # A long motion of the head gives the displacement at which the last node slips.
        far = 3.0 * self.limit.sum() / stiffness
        path = np.geomspace(0.05, 1.0, 20) * far
        backbone = self.march(path)
        sliding = next((d for d, q, *_ in backbone if q[:count].sum() > 0.999 * self.limit.sum()), far)
        self.shares = self.element_shares()
        rows = {"joint": [], "element": [], "cell": [], "backbone": []}
        load = load[contact]
        of_element = lambda values: self.shares @ values
        for d, q, *_ in backbone:
            for e, t in enumerate(of_element(q[:count])):
                rows["backbone"].append({"element": e, "displacement": d, "force_x": t})
        reached = [q[:count].sum() / self.limit.sum() for _, q, *_ in backbone]
        given = AMPLITUDES.get(self.name) or [*np.interp(FORCES, reached, path), GROSS * sliding]
        for part, amplitude in zip((*FORCES, 1.0), given):
            up = amplitude * np.linspace(1 / STEPS, 1, STEPS)
            branch = np.linspace(1, -1, 2 * STEPS + 1)[1:] * amplitude
            march = self.march(np.r_[up, branch, -branch])
            energy = np.zeros(count)
            for _, q, slip, _ in march[3 * STEPS :]:
                energy += 2 * (q[:count] * slip[:count] + q[count:] * slip[count:])
            top = march[-1][1]
            closed = np.abs(top + march[3 * STEPS - 1][1]).max() / self.limit.max()
            key = {"amplitude": amplitude, "part": part}
            rows["joint"].append(key | {
                "force_x": top[:count].sum(), "energy": energy.sum(), "approach": approach, "kt": stiffness,
                "sliding_displacement": sliding, "contact_area": self.area[contact].sum(),
                "gap": max(gap for *_, gap in march), "closed": closed, "normal_iterations": iterations,
            })
            for e, (n, t, w) in enumerate(zip(of_element(load), of_element(top[:count]), of_element(energy))):
                rows["element"].append(key | {"element": e, "normal_load": n, "force_x": t, "energy": w})
            fields = self.to_cells(load), self.to_cells(energy)
            for (i, j), p in np.ndenumerate(fields[0]):
                rows["cell"].append(key | {"i": i, "j": j, "pressure": p, "energy": fields[1][i, j]})
        print(f"{self.name} x{self.block.counts[0] // CELLS[0]}: {count} nodes, {time.time() - began:.0f} s, "
              f"{self.block.applied} solves", flush=True)
        return rows

    def element_shares(self):
        """Share of each node in contact in each contact element: 1 inside the element, equal shares on a border."""
        nx, ny = self.block.counts
        def along(n, elements):
            shares = np.zeros((elements, n + 1))
            per = n // elements
            for e in range(elements):
                shares[e, e * per : (e + 1) * per + 1] = 1.0
                if e > 0:
                    shares[e, e * per] = 0.5
                if e < elements - 1:
                    shares[e, (e + 1) * per] = 0.5
            return shares
        x, y = along(nx, ELEMENTS[0]), along(ny, ELEMENTS[1])
        all_shares = np.einsum("ai,bj->abij", x, y).reshape(-1, nx + 1, ny + 1)
        return all_shares[:, self.contact]

    def to_cells(self, values):
        """Nodal values as means over the area of the cells. The value of a node is uniform on the elements around the node."""
        refinement = self.block.counts[0] // CELLS[0]
        field = np.zeros(self.contact.shape)
        field[self.contact] = values
        density = field / self.area
        element = (density[1:, 1:] + density[1:, :-1] + density[:-1, 1:] + density[:-1, :-1]) / 4
        return element.reshape(CELLS[0], refinement, CELLS[1], refinement).mean(axis=(1, 3))


def power(matrix):
    """Upper estimate of the largest eigenvalue, by power iteration with a margin of 2 %."""
    x = np.ones(len(matrix))
    for _ in range(60):
        x = matrix @ (x / np.linalg.norm(x))
    return 1.02 * np.linalg.norm(x)


def cut_of(waves, part):
    """The height above which the given share of the face lies; infinite without a share."""
    if part is None:
        return np.inf
    fine = [np.linspace(-0.5, 0.5, 961) * s for s in SIZE]
    return float(np.quantile(heights(waves, *fine), 1 - part))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--refinements", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--surfaces", nargs="+", default=list(SURFACES))
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    tables = {"joint": [], "element": [], "cell": [], "backbone": []}
    described = {}
    for refinement in options.refinements:
        began = time.time()
        block = Block(refinement)
        print(f"x{refinement}: {3 * block.nodes.size} degrees of freedom per quarter, {time.time() - began:.0f} s", flush=True)
        for name in options.surfaces:
            joint = Joint(block, name)
            for table, rows in joint.solve().items():
                tables[table] += [{"refinement": refinement, "surface": name} | row for row in rows]
            k, phase, amplitude = joint.waves
            described[name] = {
                "rq": joint.rq, "load": joint.load, "cut": None if np.isinf(joint.cut) else joint.cut,
                "amplitude": amplitude, "wave_numbers": k.tolist(), "phases": phase.tolist(),
            }
    new = {(row["refinement"], row["surface"]) for row in tables["joint"]}
    for table, rows in tables.items():
        path = options.folder / f"{table}.parquet"
        if path.exists():
            old = pq.read_table(path).to_pylist()
            rows += [row for row in old if (row["refinement"], row["surface"]) not in new]
        rows.sort(key=lambda row: (row["surface"], row["refinement"]))
        columns = {name: [row[name] for row in rows] for name in rows[0]}
        pq.write_table(pa.table(columns), path, compression="zstd", compression_level=19)
    path = options.folder / "surface.json"
    if path.exists():
        described = json.loads(path.read_text())["surfaces"] | described
    joint = {
        "size": SIZE, "height": HEIGHT, "cells": CELLS, "elements": ELEMENTS, "youngs_modulus": YOUNG,
        "poisson_ratio": POISSON, "friction_coefficient": FRICTION, "surfaces": described,
    }
    path.write_text(json.dumps(joint))


if __name__ == "__main__":
    main()
