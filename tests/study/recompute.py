"""Evaluates the claims of the paper from the tables of runs, and compares the verdicts of `fretwear reproduce` with the result.

    recompute.py FOLDER                       # folder of fretwear reproduce, with its runs and claims.parquet
    recompute.py FOLDER --program PROGRAM     # first computes a small study in the folder (1 to 2 minutes)

The script needs Polars and numpy, and it shares only the tables with the program. Its thresholds come from the text of the paper (Armand
and others, Proc. R. Soc. A, 2019). Where the paper gives no threshold, the script uses the criteria that `claims.md` marks with *.
The exit code is 1 if a verdict differs, on a claim or on one of its runs or sets of runs.
"""

import argparse
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl

# The paper's resonator with a coarse mesh, a coarse surface and few cycles.
SMALL = """
joint.grid=[27, 27]
joint.elements=[9, 9]
joint.hole.diameter=22.98 mm
surface.correlation_length=["5 mm", "5 mm"]
structure.half_depth_cells=2
structure.block_cells=3
structure.stub_cells=1
structure.gap_cells=1
structure.leaf_cells=1
structure.window_cells=3
structure.wall_cells=2
structure.inner_cells=2
structure.rim_cells=1
structure.head_cells=1
dynamics.modes=10
dynamics.frequency=["850 Hz", "1150 Hz"]
dynamics.points=3
dynamics.force.amplitude=300 N
output.response_at=[]
fidelity.aft_samples=32
wear.cycles=200_000
"""

HOLDS, FAILS, UNDECIDED, NONE = "holds", "fails", "undecided", "not applicable"


def of(condition):
    return HOLDS if condition else FAILS


def every(verdicts):
    verdicts = list(verdicts)
    if FAILS in verdicts:
        return FAILS
    return HOLDS if all(verdict == HOLDS for verdict in verdicts) else UNDECIDED


class Bar:
    """Value with an error bound. Errors add up."""

    def __init__(self, value, error=0.0):
        self.value, self.error = float(value), float(abs(error))

    def __sub__(self, other):
        return Bar(self.value - other.value, self.error + other.error)

    def __truediv__(self, other):
        value = self.value / other.value
        return Bar(value, abs(value) * (abs(self.error / self.value) + abs(other.error / other.value)))

    def __mul__(self, factor):
        return Bar(self.value * factor, self.error * factor)

    def above(self, bound):
        if math.isnan(self.value) or (self.error > 0 and abs(self.value - bound) <= self.error):
            return UNDECIDED
        return of(self.value > bound)

    def below(self, bound):
        return Bar(-self.value, self.error).above(-bound)


def off_one(ratio):
    return Bar(abs(ratio.value - 1), ratio.error)


def rising(bars):
    return every((b - a).above(0) for a, b in zip(bars, bars[1:]))


def spread(bars):
    largest, smallest = max(bars, key=lambda b: b.value), min(bars, key=lambda b: b.value)
    mean = sum(b.value for b in bars) / len(bars)
    return Bar((largest.value - smallest.value) / mean, (largest.error + smallest.error) / abs(mean))


