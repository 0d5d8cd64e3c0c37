#!/usr/bin/env python3
"""Compares the normal pressure in a bolted lap of two plates with CalculiX on the same meshes.

    python tests/peers/lap_with_hole.py target/release/fretwear [--ccx ccx] [FOLDER]

Two steel plates of 6 and 9 mm overlap by 42 x 36 mm. A square hole passes through both, near a corner of the lap. Opposing
forces press square washers around the hole. The far end of the lower plate has statically determinate supports. The upper plate rests
on the contact, which is flat and has no friction. Elements are C3D8I of 3 mm and 1.5 mm. CalculiX computes surface-to-surface
contact with a linear penalty: the pressure is the penalty times the overlap. The script prints loads in square rings around the
hole and fails beyond its limits. It needs ccx, numpy and pyarrow. Decks and results go into FOLDER, or into a temporary folder.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

sys.path.append(str(Path(__file__).resolve().parents[2] / "data"))
from make_lap_of_bars import Bar, deck  # noqa: E402

LAP = (42.0, 36.0)  # mm, its middle the origin; the joint is z = 0
LOWER, UPPER = (60.0, 36.0, 6.0), (48.0, 36.0, 9.0)  # mm
HOLE, HOLE_SIDE, WASHER_SIDE = (-12.0, 6.0), 6.0, 12.0  # mm
LOAD = 8e3  # N
PENALTY = 1e8  # MPa/mm
CELL = 0.5  # mm, of the rough contact
RING = ELEMENT = 3.0  # mm, whose loads are compared
CELLS = [round(side / CELL) for side in LAP]
X, Y = ((np.arange(n) + 0.5) * CELL - side / 2 - c for n, side, c in zip(CELLS, LAP, HOLE))
DISTANCE = np.maximum(abs(X[:, None]), abs(Y))  # of a cell from the hole's centre; equal along squares

# Limits: the worst ring and the sum of the differences of element loads, relative to the load, and the ends of the contact in mm.
LIMITS = [
    ("CalculiX 3 x10", "CalculiX 3", (0.005, np.inf, np.inf)),  # ten times the penalty
    ("CalculiX 3", "CalculiX 1.5", 3 * (np.inf,)),
    ("punch 3", "CalculiX 3", 3 * (np.inf,)),
    ("fretwear 3", "CalculiX 3", (0.06, 0.14, 3.0)),
    ("fretwear 3", "CalculiX 1.5", (0.06, 0.14, 3.0)),
    ("fretwear 1.5", "CalculiX 1.5", (0.02, 0.14, 1.5)),
]

SCENE = f"""joint = {{ size = ["{LAP[0]} mm", "{LAP[1]} mm"], grid = {CELLS} }}
material = {{ youngs_modulus = "210 GPa", poisson_ratio = 0.3 }}
surface.kind = "flat"
dynamics = {{ force = {{ amplitude = "0.5 N", at = "HEAD", direction = "z" }}, frequency = ["100 Hz", "200 Hz"] }}
structure.interface = {{ upper = "TOP", lower = "BOTTOM" }}
structure.unit = {{ length = "mm", mass = "t", time = "s" }}
structure.kind = "mesh"
structure.file = "DECK"
contact = {{ friction_coefficient = 0.5, PRESSES }}
"""
BOLT = f'preload = {{ force = "{LOAD} N", head = "HEAD", nut = "NUT" }}'
PUNCH = f'normal_load = "{LOAD} N", pressing = "punch"'


class Lap:
    """Both plates with elements of one edge length [mm]."""

    def __init__(self, edge):
        self.edge = edge
        from_hole = lambda x, y: max(abs(x - HOLE[0]), abs(y - HOLE[1]))
        (left, front), size = (-side / 2 for side in LAP), lambda plate: [round(side / edge) for side in plate]
        self.lower = Bar("LOWER", 1, 3 * (edge,), size(LOWER), (left, front, -LOWER[2]))
        self.upper = Bar("UPPER", 100_001, 3 * (edge,), size(UPPER), (-left - UPPER[0], front, 0.0))
        for plate in (self.lower, self.upper):
            centre = lambda corners: np.mean([plate.positions[node][:2] for node in corners], axis=0)
            plate.elements = {e: corners for e, corners in plate.elements.items() if from_hole(*centre(corners)) > HOLE_SIDE / 2}
            kept = {node for corners in plate.elements.values() for node in corners}
            plate.positions = {node: place for node, place in plate.positions.items() if node in kept}
        in_lap, under_washer = lambda x, y: abs(x) <= -left, lambda x, y: from_hole(x, y) <= WASHER_SIDE / 2
        places = (("TOP", self.upper, 0.0, in_lap), ("BOTTOM", self.lower, 0.0, in_lap))
        places += (("HEAD", self.upper, UPPER[2], under_washer), ("NUT", self.lower, -LOWER[2], under_washer))
        self.sets = {name: self.nodes(*place) for name, *place in places}
        # Six displacements of three corners. The deck fixes all displacements of CLAMP.
        below, above = (self.nodes(self.lower, z, lambda x, y: x == LOWER[0] + left) for z in (-LOWER[2], 0.0))
        self.sets["CLAMP"] = below[:1]
        held = [f"{below[-1]}, 1, 1", f"{below[-1]}, 3, 3", f"{above[0]}, 1, 1"]
        self.deck = deck((self.lower, self.upper), self.sets, held)

    def nodes(self, plate, z, is_in):
        return [node for node, place in plate.positions.items() if place[2] == z and is_in(*place[:2])]

    def faces(self, plate, name):
        """Returns the elements with a face in a set, with the four nodes of the face."""
        nodes = set(self.sets[name])
        return {e: face for e, corners in plate.elements.items() if len(face := nodes & set(corners)) == 4}

    def contact(self, penalty):
        """Returns lines that only CalculiX needs. In its plane, the upper plate has determinate supports without force."""
        far = self.nodes(self.upper, 0.0, lambda x, y: x == LAP[0] / 2 - UPPER[0])
        lines = [f"{far[0]}, 1, 2", f"{far[-1]}, 1, 1"]
        for name, plate, face in (("TOP", self.upper, "S1"), ("BOTTOM", self.lower, "S2")):
            lines += [f"*SURFACE, NAME=S{name}", *(f"{element}, {face}" for element in self.faces(plate, name))]
        lines += ["*SURFACE INTERACTION, NAME=FLAT", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{penalty:g}"]
        lines += ["*CONTACT PAIR, INTERACTION=FLAT, TYPE=SURFACE TO SURFACE", "STOP, SBOTTOM", "*STEP", "*STATIC", "*CLOAD"]
        for name, plate, sign in (("HEAD", self.upper, -1), ("NUT", self.lower, 1)):
            faces = self.faces(plate, name).values()
            lines += [f"{node}, 3, {sign * LOAD / 4 / len(faces)}" for face in faces for node in face]
        return "\n".join([*lines, "*NODE PRINT, NSET=TOP", "U", "*NODE PRINT, NSET=BOTTOM", "U", "*END STEP"]) + "\n"

    def calculix(self, ccx, folder, penalty):
        """Returns mean pressures of the cells [MPa]."""
        name = f"ccx_{self.edge}_{penalty:.0e}"
        (folder / f"{name}.inp").write_text(self.deck + self.contact(penalty))
        with open(folder / f"{name}.log", "w", encoding="utf-8") as log:
            subprocess.run([ccx, "-i", name], cwd=folder, env=dict(os.environ, OMP_NUM_THREADS="1"), stdout=log, stderr=log)
        lines = (folder / f"{name}.dat").read_text().splitlines()
        lift = {int(row[0]): float(row[3]) for line in lines if len(row := line.split()) == 4}
        overlap = np.zeros([round(side / self.edge) + 1 for side in LAP])
        for plate, joint, sign in ((self.lower, "BOTTOM", 1), (self.upper, "TOP", -1)):
            for node in self.sets[joint]:
                i, j = (round((p + side / 2) / self.edge) for p, side in zip(plate.positions[node], LAP))
                overlap[i, j] += sign * lift[node]
        over_x, over_y = hats(self.edge)
        pressure = penalty * np.maximum(over_x.T @ overlap @ over_y, 0.0) * (DISTANCE > HOLE_SIDE / 2)
        # ccx may end a step out of equilibrium without an error.
        if not abs(load := pressure.sum() * CELL**2 - LOAD) < 0.005 * LOAD:
            sys.exit(f"{name}: the contact force differs from the load by {load:+.0f} N; see {folder / name}.log")
        return pressure

    def fretwear(self, program, folder, presses):
        """Returns pressures of the cells [MPa]."""
        run = f"fretwear_{self.edge}_{presses.split()[0]}"
        (folder / f"{run}.inp").write_text(self.deck)
        (folder / f"{run}.toml").write_text(SCENE.replace("DECK", f"{run}.inp").replace("PRESSES", presses))
        command = [program, "run", f"{run}.toml", "--run", run, "--until", "static_contact", "--quiet"]
        subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        table = pq.read_table(folder / run / "staging/wear_iteration=0/static_contact.contact_field.parquet")
        pressure = np.zeros(CELLS)
        pressure[table["i"].to_numpy(), table["j"].to_numpy()] = table["pressure"].to_numpy() * 1e-6
        return pressure


def hats(edge):
    """Returns linear shape functions of nodes at a distance `edge`, at the centres of the cells, along x and y."""
    axes = [(np.arange(0.0, side + CELL, edge), (np.arange(n) + 0.5) * CELL) for side, n in zip(LAP, CELLS)]
    return [np.maximum(0.0, 1 - abs(nodes[:, None] - cells) / edge) for nodes, cells in axes]


def rings(pressure):
    """Returns the loads in square rings around the centre of the hole, relative to the total load."""
    return np.bincount((DISTANCE / RING).astype(int).ravel(), pressure.ravel() * CELL**2 / LOAD)


def ends(pressure):
    """Returns the distances from the hole's centre along -x, x, -y and y at which the pressure falls to 1/1000 of the largest [mm]."""
    loaded = pressure > 1e-3 * pressure.max()
    loaded = [X[loaded[:, abs(Y) < CELL].any(axis=1)], Y[loaded[abs(X) < CELL].any(axis=0)]]
    return np.array([end for x in loaded for end in (x.min() - CELL / 2, x.max() + CELL / 2)])


