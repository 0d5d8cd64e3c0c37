"""Counts the runs of a campaign in which each claim of the paper holds, from the collected shards.

    fretwear campaign collect --dir seeds           # likewise for seeds_plastic.toml and draws.toml
    python pipelines/campaigns/claims.py --seeds seeds --plastic seeds_plastic --draws draws --out figures

Numbers and criteria of the claims are in docs/trust/paper.md. The script judges the values without error bars, from the history of a run,
and also from its fields and cycles if the run folder exists (keep = "runs"). A claim about all roughnesses applies to runs that share all
other keys. The script prints a Markdown table and draws ensembles_wear.svg into the folder. If `fretwear campaign report` has computed the
sensitivities of the draws, the script also draws ensembles_keys.svg. calibrate.py and causes.py use the same criteria. The script needs
Polars, numpy and matplotlib.
"""

import argparse
import json
import math
from functools import cached_property
from pathlib import Path

import numpy as np
import polars as pl

RQ, SEED = "surface.rq", "surface.seed"
# Correlation length, and area of the joint for runs without fields: 40 mm x 40 mm minus 21 of the 361 contact elements.
LENGTH = 0.5e-3
FACE = 0.04 * 0.04 * 340 / 361
MAIN = 5e-6
CAP = 600e6
# Number of steps of the explicit algorithm, and depth of a step [A 4b].
STEPS, STEP = 231, 1e-7


class Run:
    """History of a run by column. The default roughness is Rq 5 µm. With the run folder, `fields` contains results of fields and cycles."""

    def __init__(self, frame, folder=None):
        frame = frame.sort("wear_iteration")
        self.keys = frame.row(0, named=True)
        self.columns = {name: frame[name].to_numpy() for name in frame.columns if frame[name].dtype.is_numeric() or frame[name].dtype == pl.Boolean}
        self.rq = float(self.columns[RQ][0]) if RQ in self.columns else MAIN
        self.folder = folder

    @cached_property
    def fields(self):
        return Fields(self) if self.folder and self.folder.is_dir() else None

    @cached_property
    def sigma(self):
        """Standard deviation of the skewness of a Gaussian surface with the area of the joint."""
        return math.sqrt(2 * math.pi * LENGTH**2 / (self.fields.area if self.fields else FACE))

    def __getitem__(self, name):
        return self.columns[name].astype(float)

    def first(self, name):
        return self[name][0]

    def last(self, name):
        return self[name][-1]

    def at(self, name, cycles):
        return np.interp(cycles, self["cycles"], self[name])


def scene_of(run):
    scene = json.loads((run.folder / "run.json").read_text())["scene"]
    return scene if isinstance(scene, dict) else json.loads(scene)


class Fields:
    """Results from a run folder, for the first and the last state or for all states."""

    def __init__(self, run):
        scene = scene_of(run)
        contact, self.size = scene["contact"], scene["joint"]["size"]
        self.friction = contact["friction_coefficient"]
        self.arm = contact["normal_load"] * self.size[0] / 2
        places = [run.folder / "iterations" / f"wear_iteration={int(k)}" for k in run["wear_iteration"]]
        table = lambda place, name: pl.read_parquet(place / f"{name}.parquet")
        contacts = [table(place, "contact_field") for place in places]
        depth = table(places[-1], "wear_field")["wear_depth"].to_numpy()
        self.deepest = depth.max()
        self.area = math.prod(self.size) * len(depth) / math.prod(scene["joint"]["grid"])
        touched = np.any([field["pressure"].to_numpy() > 0 for field in contacts], axis=0)
        self.valleys = (~touched).sum(), depth[~touched].max(initial=0)
        alpha = run.first("wear_rate") / run.first("dissipated_energy")
        self.fastest = alpha * np.array([field["dissipation"].max() for field in contacts])
        self.steps = np.trapezoid(self.fastest, run["cycles"]) / STEP
        self.pressures = [self.pressure(field) for field in (contacts[0], contacts[-1])]
        cycle = table(places[0], "joint_cycle")
        self.moment = max(cycle[name].abs().max() for name in ("moment_x", "moment_y"))
        u = cycle["displacement_x"].to_numpy()
        self.shift = abs(u.mean()) / (np.ptp(u) / 2)
        # Relative to µN under the load at the same time.
        share = lambda cycle: (np.hypot(cycle["force_x"], cycle["force_y"]) / (self.friction * cycle["normal_load"])).max()
        self.sliding = np.array([share(table(place, "cycle")) for place in places])
        loops = [place / "hysteresis.parquet" for place in (places[0], places[-1])]
        self.fullness = [fullness(pl.read_parquet(loop)) for loop in loops] if all(loop.exists() for loop in loops) else None

    @staticmethod
    def pressure(field):
        """Returns the median of the peaks of all sections along x, and the 99th percentile and the mean of the loaded cells."""
        peaks = np.zeros(field["j"].max() + 1)
        np.maximum.at(peaks, field["j"].to_numpy(), field["pressure"].to_numpy())
        loaded = np.sort(field["pressure"].to_numpy()[field["pressure"].to_numpy() > 0])
        return np.median(peaks), loaded[int(0.99 * (len(loaded) - 1))], loaded.mean()


