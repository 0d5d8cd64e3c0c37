"""Draws small random scenes of fretting wear, as TOML for the program, with the surface as NPY in the same folder.

    python draw.py --kind orbit --seed 1 --n 4 --into FOLDER [--cells 16 38] [--ratio LOW HIGH] [--worn LOW HIGH] [--touching LOW HIGH]

Kinds: line, orbit (an ellipse of any phase), load (the normal load varies, along a line or an orbit), force (prescribed instead of the
displacement), torsion (a rotation about z, or a moment, possibly with a displacement), history (a table of a cycle).
The scenes have 16..32 x 18..38 cells that are not square, a Gaussian surface of Rq 0.5..10 um with a correlation length of 2..8 cells, a
load under which 5..80 % of the cells touch, and a friction coefficient of 0.2..0.9. The amplitude is a random multiple of the sliding
displacement, mu N over the stiffness of the stuck joint; --ratio sets its range. The number of cycles is chosen so that, at the rate of
the first cycle, the cells in contact wear by 0.05..1 Rq on average. The same kind and seed give the same scene.
"""

import argparse
import math
import pathlib

import numpy as np

import dense

KINDS = ("line", "orbit", "load", "force", "torsion", "history")
YOUNGS_MODULUS, POISSON_RATIO = 198.4e9, 0.3


def gaussian(random, grid, size, correlation):
    """Heights with Rq 1, mean 0 and the autocorrelation exp(-(x/clx)^2 - (y/cly)^2): a sum of random waves."""
    x = (np.arange(grid[0]) + 0.5) * size[0] / grid[0]
    y = (np.arange(grid[1]) + 0.5) * size[1] / grid[1]
    heights = np.zeros(grid)
    for _ in range(400):
        kx, ky = random.normal(0.0, math.sqrt(2.0), 2) / correlation
        phase = random.uniform(0.0, 2 * math.pi)
        heights += np.cos(kx * x[:, None] + ky * y[None, :] + phase)
    heights -= heights.mean()
    return heights / heights.std()


def load_of_area(joint, fraction):
    """Load under which this fraction of the cells touches, by bisection of its logarithm."""
    low, high = None, None
    load = 1e-3 * joint.cell / joint.normal[0, 0] * joint.heights.std() * len(joint.heights)
    for _ in range(40):
        touching = (joint.press(joint.heights, load, "drawn").pressure > 0).mean()
        if touching < fraction:
            low, load = load, load * 4 if high is None else math.sqrt(load * high)
        else:
            high, load = load, load / 4 if low is None else math.sqrt(load * low)
        if low and high and high / low < 1.02:
            break
    return load


