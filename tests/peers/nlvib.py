"""Compares the forces of exported NLvib elements in Octave with the forces of fretwear, at the displacements of fretwear.

    python tests/peers/nlvib.py --program fretwear

The script evaluates the elastic dry friction and the unilateral spring as the NLvib documentation defines these laws. Each of three
oscillators has one kind of element: sliding along x and y (friction_law = "box", constant load), opening, and closing. The script needs
octave and pyarrow. The exit code is 1 if a force differs by more than 1e-3.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

SAMPLES = 4096
SCENE = """
[structure]
kind = "oscillator"
mass = "1 kg"
damping = ["40 N s/m", "40 N s/m", "2000 N s/m"]
stiffness = "4 N/um"
[contact]
elements = "bank.csv"
[dynamics]
friction_law = "box"
force = [{force}]
response = {{ at = "mass", direction = "{response}" }}
harmonics = [0, 1, 2, 3, 4, 5, 6, 7]
at = "{at}"
frequency = ["100 Hz", "900 Hz"]
points = 3
[fidelity]
aft_samples = 4096
"""
HEAD = "element,x,y,area,mu,damping_kn,damping_kt,normal_load,gap,kn,kt\n"
CASES = {
    "slides": ('{ amplitude = "60 N", direction = "x" }, { amplitude = "45 N", direction = "y", phase = "50 deg" }', "x", "480 Hz",
               "0,0,0,0,0.3,8e6,6e6,150,0,3e6,3e6\n0,0,0,0,0.3,8e6,6e6,40,0,3e6,2e6\n"),
    "lifts_off": ('{ amplitude = "80 N", direction = "z" }', "z", "520 Hz", "0,0,0,0,0,8e6,6e6,20,0,6e6,0\n0,0,0,0,0,8e6,6e6,100,0,2e6,0\n"),
    "closes": ('{ amplitude = "80 N", direction = "z" }', "z", "420 Hz", "0,0,0,0,0,8e6,6e6,0,4e-6,6e6,0\n0,0,0,0,0,8e6,6e6,0,1e-6,1e6,0\n"),
}  # fmt: skip
OCTAVE = """
addpath('{folder}');
[M, D, K, elements, Fex1] = nlvib_joint();
q = csvread('{folder}/displacement.csv')';
bare = K;
fresh = dlmread('{folder}/bare.csv');
f = (K - fresh) * q;
for e = 1:numel(elements)
    of = elements{{e}};
    u = of.force_direction' * q;
    if strcmp(of.type, 'unilateralSpring')
        g = of.stiffness * (u - of.gap) .* (u - of.gap >= 0);
    else
        g = zeros(size(u));
        slider = 0;
        for cycle = 1:4
            for k = 1:numel(u)
                g(k) = of.stiffness * (u(k) - slider);
                if abs(g(k)) >= of.friction_limit_force
                    g(k) = of.friction_limit_force * sign(g(k));
                    slider = u(k) - g(k) / of.stiffness;
                end
            end
        end
    end
    f = f + of.force_direction * g;
end
csvwrite('{folder}/force.csv', f');
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    program = str(Path(parser.parse_args().program).resolve())
    worst = 0.0
    for name, (force, response, at, bank) in CASES.items():
        folder = Path(tempfile.mkdtemp())
        (folder / "bank.csv").write_text(HEAD + bank, encoding="utf-8")
        (folder / "scene.toml").write_text(SCENE.format(force=force, response=response, at=at), encoding="utf-8")
        subprocess.run([program, "run", "scene.toml", "--run", "run", "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        subprocess.run([program, "export", "run", "--contact", "nlvib", "-o", "x"], cwd=folder, check=True)
        rows = pq.read_table(folder / "run/iterations/wear_iteration=0/response.parquet").to_pydict()
        time = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
        found = {"displacement": np.zeros((SAMPLES, 3)), "force": np.zeros((SAMPLES, 3))}
        for k, axis in enumerate(rows["axis"]):
            if rows["element"][k] != 0:
                continue
            place, order = "xyn".index(axis), rows["harmonic"][k]
            # In the scene, positive n means approach. In the exported file, positive n means opening of the joint.
            sign = -1 if axis == "n" else 1
            for of, values in found.items():
                cosine, sine = (rows[f"{of}_{part}"][k] for part in ("cosine", "sine"))
                values[:, place] += sign * (cosine * np.cos(order * time) + sine * np.sin(order * time))
        np.savetxt(folder / "x/displacement.csv", found["displacement"], delimiter=",")
        stiffness = np.load(folder / "x/matrices.npz")["K"]
        np.savetxt(folder / "x/bare.csv", stiffness, delimiter=",")
        (folder / "test.m").write_text(OCTAVE.format(folder=folder / "x"), encoding="utf-8")
        subprocess.run(["octave-cli", "--quiet", str(folder / "test.m")], check=True)
        theirs = np.loadtxt(folder / "x/force.csv", delimiter=",")
        # Harmonics of the response.
        orders = sorted(set(rows["harmonic"]))
        spectrum = {of: np.fft.rfft(values, axis=0)[orders] for of, values in (("ours", found["force"]), ("theirs", theirs))}
        off = np.abs(spectrum["ours"] - spectrum["theirs"]).max() / np.abs(spectrum["ours"]).max()
        print(f"{name}: largest difference {off:.1e} of the largest force")
        worst = max(worst, off)
    return 0 if worst < 1e-3 else 1


if __name__ == "__main__":
    sys.exit(main())
