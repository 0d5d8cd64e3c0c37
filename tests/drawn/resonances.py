"""Compares the statements of `fretwear plan` about the resonance with runs, on drawn laps of bars and resonators.

    python resonances.py --program fretwear [--seed 1] [--n 20] [--into FOLDER] [--jobs 2]

For each scene the script makes two runs of one iteration: with the largest load under which the plan predicts no slip and no opening, and
with a random load above it. The script checks

    stuck   that no element of the first run slips as a whole or opens, except elements that together carry a thousandth of the load
    band    that the resonance of the second run, if it has one, is within the band

and prints all results. The exit code is 1 if an element slips or opens, or if less than 19 of 20 resonances are within their band.
"""

import argparse
import concurrent.futures
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import pyarrow.parquet as pq

DATA = pathlib.Path(__file__).resolve().parents[2] / "data"

SURFACE = """
[material]
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
density = "7850 kg/m^3"
[surface]
kind = "gaussian"
rq = "{rq:.4f} um"
correlation_length = ["{cx:.4f} mm", "{cy:.4f} mm"]
seed = {seed}
"""

BARS = """
[joint]
size = ["40 mm", "27 mm"]
grid = [{nx}, {ny}]
""" + SURFACE + """
[contact]
friction_coefficient = {mu:.3f}
preload = {{ force = "{load:.4f} kN", head = "HEAD", nut = "NUT" }}
[structure]
kind = "mesh"
file = "{data}/lap_of_bars.inp"
unit = {{ length = "mm", mass = "t", time = "s" }}
interface = {{ upper = "TOP", lower = "BOTTOM" }}
[dynamics]
force = {{ amplitude = "1 N", at = "TIP", direction = "{direction}" }}
response = {{ at = "SENSOR", direction = "{direction}" }}
harmonics = [0, 1, 2, 3]
modes = 12
damping_ratio = {damping:.5f}
frequency = ["{from_:.1f} Hz", "{to:.1f} Hz"]
"""

RESONATOR = """
[joint]
size = ["40 mm", "36 mm"]
grid = [45, 36]
elements = [9, 9]
""" + SURFACE + """
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
force = {{ amplitude = "1 N", at = "far_wall", direction = "x" }}
modes = 10
damping_ratio = {damping:.5f}
frequency = ["850 Hz", "1200 Hz"]
harmonics = [0, 1, 2, 3]
"""


def drawn(seed):
    random = np.random.default_rng([6, seed])
    is_bars = bool(random.random() < 0.6)
    nx, ny = (60, 36) if is_bars else (45, 36)
    direction = "xyz"[random.integers(3)] if is_bars else "x"
    # Range around the first bending mode in each direction, and around the first mode along the bars.
    from_, to = {"z": (60, 230), "y": (300, 700), "x": (2000, 4800)}[direction]
    values = dict(
        nx=nx, ny=ny, seed=seed, data=DATA, direction=direction, from_=from_, to=to,
        rq=math.exp(random.uniform(math.log(0.3), math.log(6))),
        cx=40 / nx * random.uniform(3, 6), cy=30 / ny * random.uniform(3, 6),
        mu=random.uniform(0.2, 0.8), load=math.exp(random.uniform(math.log(5), math.log(30))),
        damping=math.exp(random.uniform(math.log(1e-3), math.log(2e-2))),
    )  # fmt: skip
    # The factor is a multiple of the load up to which all elements stick.
    return (BARS if is_bars else RESONATOR).format(**values), math.exp(random.uniform(0, math.log(30))), is_bars


def called(command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else None, done.stderr[-300:]


def run(program, scene, folder, force):
    """Returns the resonance frequency and the states of the contact elements of the unworn joint."""
    amplitude = f"dynamics.force.amplitude={force!r} N"
    found, why = called([program, "run", str(scene), "--run", str(folder), "--quiet", "--set", amplitude])
    if found is None:
        return None, why
    read = lambda name: pq.read_table(next(folder.glob(f"**/{name}.parquet"))).to_pydict()
    row, elements = read("dynamic_response"), read("contact_element")
    # The result excludes the least loaded elements, which together carry a thousandth of the load.
    order = np.argsort(elements["normal_load"])
    loads = np.array(elements["normal_load"])[order]
    kept = order[np.cumsum(loads) > 1e-3 * loads.sum()]
    return row["resonance_frequency"][0], [elements["state"][k] for k in kept]


def case(program, seed, into):
    scene_text, multiple, is_bars = drawn(seed)
    into.mkdir(parents=True, exist_ok=True)
    scene = into / f"{seed}.toml"
    scene.write_text(scene_text)
    found = dict(seed=seed, kind="bars" if is_bars else "resonator")
    plan, why = called([program, "plan", str(scene), "--json"])
    if plan is None:
        return dict(found, failed=why)
    resonances = json.loads(plan)["resonances"]
    if "not_known" in resonances:
        return dict(found, failed=resonances["not_known"])
    limits = resonances["limits"]
    found["limit"], found["stuck"] = limits["sticks"], resonances["stuck"]["frequency"]
    found["band"] = [resonances["free"]["frequency"], resonances["tied"]["frequency"]]
    if limits["sticks"] > 0:
        _, states = run(program, scene, into / f"{seed}_stuck", limits["sticks"])
        found["states"] = states if isinstance(states, str) else {state: states.count(state) for state in set(states)}
    found["force"] = multiple * limits["sticks"]
    found["resonance"], states = run(program, scene, into / f"{seed}_slips", found["force"])
    found["slips"] = states if isinstance(states, str) else {state: states.count(state) for state in set(states)}
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--n", type=int, default=20)
    parser.add_argument("--into", type=pathlib.Path)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    into = given.into or pathlib.Path(tempfile.mkdtemp())
    seeds = range(given.seed, given.seed + given.n)
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        rows = list(pool.map(lambda seed: case(given.program, seed, into), seeds))
    for row in rows:
        print(json.dumps(row))
    judged = [row for row in rows if isinstance(row.get("states"), dict)]
    slip = [row["seed"] for row in judged if set(row["states"]) - {"stick", "partial"}]
    known = [row for row in rows if row.get("resonance")]
    within = [row for row in known if row["band"][0] <= row["resonance"] <= row["band"][1]]
    print(f"stuck: {len(slip)} of {len(judged)} slip or open {slip}; band: {len(within)} of {len(known)} within; {len(rows)} drawn")
    sys.exit(int(bool(slip) or not judged or 20 * len(within) < 19 * len(known) or 4 * len(known) < 3 * len(rows)))


main()