def drawn(kind, seed, cells=(16, 38), ratio=None, worn=None, touching=None):
    """Returns the scene as TOML, the heights in um, the table of a history or None, and the mean depth to wear in m."""
    random = np.random.default_rng([KINDS.index(kind), seed])
    while True:
        nx = int(random.integers(max(cells[0], 16), min(cells[1], 32) + 1))
        ny = int(random.integers(max(cells[0], 18), min(cells[1], 38) + 1))
        if nx != ny:
            break
    grid = (nx, ny)
    dx = float(f"{math.exp(random.uniform(math.log(20e-6), math.log(200e-6))):.3g}")
    dy = float(f"{dx * random.choice([random.uniform(0.6, 0.9), random.uniform(1.1, 1.7)]):.3g}")
    size = (nx * dx, ny * dy)
    rq = math.exp(random.uniform(math.log(0.5), math.log(10.0)))  # um
    correlation = random.uniform(2, 8, 2) * (dx, dy)
    heights = rq * gaussian(random, grid, size, correlation)
    mu = round(random.uniform(0.2, 0.9), 3)
    area = math.exp(random.uniform(*np.log(touching or (0.05, 0.8))))
    tilts = random.random() < 0.25
    has_cap = random.random() < 0.2
    part = math.exp(random.uniform(*np.log(ratio or (0.2, 4.0))))
    worn = math.exp(random.uniform(*np.log(worn or (0.05, 1.0))))  # in Rq

    contact = {"friction_coefficient": mu, "normal_load": 1.0, "rotation": "free" if tilts else "fixed"}
    rest = dense.Drive(("displacement",) * 3, lambda t: 0 * t, (lambda t: 0 * t,) * 3, True, True)
    joint = dense.Joint(grid, size, heights * 1e-6, (YOUNGS_MODULUS, POISSON_RATIO), contact, rest)
    joint.load = load = float(f"{load_of_area(joint, area):.4g}")
    pressed = joint.press(joint.heights, load)
    cap = None
    if has_cap:
        cap = float(f"{max(0.7 * pressed.pressure.max(), 1.3 * load / joint.cell / len(joint.heights)):.3g}")
        joint.cap = cap
        pressed = joint.press(joint.heights, load, "capped")
    borne = np.flatnonzero(pressed.pressure > 0)
    stuck = np.concatenate([borne, borne + len(joint.heights)])
    xx, xy, yy = joint.tangential
    matrix = np.block([[xx, xy], [xy, yy]])[np.ix_(stuck, stuck)]
    modes = joint.modes_of_motion(borne)
    stiffness = modes.T @ np.linalg.solve(matrix, modes) * joint.cell
    bound = mu * pressed.pressure[borne] * joint.cell
    slide = mu * load / np.array([stiffness[0, 0], stiffness[1, 1]])
    arms = np.hypot(joint.x[borne], joint.y[borne])
    turn = (bound * arms).sum() / stiffness[2, 2]

    motion, table = {}, None
    um = 1e6
    phase = round(random.uniform(0.0, 360.0), 1)
    second = round(random.uniform(15.0, 165.0), 1)
    minor = random.uniform(0.2, 1.0)
    turned = random.random() < 0.5

    def along(amplitudes, name="amplitude", unit="um"):
        a, b = amplitudes[::-1] if turned else amplitudes
        motion[name] = f'["{a:.6g} {unit}", "{b:.6g} {unit}"]'

    if kind == "line":
        along((part * slide.mean() * um, 0.0))
    elif kind == "orbit":
        along((part * slide.mean() * um, part * minor * slide.mean() * um))
        motion["phase"] = f'["0 deg", "{second} deg"]'
    elif kind == "load":
        motion["normal_load_amplitude"] = f'"{load * random.uniform(0.1, 0.7):.4g} N"'
        if random.random() < 0.5:
            along((part * slide.mean() * um, 0.0))
            motion["phase"] = f'"{phase} deg"'
        else:
            along((part * slide.mean() * um, part * minor * slide.mean() * um))
            motion["phase"] = f'["{phase} deg", "{(phase + second) % 360:.1f} deg"]'
    elif kind == "force":
        near = mu * load * random.choice([random.uniform(0.4, 0.9), random.uniform(0.9, 0.99)])
        if random.random() < 0.5:
            along((near, 0.0), "force", "N")
        else:  # the largest force of the ellipse is below `near`
            around = np.exp(1j * np.linspace(0.0, 2 * math.pi, 720))
            largest = np.hypot(around.real, minor * (around * np.exp(1j * math.radians(second))).real).max()
            along((near / largest, minor * near / largest), "force", "N")
            motion["phase"] = f'["0 deg", "{second} deg"]'
    elif kind == "torsion":
        choice = random.integers(3)
        if choice == 0:
            motion["rotation"] = f'"{part * turn:.6g} rad"'
        elif choice == 1:
            motion["moment"] = f'"{(bound * arms).sum() * random.uniform(0.3, 0.75):.6g} N m"'
        else:
            motion["rotation"] = f'"{part * turn:.6g} rad"'
            along((part * minor * slide.mean() * um, 0.0))
    elif kind == "history":
        rows = 128
        t = np.arange(rows) / rows
        x, y = np.zeros(rows), np.zeros(rows)
        for harmonic in (1, 2, 3):
            for course in (x, y):
                size_of = random.normal() / harmonic**1.5
                course += size_of * np.cos(2 * math.pi * (harmonic * t + random.uniform()))
        scale = part * slide.mean() / np.hypot(x - x.mean(), y - y.mean()).max()
        normal = np.full(rows, load)
        if random.random() < 0.5:
            normal *= 1 + random.uniform(0.1, 0.5) * np.sin(2 * math.pi * (t + random.uniform()))
        table = np.column_stack([t, scale * (x - x.mean()), scale * (y - y.mean()), normal])
        motion["history"] = '"HISTORY"'

    # A first cycle with few samples determines the number of cycles.
    lines = [
        f'title = "{kind} {seed}: drawn, {len(borne) / len(joint.heights):.0%} touching, {part:.3g} of sliding"',
        "",
        "[joint]",
        f'size = ["{size[0] * 1e6:.9g} um", "{size[1] * 1e6:.9g} um"]',
        f"grid = [{nx}, {ny}]",
        "",
        "[material]",
        f'youngs_modulus = "{YOUNGS_MODULUS / 1e9} GPa"',
        f"poisson_ratio = {POISSON_RATIO}",
        "",
        "[surface]",
        'kind = "file"',
        'path = "SURFACE"',
        'unit = "um"',
        f'spacing = ["{dx * 1e6:.9g} um", "{dy * 1e6:.9g} um"]',
        'detrend = "none"',
        "",
        "[contact]",
        f"friction_coefficient = {mu}",
        f'normal_load = "{load} N"',
        *([f'pressure_cap = "{cap} Pa"'] if cap else []),
        f'rotation = "{contact["rotation"]}"',
        "",
        "[motion]",
        *(f"{key} = {value}" for key, value in motion.items()),
        "",
        "[wear]",
        'coefficient = "2000 um^3/J"',
        "cycles = CYCLES",
        "",
    ]
    return "\n".join(lines), heights, table, worn * rq * 1e-6


