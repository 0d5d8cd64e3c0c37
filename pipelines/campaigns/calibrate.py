"""Finds the rigs of a campaign that agree best with the paper, the requirements of each claim, and claims that exclude each other.

    fretwear campaign collect --dir calibration          # for calibration.toml or another campaign with keep = "runs"
    python pipelines/campaigns/calibrate.py calibration [MORE ...] --out calibration

All runs of a rig share all keys except the roughness. The script judges a rig if its runs at all four roughnesses are finished, with the
criteria of claims.py and without error bars. The script writes calibration.csv with one row per rig: keys in SI units, numbers to compare
with the paper, and verdicts. It prints tables in Markdown. The script computes the steps of the explicit algorithm without running it:
the wear rate of the fastest cell of each state, integrated over the cycles by trapezoids, divided by 0.1 µm. It needs Polars and numpy.
"""

import argparse
import itertools
from pathlib import Path

import numpy as np
import polars as pl

from claims import OF_A_RUN, OF_FIELDS, OF_FOUR, RQ, by, number, of_rig, runs_of, scene_of, spread

# Check of the runs. This check is not a claim of the paper.
CHECK = 47
# Smallest probability for a key that separates the rigs with a claim from the other rigs: of two such rigs, the first has the larger value.
TELLS = 0.75
# Smallest number of rigs in each group.
FEWEST = 4
# Pairs of claims that never hold together are listed if chance gives at least this number of common rigs.
BY_CHANCE = 1.0
# Largest relative distance between the phase resonance, which wears the joint, and the peak. Other rigs are not judged.
ELSEWHERE = 0.05


def figures(four):
    """Returns the numbers of a rig to compare with the paper. By default, the numbers are from the run at Rq 5 µm."""
    main = four[2]
    ratio = lambda run, name: run.last(name) / run.first(name)
    at = lambda name, end: [getattr(run, end)(name) for run in four]
    return {
        "steps": main.fields.steps,
        "cycles_a_step": main.last("cycles") / main.fields.steps,
        "deepest_um": 1e6 * main.fields.deepest,
        "sliding": main.fields.sliding.max(),
        "viscous_share": main.first("worn_response_viscous_energy") / main.first("worn_response_input_energy"),
        "frequency": main.first("worn_response_peak_frequency"),
        "frequency_rise": ratio(main, "worn_response_peak_frequency") - 1,
        "amplitude_um": 1e6 * main.first("worn_response_peak_amplitude"),
        "amplitude_rise": ratio(main, "worn_response_peak_amplitude") - 1,
        "friction_rise": ratio(main, "worn_response_friction_energy") - 1,
        "rate_rise": ratio(main, "wear_rate") - 1,
        "rates_rise": sum(ratio(run, "wear_rate") > 1 for run in four),
        "rates_apart": spread(at("wear_rate", "last")),
        "frequencies_apart": spread(at("worn_response_peak_frequency", "first")),
        "frequencies_apart_worn": spread(at("worn_response_peak_frequency", "last")),
        "amplitudes_apart": spread(at("worn_response_peak_amplitude", "first")),
        "amplitudes_apart_worn": spread(at("worn_response_peak_amplitude", "last")),
        "moment": main.fields.moment / main.fields.arm,
        "friction_over_supply": max((run["dissipated_energy"] / run["dynamic_response_input_energy"]).max() for run in four),
    }


def plain(value):
    """Returns the number of a quantity with a unit, or the name of a law of the contact elements."""
    words = value.replace('"', " ").split() if isinstance(value, str) else []
    try:
        return float(words[0])
    except (IndexError, ValueError):
        return next((word for word in reversed(words) if word.isidentifier()), value)


def drawn(folder):
    """Returns the varied keys of a campaign except the roughness. The first columns of the table are not keys."""
    names = pl.scan_parquet(Path(folder) / "campaign.parquet").collect_schema().names()
    return [name for name in names[names.index("memory") + 1 :] if name != RQ]


def shipped(run, key):
    """Returns the value of a key that another campaign varies: a number, or the law of the contact elements."""
    value = scene_of(run)
    for name in key.split("."):
        value = value[name]
        value = value[0] if isinstance(value, list) else value
    return value["distribution" if value["stiffness"] == "total" else "stiffness"] if key == "contact" else value


def rigs_of(folders):
    """Returns the rows of the table (keys, numbers, verdicts) and the number of rigs with missing runs."""
    rows, missing, elsewhere = [], 0, 0
    keys_of = {folder: drawn(folder) for folder in folders}
    every = list(dict.fromkeys(key for keys in keys_of.values() for key in keys))
    for folder, keys in keys_of.items():
        runs = runs_of(folder)
        for indices in by(list(runs), lambda index: tuple(runs[index].keys[key] for key in keys)).values():
            four = sorted((runs[index] for index in indices), key=lambda run: run.rq)
            if len({run.rq for run in four}) < 4:
                missing += 1
                continue
            if any(abs(run.first("resonance_frequency") / run.first("worn_response_peak_frequency") - 1) > ELSEWHERE for run in four):
                elsewhere += 1
                continue
            keyed = {key: plain(four[0].keys[key] if key in keys else shipped(four[0], key)) for key in every}
            name = f"{Path(folder).name}/{min(indices)}"
            rows.append({"rig": name, **keyed, **figures(four), **{f"claim_{k}": verdict for k, verdict in of_rig(four).items()}})
    return rows, missing, elsewhere, every