def fullness(loop):
    """Returns the area of a loop over the area of the parallelogram with its force, its half range and the slope after its reversal."""
    u, f = loop["displacement"].to_numpy(), loop["load"].to_numpy()
    far = len(u) - 1 - int(np.argmax(u[::-1]))
    after = np.roll(np.arange(len(u)), -far - 1)
    after = next(k for k in after if u[far] - u[k] > 1e-9 * abs(u[far]))
    slope = (f[far] - f[after]) / (u[far] - u[after])
    area = abs(np.dot(u, np.roll(f, -1)) - np.dot(np.roll(u, -1), f)) / 2
    whole = 2 * np.ptp(f) * (np.ptp(u) / 2 - np.ptp(f) / 2 / slope)
    return area / whole if whole > 0 else math.nan


def spread(values):
    return (max(values) - min(values)) / np.mean(values)


def rises(values):
    return all(a < b for a, b in zip(values, values[1:]))


def running_in(run, name):
    early = (run.at(name, 1e5) - run.first(name)) / 1e5
    late = (run.at(name, 1e7) - run.at(name, 5e6)) / 5e6
    return early > 5 * max(late, 0) and late >= -1e-9 * run.first(name) / 5e6


def area_grows(run):
    area = run["contact_area_fraction"]
    if run.rq > 1.0000001e-6:
        at = np.linspace(0, 1e7, 200)
        return np.corrcoef(at, run.at("contact_area_fraction", at))[0, 1] ** 2 > 0.95
    early = (run.at("contact_area_fraction", 1e6) - area[0]) / 1e6
    late = (run.at("contact_area_fraction", 1e7) - run.at("contact_area_fraction", 5e6)) / 5e6
    return early > 5 * max(late, 0)


def friction_below_supply(run):
    fine = run["dissipated_energy"] / run["dynamic_response_input_energy"]
    worn = run["worn_response_friction_energy"] / run["worn_response_input_energy"]
    return fine.max() < 1 and np.nanmax(worn) < 1


def changed(run):
    fall = (run.first("mean_height") - run.last("mean_height")) / run.rq
    rq = run.last("rq") / run.first("rq") - 1
    return fall > 0.05 and rq < -0.05 and run.last("sk") - run.first("sk") < -0.3 and run.last("ku") - run.first("ku") > 0.3


