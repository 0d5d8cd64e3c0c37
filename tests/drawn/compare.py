"""Compares runs of the program with the reference solutions of drawn scenes.

    python compare.py --program fretwear [--preset balanced ...] [--set KEY=VALUE ...] [--out FILE.jsonl] scene.toml ...

The reference of a scene is in the same folder (truth.py). For each scene and preset the script prints a row and writes a JSON line with all
figures:

    volume, bar      relative error of the worn volume (program minus reference), and error_wear_volume of the program
    in bar           whether the error of the volume is within the bar plus the error of the reference
    field            L1 norm of the difference of the wear depths over the worn volume of the reference
    first, last      relative error of the dissipated energy of the first and of the last cycle, with the bar of the last cycle
    pairs, CPU       transform pairs of all iterations; CPU seconds of the whole run

The exit code is 1 if a volume is outside its error bar, a run fails, or no scene has a reference.
"""

import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np
import polars as pl


def run(program, scene, folder, sets):
    command = [program, "run", str(scene), "--run", str(folder), "--quiet"]
    for one in sets:
        command += ["--set", one]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done, seconds, time.monotonic() - began


def iterations(folder):
    return sorted((folder / "iterations").iterdir(), key=lambda path: int(path.name.split("=")[1]))


def one(frame, name):
    return frame[name][0] if name in frame.columns else None


def compare(program, path, preset, sets, folder):
    truth = json.loads(path.with_suffix(".truth.json").read_text(encoding="utf-8"))
    field = pl.read_parquet(path.with_suffix(".truth.parquet"))
    settings = ([f"fidelity.preset={preset}"] if preset else []) + list(sets)
    done, seconds, wall = run(program, path, folder, settings)
    row = {
        "scene": path.stem,
        "kind": path.stem.rpartition("_")[0],
        "program": str(program),
        "preset": preset,
        "set": list(sets),
        "code": done.returncode,
        "cpu_seconds": seconds,
        "wall_seconds": wall,
        "truth_volume": truth["volume"],
        "truth_error": truth["error_volume"],
        "truth_error_field": truth["error_field"],
    }
    if done.returncode:
        row["message"] = done.stderr.strip()[-500:]
        return row
    folders = iterations(folder)
    summaries = [pl.read_parquet(folder / "summary.parquet") for folder in folders]
    first, last = summaries[0], summaries[-1]
    worn = pl.read_parquet(folders[-1] / "wear_field.parquet")
    both = field.join(worn, on=["i", "j"], how="left", suffix="_program")
    volume = one(last, "wear_volume")
    difference = np.abs(both["wear_depth"].to_numpy() - both["wear_depth_program"].to_numpy()).sum()
    unworn = field.join(pl.read_parquet(folders[0] / "contact_field.parquet"), on=["i", "j"], how="left")
    energy = unworn["dissipation_first"].to_numpy()
    row |= {
        "volume": volume,
        "error_volume": volume / truth["volume"] - 1,
        "bar_volume": one(last, "error_wear_volume"),
        "error_field": difference / field["wear_depth"].sum(),
        "error_first": one(first, "dissipated_energy") / truth["first"]["dissipated_energy"] - 1,
        "error_first_field": np.abs(unworn["dissipation"].to_numpy() - energy).sum() / energy.sum(),
        "error_last": one(last, "dissipated_energy") / truth["last"]["dissipated_energy"] - 1,
        "bar_last": one(last, "error_dissipated_energy"),
        "bar_cycle_first": one(first, "error_cycle"),
        "bar_cycle_last": one(last, "error_cycle"),
        "bar_wear": one(last, "error_wear"),
        "error_loaded_area": one(last, "loaded_area_fraction") / truth["last"]["loaded_area_fraction"] - 1,
        "bar_loaded_area": one(last, "error_loaded_area"),
        "bar_field": one(last, "error_wear_field"),
        "bar_max_pressure": one(last, "error_max_pressure"),
        "error_max_pressure": one(last, "max_pressure") / truth["last"]["max_pressure"] - 1,
        "iterations": len(folders) - 1,
        "fft_pairs": sum(one(summary, "fft_pairs") for summary in summaries),
    }
    # The summaries count all transform pairs, because the run is neither resumed nor split into stages: the summary of an iteration
    # includes the pairs of its wear step.
    cycle = pl.read_parquet(folders[0] / "cycle.parquet")
    row["error_force"] = max(
        abs(cycle[name].max() - truth["first"][name][1]) for name in ("force_x", "force_y") if name in cycle.columns
    ) / max(map(abs, truth["first"]["force_x"] + truth["first"]["force_y"]))
    row["in_bar"] = bool(abs(row["error_volume"]) <= (row["bar_volume"] or 0.0) + truth["error_volume"])
    return row


def percent(value):
    return "     -" if value is None else f"{100 * value:+6.2f}"


def line(row):
    head = f"{row['scene']:14} {row['preset'] or '-':10}"
    if row["code"]:
        return f"{head} code {row['code']}: {row['message'].splitlines()[-1] if row['message'] else ''}"
    return (
        f"{head} {row['truth_volume']:.4e} {100 * row['truth_error']:5.2f}  {row['volume']:.4e} {percent(row['error_volume'])} "
        f"{percent(row['bar_volume'])} {'in ' if row['in_bar'] else 'OUT'} {100 * row['error_field']:6.2f} "
        f"{percent(row['error_first'])} {percent(row['error_last'])} {percent(row['bar_last'])} "
        f"{row['iterations']:3} {row['fft_pairs']:9.0f} {row['cpu_seconds']:7.2f}"
    )


HEAD = (
    f"{'scene':14} {'preset':10} {'truth m^3':10} {'+- %':>5}  {'program':10} {'vol %':>6} {'bar %':>6} {'':3} {'field':>6} "
    f"{'first':>6} {'last':>6} {'bar':>6} {'it':>3} {'pairs':>9} {'CPU s':>7}"
)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=pathlib.Path)
    parser.add_argument("--program", required=True)
    parser.add_argument("--preset", nargs="+", default=["balanced"])
    parser.add_argument("--set", nargs="+", default=[], help="further keys, as KEY=VALUE")
    parser.add_argument("--out", type=pathlib.Path)
    options = parser.parse_args()
    print(HEAD)
    rows = []
    for path in options.scenes:
        if not path.with_suffix(".truth.json").exists():
            continue
        for preset in options.preset:
            with tempfile.TemporaryDirectory() as folder:
                row = compare(options.program, path, preset, options.set, pathlib.Path(folder) / "run")
            rows.append(row)
            print(line(row), flush=True)
            if options.out:
                with open(options.out, "a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    done = [row for row in rows if not row["code"]]
    for preset in options.preset:
        of = [row for row in done if row["preset"] == preset]
        if of:
            errors = np.abs([row["error_volume"] for row in of])
            print(
                f"{preset}: {len(of)} scenes, error of the volume {100 * np.median(errors):.2f} % in the median, "
                f"{100 * errors.max():.2f} % at most; {sum(row['in_bar'] for row in of)} within the bar; "
                f"{sum(row['fft_pairs'] for row in of):.0f} pairs, {sum(row['cpu_seconds'] for row in of):.1f} CPU s"
            )
    return 0 if rows and all(row.get("in_bar") for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