class Run:
    def __init__(self, folder):
        self.folder, self.name = folder, folder.name
        record = json.loads((folder / "run.json").read_text())
        self.scene = record["scene"] if isinstance(record["scene"], dict) else json.loads(record["scene"])
        numbers = [int(path.name.split("=")[1]) for path in (folder / "iterations").glob("wear_iteration=*")]
        self.iterations = sorted(numbers)
        self.summary = self.series("summary")
        self.response = self.series("dynamic_response")
        self.step = self.series("wear_step")
        self.worn = self.series("worn_response")
        section = lambda name: self.scene.get(name) or {}
        self.rq = section("surface").get("rq")
        self.sphere = section("surface").get("kind") == "sphere"
        self.lengths = section("surface").get("correlation_length")
        self.cap = section("contact").get("pressure_cap")
        self.update = (section("update") or {}).get("stiffness_change")
        self.never = not self.scene.get("update")
        self.vibrates = bool(self.scene.get("structure"))
        self.harmonics = section("dynamics").get("harmonics")
        self.wears = bool(self.scene.get("wear"))
        self.alpha = section("wear").get("coefficient")
        self.explicit = section("wear").get("depth_step") if section("wear").get("scheme") == "explicit" else None
        self.law = ""
        if self.vibrates:
            self.law = section("contact")["stiffness"]
            if self.law in ("total", "roughness"):
                self.law += ", " + section("contact")["distribution"]
            elif self.law == "sliders" and section("contact")["pressing"] == "punch":
                # The pressing takes effect with sliders only.
                self.law += ", punch"
        self.load = section("contact").get("normal_load")
        self.friction = section("contact").get("friction_coefficient")
        self.size, self.cells = section("joint").get("size"), section("joint").get("grid")
        base = json.loads(json.dumps(self.scene))
        for name, keys in (
            ("surface", ("rq", "seed")),
            ("contact", ("pressure_cap", "stiffness", "distribution", "pressing")),
            ("dynamics", ("harmonics",)),
            ("wear", ("cycles", "scheme", "tolerance", "depth_step")),
        ):
            for key in keys:
                (base.get(name) or {}).pop(key, None)
        for name in ("update", "fidelity", "output"):
            base.pop(name, None)
        self.base = json.dumps(base, sort_keys=True)

    def table(self, k, name):
        path = self.folder / "iterations" / f"wear_iteration={k}" / f"{name}.parquet"
        return pl.read_parquet(path) if path.exists() else None

    def once(self, name):
        path = self.folder / "once" / f"{name}.parquet"
        return pl.read_parquet(path) if path.exists() else None

    def series(self, name):
        frames = [(place, self.table(k, name)) for place, k in enumerate(self.iterations)]
        frames = [frame.with_columns(place=pl.lit(place)) for place, frame in frames if frame is not None]
        return pl.concat(frames, how="diagonal_relaxed") if frames else pl.DataFrame()

    def column(self, name):
        return self.summary[name].to_numpy() if name in self.summary.columns else None

    @property
    def cycles(self):
        return self.column("cycles").astype(float)

    def reaches(self, cycles):
        return self.wears and self.cycles[-1] >= cycles

    def steps_error(self, place):
        """Relative error of the worn volume by wear steps and contact solves: the error bar without closure and harmonics."""
        at = lambda name: float(self.column(name)[place] or 0) if self.column(name) is not None else 0.0
        clean = lambda value: 0.0 if math.isnan(value) else value
        whole, closure, harmonics = (clean(at("error_" + n)) for n in ("wear_volume", "closure", "harmonics"))
        return max(0.0, whole - closure - harmonics)

    @staticmethod
    def followed(values, volumes, place, error):
        """Error of a value for a relative error of the volume, by extrapolation of the last step."""
        worn = volumes[place] - volumes[place - 1]
        return abs(values[place] - values[place - 1]) * error * volumes[place] / worn if place and worn else 0.0

    def state(self, values, volumes, place, error):
        """Error of a value that follows the wear: at least the relative error times the change by wear so far."""
        return max(self.followed(values, volumes, place, error), abs(values[place] - values[0]) * error)

    def bar(self, name, place):
        values = self.column(name)
        place %= len(values)
        value, error, off = values[place], self.steps_error(place), 0.0
        if name in ("dissipated_energy", "wear_rate"):
            off = max(self.followed(values, self.column("wear_volume"), place, error), 0.4 * error * value)
            off += float(self.column("error_cycle")[place]) * value
        elif name in ("kn", "kt"):
            off = self.state(values, self.column("wear_volume"), place, error) if self.wears else 0.0
            off += float(self.column("error_" + name)[0]) * value
        return Bar(value, off)

    def bar_at(self, name, cycles):
        place = min(int(np.searchsorted(self.cycles, cycles, side="left")), len(self.cycles) - 1)
        value = float(np.interp(cycles, self.cycles, self.column(name)))
        near = self.bar(name, place)
        return Bar(value, value * near.error / abs(near.value))

    def worn_bars(self, name):
        values = self.worn[name].to_numpy()
        places = self.worn["place"].to_numpy()
        volumes = self.column("wear_volume")[places] if self.wears else np.zeros(len(values))
        found = 1e-6 if name.endswith("frequency") else 2e-5
        bars = []
        for k, place in enumerate(places):
            error = self.steps_error(int(place)) if self.wears else 0.0
            bars.append(Bar(values[k], found * values[k] + self.state(values, volumes, k, error)))
        return bars

    def field(self, k, name):
        return self.table(self.iterations[k], name)

    def deepest(self):
        depth = float(self.field(-1, "wear_field")["wear_depth"].max())
        return Bar(depth, depth * self.steps_error(len(self.iterations) - 1))

    def forces(self):
        """Largest tangential force of the fine contact, relative to the friction limit under the load at the same time."""
        of = lambda cycle: np.hypot(cycle["force_x"], cycle["force_y"]) / (self.friction * cycle["normal_load"])
        return [float(of(self.table(k, "cycle")).max()) for k in self.iterations]

    def seconds(self):
        """Processor time of all stages and their parts. A stage without complete processor times counts with its elapsed time."""
        timing = self.series("timing")
        frames = [path for path in (self.folder / "once").glob("timing.parquet")]
        timing = pl.concat([timing, *(pl.read_parquet(path) for path in frames)], how="diagonal_relaxed")
        stages = timing.group_by("stage").agg(
            pl.when(pl.col("cpu_seconds").null_count() == 0).then(pl.col("cpu_seconds").sum()).otherwise(pl.col("seconds").sum())
        )
        return float(stages["cpu_seconds"].sum())