# Claims about one run.
OF_A_RUN = {
    "7: steady after 10⁷ cycles": lambda r: abs(r.last("dissipated_energy") - r.at("dissipated_energy", 8e6)) / 2 < 0.05 * r.last("dissipated_energy"),
    "9: Rq falls": lambda r: r["rq"].max() <= r.first("rq") * (1 + 1e-4) and r.last("rq") < r.first("rq"),
    "11: skewness from 0 to negative": lambda r: abs(r.first("sk")) < 0.1 and r.last("sk") < -0.1,
    "12: kurtosis from 3 to above": lambda r: abs(r.first("ku") - 3) < 0.2 and r.last("ku") > max(3, r.first("ku")),
    "13: not Gaussian after 1 % of the cycles": lambda r: abs(r.at("sk", 1e5)) > 3 * r.sigma,
    "14: all roughness parameters strongly affected": changed,
    "15: contact area grows": lambda r: all(b >= 0.99 * a for a, b in zip(r["contact_area_fraction"], r["contact_area_fraction"][1:]))
    and r.last("contact_area_fraction") > r.first("contact_area_fraction"),
    "18: smooth: fast, then flat; rough: nearly linear": area_grows,
    "19: kn runs in fast, then rises slowly": lambda r: running_in(r, "kn"),
    "21: so does kt": lambda r: running_in(r, "kt"),
    "24: the load of the joint hardly varies": lambda r: r.first("dynamic_response_load_variation") <= 0.05,
    "34: the resonance rises, by less than 5 %": lambda r: 1 < r.last("worn_response_peak_frequency") / r.first("worn_response_peak_frequency") < 1.05,
    "35: a higher peak with less friction": lambda r: r.last("worn_response_peak_amplitude") > r.first("worn_response_peak_amplitude")
    and r.last("worn_response_friction_energy") < r.first("worn_response_friction_energy"),
    "47: friction takes no more than the exciter supplies": friction_below_supply,
}


def peaks_fall(run):
    (section, high, mean), (section_end, high_end, mean_end) = run.fields.pressures
    return section_end <= section / 2 and high_end <= high / 2 and high_end / mean_end < high / mean


def sharper(run):
    if run.fields.fullness is None:
        return None
    before, after = run.fields.fullness
    softer, less = run.first("kt") < run.last("kt"), run.first("worn_response_friction_energy") > run.last("worn_response_friction_energy")
    return softer and less and after > before


# Claims about fields and cycles of one run. None: undecided.
OF_FIELDS = {
    "1: 231 steps of 0.1 µm, within a factor of 1.5": lambda r: STEPS / 1.5 <= r.fields.steps <= 1.5 * STEPS,
    "5: deepest wear below 231 × 0.1 µm": lambda r: r.fields.deepest <= STEPS * STEP,
    "8: peaks are flattened, valleys untouched": lambda r: r.fields.valleys[0] > 0 and r.fields.valleys[1] == 0 and r.fields.deepest > 0,
    "16: peaks of pressure fall, flat patches": peaks_fall,
    "25: moments are negligible": lambda r: r.fields.moment < 0.05 * r.fields.arm,
    "26: the loops are shifted": lambda r: None if r.fields.sliding[0] > 0.999 else r.fields.shift > 0.05,
    "36: loops steeper, sharper, smaller": sharper,
    "45: wear is shallow": lambda r: r.fields.deepest / min(r.fields.size) < 1e-3,
    "46: the joint slides as a whole": lambda r: 0.999 <= r.fields.sliding.max() <= 1.001,
}
# Claims about Rq 5 µm only. All other claims are about each roughness.
OF_MAIN = {1, 5, 8, 16, 26, 34, 35, 36, 46}


def third(runs, name):
    first, last = (spread([getattr(run, end)(name) for run in runs]) for end in ("first", "last"))
    return last <= first / 3


def rates(runs):
    first, last = ([getattr(run, end)("wear_rate") for run in runs] for end in ("first", "last"))
    return rises(first) and all(b < a for a, b in zip(first, last)) and spread(last) < 0.1


# Claims about the four roughnesses, in ascending order.
OF_FOUR = {
    "17: smoother starts with more area": lambda four: rises([-run.first("contact_area_fraction") for run in four])
    and four[0].first("contact_area_fraction") > 2 * four[-1].first("contact_area_fraction"),
    "20: kn comes together": lambda four: third(four, "kn"),
    "21: so does kt (together)": lambda four: third(four, "kt"),
    "23: rougher is softer, slips more, dissipates more": lambda four: rises([-run.first("worn_response_peak_frequency") for run in four])
    and rises([run.first("dynamic_response_displacement_amplitude") for run in four])
    and rises([run.first("worn_response_friction_energy") for run in four]),
    "37: worn joints respond alike": lambda four: third(four, "worn_response_peak_frequency") and third(four, "worn_response_peak_amplitude"),
    "37: in frequency alone": lambda four: third(four, "worn_response_peak_frequency"),
    "38: rougher wears faster, rates fall and come together": rates,
    "38: rougher wears faster at first": lambda four: rises([run.first("wear_rate") for run in four]),
}


