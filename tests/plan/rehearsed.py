"""Compares the cost that `fretwear plan` estimates with the cost of the run, on random scenes.

    python tests/plan/rehearsed.py FRETWEAR [--each N] [--seed S] [--kind KIND] [--folder DIR]

For each kind of motion the script draws N scenes, plans them and runs them. For iterations, FFT pairs, disk and seconds it prints the
number of scenes within the estimated range, the number of scenes without an estimate, and the median ratio of the upper to the lower bound.
The exit code is 1 if the FFT pairs of more than a tenth of the scenes lie outside their range. The script takes some minutes and needs
only Python.
"""

import argparse
import json
import math
import os
import random
import statistics
import subprocess
import sys
import tempfile

KINDS = ["straight", "orbit", "varying load", "history", "force", "torsion"]
FIGURES = {"iterations": "wear_iterations", "fft_pairs": "fft_pairs", "disk": "disk_bytes", "seconds": "seconds"}
LONGEST = 120  # s; the script replaces a scene whose run takes longer

STEEL = 'youngs_modulus = "198.4 GPa"\npoisson_ratio = 0.3\ndensity = "7949 kg/m^3"\n'


def log(draw, low, high):
    return math.exp(draw.uniform(math.log(low), math.log(high)))


def scene(draw, kind, folder, name):
    """Returns the text of a scene; sizes, loads, motions and wear vary over one to three decades."""
    stepped = kind not in ("straight", "force")
    side = draw.randint(40, 72 if stepped else 144)
    other = max(32, round(side * draw.uniform(0.7, 1.0)))
    size = (log(draw, 1, 20),) * 2
    lengths = side / draw.uniform(2.5, 8)
    rq = log(draw, 0.3, 4)
    area = size[0] * size[1] * 1e-6
    load = log(draw, 2e6, 6e7) * area
    surface = draw.choice(["gaussian", "gaussian", "exponential"])
    text = f'[joint]\nsize = ["{size[0]:.4g} mm", "{size[1]:.4g} mm"]\ngrid = [{side}, {other}]\n'
    text += f"[material]\n{STEEL}[surface]\nkind = \"{surface}\"\nrq = \"{rq:.3g} um\"\n"
    text += f'correlation_length = "{size[0] / lengths:.4g} mm"\nseed = {draw.randint(1, 999)}\n'
    text += f'[contact]\nfriction_coefficient = {draw.uniform(0.2, 0.8):.2g}\nnormal_load = "{load:.4g} N"\n'
    if draw.random() < 0.2:
        text += 'pressure_cap = "%.3g MPa"\n' % log(draw, 300, 2000)
    elif kind != "torsion" and draw.random() < 0.15:
        text += 'boundary = "periodic"\n'
    # Approximate displacement at which the whole joint slides.
    onset = 0.6 * load / (1.2e11 * math.sqrt(area)) * 1e6 + 0.1 * rq
    reach = onset * log(draw, 0.3, 6)
    if kind == "straight":
        text += f'[motion]\namplitude = "{reach:.3g} um"\n'
    elif kind == "orbit":
        text += f'[motion]\namplitude = ["{reach:.3g} um", "{reach * draw.uniform(0.3, 1):.3g} um"]\nphase = ["0 deg", "{draw.randint(40, 90)} deg"]\n'
    elif kind == "varying load":
        text += f'[motion]\namplitude = "{reach:.3g} um"\nnormal_load_amplitude = "{load * draw.uniform(0.1, 0.6):.4g} N"\n'
    elif kind == "history":
        rows = draw.choice([12, 16, 24])
        second, shift = draw.uniform(0, 0.5), draw.uniform(0, 6)
        lines = ["time,displacement_x,displacement_y"]
        for row in range(rows):
            t = 2 * math.pi * row / rows
            x = reach * 1e-6 * (math.cos(t) + second * math.cos(2 * t + shift))
            lines.append(f"{row / rows},{x:e},{0.5 * reach * 1e-6 * math.sin(t):e}")
        with open(os.path.join(folder, name + ".csv"), "w") as file:
            file.write("\n".join(lines) + "\n")
        text += f'[motion]\nhistory = "{name}.csv"\n'
    elif kind == "force":
        text += f'[motion]\nforce = "{load * draw.uniform(0.05, 0.18):.4g} N"\n'
    else:
        text += f'[motion]\nrotation = "{2 * reach / size[0] * 1e-3:.3g} rad"\n'
    cycles = round(log(draw, 3e4, 3e7 if not stepped else 3e6))
    text += f'[wear]\ncoefficient = "{log(draw, 5e2, 2e4):.3g} um^3/J"\ncycles = {cycles}\n'
    if draw.random() < 0.15 and not stepped:
        text += f'scheme = "explicit"\ndepth_step = "{rq * log(draw, 0.01, 0.1):.3g} um"\n'
    text += f"[fidelity]\npreset = \"{draw.choice(['balanced', 'balanced', 'fast'])}\"\n"
    text += f"[output]\ncurves_every = {draw.choice([0, 1, 10])}\n"
    return text


