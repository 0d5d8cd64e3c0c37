"""Compares the forced response of an oscillator on a bank of sliders with pyHarm, which uses the module exported by fretwear.

    python tests/peers/pyharm_table.py --program fretwear

The bank has a loaded slider that slips, a slider that opens, and a slider that is open at rest and closes. Forces act along the joint
and across it. The frequencies cover the sticking joint, the peak, and again the sticking joint. At each frequency, the residual of pyHarm
is below 1e-6 of the load. The script needs pyHarm-os and pyarrow. The exit code is 1 if an amplitude differs by more than 0.2 %.
"""

import argparse
import importlib
import logging
import math
import os
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

SAMPLES = 4096
SCENE = """
[structure]
kind = "oscillator"
mass = "1 kg"
damping = ["20 N s/m", "20 N s/m", "2000 N s/m"]
stiffness = "4 N/um"
[contact]
elements = "bank.csv"
[dynamics]
force = [{{ amplitude = "{amplitude} N", at = "mass", direction = "x" }}, {{ amplitude = "60 N", at = "mass", direction = "z", phase = "40 deg" }}]
response = {{ at = "mass", direction = "x" }}
harmonics = [0, 1, 2, 3]
frequency = ["300 Hz", "620 Hz"]
points = 41
[fidelity]
aft_samples = {samples}
"""
BANK = """element,x,y,area,mu,damping_kn,damping_kt,normal_load,gap,kn,kt
0,0,0,0,0.3,8e6,6e6,150,0,3e6,3e6
0,0,0,0,0.3,8e6,6e6,8,0,3e6,2e6
0,0,0,0,0.3,8e6,6e6,0,2e-6,2e6,1e6
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    program = str(Path(parser.parse_args().program).resolve())
    folder = Path(tempfile.mkdtemp())
    (folder / "bank.csv").write_text(BANK, encoding="utf-8")
    os.environ["HOME"] = str(folder)
    os.chdir(folder)
    worst = 0.0
    for amplitude in (5, 60):
        scene, run, exported = f"s{amplitude}.toml", f"r{amplitude}", folder / f"x{amplitude}"
        Path(scene).write_text(SCENE.format(amplitude=amplitude, samples=SAMPLES), encoding="utf-8")
        subprocess.run([program, "run", scene, "--run", run, "--quiet"], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([program, "export", run, "--contact", "pyharm", "-o", str(exported)], check=True)
        found = pq.read_table(f"{run}/iterations/wear_iteration=0/frf.parquet").to_pydict()
        order = np.argsort(found["frequency"])
        frequencies, ours = (np.array(found[name])[order] for name in ("frequency", "amplitude"))
        worst = max(worst, compare(exported, frequencies, ours, amplitude))
    print(f"largest difference of the amplitudes: {worst:.1e}")
    return 0 if worst < 2e-3 else 1


def compare(exported, frequencies, ours, load):
    warnings.filterwarnings("ignore")
    logging.disable(logging.CRITICAL)
    sys.path.insert(0, str(exported))
    pyharm = importlib.import_module("pyHarm")
    sys.modules.pop("pyharm_joint", None)
    joint = importlib.import_module("pyharm_joint")
    sys.path.pop(0)
    problem = joint.problem(pyharm, samples=SAMPLES)
    problem["analysis"]["response"] |= {"verbose": False, "solver": "scipyroot", "solver_options": {"root": {"method": "hybr", "options": {"xtol": 1e-12, "maxfev": 5000}}}}
    maestro = pyharm.Maestro(problem)
    analysis, dofs = maestro.nls["response"], maestro.system.expl_dofs
    place = {part: dofs[(dofs["harm"] == 1) & (dofs["dof_num"] == 0) & (dofs["cs"] == part)].index[0] for part in "cs"}
    states, worst = [], 0.0
    for frequency, amplitude in zip(frequencies, ours):
        analysis.analysis_options["puls_start"] = math.tau * frequency
        secant = [2 * states[-1] - states[-2]] if len(states) > 1 else []
        for start in [*secant, *states[-1:], None, "null"]:
            analysis.SolList = []
            analysis.initialise(start)
            solution = analysis.SolList[-1]
            residual = float(np.linalg.norm(solution.R_solver))
            if residual < 1e-6 * load:
                break
        else:
            sys.exit(f"pyHarm finds no solution at {frequency} Hz: residual {residual} N")
        state = solution.x[:-1].copy()
        states.append(state)
        worst = max(worst, abs(math.hypot(state[place["c"]], state[place["s"]]) / amplitude - 1))
    print(f"{load} N: {len(frequencies)} frequencies, largest difference of the amplitudes {worst:.1e}")
    return worst


if __name__ == "__main__":
    sys.exit(main())