def apart(runs, name, first):
    """Returns the largest relative difference between two of the runs, from `first` cycles on."""
    at = np.geomspace(first, 1e7, 40)
    courses = [run.at(name, at) for run in runs]
    return max(np.abs(a / b - 1).max() for k, a in enumerate(courses) for b in courses[k + 1 :])


def alike(runs):
    ends = lambda name: [run.last(name) for run in runs]
    off = lambda values: max(abs(a / b - 1) for k, a in enumerate(values) for b in values[k + 1 :])
    return off(ends("worn_response_peak_frequency")) < 1e-3 and off(ends("worn_response_peak_amplitude")) < 0.02


def jumps(run):
    """Returns the relative change of the energy per cycle at each update. The energy before follows from the volume of a linear step."""
    energy, volume, n_cycles = run["dissipated_energy"], run["wear_volume"], run["n_cycles"]
    alpha = run.first("wear_rate") / energy[0]
    found = []
    for k in np.flatnonzero(run["updated"])[1:]:
        mean = (volume[k] - volume[k - 1]) / (alpha * n_cycles[k])
        before = ((2 * mean - energy[k - 1]) + mean**2 / energy[k - 1]) / 2
        found.append(energy[k] / before - 1)
    return np.array(found)


def jump_down(runs):
    found = [jumps(run) for run in runs]
    return None if any(len(own) == 0 for own in found) else all((own < -0.01).all() for own in found)


# Claims about the runs with updates at 5, 10 and 20 %, followed by the run without updates.
OF_UPDATES = {
    "29: the wear rate jumps down at each update": lambda runs: jump_down(runs[:-1]),
    "30: alike in wear rate after 10⁶ cycles": lambda runs: apart(runs[:-1], "wear_rate", 1e6) < 0.05,
    "31: kn hardly depends on the updates": lambda runs: apart(runs[:-1], "kn", 1e4) < 0.03,
    "32: the same response after 10⁷ cycles": lambda runs: alike(runs[:-1]),
    "33: no update is needed": lambda runs: alike([runs[0], runs[-1]]),
}


def more_harmonics(runs):
    """Returns the changes of the unworn peak and of its frequency between the fewest and the most harmonics."""
    few, most = runs[0], runs[-1]
    of = lambda name: abs(most.first(name) / few.first(name) - 1)
    return of("worn_response_peak_amplitude"), of("worn_response_peak_frequency")


# Claims about the unworn joint with harmonics up to 3, 5 and 7.
OF_HARMONICS = {"27: three harmonics suffice": lambda runs: more_harmonics(runs)[0] < 0.01 and more_harmonics(runs)[1] < 5e-4}


def local_stiffness(run):
    """Returns the median over the contact elements of kn per touching area, unworn and at the last update."""
    scene = scene_of(run)
    cells, size = scene["joint"]["grid"], scene["joint"]["size"]
    step = [a / b for a, b in zip(size, cells)]
    found = []
    for k in (0, np.flatnonzero(run["updated"])[-1]):
        place = run.folder / "iterations" / f"wear_iteration={int(run['wear_iteration'][k])}"
        loaded = pl.read_parquet(place / "contact_field.parquet").filter(pl.col("pressure") > 0)
        x, y = ((loaded[axis].to_numpy() + 0.5 - count / 2) * d for axis, count, d in zip("ij", cells, step))
        own = []
        for element in pl.read_parquet(place / "contact_element.parquet").iter_rows(named=True):
            half = math.sqrt(element["area"]) / 2 * (1 + 1e-9)
            touching = ((abs(x - element["x"]) <= half) & (abs(y - element["y"]) <= half)).sum()
            if element["normal_load"] > 0 and touching:
                own.append(element["kn"] / (touching * step[0] * step[1]))
        found.append(np.median(own))
    return found


def falls_locally(run):
    before, after = local_stiffness(run)
    return after < before and run.last("kn") > run.first("kn") and run.last("contact_area_fraction") > run.first("contact_area_fraction")


