"""What `fretwear plan` says a run will cost, against what the run has cost, on scenes drawn at random.

    python tests/plan/rehearsed.py FRETWEAR [--each N] [--seed S] [--kind KIND] [--folder DIR]

For each kind of motion it draws N scenes, plans and runs them, and prints for iterations, FFT pairs and disk the share of scenes
that are within a factor of 1.5 of the expected number or within the printed range, those of which nothing is said, and the median width of
the range (most over least). It takes some minutes. Needs nothing but Python.
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

KINDS = ["straight", "orbit", "varying load", "history", "force", "torsion", "vibrating"]
FIGURES = {"iterations": "wear_iterations", "fft_pairs": "fft_pairs", "disk": "disk_bytes"}
FACTOR = 1.5
LONGEST = 120  # s; a run that takes longer is drawn again

STEEL = 'youngs_modulus = "198.4 GPa"\npoisson_ratio = 0.3\ndensity = "7949 kg/m^3"\n'

RESONATOR = """
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
force = {{ amplitude = "{force:.3g} N", at = "far_wall", direction = "x" }}
harmonics = [0, 1]
modes = 10
damping_ratio = {damping:.3g}
frequency = ["850 Hz", "1150 Hz"]
points = 3
"""

def log(draw, low, high):
    return math.exp(draw.uniform(math.log(low), math.log(high)))


def scene(draw, kind, folder, name):
    """The text of a scene: sizes, loads, motions and wear over one to three decades."""
    vibrates = kind == "vibrating"
    stepped = kind not in ("straight", "force", "vibrating")
    side = draw.randint(40, 72 if stepped or vibrates else 144)
    other = max(32, round(side * draw.uniform(0.7, 1.0)))
    size = (40.0, 36.0) if vibrates else (log(draw, 1, 20),) * 2
    lengths = side / draw.uniform(2.5, 8)
    rq = log(draw, 0.3, 4)
    area = size[0] * size[1] * 1e-6
    load = log(draw, 2e6, 6e7) * area
    if vibrates:
        load = log(draw, 1e4, 5e4)
    surface = draw.choice(["gaussian", "gaussian", "exponential"])
    text = f'[joint]\nsize = ["{size[0]:.4g} mm", "{size[1]:.4g} mm"]\ngrid = [{side}, {other}]\n'
    if vibrates:
        elements = draw.choice([9, 11])
        text += f"elements = [{elements}, {elements}]\n"
    text += f"[material]\n{STEEL}[surface]\nkind = \"{surface}\"\nrq = \"{rq:.3g} um\"\n"
    text += f'correlation_length = "{size[0] / lengths:.4g} mm"\nseed = {draw.randint(1, 999)}\n'
    text += f'[contact]\nfriction_coefficient = {draw.uniform(0.2, 0.8):.2g}\nnormal_load = "{load:.4g} N"\n'
    if draw.random() < 0.2:
        text += 'pressure_cap = "%.3g MPa"\n' % log(draw, 300, 2000)
    elif kind != "torsion" and not vibrates and draw.random() < 0.15:
        text += 'boundary = "periodic"\n'
    # A displacement at which such a joint slides all over, about.
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
    elif kind == "torsion":
        text += f'[motion]\nrotation = "{2 * reach / size[0] * 1e-3:.3g} rad"\n'
    else:
        text += RESONATOR.format(damping=log(draw, 0.003, 0.02), force=load * log(draw, 0.003, 0.03))
    cycles = round(log(draw, 3e4, 3e7 if not stepped else 3e6))
    text += f'[wear]\ncoefficient = "{log(draw, 5e2, 2e4):.3g} um^3/J"\ncycles = {cycles}\n'
    if draw.random() < 0.15 and not stepped:
        text += f'scheme = "explicit"\ndepth_step = "{rq * log(draw, 0.01, 0.1):.3g} um"\n'
    if vibrates and draw.random() < 0.5:
        text += f"[update]\nstiffness_change = {draw.choice([0.05, 0.1, 0.2])}\n"
    text += f"[fidelity]\npreset = \"{draw.choice(['balanced', 'balanced', 'fast'])}\"\n"
    if vibrates:
        text += "aft_samples = 64\n"
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
                print(f"{name}: drawn again: {error}", file=sys.stderr, flush=True)
                continue
            row = {"took": plan["seconds"]["rehearsal"], "seconds": ran["cost"]["seconds"]}
            run = plan["seconds"]["run"]
            row["expected seconds"] = run and run["contact"] + (run["response"] or 0.0)
            for figure, spent in FIGURES.items():
                row[figure] = (plan["cost"][figure], ran["cost"][spent])
            rows.append(row)
            words = [f"{name}: rehearsed {plan['cost']['rehearsed']} in {row['took']:.1f} s, ran {row['seconds']:.1f} s ({row['expected seconds'] or math.nan:.1f})"]
            for figure in FIGURES:
                expected, spent = row[figure]
                words.append(f"{figure} {spent:.0f} " + (f"({expected['least']:.0f} {expected['expected']:.0f} {expected['most']:.0f})" if expected else "(not said)"))
            print(", ".join(words), *plan["cost"]["not_rehearsed"], file=sys.stderr, flush=True)
    print("| motion | scenes | figure | refused | within 1.5 | in the range | either | median most/least | longest rehearsal / s |")
    print("|---|---|---|---|---|---|---|---|---|")
    for kind, rows in found.items():
        for figure in FIGURES:
            refused = within = held = either = 0
            widths = []
            for row in rows:
                expected, spent = row[figure]
                if not expected:
                    refused += 1
                    continue
                close = spent <= FACTOR * expected["expected"] and expected["expected"] <= FACTOR * spent
                inside = expected["least"] <= spent <= expected["most"]
                within, held, either = within + close, held + inside, either + (close or inside)
                if expected["least"] > 0:
                    widths.append(expected["most"] / expected["least"])
            width = f"{statistics.median(widths):.2f}" if widths else "-"
            longest = max((row["took"] for row in rows), default=0.0)
            print(f"| {kind} | {len(rows)} | {figure} | {refused} | {within} | {held} | {either} | {width} | {longest:.1f} |")


main()
