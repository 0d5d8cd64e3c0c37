"""Checks the fields of the steady cycle in a run (output.cycle_fields) against the laws of contact and friction.

    python fields.py --program fretwear [--set KEY=VALUE ...] [--out FILE.jsonl] scene.toml ...

Without scenes, the script takes one scene of each kind of motion on the surface of a case. Scenes are of the kinds that draw.py writes. The
script solves nothing: it inserts pressure, shear and slip of all samples into the equations of contact and friction, with full influence
matrices (half_spaces.py), so it needs only numpy and Polars. It checks the unworn joint and the last iteration, with the tolerances of
`limits_of`:

    load, force, moment    sum of pressure and shear times the area of a cell, against the loads of the table `cycle` and against the
                           prescribed loads of the scene
    displacement           prescribed displacement of the scene against the table `cycle`
    penetration, adhesion  gap and pressure from the heights and the pressures: g = K p - (h - w) - rigid is zero in contact and
                           positive elsewhere
    elastic                displacement of the bodies - K q - slip is the same at all samples
    coulomb                |q| <= mu p
    friction               sum of mu p |dv| - q dv over the dissipation: zero if the shear at the end of each step has the direction of the
                           slip in the step and no cell slips below its limit
    stick                  slip of cells below their limit at the end of a step, over the longest path of the bodies in a step. In a step
                           of second order, the slip minus beta times the slip of the step before is parallel to q. So in the step in
                           which a cell comes to rest, it moves by the subtracted slip and dissipates nothing
    work                   sum of mean shear times slip over the cycle against the work of the forces of the table `cycle`
    closure                shear at t = T against shear at t = 0
    energy                 sum of mean limit times |dv| over the steps against the dissipation, which is extrapolated

    seam_stick             stick at the seams (see SEAMS)

The script also prints, without a limit: `seam`, the friction at the seams; `energy_of_cells` and `path`, sums of |difference| over the
cells.
"""

import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import tomllib

import numpy as np
import polars as pl
from half_spaces import compliance, pair, si

# Rounding error of sums of some thousand products by transforms, relative to the largest term. The largest measured error is 1e-14, and
# 1e-13 for a force that is an unknown.
ROUNDING = 1e-10
# fidelity.normal_tolerance of all presets except `reference` is 1e-6 or less, relative to the displacement of one cell under the largest
# pressure.
NORMAL = 3e-6
# Factor on error_cycle, with a margin for its rounding: in a cycle by reversal, error_cycle includes the violation of the friction law.
WITHIN_BAR = 1.001
# In a stepped cycle, the shear at the end of a step deviates from the direction of its slip by half the rotation of the slip in the step,
# which is a second-order error. In few cells the slip rotates faster than the motion: the largest measured value is 2.6 times
# (pi/samples)^2 / 2.
TURNING = 4.0
# The extrapolation changes the energy of a stepped cycle by two thirds of its estimated error. For a history, the table contains every
# second instant of the march, and the path between these instants is shorter by three times this change. The remainder allows for the error
# of the closure.
OF_BAR = 4.0
# A cell with a shear below this fraction of its limit counts as sticking: with a gap of 1e-4, the shear of a slipping cell may be below its
# limit by about the root of the gap.
BELOW = 0.98
# Largest slip per step of a cell below its limit, over the path of the bodies per step: a hundredth, the accuracy of the shear.
STUCK = 1e-2
# The program composes a cycle of parts of two marches. Between the parts and at t = 0, the shear of sticking cells may jump, and each jump
# occurs twice if the halves are opposite. The script treats these steps separately and gives them the friction of their neighbours.
SEAMS_OF_HALVES, SEAMS = 4, 2
# Largest displacement of a cell below its limit at a seam, as STUCK: the closing of a cycle weights cells by their dissipation, so sticking
# cells have the smallest weight. Measured values are 0.07, and 0.3 for prescribed forces, whose resultant prevents the removal of locked-in
# shear from both marches.
AT_SEAM, AT_SEAM_OF_FORCES = 0.15, 0.5
# A step is a seam if its friction error exceeds the median by this factor.
STANDS_OUT = 20.0
# Below this fraction of mu N times the path of the bodies, the dissipation counts as zero.
NOTHING = 1e-9


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--set", action="append", default=[], dest="sets")
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*", type=pathlib.Path)
    options = parser.parse_args()
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        scenes = [(scene, options.sets) for scene in options.scenes] or list(short(folder))
        for k, (scene, sets) in enumerate(scenes):
            for checked in check(options.program, scene, folder / f"run {k}", sets):
                beyond = [name for name, limit in limits_of(checked).items() if not abs(checked[name]) <= limit]
                wrong += beyond
                name = " ".join([scene.stem, *sets])
                told = {key: float(f"{value:.2e}") if isinstance(value, float) else value for key, value in checked.items()}
                print(f"{name}: {'WRONG: ' + ', '.join(beyond) if beyond else 'within limits'} {json.dumps(told)}", flush=True)
                if options.out:
                    with open(options.out, "a", encoding="utf-8") as out:
                        out.write(json.dumps({"scene": name, "beyond": beyond, **checked}) + "\n")
    return f"{len(wrong)} residuals exceed their limits" if wrong else None


