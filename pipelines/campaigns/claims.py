"""Which statements of the paper hold in how many of the runs of a campaign, from its collected shards.

    fretwear campaign collect --dir seeds           # and so on, of seeds.toml, seeds_plastic.toml and draws.toml
    python pipelines/campaigns/claims.py --seeds seeds --plastic seeds_plastic --draws draws --out figures

Numbers and criteria of the statements are those of docs/study.md; judged is by the values alone, without error bars, and only what the history
of a run tells. A statement about all roughnesses is judged on the runs that share everything else. Prints a Markdown table, and draws
ensembles_wear.svg into the folder, and ensembles_keys.svg of the sensitivities that `fretwear campaign report` has written for the draws. Wants Polars, numpy and matplotlib.
"""

import argparse
import math
from pathlib import Path

import numpy as np
import polars as pl

RQ, SEED = "surface.rq", "surface.seed"
# A correlation length of 0.5 mm on the face of the joint: 40 mm x 40 mm less 21 of its 361 contact elements.
FACE = 0.04 * 0.04 * 340 / 361
SIGMA = math.sqrt(2 * math.pi * 0.5e-3**2 / FACE)
MAIN = 5e-6
CAP = 600e6


class Run:
    """The history of a run: columns by name."""

    def __init__(self, frame):
        frame = frame.sort("wear_iteration")
        self.columns = {name: frame[name].to_numpy() for name in frame.columns if frame[name].dtype.is_numeric()}
        self.rq = float(self.columns[RQ][0])

    def __getitem__(self, name):
        return self.columns[name].astype(float)

    def first(self, name):
        return self[name][0]

    def last(self, name):
        return self[name][-1]

    def at(self, name, cycles):
        return np.interp(cycles, self["cycles"], self[name])


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


# Of one run.
OF_A_RUN = {
    "7: steady after 10⁷ cycles": lambda r: abs(r.last("dissipated_energy") - r.at("dissipated_energy", 8e6)) / 2 < 0.05 * r.last("dissipated_energy"),
    "9: Rq falls": lambda r: r["rq"].max() <= r.first("rq") * (1 + 1e-4) and r.last("rq") < r.first("rq"),
    "11: skewness from 0 to negative": lambda r: abs(r.first("sk")) < 0.1 and r.last("sk") < -0.1,
    "12: kurtosis from 3 to above": lambda r: abs(r.first("ku") - 3) < 0.2 and r.last("ku") > max(3, r.first("ku")),
    "13: not Gaussian after 1 % of the cycles": lambda r: abs(r.at("sk", 1e5)) > 3 * SIGMA,
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


def third(runs, name):
    first, last = (spread([getattr(run, end)(name) for run in runs]) for end in ("first", "last"))
    return last <= first / 3


def rates(runs):
    first, last = ([getattr(run, end)("wear_rate") for run in runs] for end in ("first", "last"))
    return rises(first) and all(b < a for a, b in zip(first, last)) and spread(last) < 0.1


# Of the four roughnesses, from the smoothest on.
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


def ratio(pair, name, first, last):
    at = np.linspace(first, last, 40)
    return np.abs(pair[1].at(name, at) / pair[0].at(name, at) - 1).max()


# Of an elastic and a plastic run of the same surface.
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


def runs_of(folder):
    """The runs of a campaign, by index."""
    frame = pl.scan_parquet(Path(folder) / "collected" / "*.parquet").collect()
    return {index[0]: Run(own) for index, own in sorted(frame.group_by("index"), key=lambda item: item[0][0])}


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


def draw_wear(seeds, plastic, path):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "fretwear", "font.size": 8})
    import matplotlib.pyplot as plt

    panels = [
        ("wear_volume", 1e9, "worn volume / mm³"),
        ("dissipated_energy", 1, "friction of a cycle / J"),
        ("kn", 1e-9, "normal stiffness / (kN/µm)"),
        ("contact_area_fraction", 100, "area in contact / %"),
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
    "dissipated_energy": "friction of a cycle, in the end",
    "wear_rate": "worn volume of a cycle, in the end",
    "wear_volume": "worn volume",
    "rq": "Rq of the worn face",
    "kn": "normal stiffness, in the end",
    "loaded_area_fraction": "loaded area, in the end",
    "max_pressure": "largest pressure, in the end",
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
    parser.add_argument("--out", type=Path, default=Path("."), help="folder of the figure")
    arguments = parser.parse_args()
    seeds, plastic = (list(runs_of(folder).values()) for folder in (arguments.seeds, arguments.plastic))
    draws = list(runs_of(arguments.draws).values()) if arguments.draws else []
    print(table(seeds, plastic, draws))
    arguments.out.mkdir(parents=True, exist_ok=True)
    draw_wear(seeds, plastic, arguments.out / "ensembles_wear.svg")
    sensitivity = Path(arguments.draws or ".") / "campaign_sensitivity.parquet"
    if arguments.draws and sensitivity.exists():
        draw_keys(pl.read_parquet(sensitivity), arguments.out / "ensembles_keys.svg")


if __name__ == "__main__":
    main()
