"""Finds the causes of the failing claims of docs/trust/paper.md: varies one key at a time, on the coarse joint.

    for file in pipelines/campaigns/causes/*.toml; do
        name=$(basename $file .toml)
        fretwear campaign plan $file --dir causes/$name && fretwear campaign run --dir causes/$name && fretwear campaign collect --dir causes/$name
    done
    python pipelines/campaigns/causes.py causes

Prints a table in Markdown for the existing campaigns, with the criteria of claims.py. The script needs Polars and numpy.
"""

import argparse
import math
from pathlib import Path

import numpy as np
import polars as pl

from calibrate import figures
from claims import (
    OF_A_RUN, OF_FIELDS, OF_FOUR, apart, by, more_harmonics, number, of_rig, ratio, rates, runs_of, scene_of, spread,
)  # fmt: skip

HELD = {number(name): judge for name, judge in [*OF_FOUR.items(), *OF_FIELDS.items(), *OF_A_RUN.items()]}
# Cut-off wavelength, in correlation lengths, and constant of the Gaussian filter that removes the form (ISO 16610-61).
CUTOFF, ALPHA = 5, 0.4697186391


def word(verdict):
    return {True: "holds", False: "fails"}.get(verdict if verdict is None else bool(verdict), "–")


def percent(value, digits=1):
    return f"{100 * value:.{digits}f} %"


def um(run):
    return f"{1e6 * run.rq:g} µm"


def runs(root, name):
    folder = root / name
    return list(runs_of(folder).values()) if (folder / "collected").is_dir() else []


def fours(all_runs, key):
    return {value: sorted(own, key=lambda run: run.rq) for value, own in sorted(by(all_runs, lambda run: run.first(key)).items())}


def damping(found):
    for ratio_of, four in fours(found, "dynamics.damping_ratio").items():
        if len(four) < 4:
            continue
        own, verdicts = figures(four), of_rig(four)
        first, last = ([getattr(run, end)("wear_rate") for run in four] for end in ("first", "last"))
        yield (
            "35, 37, 38, 46, 1",
            f"damping {ratio_of:g}",
            f"viscous share {percent(own['viscous_share'], 0)}, T {percent(own['sliding'])} of µN, {own['steps']:.0f} steps; peak {percent(own['amplitude_rise'], 2)}, "
            f"friction {percent(own['friction_rise'], 2)}; frequencies apart {percent(own['frequencies_apart'], 2)} → {percent(own['frequencies_apart_worn'], 2)}, "
            f"peaks {percent(own['amplitudes_apart'])} → {percent(own['amplitudes_apart_worn'])}; rates at first {', '.join(f'{1e18 * v:.0f}' for v in first)} µm³, "
            f"in the end {', '.join(f'{1e18 * v:.0f}' for v in last)}; "
            + ", ".join(f"{k} {word(verdicts[k])}" for k in (1, 7, 18, 23, 35, 36, 37, 38, 46)),
        )


def longer(found):
    for run in found:
        states = [(n, e) for n, e in zip(run["cycles"], run["dissipated_energy"]) if n >= 5e6]
        told = ", ".join(f"{1e3 * e:.2g} mJ at {n / 1e6:.0f}" for n, e in states)
        yield "7", f"{um(run)}, {run.last('cycles') / 1e6:.0f} × 10⁶ cycles", f"friction of a cycle {told} × 10⁶ cycles"


def heights(run, k):
    """Returns the worn heights [m] with NaN in the hole, the cell sizes and the correlation lengths."""
    scene = scene_of(run)
    surface = pl.read_parquet(run.folder / "once" / "surface.parquet").filter(pl.col("kept"))
    worn = pl.read_parquet(run.folder / "iterations" / f"wear_iteration={int(run['wear_iteration'][k])}" / "wear_field.parquet")
    joined = worn.join(surface, on=["i", "j"], how="left")
    field = np.full(scene["joint"]["grid"], np.nan)
    field[joined["i"].to_numpy(), joined["j"].to_numpy()] = (joined["height"] - joined["wear_depth"]).to_numpy()
    return (
        field,
        [size / cells for size, cells in zip(scene["joint"]["size"], scene["joint"]["grid"])],
        scene["surface"]["correlation_length"],
    )