# Claims about a run whose contact elements have separate stiffnesses.
OF_TANGENT = {"22: local stiffness falls while the global one rises": falls_locally}


def ratio(pair, name, first, last):
    at = np.linspace(first, last, 40)
    return np.abs(pair[1].at(name, at) / pair[0].at(name, at) - 1).max()


# Claims about an elastic and a plastic run of the same surface.
OF_A_PAIR = {
    "40: peaks above the limit come to it": lambda pair: pair[0].first("max_pressure") > CAP and abs(pair[1].first("max_pressure") / CAP - 1) < 1e-9,
    "41: the limit makes the area slightly larger, kn lower": lambda pair: 1 < pair[1].first("contact_area_fraction") / pair[0].first("contact_area_fraction") < 1.5
    and pair[1].first("kn") < pair[0].first("kn"),
    "41: kn lower": lambda pair: pair[1].first("kn") < pair[0].first("kn"),
    "42: kn alike after 2 × 10⁶ cycles": lambda pair: ratio(pair, "kn", 2e6, 1e7) < 0.05,
    "43: dissipation differs first and meets": lambda pair: ratio(pair, "dissipated_energy", 0, 1e5) > 0.05
    and ratio(pair, "dissipated_energy", 2e6, 4e6) < 0.05,
    "43: dissipation alike from 2 × 10⁶ cycles": lambda pair: ratio(pair, "dissipated_energy", 2e6, 4e6) < 0.05,
}


# Additional rows that are not claims.
BESIDE = {"37: in frequency alone", "38: rougher wears faster at first", "41: kn lower", "43: dissipation alike from 2 × 10⁶ cycles"}


def number(name):
    return int(name.split(":")[0])


def together(verdicts):
    return False if False in verdicts else None if None in verdicts else True


def of_rig(four):
    """Returns the verdicts of a rig by claim number, from its runs without updates at the four roughnesses in ascending order."""
    main = min(four, key=lambda run: abs(math.log(run.rq / MAIN)))
    found = {}
    own = {**OF_A_RUN, **(OF_FIELDS if all(run.fields for run in four) else {})}
    for name, judge in own.items():
        runs = [main] if number(name) in OF_MAIN else four
        verdict = together([told if told is None else bool(told) for told in map(judge, runs)])
        found.setdefault(number(name), []).append(verdict)
    for name, judge in OF_FOUR.items():
        if name not in BESIDE:
            found.setdefault(number(name), []).append(bool(judge(four)))
    return {claim: together(verdicts) for claim, verdicts in sorted(found.items())}


def runs_of(folder):
    """Returns the runs of a campaign by index."""
    frame = pl.scan_parquet(Path(folder) / "collected" / "*.parquet").collect()
    own = lambda index: Path(folder) / "runs" / f"{index:06}"
    return {index[0]: Run(rows, own(index[0])) for index, rows in sorted(frame.group_by("index"), key=lambda item: item[0][0])}


def by(runs, key):
    groups = {}
    for run in runs:
        groups.setdefault(key(run), []).append(run)
    return groups


def count(judge, things):
    return sum(bool(judge(thing)) for thing in things), len(things)


def told(counts):
    holds, of = counts
    return "" if of == 0 else f"{holds} of {of}"


def fours(runs, key):
    groups = by(runs, key).values()
    return [sorted(group, key=lambda run: run.rq) for group in groups if len({run.rq for run in group}) == 4]