def told(program, *arguments):
    done = subprocess.run([program, *arguments, "--json"], capture_output=True, text=True, timeout=LONGEST)
    if done.returncode != 0:
        raise ValueError(done.stderr.strip().splitlines()[-1][:200])
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("--each", type=int, default=9)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", action="append", choices=KINDS)
    parser.add_argument("--folder")
    options = parser.parse_args()
    folder = options.folder or tempfile.mkdtemp()
    os.makedirs(folder, exist_ok=True)
    program = os.path.abspath(options.program)
    found = {}
    for kind in options.kind or KINDS:
        draw = random.Random(f"{options.seed} {kind}")
        rows = found.setdefault(kind, [])
        tried = 0
        while len(rows) < options.each and tried < 4 * options.each:
            tried += 1
            name = f"{kind.replace(' ', '_')}_{tried}"
            path = os.path.join(folder, name + ".toml")
            with open(path, "w") as file:
                file.write(scene(draw, kind, folder, name))
            try:
                plan = told(program, "plan", path)
                ran = told(program, "run", path, "--run", os.path.join(folder, name), "--quiet")
            except (ValueError, subprocess.TimeoutExpired) as error:
                print(f"{name}: replaced by another scene: {error}", file=sys.stderr, flush=True)
                continue
            planned = {**plan["cost"], "seconds": plan["seconds"]["run"]}
            row = {"took": plan["seconds"]["rehearsal"]}
            words = [f"{name}: {plan['cost']['coarse_run']} in {row['took']:.1f} s"]
            for figure, spent in FIGURES.items():
                expected, actual = row[figure] = (planned[figure], ran["cost"][spent])
                told_range = f"{expected['least']:.3g} {expected['expected']:.3g} {expected['most']:.3g}" if expected else "not known"
                words.append(f"{figure} {actual:.3g} ({told_range})")
            rows.append(row)
            print(", ".join(words), plan["cost"]["not_known"] or "", file=sys.stderr, flush=True)
    print("| motion | scenes | figure | not known | in the range | median most/least | longest rehearsal / s |")
    print("|---|---|---|---|---|---|---|")
    outside = 0
    for kind, rows in found.items():
        for figure in FIGURES:
            known = [row[figure] for row in rows if row[figure][0]]
            held = sum(expected["least"] <= actual <= expected["most"] for expected, actual in known)
            widths = [expected["most"] / expected["least"] for expected, _ in known if expected["least"] > 0]
            width = f"{statistics.median(widths):.2f}" if widths else "-"
            longest = max((row["took"] for row in rows), default=0.0)
            print(f"| {kind} | {len(rows)} | {figure} | {len(rows) - len(known)} | {held} | {width} | {longest:.1f} |")
            outside += len(rows) - held if figure == "fft_pairs" else 0
    scenes = sum(map(len, found.values()))
    print(f"FFT pairs of {scenes - outside} of {scenes} scenes lie in their range")
    sys.exit(10 * outside > scenes)


main()