CASE = pathlib.Path(__file__).parent / "cases" / "orbit_204.toml"
# Number of cycles that is so small that all these joints still slip in the last iteration.
FEW_CYCLES = "wear.cycles=10_000_000"
# Motions of the scenes on the surface of the case; `reach` is the half range of the case, `part` and `little` are fractions of its load.
MOTIONS = {
    "line": 'amplitude = ["{reach} um", "0 um"]\nphase = "40 deg"',
    "orbit": 'amplitude = ["{reach} um", "{half} um"]\nphase = ["0 deg", "70 deg"]',
    "load": 'amplitude = ["{reach} um", "{half} um"]\nphase = ["30 deg", "110 deg"]\nnormal_load_amplitude = "{part} N"',
    "force": 'force = ["{part} N", "{little} N"]\nphase = ["0 deg", "60 deg"]',
    "torsion": 'rotation = "{turn} rad"\namplitude = ["{half} um", "0 um"]',
    "history": 'history = "history.csv"',
}


def short(folder):
    """Yields a scene of each kind of motion on the surface of a case, and the scene along a line also with a stepped cycle."""
    text = CASE.read_text(encoding="utf-8")
    case = tomllib.loads(text)
    load, mu = si(case["contact"]["normal_load"]), case["contact"]["friction_coefficient"]
    reach = 1e6 * max(pair(case["motion"]["amplitude"]))
    turn = 4e-6 * reach / max(si(case["joint"]["size"]))
    values = {"reach": reach, "half": 0.5 * reach, "part": 0.4 * mu * load, "little": 0.2 * mu * load, "turn": turn}
    head, rest = text.split("[motion]")
    rest = rest[rest.index("[wear]") :]
    head = head.replace(case["surface"]["path"], str((CASE.parent / case["surface"]["path"]).resolve()))
    time = np.arange(48) / 48
    x = reach * 1e-6 * (np.cos(2 * math.pi * time) + 0.4 * np.sin(4 * math.pi * time))
    y = 0.3e-6 * reach * np.sin(2 * math.pi * time)
    table = np.column_stack([time, x, y, load * (1 + 0.3 * np.sin(2 * math.pi * time))])
    header = "time,displacement_x,displacement_y,normal_load"
    np.savetxt(folder / "history.csv", table, fmt="%.17g", delimiter=",", header=header, comments="")
    for name, motion in MOTIONS.items():
        path = folder / f"{name}.toml"
        path.write_text(f"{head}[motion]\n{motion.format(**values)}\n\n{rest}", encoding="utf-8")
        yield path, [FEW_CYCLES]
        if name == "line":
            yield path, [FEW_CYCLES, "fidelity.cycle=stepped"]


def check(program, path, folder, sets):
    command = [program, "run", str(path), "--run", str(folder), "--quiet"]
    for one in ["output.cycle_fields={ every = 1000000 }", *sets]:
        command += ["--set", one]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{path}: {done.stderr}"
    iterations = sorted(int(of.name.split("=")[1]) for of in (folder / "iterations").glob("wear_iteration=*"))
    scene = Scene(path)
    for iteration in dict.fromkeys((iterations[0], iterations[-1])):
        yield {"iteration": iteration, **Cycle(scene, folder / f"iterations/wear_iteration={iteration}").residuals()}