def moments(heights):
    deviation = heights - heights.mean()
    m2, m3, m4 = ((deviation**power).mean() for power in (2, 3, 4))
    return {"rq": m2**0.5, "sk": m3 / m2**1.5, "ku": m4 / m2**2}


class Claims:
    """Verdicts on the claims. Each method evaluates one claim and returns pairs of runs and verdict."""

    def __init__(self, runs, setting_law):
        own = [run for run in runs if run.law == setting_law and not run.sphere]
        never = [run for run in own if run.never and run.harmonics in (None, [0, 1, 2, 3])]
        order = lambda run: (run.rq or math.inf, run.explicit is not None)
        elastic = sorted((run for run in never if run.cap is None), key=order)
        self.rough = []
        for run in elastic:
            if not self.rough or self.rough[-1].rq != run.rq:
                self.rough.append(run)
        self.main = min(self.rough, key=lambda run: abs(math.log(run.rq / 5e-6)) if run.rq else math.inf)
        main = [run for run in own if run.rq == self.main.rq]
        first = lambda found: next(iter(found), None)
        self.explicit = first(run for run in never if run in main and run.cap is None and run.explicit)
        self.plastic = first(run for run in never if run in main and run.cap is not None)
        self.updated = sorted((run for run in main if not run.never and run.cap is None), key=lambda run: run.update)
        more = (run for run in main if run.never and run.cap is None and len(run.harmonics or []) > 4)
        self.more = sorted(more, key=lambda run: len(run.harmonics))
        self.local = first(run for run in runs if run.law == "tangent" and run.column("updated")[1:].any())
        spheres = [run for run in runs if run.sphere]
        self.spheres = sorted(spheres, key=lambda run: -(run.cap or math.inf))
        every_run = [*self.rough, self.plastic, self.explicit, self.local, *self.updated, *self.more, *self.spheres]
        self.all = list(dict.fromkeys(run for run in every_run if run))

    def parts(self, number):
        found = getattr(self, f"claim_{number}")()
        if found is None:
            return []
        return found if isinstance(found, list) else [found]

    def each(self, judge, runs=None):
        return [([run], judge(run)) for run in (self.rough if runs is None else runs)]

    # Paper: 231 iterations with steps of 0.1 µm to 10 million cycles, in 4 h 29 min, 70 s per iteration.

    def claim_1(self):
        run = self.explicit
        if run and run.reaches(1e7) and abs(run.explicit / 1e-7 - 1) < 1e-6 and abs(run.rq / 5e-6 - 1) < 1e-6:
            iterations = int(np.argmax(run.cycles >= 1e7))
            return [run], of(231 / 1.5 <= iterations <= 231 * 1.5)

    def claim_2(self):
        run = self.explicit
        if not run:
            return None
        steps, right = run.column("n_cycles")[1:-1], True
        for place, n_cycles in enumerate(steps):
            depth = run.alpha * run.field(place, "contact_field")["dissipation"].max()
            ratio = run.explicit / depth
            right &= n_cycles in {max(1.0, math.floor(ratio * (1 + tilt))) for tilt in (-1e-9, 0, 1e-9)}
        return [run], of(right and len(set(steps)) > 1)

    def claim_3(self):
        run = self.explicit
        if not run:
            return None
        depth = [run.field(k, "wear_field")["wear_depth"].to_numpy() for k in range(len(run.iterations))]
        rate = [run.alpha * run.field(k, "contact_field")["dissipation"].to_numpy() for k in range(len(run.iterations))]
        grows = min((b - a).min() for a, b in zip(depth, depth[1:])) >= 0
        steps = run.column("n_cycles")
        off = max(np.abs(depth[k] - depth[k - 1] - steps[k] * rate[k - 1]).max() for k in range(1, len(depth)))
        return [run], of(grows and off <= 1e-12 * depth[-1].max())

    def claim_4(self):
        verdicts, runs = [], [run for run in self.all if run.wears]
        for run in runs:
            volume = run.column("wear_volume")[-1]
            cell = run.size[0] * run.size[1] / run.cells[0] / run.cells[1]
            local = run.field(-1, "wear_field")["wear_depth"].sum() * cell
            whole = run.alpha * run.column("dissipated_energy_total")[-1]
            verdicts.append(of(abs(local / volume - 1) <= 1e-10 and abs(whole / volume - 1) <= 1e-10))
        return runs, every(verdicts)

    def claim_5(self):
        if self.main.reaches(1e7) and abs(self.main.rq / 5e-6 - 1) < 1e-6:
            return [self.main], self.main.deepest().below(231 * 0.1e-6 * (1 + 1e-12))

    def claim_6(self):
        run = self.explicit
        if run and run.reaches(1e7):
            seconds = run.seconds()
            return [run], of(seconds <= 4 * 3600 + 29 * 60 and seconds / (len(run.iterations) - 1) <= 70)

    def claim_7(self):
        def judge(run):
            end = run.cycles[-1]
            last, earlier = run.bar("dissipated_energy", -1), run.bar_at("dissipated_energy", end - 2e6)
            change = abs(last.value - earlier.value) / 2 / last.value
            # The step errors of neighbouring iterations are nearly equal. The solver error of each cycle is independent.
            solves = np.nan_to_num(run.column("error_cycle").astype(float)[-1]) if run.column("error_cycle") is not None else 0
            return Bar(change, abs(last.error - earlier.error) / 2 / last.value + solves).below(0.05)

        return self.each(judge, [run for run in self.rough if run.reaches(1e7)])

    # Flattened peaks and unworn valleys; Rq, skewness and kurtosis by eq. 4.1 and 4.2.

    def claim_8(self):
        run = self.main
        touched = np.zeros(len(run.field(0, "contact_field")), bool)
        for k in range(len(run.iterations)):
            touched |= run.field(k, "contact_field")["pressure"].to_numpy() > 0
        depth = run.field(-1, "wear_field")["wear_depth"].to_numpy()
        valleys = depth[~touched]
        return [run], of(len(valleys) > 0 and valleys.max() == 0 and depth.max() > 0)

    def heights(self, run, k):
        surface = run.once("surface").filter(pl.col("kept"))
        worn = run.field(k, "wear_field")
        joined = worn.join(surface, on=["i", "j"], how="left")
        return (joined["height"] - joined["wear_depth"]).to_numpy()

    def claim_9(self):
        def judge(run):
            rq = [moments(self.heights(run, k))["rq"] for k in range(len(run.iterations))]
            return of(max(rq) <= rq[0] * (1 + 1e-4) and rq[-1] < rq[0])

        return self.each(judge)

    def claim_10(self):
        runs, verdicts = [run for run in self.all if run.rq and run not in self.more], []
        for run in runs:
            heights, volumes = run.column("mean_height"), run.column("wear_volume")
            cell = run.size[0] * run.size[1] / run.cells[0] / run.cells[1]
            area = cell * len(run.field(0, "wear_field"))
            off = np.abs(heights[0] - heights - volumes / area).max() / (volumes[-1] / area)
            verdicts.append(of(off <= 1e-9 and (np.diff(heights) <= 0).all()))
        return runs, every(verdicts)

    def claim_11(self):
        def judge(run):
            sk = [moments(self.heights(run, k))["sk"] for k in (0, -1)]
            return of(abs(sk[0]) < 0.1 and sk[1] < -0.1)

        return self.each(judge)

    def claim_12(self):
        def judge(run):
            ku = [moments(self.heights(run, k))["ku"] for k in (0, -1)]
            return of(abs(ku[0] - 3) < 0.2 and ku[1] > max(3, ku[0]))

        return self.each(judge)

    def claim_13(self):
        def judge(run):
            cell = run.size[0] * run.size[1] / run.cells[0] / run.cells[1]
            area = cell * len(run.field(0, "wear_field"))
            sigma = math.sqrt(2 * math.pi * run.lengths[0] * run.lengths[1] / area)
            return of(abs(np.interp(1e5, run.cycles, run.column("sk"))) > 3 * sigma)

        return self.each(judge, [run for run in self.rough if run.reaches(1e5)])

    def claim_14(self):
        def judge(run):
            first, last = (moments(self.heights(run, k)) for k in (0, -1))
            fall = (self.heights(run, 0).mean() - self.heights(run, -1).mean()) / run.rq
            rq = last["rq"] / first["rq"] - 1
            return of(fall > 0.05 and rq < -0.05 and last["sk"] - first["sk"] < -0.3 and last["ku"] - first["ku"] > 0.3)

        return self.each(judge)

    # Area, pressure and stiffness.

    def claim_15(self):
        def judge(run):
            area = [int((run.field(k, "contact_field")["pressure"] > 0).sum()) for k in range(len(run.iterations))]
            return of(all(b >= 0.99 * a for a, b in zip(area, area[1:])) and area[-1] > area[0])

        return self.each(judge)

    def claim_16(self):
        run, found = self.main, []
        for k in (0, -1):
            field = run.field(k, "contact_field")
            peaks = field.group_by("j").agg(pl.col("pressure").max())["pressure"]
            sections = np.zeros(int(field["j"].max()) + 1)
            sections[: len(peaks)] = peaks.to_numpy()
            loaded = np.sort(field["pressure"].to_numpy()[field["pressure"].to_numpy() > 0])
            found.append((np.median(sections), loaded[int(0.99 * (len(loaded) - 1))], loaded.mean()))
        (section, high, mean), (section_end, high_end, mean_end) = found
        return [run], of(section_end <= section / 2 and high_end <= high / 2 and high_end / mean_end < high / mean)

    def unworn(self, name):
        return [float(run.column(name)[0]) for run in self.rough]

    def claim_17(self):
        if len(self.rough) > 1:
            area = self.unworn("contact_area_fraction")
            return self.rough, of(all(a > b for a, b in zip(area, area[1:])) and area[0] > 2 * area[-1])

    def claim_18(self):
        def judge(run):
            at = np.linspace(0, run.cycles[-1], 200)
            area = np.interp(at, run.cycles, run.column("contact_area_fraction"))
            early, late = (area[20] - area[0]) / 20, (area[199] - area[100]) / 99
            line = np.corrcoef(at, area)[0, 1] ** 2
            return of(early > 5 * max(late, 0)) if run.rq <= 1.0000001e-6 else of(line > 0.95)

        return self.each(judge) if len(self.rough) > 1 else None

    def running_in(self, run, name):
        slope = lambda a, b, n: Bar((b.value - a.value) / n, abs(b.error - a.error) / n)
        early = slope(run.bar(name, 0), run.bar_at(name, 1e5), 1e5)
        late = slope(run.bar_at(name, 5e6), run.bar_at(name, 1e7), 5e6)
        fast = (early - Bar(5 * max(late.value, 0), 5 * late.error)).above(0)
        return every([fast, late.above(-1e-9 * run.column(name)[0] / 5e6)])

    def third(self, before, after):
        return (after - before * (1 / 3)).below(1e-300)

    def meets(self, name):
        ends = [[run.bar(name, k) for run in self.rough] for k in (0, -1)]
        return self.rough, self.third(spread(ends[0]), spread(ends[1]))

    def to_the_end(self):
        return [run for run in self.rough if run.reaches(1e7)]

    def claim_19(self):
        return self.each(lambda run: self.running_in(run, "kn"), self.to_the_end())

    def claim_20(self):
        return self.meets("kn") if len(self.rough) > 1 else None

    def claim_21(self):
        each = self.each(lambda run: self.running_in(run, "kt"), self.to_the_end())
        return each + ([self.meets("kt")] if len(self.rough) > 1 else [])

    def claim_22(self):
        run = self.local
        if not run:
            return None
        medians, last = [], int(np.flatnonzero(run.column("updated"))[-1])
        for k in (0, last):
            elements, field = run.field(k, "contact_element"), run.field(k, "contact_field")
            dx, dy = (size / count for size, count in zip(run.size, run.cells))
            loaded = field.filter(pl.col("pressure") > 0)
            x = (loaded["i"].to_numpy() + 0.5 - run.cells[0] / 2) * dx
            y = (loaded["j"].to_numpy() + 0.5 - run.cells[1] / 2) * dy
            densities = []
            for row in elements.iter_rows(named=True):
                half = 0.5 * math.sqrt(row["area"]) * (1 + 1e-9)
                touching = int(((abs(x - row["x"]) <= half) & (abs(y - row["y"]) <= half)).sum())
                if row["normal_load"] > 0 and touching:
                    densities.append(row["kn"] / (touching * dx * dy))
            medians.append(np.median(densities))
        kn, area = run.column("kn"), run.column("contact_area_fraction")
        return [run], of(medians[1] < medians[0] and kn[-1] > kn[0] and area[-1] > area[0])

    # Vibration.

    def claim_23(self):
        if len(self.rough) < 2 or not self.main.vibrates:
            return None
        frequency = [run.worn_bars("peak_frequency")[0] * -1 for run in self.rough]
        frequency = [Bar(bar.value, bar.error) for bar in frequency]
        slip = [Bar(run.response["displacement_amplitude"][0]) for run in self.rough]
        friction = [run.worn_bars("friction_energy")[0] for run in self.rough]
        return self.rough, every([rising(frequency), rising(slip), rising(friction)])

    def claim_24(self):
        def judge(run):
            load = run.field(0, "joint_cycle")["normal_load"]
            return of(abs(load.mean() / run.load - 1) <= 0.01 and (load.max() - load.min()) / 2 <= 0.05 * run.load)

        return self.each(judge)

    def claim_25(self):
        def judge(run):
            cycle = run.field(0, "joint_cycle")
            most = max(cycle["moment_x"].abs().max(), cycle["moment_y"].abs().max())
            return of(most < 0.05 * run.load * run.size[0] / 2)

        return self.each(judge)

    def claim_26(self):
        u = self.main.field(0, "joint_cycle")["displacement_x"]
        if self.main.forces()[0] > 0.999:
            return [self.main], UNDECIDED
        return [self.main], of(abs(u.mean()) > 0.05 * (u.max() - u.min()) / 2)

    def claim_27(self):
        if not self.more:
            return None
        verdicts = []
        for name, bound in (("peak_amplitude", 0.01), ("peak_frequency", 5e-4)):
            few, *more = (float(run.worn[name][0]) for run in [self.main, *self.more])
            before = more[-2] if len(more) > 1 else more[-1]
            verdicts.append(Bar(abs(more[-1] / few - 1), abs(more[-1] - before) / few).below(bound))
        return [self.main, *self.more], every(verdicts)

    def claim_28(self):
        runs = [run for run in self.all if run.column("max_pressure") is not None]

        def alike(run):
            lower, upper = run.scene["material"]["lower"], run.scene["material"]["upper"]
            keys = ("youngs_modulus", "poisson_ratio")
            return of([lower[key] for key in keys] == [upper[key] for key in keys])

        return runs, every(alike(run) for run in runs)

    def claim_34(self):
        first, *later = self.main.worn_bars("peak_frequency")
        if later:
            rise = later[-1] / first - Bar(1)
            return [self.main], every([*((bar - first).above(0) for bar in later), rise.below(0.05)])

    def claim_35(self):
        peak, friction = (self.main.worn_bars(name) for name in ("peak_amplitude", "friction_energy"))
        return [self.main], every([(peak[-1] - peak[0]).above(0), (friction[0] - friction[-1]).above(0)])

    @staticmethod
    def fullness(loop, energy):
        u, f = loop["displacement"].to_numpy(), loop["load"].to_numpy()
        far = len(u) - 1 - int(np.argmax(u[::-1]))
        for k in range(1, len(u)):
            next_one = (far + k) % len(u)
            if u[far] - u[next_one] > 1e-9 * abs(u[far]):
                break
        slope = (f[far] - f[next_one]) / (u[far] - u[next_one])
        area = 0.5 * abs(np.dot(u, np.roll(f, -1)) - np.dot(np.roll(u, -1), f))
        reach, force = np.ptp(u) / 2, np.ptp(f) / 2
        whole = 4 * force * (reach - force / slope)
        # The error is the energy that the polygon of the points does not enclose.
        return Bar(area / whole, area / whole * (area / energy - 1)) if whole > 0 else None

    def claim_36(self):
        run = self.main
        kt, friction = [run.bar("kt", k) for k in (0, -1)], run.worn_bars("friction_energy")
        loops = [run.field(k, "hysteresis") for k in (0, -1)]
        energies = [run.column("dissipated_energy")[k] for k in (0, -1)]
        full = [self.fullness(loop, energy) if loop is not None else None for loop, energy in zip(loops, energies)]
        sharper = UNDECIDED if None in full else (full[1] - full[0]).above(0)
        return [run], every([(kt[1] - kt[0]).above(0), sharper, (friction[0] - friction[-1]).above(0)])

    def claim_37(self):
        if len(self.rough) < 2 or not self.main.vibrates:
            return None
        verdicts = []
        for name in ("peak_frequency", "peak_amplitude"):
            ends = [[run.worn_bars(name)[k] for run in self.rough] for k in (0, -1)]
            verdicts.append(self.third(spread(ends[0]), spread(ends[1])))
        return self.rough, every(verdicts)

    def claim_38(self):
        if len(self.rough) < 2:
            return None
        first, last = ([run.bar("wear_rate", k) for run in self.rough] for k in (0, -1))
        falls = every((a - b).above(0) for a, b in zip(first, last))
        return self.rough, every([rising(first), falls, spread(last).below(0.1)])

    def claim_44(self):
        runs, verdicts = [run for run in self.all if run.column("max_pressure") is not None], []
        for run in runs:
            for name in ("normal", "tangential"):
                error = run.column("error_" + name)
                if error is not None and not all(value is None for value in run.summary["error_" + name]):
                    verdicts.append(of(np.nanmax(error.astype(float)) <= run.scene["fidelity"][name + "_tolerance"]))
        return runs, every(verdicts)

    def claim_45(self):
        return self.each(
            lambda run: (Bar(run.deepest().value, run.deepest().error) * (1 / min(run.size))).below(1e-3)
            if run.once("structure_mode") is not None or run.vibrates
            else None
        )

    def claim_46(self):
        most = max(self.main.forces())
        return [self.main], of(0.999 <= most <= 1.001)

    def claim_47(self):
        def judge(run):
            supplied = run.response["input_energy"].to_numpy()
            fine = [run.bar("dissipated_energy", k) / Bar(supplied[k]) for k in range(len(supplied))]
            worn = zip(run.worn_bars("friction_energy"), run.worn["input_energy"])
            worn = [friction / Bar(energy) for friction, energy in worn]
            largest = lambda bars: max(bars, key=lambda bar: bar.value)
            return every([largest(fine).below(1), largest(worn).below(1)])

        return self.each(judge)

    # Updates at 5, 10 and 20 %.

    def claim_29(self):
        def judge(run):
            energy, verdicts = run.column("dissipated_energy"), []
            for k in np.flatnonzero(run.column("updated"))[1:]:
                end = run.step["end_energy"][int(k)] if "end_energy" in run.step.columns else None
                if end is None:
                    begin = energy[k - 1]
                    mean = run.step["volume"][int(k)] / (run.alpha * run.step["n_cycles"][int(k)])
                    linear, exponential = 2 * mean - begin, mean**2 / begin
                    before = Bar((linear + exponential) / 2, (linear - exponential) / 2)
                else:
                    before = Bar(end)
                after = Bar(energy[k], energy[k] * run.column("error_cycle")[k])
                verdicts.append((after / before - Bar(1)).below(-0.01))
            return every(verdicts) if verdicts else UNDECIDED

        return self.each(judge, self.updated)

    def pairs(self, judge, runs):
        """Compares pairs of runs. Two runs without any update are equal and therefore give no verdict."""
        updates = lambda run: run.column("updated")[1:].sum()
        each = [(a, b) for k, a in enumerate(runs) for b in runs[k + 1 :]]
        return every(judge(a, b) if updates(a) + updates(b) else UNDECIDED for a, b in each)

    def apart(self, name, first, bound):
        end = min(run.cycles[-1] for run in self.updated)
        at = np.geomspace(first, end, 40)

        def judge(a, b):
            off = [off_one(a.bar_at(name, n) / b.bar_at(name, n)) for n in at]
            return max(off, key=lambda bar: bar.value).below(bound)

        return self.updated, self.pairs(judge, self.updated)

    def claim_30(self):
        long = all(run.cycles[-1] > 1e6 for run in self.updated)
        return self.apart("wear_rate", 1e6, 0.05) if len(self.updated) > 1 and long else None

    def claim_31(self):
        return self.apart("kn", 1e4, 0.03) if len(self.updated) > 1 else None

    def alike(self, runs):
        def judge(a, b):
            bounds = (("peak_frequency", 1e-3), ("peak_amplitude", 0.02))
            return every(off_one(a.worn_bars(name)[-1] / b.worn_bars(name)[-1]).below(bound) for name, bound in bounds)

        return runs, self.pairs(judge, runs)

    def claim_32(self):
        # The paper claims this "after these 10 million cycles".
        return self.alike(self.updated) if len(self.updated) > 1 and all(run.reaches(1e7) for run in self.updated) else None

    def claim_33(self):
        # The paper claims this "up to 10 million cycles".
        both = [*self.updated[:1], self.main]
        return self.alike(both) if self.updated and all(run.reaches(1e7) for run in both) else None

    # A hardness limit of 600 MPa.

    def at_cap(self, run):
        pressure = run.field(0, "contact_field")["pressure"].to_numpy()
        loaded = pressure[pressure > 0]
        return (loaded >= run.cap * (1 - 1e-12)).sum() / len(loaded)

    def claim_39(self):
        if len(self.spheres) < 2:
            return None
        elastic, *capped = self.spheres
        area = [float(run.column("contact_area_fraction")[0]) for run in self.spheres]
        load = []
        for run in self.spheres:
            cell = run.size[0] * run.size[1] / run.cells[0] / run.cells[1]
            load.append(abs(run.field(0, "contact_field")["pressure"].sum() * cell / run.load - 1) <= 1e-6)
        plateau = [abs(run.column("max_pressure")[0] / run.cap - 1) <= 1e-9 and self.at_cap(run) > 0.01 for run in capped]
        grows = all(a < b for a, b in zip(area, area[1:])) and max(area) < 1.5 * area[0]
        return self.spheres, of(all(load) and all(plateau) and grows)

    def limited(self, judge):
        """Verdict on the elastic and the plastic joint. The claim is undecided if the elastic pressure nowhere reaches the limit."""
        if self.plastic:
            is_limited = self.main.column("max_pressure")[0] > self.plastic.cap
            return [self.main, self.plastic], judge() if is_limited else UNDECIDED

    def claim_40(self):
        def judge():
            cap = self.plastic.cap
            plateau = abs(self.plastic.column("max_pressure")[0] / cap - 1) <= 1e-9
            return of(plateau and self.at_cap(self.plastic) > 0.01)

        return self.limited(judge)

    def claim_41(self):
        def judge():
            area = [float(run.column("contact_area_fraction")[0]) for run in (self.main, self.plastic)]
            softer = (self.main.bar("kn", 0) - self.plastic.bar("kn", 0)).above(0)
            return every([of(area[0] < area[1] < 1.5 * area[0]), softer])

        return self.limited(judge)

    def ratio(self, name, first, last):
        at = np.linspace(first, last, 40)
        off = [off_one(self.plastic.bar_at(name, n) / self.main.bar_at(name, n)) for n in at]
        return max(off, key=lambda bar: bar.value)

    def both_reach(self, cycles):
        return self.plastic and self.plastic.reaches(cycles) and self.main.reaches(cycles)

    def claim_42(self):
        if self.both_reach(4e6):
            end = min(self.main.cycles[-1], self.plastic.cycles[-1])
            return self.limited(lambda: self.ratio("kn", 2e6, end).below(0.05))

    def claim_43(self):
        if self.both_reach(4e6):
            early, later = (self.ratio("dissipated_energy", *range) for range in ((0, 1e5), (2e6, 4e6)))
            return self.limited(lambda: every([early.above(0.05), later.below(0.05)]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--counts", action="store_true", help="also print the verdicts")
    parser.add_argument("--program", help="program that first computes a small study in the folder")
    arguments = parser.parse_args()
    if arguments.program:
        sets = [word for line in SMALL.strip().splitlines() for word in ("--set", line)]
        command = [arguments.program, "reproduce", "--law", "both", "--dir", str(arguments.folder), "--quiet", *sets]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    program = pl.read_parquet(arguments.folder / "claims.parquet")
    names = {name for runs in program["runs"] for name in runs.split()}
    runs = [Run(arguments.folder / name) for name in sorted(names)]
    laws = dict.fromkeys(run.law for run in runs if run.never and run.vibrates and not run.sphere)
    compared, wrong = 0, []
    for law in laws:
        claims = Claims(runs, law)
        setting = f"{law}; never updated"
        own = program.filter(pl.col("setting") == setting)
        if own.is_empty():
            wrong.append(f"the program has no setting {setting}")
            continue
        for number in range(1, 48):
            parts = claims.parts(number)
            whole = every(verdict for _, verdict in parts) if parts else NONE
            rows = own.filter(pl.col("claim") == number)
            said = rows.filter(pl.col("whole"))["verdict"].to_list()
            compared += 1
            if said != [whole]:
                wrong.append(f"{setting}: claim {number}: {whole}, the program says {said}")
            if arguments.counts:
                print(f"{setting}: {number} {whole}")
            of_parts = {}
            for row in rows.filter(~pl.col("whole")).iter_rows(named=True):
                of_parts[frozenset(row["runs"].split())] = row["verdict"]
            if len(parts) > 1:
                for part, verdict in parts:
                    compared += 1
                    key = frozenset(run.name for run in part)
                    if of_parts.get(key) != verdict:
                        wrong.append(f"{setting}: claim {number} on {sorted(key)}: {verdict}, the program says {of_parts.get(key)}")
    print("\n".join(wrong))
    print(f"{compared} verdicts compared, {len(wrong)} differ")
    return 1 if wrong or not compared else 0


if __name__ == "__main__":
    sys.exit(main())
