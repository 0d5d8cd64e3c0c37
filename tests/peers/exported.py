"""Compares the exported matrices and contact elements of a run with the forced response of the program for a stuck joint.

    python tests/peers/exported.py --program fretwear [RUN]

Without RUN, the script computes the small resonator at 1e-4 of its force. The script solves the equations of K, M, C and Ks, with the
loaded sliders as springs, at the frequencies of `frf`. The script needs numpy and pyarrow. The exit code is 1 if an amplitude differs by
more than 1e-4.
"""

import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
import pyarrow.parquet as pq


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("run", nargs="?", type=pathlib.Path)
    given = parser.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp())
    run = given.run
    if run is None:
        text = (pathlib.Path(__file__).parents[1] / "support/mod.rs").read_text(encoding="utf-8")
        scene = folder / "small.toml"
        scene.write_text(re.search(r'pub const RESONATOR: &str = r#"(.*?)"#', text, re.S).group(1), encoding="utf-8")
        run = folder / "run"
        sets = ["dynamics.force.amplitude=0.03 N", "dynamics.points=41", "contact.stiffness=sliders", "wear.cycles=1"]
        subprocess.run([given.program, "run", str(scene), "--run", str(run), "--quiet", *(x for s in sets for x in ("--set", s))], check=True)
    subprocess.run([given.program, "export", f"{run}@0", "--contact", "csv", "-o", str(folder / "x")], check=True)
    matrices = np.load(folder / "x/matrices.npz")
    stiffness, mass = (matrices[name] for name in ("K", "M"))
    zero = np.zeros_like(mass)
    damping, hysteretic = (matrices[name] if name in matrices else zero for name in ("C", "Ks"))
    about = json.loads((folder / "x/vibration.json").read_text(encoding="utf-8"))
    lines = [line for line in (folder / "x/contact.csv").read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    rows = np.array([line.split(",") for line in lines[1:]], dtype=float)
    closed = stiffness.copy()
    for element, load, kn, kt in zip(rows[:, 0].astype(int), rows[:, 7], rows[:, 9], rows[:, 10]):
        if load > 0:
            for axis, spring in enumerate((kt, kt, kn)):
                closed[3 * element + axis, 3 * element + axis] += spring
    force = np.zeros(len(mass), complex)
    for load in about["loads"]:
        if load["harmonic"] == 1:
            force[load["row"] - 1] += load["cosine"] - 1j * load["sine"]
    frf = pq.read_table(run / "iterations/wear_iteration=0/frf.parquet").to_pydict()
    worst = 0.0
    for frequency, amplitude in zip(frf["frequency"], frf["amplitude"]):
        omega = 2 * np.pi * frequency
        dynamic = closed - omega**2 * mass + 1j * omega * damping + 1j * hysteretic
        found = abs(np.linalg.solve(dynamic, force)[about["response_row"] - 1])
        if amplitude is not None:
            worst = max(worst, abs(found / amplitude - 1))
    print(f"{len(frf['frequency'])} frequencies: largest difference of the amplitudes {worst:.1e}")
    return 0 if worst < 1e-4 else 1


if __name__ == "__main__":
    sys.exit(main())