class Scene:
    """Data of a scene for the equations."""

    def __init__(self, path):
        with open(path, "rb") as file:
            scene = tomllib.load(file)
        joint, surface, contact, material = (scene[name] for name in ("joint", "surface", "contact", "material"))
        self.grid = tuple(joint["grid"])
        size = si(joint["size"])
        self.heights = np.load(path.parent / surface["path"]).ravel() * si(f"1 {surface['unit']}")
        self.matrices = compliance(self.grid, size, si(material["youngs_modulus"]), material["poisson_ratio"])
        self.cell = size[0] / self.grid[0] * size[1] / self.grid[1]
        i, j = (index.ravel() for index in np.indices(self.grid))
        self.x = (i + 0.5) * size[0] / self.grid[0] - size[0] / 2
        self.y = (j + 0.5) * size[1] / self.grid[1] - size[1] / 2
        self.mu = contact["friction_coefficient"]
        self.load = si(contact["normal_load"])
        self.cap = si(contact.get("pressure_cap", math.inf))
        self.turns = contact.get("rotation", "fixed") == "free"
        self.motion, self.folder = scene["motion"], path.parent

    def prescribed(self, time):
        """Returns the columns of the table `cycle` that the scene prescribes, at these times."""
        motion = self.motion
        if "history" in motion:
            with open(self.folder / motion["history"], encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
            of = {name: np.array([float(row[name]) for row in rows] + [float(rows[0][name])]) for name in rows[0]}
            of["time"][-1] = 1.0
            return {name: np.interp(time, of["time"], values) for name, values in of.items() if name != "time"}
        phases = motion.get("phase", "0 deg")
        phases = si(phases) if isinstance(phases, list) else [si(phases)] * 2

        def wave(amplitude, phase):
            return amplitude * np.cos(2 * math.pi * time + phase)

        columns = {"normal_load": self.load + wave(si(motion.get("normal_load_amplitude", 0.0)), 0.0)}
        what = "force" if "force" in motion else "displacement"
        amplitudes = pair(motion.get("force", motion.get("amplitude", 0.0)))
        for axis, amplitude, phase in zip("xy", amplitudes, phases):
            if amplitude or what == "displacement":
                columns[f"{what}_{axis}"] = wave(amplitude, phase)
        for key, column in (("rotation", "rotation_z"), ("moment", "moment_z")):
            if key in motion:
                columns[column] = wave(si(motion[key]), phases[0])
        return columns


class Cycle:
    """Fields of an iteration with one row per sample and one column per cell of the grid."""

    def __init__(self, scene, folder):
        self.scene = scene
        table = {name: pl.read_parquet(folder / f"{name}.parquet") for name in ("cycle", "cycle_field", "contact_field", "fretting_cycle")}
        worn = folder / "wear_field.parquet"
        self.cycle, fields, contact = table["cycle"], table["cycle_field"], table["contact_field"]
        self.figures = table["fretting_cycle"]
        samples, cells = self.cycle.height, len(scene.heights)
        assert fields["sample"].unique().sort().to_list() == list(range(samples)), "all samples"
        cell = fields["i"].to_numpy() * scene.grid[1] + fields["j"].to_numpy()
        sample = fields["sample"].to_numpy()
        assert (fields["time"].to_numpy() == self.cycle["time"].to_numpy()[sample]).all()

        def field(name, otherwise=0.0):
            values = np.full((samples, cells), otherwise)
            values[sample, cell] = fields[name].to_numpy()
            return values

        self.pressure = field("pressure")
        self.shear = np.stack([field("shear_x"), field("shear_y")], axis=2)
        self.slip = np.stack([field("slip_x"), field("slip_y")], axis=2)
        self.listed = np.unique(cell)
        self.gap = field("gap") if "gap" in fields.columns else None

        def of_cells(frame, name):
            values = np.zeros(cells)
            values[frame["i"].to_numpy() * scene.grid[1] + frame["j"].to_numpy()] = frame[name].to_numpy()
            return values

        self.dissipation, self.path = (of_cells(contact, name) for name in ("dissipation", "slip_path"))
        self.at_rest = of_cells(contact, "pressure")
        self.wear = of_cells(pl.read_parquet(worn), "wear_depth") if worn.exists() else np.zeros(cells)

    def column(self, name):
        if name not in self.cycle.columns:
            return np.zeros(self.cycle.height)
        return self.cycle[name].to_numpy()

    def residuals(self):
        scene, area = self.scene, self.scene.cell
        p, q, v = self.pressure, self.shear, self.slip
        limit = scene.mu * p
        found = {"samples": len(p) - 1, "cells": len(self.listed)}

        def relative(name, difference, scale):
            found[name] = float(np.abs(difference).max() / max(np.abs(scale).max(), 1e-300))

        # Resultants, and prescribed loads and displacements.
        load = self.column("normal_load")
        force = np.column_stack([self.column("force_x"), self.column("force_y")])
        relative("load", p.sum(axis=1) * area - load, load)
        relative("force", q.sum(axis=1) * area - force, limit.sum(axis=1) * area)
        if "moment_z" in self.cycle.columns:
            arms = np.hypot(scene.x, scene.y)
            moment = (q[:, :, 1] * scene.x - q[:, :, 0] * scene.y).sum(axis=1) * area
            relative("moment", moment - self.column("moment_z"), (limit * arms).sum(axis=1) * area)
        given = scene.prescribed(self.column("time"))
        for name, values in given.items():
            own = self.column(name)
            if name.startswith(("displacement", "rotation")):  # the mean of a motion is free
                own, values = own - own[0], values - values[0]
            reach = np.abs(values).max()
            if name.startswith("force"):
                reach = scene.mu * scene.load
            if name.startswith("moment"):
                reach = (limit * np.hypot(scene.x, scene.y)).sum(axis=1).max() * area
            if reach > 0.0:
                key = f"given_{name.split('_')[0]}"
                found[key] = max(found.get(key, 0.0), float(np.abs(own - values).max() / reach))

        # Normal contact, from the heights.
        normal, xx, xy, yy = scene.matrices
        modes = [np.ones(len(scene.x))] + ([scene.y, scene.x] if scene.turns else [])
        modes = np.column_stack(modes)
        penetration = adhesion = 0.0
        scale = p.max() * normal[0, 0]
        for k in range(len(p)):
            raw = normal @ p[k] - (scene.heights - self.wear)
            free = (p[k] > 0) & (p[k] < scene.cap * (1 - 1e-9))
            rigid = np.linalg.lstsq(modes[free], raw[free], rcond=None)[0]
            gap = raw - modes @ rigid
            penetration = max(penetration, -gap[p[k] < scene.cap * (1 - 1e-9)].min() / scale)
            adhesion = max(adhesion, np.abs(gap[free]).max() / scale)
            if self.gap is not None:
                off = np.abs(self.gap[k] - gap)[self.listed][p[k][self.listed] == 0]
                found["gap"] = max(found.get("gap", 0.0), float(off.max(initial=0.0) / scale))
                wrong = np.where(p[k] > 0, np.abs(self.gap[k]), -self.gap[k])[free | (p[k] == 0)].max()
                found["gap_sign"] = max(found.get("gap_sign", 0.0), float(wrong / scale))
        found |= {"penetration": float(penetration), "adhesion": float(adhesion)}

        # Elasticity: the slip is known for the listed cells.
        motion = np.column_stack([self.column("displacement_x"), self.column("displacement_y")])
        turned = self.column("rotation_z")
        bodies = motion[:, None, :] + turned[:, None, None] * np.stack([-scene.y, scene.x], axis=1)[None]
        elastic = np.stack([q[:, :, 0] @ xx + q[:, :, 1] @ xy, q[:, :, 0] @ xy + q[:, :, 1] @ yy], axis=2)
        left = (bodies - elastic - v)[:, self.listed]
        relative("elastic", left - left[0], bodies)

        # Friction, step by step.
        size = np.linalg.norm(q, axis=2)
        relative("coulomb", np.maximum(size - limit, 0.0), limit)
        relative("closure", q[-1] - q[0], limit)
        steps = np.diff(v, axis=0)
        slid = np.linalg.norm(steps, axis=2)
        by_reversal = len(steps) < FEWEST_STEPS
        both = (p[1:] > 0) & (p[:-1] > 0)
        ways = np.linalg.norm(np.diff(bodies, axis=0), axis=2).max(axis=1)
        bound = np.where(both, limit[1:] * slid, 0.0).sum(axis=1) * area
        along = np.where(both, (q[1:] * steps).sum(axis=2), 0.0).sum(axis=1) * area
        # In the first step of a cell at rest, the allowed displacement follows from the step before.
        durations = np.diff(self.column("time"))
        ratio = durations / np.roll(durations, 1)
        rest = (ratio**2 / (1 + 2 * ratio))[:, None] * np.roll(slid, 1, axis=0)
        below = both & (size[1:] < BELOW * limit[1:])
        stuck = np.where(below, np.maximum(slid - (0.0 if by_reversal else 1.0) * rest, 0.0), 0.0).max(axis=1) / ways.max()
        # By reversal, the shear of a cell is at its limit in a whole step or not at all: the limit at the end of the step counts.
        limits = limit[1:] if by_reversal else 0.5 * (limit[1:] + limit[:-1])
        energies = limits * np.where(below, 0.0, slid)
        # The contact time is unknown in a step in which a cell closes or opens: half of the step counts, with an uncertainty of the other
        # half.
        opens = (p[1:] > 0) != (p[:-1] > 0)
        energies[opens] *= 0.5
        found["not_known"] = float(energies[opens].sum() * area)
        violated = bound - along
        if not by_reversal:
            middle = len(steps) // 2
            apart = np.abs(v[middle] - v[:middle] - v[middle : 2 * middle]).max() if len(steps) % 2 == 0 else math.inf
            seams = SEAMS_OF_HALVES if apart < ROUNDING * np.abs(v).max() else SEAMS
            share = violated / max(bound.sum(), 1e-300)
            at = np.argsort(np.maximum(share, stuck))[-seams:]
            at = [int(k) for k in at if stuck[k] > STUCK / 10 or share[k] > STANDS_OUT * np.median(share)]
            found |= {"seams": sorted(at), "seam": float(share[at].max(initial=0.0)), "seam_stick": float(stuck[at].max(initial=0.0))}
            for array in (violated, stuck, energies, slid):
                kept = np.delete(np.arange(len(array)), at)
                for k in at:
                    array[k] = 0.5 * sum(array[kept[np.argsort(np.abs(kept - k))[:2]]])
            found["not_known"] += 0.5 * float(energies[at].sum() * area)
        found["stick"] = float(stuck.max())

        # Work and dissipation.
        work = (0.5 * (q[1:] + q[:-1]) * steps).sum() * area
        moments = self.column("moment_z")
        parts = 0.5 * (force[1:] + force[:-1]) * np.diff(motion, axis=0)
        turning = 0.5 * (moments[1:] + moments[:-1]) * np.diff(turned)
        found["work"] = float(abs(work - parts.sum() - turning.sum()) / max(np.abs(parts).sum() + np.abs(turning).sum(), 1e-300))
        whole, bar = (float(self.figures[name][0]) for name in ("dissipated_energy", "error_cycle"))
        found |= {"dissipated": whole, "bar": bar}
        energy = energies.sum(axis=0)
        if whole > NOTHING * scene.mu * scene.load * ways.sum():
            found["friction"] = float(violated.sum() / whole)
            found["energy"] = float(energy.sum() * area / whole - 1)
            found["not_known"] /= whole
            found["energy_of_cells"] = float(np.abs(energy - self.dissipation).sum() / self.dissipation.sum())
            wears = self.dissipation > 0
            found["path"] = float(np.abs(slid.sum(axis=0) - self.path)[wears].sum() / self.path[wears].sum())
        return found


# A cycle with fewer steps is a cycle by reversal.
FEWEST_STEPS = 8


def limits_of(found):
    """Returns the limit of each residual."""
    samples, bar = found["samples"], found["bar"]
    stepped = samples >= FEWEST_STEPS
    turning = TURNING * (math.pi / samples) ** 2 / 2
    limits = dict.fromkeys(("load", "force", "moment", "elastic", "coulomb", "closure", "work"), ROUNDING)
    limits |= dict.fromkeys(("given_normal", "given_displacement", "given_rotation", "given_force", "given_moment"), ROUNDING)
    limits |= dict.fromkeys(("penetration", "adhesion", "gap", "gap_sign"), NORMAL)
    limits["stick"] = STUCK
    limits["seam_stick"] = AT_SEAM_OF_FORCES if "given_force" in found else AT_SEAM
    # If t = 0 is between the ends of a motion, the cycle has an additional solve for it.
    solves = 2 if samples == 3 else 1
    limits["friction"] = turning + bar if stepped else solves * WITHIN_BAR * bar
    limits["energy"] = (OF_BAR * bar if stepped else WITHIN_BAR * bar) + found["not_known"]
    return {name: limit for name, limit in limits.items() if name in found}


if __name__ == "__main__":
    sys.exit(main())
