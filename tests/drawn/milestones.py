"""Compares milestones (`fretwear when`) of drawn joints with runs with the preset `reference` and much smaller wear steps.

    python milestones.py --program fretwear --kind lap|resonator [--seed 1] [--n 30] [--into FOLDER] [--jobs 2]

Laps have a prescribed motion and a bolt of random stiffness; resonators have the structure of the published case on a coarser mesh. Size,
grid, roughness, load, friction, amplitude or force, and cycles are random. The runs pass about two thirds of the levels. For each
figure the script prints

    in      number of known milestones whose reference lies between earliest and latest
    width   median of (latest - earliest)/2 over the reference, for the passed milestones
    error   median of |nominal - reference| over the reference
    lost    number of unknown milestones that the reference passes by more than three times its error bar

and writes one JSON line per milestone to milestones.jsonl. The exit code is 1 if less than 28 of 30 milestones are in, or if one is lost.
"""

import argparse
import concurrent.futures
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile

import numpy as np

LAP = """
[joint]
size = ["{lx:.3f} mm", "{ly:.3f} mm"]
grid = [{nx}, {ny}]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "{rq:.4f} um"
correlation_length = ["{cx:.4f} mm", "{cy:.4f} mm"]
seed = {seed}
[contact]
friction_coefficient = {mu:.3f}
normal_load = "{load:.4f} kN"
bolt_stiffness = "{bolt:.2f} N/um"
[motion]
amplitude = ["{amplitude:.4f} um", "0 um"]
[wear]
coefficient = "2e3 um^3/J"
cycles = {cycles}
[output]
curves_every = 0
"""

RESONATOR = """
[joint]
size = ["40 mm", "36 mm"]
grid = [{nx}, {ny}]
elements = [9, 9]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
density = "7949 kg/m^3"
[surface]
kind = "gaussian"
rq = "{rq:.4f} um"
correlation_length = ["{cx:.4f} mm", "{cy:.4f} mm"]
seed = {seed}
[contact]
friction_coefficient = {mu:.3f}
normal_load = "{load:.4f} kN"
[structure]
kind = "resonator"
half_depth_cells = 2
block_cells = 3
stub_cells = 1
gap_cells = 1
leaf_cells = 1
window_cells = 3
wall_cells = 2
inner_cells = 2
rim_cells = 1
head_cells = 1
[dynamics]
force = {{ amplitude = "{force:.1f} N", at = "far_wall", direction = "x" }}
modes = 10
damping_ratio = 0.01
frequency = ["850 Hz", "1200 Hz"]
[wear]
coefficient = "2e3 um^3/J"
cycles = {cycles}
[update]
stiffness_change = 0.1
[output]
curves_every = 0
"""

FINE = {
    "lap": ["fidelity.preset=reference", "wear.tolerance=2e-5"],
    "resonator": ["fidelity.preset=reference", "wear.tolerance=1e-4", "update.stiffness_change=0.02", "update.volume_growth=0.1"],
}
FIGURES = ("normal_load", "kn", "kt", "largest_depth", "depth_99", "wear_volume", "resonance_frequency")


def drawn(kind, seed):
    random = np.random.default_rng([("lap", "resonator").index(kind), seed])
    lx, ly = random.uniform(12, 45, 2)
    nx, ny = (int(2 * random.integers(16, 32)) for _ in range(2))
    ny += 2 * (nx == ny)
    if kind == "resonator":
        nx, ny, lx, ly = 45, 36, 40.0, 36.0
    rq = math.exp(random.uniform(math.log(0.5), math.log(8)))
    pressure = math.exp(random.uniform(math.log(3e6), math.log(3e7)))
    load = pressure * lx * ly * 1e-6
    return dict(
        lx=lx, ly=ly, nx=nx, ny=ny, rq=rq, seed=seed,
        cx=lx / nx * random.uniform(4, 7), cy=ly / ny * random.uniform(4, 7),
        mu=random.uniform(0.3, 0.8), load=load / 1e3,
        bolt=load * math.exp(random.uniform(math.log(0.003), math.log(0.06))),
        amplitude=math.exp(random.uniform(math.log(1.5), math.log(15))),
        force=math.exp(random.uniform(math.log(150), math.log(1000))),
        cycles=int(10 ** random.uniform(5.5, 7.2)),
    ), random  # fmt: skip


def run(program, scene, folder, sets):
    command = [program, "run", str(scene), "--run", str(folder), "--quiet"]
    for one in sets:
        command += ["--set", one]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode == 0 or done.stderr[-500:]