def table(seeds, plastic, draws):
    rqs = sorted({run.rq for run in seeds})
    of_rq = [[run for run in seeds if run.rq == rq] for rq in rqs]
    main = [run for run in draws if abs(run.rq / MAIN - 1) < 1e-6]
    lines = ["| of one run | " + " | ".join(f"seeds, Rq {rq * 1e6:g} µm" for rq in rqs) + " | draws, Rq 5 µm |", "|---|" + "---:|" * (len(rqs) + 1)]
    for name, judge in OF_A_RUN.items():
        cells = [told(count(judge, runs)) for runs in [*of_rq, main]]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    keys = ("contact.friction_coefficient", "contact.normal_load", "dynamics.damping_ratio", "wear.coefficient")
    draw = lambda run: tuple(run.first(key) for key in keys)
    sets = [fours(seeds, lambda run: run.first(SEED)), fours(plastic, lambda run: run.first(SEED)), fours(draws, draw)]
    lines += ["", "| of the four roughnesses | seeds | seeds, plastic | draws |", "|---|---:|---:|---:|"]
    for name, judge in OF_FOUR.items():
        lines.append(f"| {name} | " + " | ".join(told(count(judge, own)) for own in sets) + " |")
    of_seed = {(run.rq, run.first(SEED)): run for run in plastic}
    pairs = [[(run, of_seed[run.rq, run.first(SEED)]) for run in runs if (run.rq, run.first(SEED)) in of_seed] for runs in of_rq]
    lines += ["", "| of elastic and plastic | " + " | ".join(f"Rq {rq * 1e6:g} µm" for rq in rqs) + " |", "|---|" + "---:|" * len(rqs)]
    for name, judge in OF_A_PAIR.items():
        lines.append(f"| {name} | " + " | ".join(told(count(judge, own)) for own in pairs) + " |")
    return "\n".join(lines)


def further(fields, updates, harmonics, tangent):
    """Returns the table of the smaller campaigns on some of the surfaces."""
    lines = ["| of one run | " + " | ".join(f"Rq {rq * 1e6:g} µm" for rq in sorted({run.rq for run in fields})) + " |"]
    lines.append("|---|" + "---:|" * (lines[0].count("|") - 2))
    of_rq = [[run for run in fields if run.rq == rq] for rq in sorted({run.rq for run in fields})]
    for name, judge in OF_FIELDS.items():
        cells = []
        for runs in of_rq:
            if number(name) in OF_MAIN and abs(runs[0].rq / MAIN - 1) > 1e-6:
                cells.append("")
                continue
            verdicts = [verdict for verdict in map(judge, runs) if verdict is not None]
            cells.append(f"{sum(map(bool, verdicts))} of {len(verdicts)}" + (f", {len(runs) - len(verdicts)} not judged" if len(verdicts) < len(runs) else ""))
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    lines += ["", "| of Rq 5 µm | surfaces |", "|---|---:|"]
    seed = lambda run: run.first(SEED)
    never = {run.first(SEED): run for run in fields if abs(run.rq / MAIN - 1) < 1e-6}
    of_update = lambda runs: [*sorted(runs, key=lambda run: run.first("update.stiffness_change")), never[runs[0].first(SEED)]]
    of_harmonics = lambda runs: sorted(runs, key=lambda run: run.first("dynamic_response_highest_harmonic"))
    sets = [
        (OF_UPDATES, [of_update(runs) for runs in by(updates, seed).values() if len(runs) == 3 and runs[0].first(SEED) in never]),
        (OF_HARMONICS, [of_harmonics(runs) for runs in by(harmonics, seed).values() if len(runs) == 3]),
        (OF_TANGENT, tangent),
    ]
    for judges, things in sets:
        for name, judge in judges.items():
            verdicts = [judge(thing) for thing in things]
            told = [bool(verdict) for verdict in verdicts if verdict is not None]
            if things:
                lines.append(f"| {name} | {sum(told)} of {len(told)} |")
    return "\n".join(lines)


def draw_wear(seeds, plastic, path):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "fretwear", "font.size": 8})
    import matplotlib.pyplot as plt

    panels = [
        ("wear_volume", 1e9, "worn volume / mm³"),
        ("dissipated_energy", 1, "friction energy per cycle / J"),
        ("kn", 1e-9, "normal stiffness / (kN/µm)"),
        ("contact_area_fraction", 100, "contact area / %"),
    ]
    at = np.concatenate([[0], np.geomspace(2e4, 1e7, 60)])
    figure, axes = plt.subplots(2, 2, figsize=(7.2, 5.2), layout="constrained")
    for (name, scale, label), axis in zip(panels, axes.flat):
        for k, (rq, runs) in enumerate(sorted(by(seeds, lambda run: run.rq).items())):
            values = scale * np.array([run.at(name, at) for run in runs])
            axis.fill_between(at, values.min(0), values.max(0), color=f"C{k}", alpha=0.25, lw=0)
            axis.plot(at, np.median(values, 0), color=f"C{k}", lw=1.2, label=f"Rq {rq * 1e6:g} µm")
            capped = [run for run in plastic if run.rq == rq]
            if capped:
                axis.plot(at, np.median(scale * np.array([run.at(name, at) for run in capped]), 0), "--", color=f"C{k}", lw=1)
        axis.set(xlabel="cycles", ylabel=label, xscale="symlog" if name != "wear_volume" else "linear")
        if name != "wear_volume":
            axis.set_xscale("symlog", linthresh=2e4)
        axis.set_ylim(bottom=0)
    axes.flat[0].legend(frameon=False)
    figure.savefig(path, metadata={"Date": None})