def judged(rows):
    return sorted({int(name[6:]) for row in rows for name in row if name.startswith("claim_")} - {CHECK})


def count(row):
    return sum(row[f"claim_{k}"] is True for k in judged([row]))


def best(rows, keys, most):
    lines = [
        "| rig | holds | steps | deepest, µm | viscous share | T/µN | f, peak, rate rise by | fails |",
        "|---|---:|---:|---:|---:|---:|---:|---|",
    ]
    for row in sorted(rows, key=lambda row: (-count(row), abs(np.log(row["steps"] / 231))))[:most]:
        rises = ", ".join(f"{100 * row[name]:+.2f} %" for name in ("frequency_rise", "amplitude_rise", "rate_rise"))
        fails = ", ".join(str(k) for k in judged([row]) if row[f"claim_{k}"] is False)
        lines.append(
            f"| {row['rig']} | {count(row)} | {row['steps']:.0f} | {row['deepest_um']:.1f} | {100 * row['viscous_share']:.0f} % "
            f"| {100 * row['sliding']:.1f} % | {rises} | {fails} |"
        )
    lines += ["", "| rig | " + " | ".join(keys) + " |", "|---|" + "---|" * len(keys)]
    for row in sorted(rows, key=lambda row: (-count(row), abs(np.log(row["steps"] / 231))))[:most]:
        lines.append(
            f"| {row['rig']} | " + " | ".join(f"{row[key]:.4g}" if isinstance(row[key], float) else str(row[key]) for key in keys) + " |"
        )
    return "\n".join(lines)


def sorting(inside, outside):
    """Returns the probability that a value of the first group exceeds a value of the second group."""
    first, second = np.asarray(inside, float)[:, None], np.asarray(outside, float)[None]
    return (first > second).mean() + (first == second).mean() / 2


def needs(rows, keys):
    names = {number(name): name.split(": ", 1)[1] for name in reversed([*OF_A_RUN, *OF_FIELDS, *OF_FOUR])}
    lines = ["| claim | holds in | range where it holds | separating keys |", "|---|---:|---|---|"]
    numeric = [key for key in keys if all(isinstance(row[key], float) for row in rows)]
    words = [key for key in keys if key not in numeric]
    shown = ["viscous_share", "sliding"]
    for k in judged(rows):
        known = [row for row in rows if row[f"claim_{k}"] is not None]
        inside, outside = ([row for row in known if row[f"claim_{k}"] is told] for told in (True, False))
        ranges, tells = [], []
        if inside and outside:
            for key in [*numeric, *shown]:
                own = [row[key] for row in inside]
                chance = sorting(own, [row[key] for row in outside])
                if min(len(inside), len(outside)) >= FEWEST and max(chance, 1 - chance) >= TELLS:
                    tells.append((max(chance, 1 - chance), f"{'more' if chance > 0.5 else 'less'} {key} ({max(chance, 1 - chance):.2f})"))
                    ranges.append(f"{key} {min(own):.3g} to {max(own):.3g}")
            for key in words:
                own = by(inside, lambda row: row[key])
                shares = ", ".join(
                    f"{value} {len(own.get(value, []))}/{len(of)}" for value, of in sorted(by(known, lambda row: row[key]).items(), key=str)
                )
                if len(by(known, lambda row: row[key])) > 1 and len(inside) >= FEWEST:
                    parts = [len(own.get(value, [])) / len(of) for value, of in by(known, lambda row: row[key]).items()]
                    if max(parts) - min(parts) > 0.5:
                        ranges.append(f"{key}: {shares}")
        told = "; ".join(text for _, text in sorted(tells, reverse=True)[:3])
        lines.append(f"| {k}: {names[k]} | {len(inside)} of {len(known)} | {'; '.join(ranges)} | {told} |")
    return "\n".join(lines)


def exclusions(rows):
    lines, pairs = ["| claims | hold in | both by chance in |", "|---|---:|---:|"], []
    for a, b in itertools.combinations(judged(rows), 2):
        known = [row for row in rows if row[f"claim_{a}"] is not None and row[f"claim_{b}"] is not None]
        first, second = ({row["rig"] for row in known if row[f"claim_{k}"]} for k in (a, b))
        if first and second and not first & second:
            pairs.append((len(first) * len(second) / len(known), f"| {a}, {b} | {len(first)}, {len(second)} of {len(known)}"))
    lines += [f"{text} | {chance:.1f} |" for chance, text in sorted(pairs, reverse=True) if chance >= BY_CHANCE]
    return "\n".join([*lines, "", f"{len(pairs)} pairs in total"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", help="folders of collected campaigns")
    parser.add_argument("--out", type=Path, default=Path("."), help="folder of calibration.csv")
    parser.add_argument("--best", type=int, default=8, help="number of listed rigs")
    arguments = parser.parse_args()
    rows, missing, elsewhere, keys = rigs_of(arguments.folders)
    arguments.out.mkdir(parents=True, exist_ok=True)
    table = pl.DataFrame(rows, infer_schema_length=None)
    table.with_columns(pl.selectors.float().round_sig_figs(5)).write_csv(arguments.out / "calibration.csv")
    print(f"{len(rows)} rigs; {missing} rigs lack a run, {elsewhere} rigs wear at a resonance away from the peak\n")
    print(best(rows, keys, arguments.best), needs(rows, keys), exclusions(rows), sep="\n\n")


if __name__ == "__main__":
    main()