def write(kind, seed, folder, cells=(16, 38), ratio=None, worn=None, touching=None):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{kind}_{seed}"
    text, heights, table, depth = drawn(kind, seed, cells, ratio, worn, touching)
    np.save(folder / f"{name}.npy", heights)
    if table is not None:
        header = "time,displacement_x,displacement_y,normal_load"
        np.savetxt(folder / f"{name}.csv", table, fmt="%.17g", delimiter=",", header=header, comments="")
    text = text.replace("SURFACE", f"{name}.npy").replace("HISTORY", f"{name}.csv")
    path = folder / f"{name}.toml"
    path.write_text(text.replace("CYCLES", "1"), encoding="utf-8")
    joint = dense.Joint.read(path)
    cycle = joint.cycle(joint.heights, 48, tolerance=1e-3)
    worn = joint.wear["coefficient"] * cycle.energy[cycle.energy > 0].mean()
    cycles = max(int(float(f"{depth / worn:.3g}")), 1)
    path.write_text(text.replace("CYCLES", str(cycles)), encoding="utf-8")
    joint.wear["cycles"] = cycles
    return path, joint, cycle


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kind", choices=KINDS, required=True)
    parser.add_argument("--seed", type=int, default=1, help="seed of the first scene; the next scenes have the following seeds")
    parser.add_argument("--n", type=int, default=1)
    parser.add_argument("--into", default="cases")
    parser.add_argument("--cells", type=int, nargs=2, default=(16, 38), help="fewest and most cells along an axis")
    parser.add_argument("--ratio", type=float, nargs=2, help="range of the amplitude over the sliding displacement")
    parser.add_argument("--worn", type=float, nargs=2, help="range of the mean worn depth over Rq, at the first rate")
    parser.add_argument("--touching", type=float, nargs=2, help="range of the fraction of cells that touch")
    options = parser.parse_args()
    for seed in range(options.seed, options.seed + options.n):
        path, joint, cycle = write(options.kind, seed, options.into, options.cells, options.ratio, options.worn, options.touching)
        print(
            path,
            joint.grid,
            f"{(cycle.energy > 0).sum()} cells dissipate {cycle.energy.sum() * joint.cell:.4g} J, {cycle.marches} marches,",
            f"{joint.wear['cycles']} cycles",
            flush=True,
        )


if __name__ == "__main__":
    main()