def flags(levels):
    flag = {"normal_load": "--preload={}N", "kn": "--stiffness=kn {} N/m", "kt": "--stiffness=kt {} N/m", "largest_depth": "--depth={}m",
            "depth_99": "--depth-99={}m", "wear_volume": "--volume={}m^3", "resonance_frequency": "--resonance={}Hz"}  # fmt: skip
    return [flag[figure].format(repr(float(level))) for figure, level in levels]


def when(program, folder, levels):
    done = subprocess.run([program, "when", str(folder), "--json", *flags(levels)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["milestones"]
    return {(row["figure"], row["level"]): row for row in found}


def case(program, kind, seed, into):
    values, random = drawn(kind, seed)
    into.mkdir(parents=True, exist_ok=True)
    scene = into / f"{kind}_{seed}.toml"
    scene.write_text({"lap": LAP, "resonator": RESONATOR}[kind].format(**values))
    own, fine = into / f"{kind}_{seed}", into / f"{kind}_{seed}_fine"
    for folder, sets in ((own, []), (fine, FINE[kind])):
        if not (folder / 'history.parquet').exists() and (why := run(program, scene, folder, sets)) is not True:
            return [dict(seed=seed, failed=f"{folder.name}: {why}")]
    import polars as pl

    history = pl.read_parquet(fine / "history.parquet")
    levels = []
    for figure in FIGURES:
        if figure not in history.columns or (figure == "resonance_frequency" and kind == "lap"):
            continue
        first, last = history[figure][0], history[figure][-1]
        if first is None or last is None or first == last:
            continue
        # The level is between a twentieth of the final change and one and a half times this change.
        levels.append((figure, first + (last - first) * random.uniform(0.05, 1.5)))
    ours, truth = (when(program, folder, levels) for folder in (own, fine))
    rows = []
    for (key, row), true in zip(sorted(ours.items()), (truth[key] for key in sorted(ours))):
        rows.append(dict(seed=seed, figure=key[0], level=key[1], known=row["known"], reference=true["nominal"],
                         reference_bar=[true["earliest"], true["latest"]], reference_known=true["known"],
                         **{at: row[at] for at in ("earliest", "nominal", "latest", "beyond")}))  # fmt: skip
    return rows


def judged(rows):
    # A milestone beyond the end counts as later than all others; the comparison allows one rounding step.
    late = lambda cycles: math.inf if cycles is None else cycles
    is_in = lambda row: late(row["earliest"]) * (1 - 1e-9) <= late(row["reference"]) <= late(row["latest"]) * (1 + 1e-9)
    known = [row for row in rows if row["known"] != "not known"]
    passed = [row for row in known if None not in (row["nominal"], row["latest"], row["reference"])]
    lost = [row for row in rows if row["known"] == "not known" and row["reference_known"] == "reached"
            and row["reference"] and (row["reference_bar"][1] - row["reference_bar"][0]) * 3 < 2 * row["reference"]]  # fmt: skip
    width = [(row["latest"] - row["earliest"]) / 2 / row["reference"] for row in passed]
    error = [abs(row["nominal"] / row["reference"] - 1) for row in passed]
    median = lambda values: statistics.median(values) if values else math.nan
    return sum(map(is_in, known)), len(known), len(passed), len(lost), median(width), median(error)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--kind", choices=("lap", "resonator"), required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--n", type=int, default=30)
    parser.add_argument("--into", type=pathlib.Path)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    into = given.into or pathlib.Path(tempfile.mkdtemp())
    rows = []
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        seeds = range(given.seed, given.seed + given.n)
        for found in pool.map(lambda seed: case(given.program, given.kind, seed, into), seeds):
            rows += found
            for row in found:
                if "failed" in row:
                    print(row, file=sys.stderr)
    (into / "milestones.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    rows = [row for row in rows if "failed" not in row]
    print(f"{'figure':<22}{'in':>8}{'passed':>8}{'lost':>6}{'width':>9}{'error':>9}")
    fine = True
    for figure in FIGURES:
        if of := [row for row in rows if row["figure"] == figure]:
            inside, known, passed, lost, width, error = judged(of)
            fine &= inside >= 28 / 30 * known and lost == 0
            print(f"{figure:<22}{inside:>4}/{known:<3}{passed:>8}{lost:>6}{width:>9.2%}{error:>9.2%}")
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