KEYS = {
    "contact.friction_coefficient": "friction coefficient",
    "contact.normal_load": "preload",
    "dynamics.damping_ratio": "damping",
    "wear.coefficient": "wear coefficient",
}
ANSWERS = {
    "peak_amplitude": "peak of the vibration",
    "peak_frequency": "its frequency",
    "dissipated_energy": "friction energy per cycle, at the end",
    "wear_rate": "worn volume per cycle, at the end",
    "wear_volume": "worn volume",
    "rq": "Rq of the worn face",
    "kn": "normal stiffness, at the end",
    "loaded_area_fraction": "loaded area, at the end",
    "max_pressure": "largest pressure, at the end",
}


def draw_keys(sensitivity, path):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "fretwear", "font.size": 8})
    import matplotlib.pyplot as plt

    found = {(row["figure"], row["key"]): row for row in sensitivity.iter_rows(named=True)}
    answers = [name for name in ANSWERS if (name, next(iter(KEYS))) in found]
    figure, axis = plt.subplots(figsize=(7.2, 0.34 * len(answers) + 0.9), layout="constrained")
    left = np.zeros(len(answers))
    for k, (key, label) in enumerate(KEYS.items()):
        rows = [found[name, key] for name in answers]
        shares = np.array([100 * max(row["share"] or 0, 0) for row in rows])
        axis.barh(range(len(answers)), shares, left=left, color=f"C{k}", label=label)
        for place, (share, row) in enumerate(zip(shares, rows)):
            if share > 8:
                text = f"{'+' if row['rank'] > 0 else '−'}{share:.0f}"
                axis.text(left[place] + share / 2, place, text, ha="center", va="center", color="white")
        left += shares
    axis.set(yticks=range(len(answers)), yticklabels=[ANSWERS[name] for name in answers], xlabel="share of the variance / %", xlim=(0, 105))
    axis.invert_yaxis()
    figure.legend(ncols=4, frameon=False, loc="outside upper center")
    figure.savefig(path, metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", required=True, help="folder of seeds.toml")
    parser.add_argument("--plastic", required=True, help="folder of seeds_plastic.toml")
    parser.add_argument("--draws", help="folder of draws.toml")
    for name in ("fields", "updates", "harmonics", "tangent"):
        parser.add_argument(f"--{name}", help=f"folder of seeds_{name}.toml" + ("; requires --fields" if name == "updates" else ""))
    parser.add_argument("--out", type=Path, default=Path("."), help="folder of the figures")
    arguments = parser.parse_args()
    seeds, plastic = (list(runs_of(folder).values()) for folder in (arguments.seeds, arguments.plastic))
    draws = list(runs_of(arguments.draws).values()) if arguments.draws else []
    print(table(seeds, plastic, draws))
    others = (arguments.fields, arguments.updates, arguments.harmonics, arguments.tangent)
    if any(others):
        print("", further(*(list(runs_of(folder).values()) if folder else [] for folder in others)), sep="\n")
    arguments.out.mkdir(parents=True, exist_ok=True)
    draw_wear(seeds, plastic, arguments.out / "ensembles_wear.svg")
    sensitivity = Path(arguments.draws or ".") / "campaign_sensitivity.parquet"
    if arguments.draws and sensitivity.exists():
        draw_keys(pl.read_parquet(sensitivity), arguments.out / "ensembles_keys.svg")


if __name__ == "__main__":
    main()