def without_form(field, step, lengths):
    kept = ~np.isnan(field)
    sums = [np.where(kept, field, 0.0), kept.astype(float)]
    for axis in (0, 1):
        cutoff = CUTOFF * lengths[axis]
        place = np.arange(field.shape[axis]) * step[axis]
        away = np.abs(place[:, None] - place[None])
        weight = np.where(away <= math.ceil(cutoff / step[axis]) * step[axis], np.exp(-math.pi * (away / (ALPHA * cutoff)) ** 2), 0.0)
        sums = [np.moveaxis(np.tensordot(weight, own, (1, axis)), 0, axis) for own in sums]
    return (field - sums[0] / np.where(kept, sums[1], 1.0))[kept]


def moments(values):
    away = values - values.mean()
    m2, m3, m4 = ((away**power).mean() for power in (2, 3, 4))
    return math.sqrt(m2), m3 / m2**1.5, m4 / m2**2


def wear(found):
    for run in sorted(found, key=lambda run: (run.first("wear.coefficient"), run.rq)):
        fall = (run.first("mean_height") - run.last("mean_height")) / run.rq
        verdicts = ", ".join(f"{k} {word(HELD[k](run))}" for k in (9, 12, 13, 14))
        ends = [moments(without_form(*heights(run, k))) for k in (0, -1)]
        at = np.linspace(0, 1e7, 2001)
        not_gaussian = np.flatnonzero(np.abs(run.at("sk", at)) > 3 * run.sigma)
        text = f"{percent(at[not_gaussian[0]] / 1e7)} of the cycles" if len(not_gaussian) else "never"
        bare = f"without the form Rq {1e6 * ends[0][0]:.3g} → {1e6 * ends[1][0]:.3g} µm, Sk {ends[0][1]:.2f} → {ends[1][1]:.2f}, Ku {ends[0][2]:.2f} → {ends[1][2]:.2f}"
        whole = f"Rq {1e6 * run.first('rq'):.3g} → {1e6 * run.last('rq'):.3g} µm, Ku {run.first('ku'):.2f} → {run.last('ku'):.2f}"
        yield (
            "9, 12, 13, 14",
            f"{um(run)}, α {1e18 * run.first('wear.coefficient'):.0f} µm³/J",
            f"{fall:.2f} Rq worn; {whole}; {bare}; not Gaussian from {text}; {verdicts}",
        )


def rotation(found):
    for way, own in by(found, lambda run: scene_of(run)["contact"]["rotation"]).items():
        own = sorted(own, key=lambda run: run.rq)
        told = ", ".join(f"{percent(run.fields.moment / run.fields.arm, 2)}" for run in own)
        yield (
            "25",
            f"bodies {way}",
            f"moments {told} of N × half the side at Rq {', '.join(um(run) for run in own)}: {word(all(HELD[25](run) for run in own))}",
        )


def harmonics(found):
    for value, own in by(found, lambda run: run.first("dynamics.damping_ratio")).items():
        own = sorted(own, key=lambda run: run.first("dynamic_response_highest_harmonic"))
        peak, frequency = more_harmonics(own)
        yield "27", f"damping {value:g}", f"harmonics to 7 change the peak by {percent(peak, 2)}, its frequency by {percent(frequency, 3)}"


def meets(pair):
    spans = ((0, 1e5), (2e6, 4e6), (4e6, 1e7))
    return ", ".join(
        f"{percent(ratio(pair, 'dissipated_energy', *span))} apart from {span[0] / 1e6:g} to {span[1] / 1e6:g} × 10⁶" for span in spans
    )