def differences(pressure, other):
    over_x, over_y = hats(ELEMENT)
    elements = abs(over_x @ (pressure - other) @ over_y.T).sum() * CELL**2 / LOAD
    return abs(rings(pressure) - rings(other)).max(), elements, abs(ends(pressure) - ends(other)).max()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, help="the fretwear program")
    parser.add_argument("folder", nargs="?", metavar="FOLDER", help="folder of the decks and results")
    parser.add_argument("--ccx", default="ccx", help="the CalculiX solver [default: %(default)s]")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.folder or temporary)
        folder.mkdir(parents=True, exist_ok=True)
        coarse, fine, program, found = Lap(3.0), Lap(1.5), arguments.program.resolve(), {}
        print("Rings in % of the load, from 3 mm outwards; ends of the contact in mm.")
        for name, solve, more in (
            ("fretwear 3", coarse.fretwear, (program, folder, BOLT)),
            ("punch 3", coarse.fretwear, (program, folder, PUNCH)),
            ("CalculiX 3", coarse.calculix, (arguments.ccx, folder, PENALTY)),
            ("CalculiX 3 x10", coarse.calculix, (arguments.ccx, folder, 10 * PENALTY)),
            ("fretwear 1.5", fine.fretwear, (program, folder, BOLT)),
            ("CalculiX 1.5", fine.calculix, (arguments.ccx, folder, PENALTY)),
        ):
            started = time.monotonic()
            pressure = found[name] = solve(*more)
            loads = " ".join(f"{100 * ring:5.2f}" for ring in rings(pressure)[1:])
            print(f"{name:14s} {time.monotonic() - started:5.1f} s  rings {loads}  ends {ends(pressure)}", flush=True)
    print(f"{'':30s} ring [%]       elements [%]   ends [mm]")
    failed = False
    for name, other, limits in LIMITS:
        apart = differences(found[name], found[other])
        failed |= not all(np.less_equal(apart, limits))
        shown = (f"{unit * value:6.2f} < {unit * limit:<5.3g}" for value, limit, unit in zip(apart, limits, (100, 100, 1)))
        print(f"{name:14s}  {other:14s}", *shown)
    if failed:
        sys.exit("CalculiX and fretwear disagree")


if __name__ == "__main__":
    main()