def updates(found, plastic):
    main = sorted((run for run in found if abs(run.rq / 5e-6 - 1) < 1e-6), key=lambda run: -run.first("update.stiffness_change"))
    for a, b in zip(main, main[1:]):
        pair = [a, b]
        names = " and ".join(percent(run.first("update.stiffness_change"), 2) for run in pair)
        counts = " and ".join(f"{run['updated'].sum() - 1:.0f}" for run in pair)
        yield (
            "30",
            f"updates at {names}",
            f"{counts} updates; rates after 10⁶ cycles {percent(apart(pair, 'wear_rate', 1e6))} apart, volumes in the end {percent(abs(a.last('wear_volume') / b.last('wear_volume') - 1))}",
        )
    four = sorted((run for run in found if run.first("update.stiffness_change") == 0.05), key=lambda run: run.rq)
    if len(four) == 4:
        first, last = ([getattr(run, end)("wear_rate") for run in four] for end in ("first", "last"))
        yield (
            "38",
            "updates at 5 %, the four roughnesses",
            f"rates at first {', '.join(f'{1e18 * v:.0f}' for v in first)} µm³, in the end {', '.join(f'{1e18 * v:.0f}' for v in last)}, {percent(spread(last))} apart: {word(rates(four))}",
        )
    elastic = next((run for run in main if run.first("update.stiffness_change") == 0.05), None)
    if plastic and elastic:
        yield "43", "elastic and plastic, updates at 5 %", meets((elastic, plastic[0]))


def pressure(elastic, plastic):
    grid = lambda run: tuple(scene_of(run)["joint"]["grid"]) if run.folder.is_dir() else None
    key = lambda run: tuple(run.first(name) for name in run.columns if name.startswith("joint.grid")) or grid(run)
    of_grid = {key(run): run for run in elastic}
    for run in sorted(plastic, key=lambda run: (run.first("contact.pressure_cap"), key(run) or ())):
        own = of_grid.get(key(run))
        if own:
            area, kn = (run.first(name) / own.first(name) - 1 for name in ("contact_area_fraction", "kn"))
            yield (
                "41",
                f"{key(run)[0]:.0f} cells a side, {run.first('contact.pressure_cap') / 1e6:.0f} MPa",
                (
                    f"area {percent(own.first('contact_area_fraction'))} → {percent(run.first('contact_area_fraction'))} ({percent(area)} more), kn {percent(kn)}; largest elastic pressure {own.first('max_pressure') / 1e6:.0f} MPa"
                ),
            )


def sliding(found, plastic):
    for elastic, other in (
        (elastic, other)
        for other in plastic
        for elastic in found
        if elastic.keys["dynamics.force.amplitude"] == other.keys["dynamics.force.amplitude"]
    ):
        yield "43", f"elastic and plastic, {other.keys['dynamics.force.amplitude']}", meets((elastic, other))
    for run in found:
        keys = ("contact.friction_coefficient", "contact.normal_load", "dynamics.force.amplitude", "dynamics.damping_ratio")
        share = run.first("worn_response_viscous_energy") / run.first("worn_response_input_energy")
        told = f"T at most {percent(run.fields.sliding.max(), 2)} of µN ({percent(run.fields.sliding[0], 2)} unworn), viscous share {percent(share, 0)}; {run.fields.steps:.0f} steps"
        yield (
            "46",
            ", ".join(str(run.keys[key]) for key in keys),
            f"{told}: {word(HELD[46](run))}; loops shifted by {percent(run.fields.shift)}",
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", type=Path, help="folder that contains the folders of the campaigns")
    root = parser.parse_args().root
    rows = [*damping(runs(root, "damping")), *longer(runs(root, "longer")), *wear(runs(root, "wear")), *rotation(runs(root, "rotation"))]
    rows += [*harmonics(runs(root, "harmonics")), *updates(runs(root, "updates"), runs(root, "updates_plastic"))]
    rows += [
        *pressure(runs(root, "pressure"), runs(root, "pressure_plastic")),
        *sliding(runs(root, "sliding"), runs(root, "sliding_plastic")),
    ]
    print("| claim | varied | result |", "|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows), sep="\n")


if __name__ == "__main__":
    main()
