#!/usr/bin/env python3
"""Compares rough normal contact with tamaas and ContactMechanics on the same surfaces.

    python tests/peers/contact.py target/release/fretwear [--repeats 5] [--case NAME] [FOLDER]

The script generates the surfaces. `fretwear run` of a static contact, tamaas (Polonsky-Keer, elastic only) and ContactMechanics
(Polonsky-Keer, elastic and with a hardness) press each surface in turn, on one thread, to a tight tolerance. With free edges, all three
programs convolve with the same cell-integrated kernel. With periodic edges, they use the same symbol 2 / (E* |k|) without its mean. The
script prints the differences of pressure, area and approach, the median wall times, and the ratio to the time of fretwear in the same
round. The script fails if a pressure differs by more than 1e-6 of the largest pressure. An error message names missing packages.
Surfaces and runs go into FOLDER, or into a temporary folder.
"""

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

# One thread for every program. The libraries read this variable when they are loaded.
os.environ["OMP_NUM_THREADS"] = "1"

PACKAGES = ["numpy", "scipy", "pyarrow", "tamaas==2.9.0", "ContactMechanics==1.8.3"]

try:
    import numpy as np
    import pyarrow.parquet as pq
    import tamaas
    from ContactMechanics import FreeFFTElasticHalfSpace, PeriodicFFTElasticHalfSpace
    from ContactMechanics.Optimization.ConstrainedConjugateGradients import constrained_conjugate_gradients
    from SurfaceTopography import Topography
except ImportError as error:
    sys.exit(
        f"{error}: this script needs Python packages for the comparison; in a separate environment, run\n"
        f"    pip install {' '.join(PACKAGES)}"
    )

SCENE = Path(__file__).resolve().parents[2] / "pipelines" / "static_contact.toml"

SIZE = (40e-3, 30e-3)  # m
LOAD = 30e3  # N
YOUNGS_MODULUS, POISSON_RATIO = 198.4e9, 0.3  # Pa, 1; of both bodies, as the scene has it
MODULUS = YOUNGS_MODULUS / (2.0 * (1.0 - POISSON_RATIO**2))

# All programs solve the same discrete problem. The solvers stop at about 1e-9 of the largest pressure. The condition number of the contact
# set relates the error of the pressure to the error of the gap.
SAME = 1e-6
OUR_TOLERANCE = 1e-9
TAMAAS_TOLERANCE = 1e-10
# Tolerance relative to the displacement of one cell under the peak pressure, to its force, and to the approach.
CONTACT_MECHANICS_TOLERANCE = 1e-8
MAX_ITERATIONS = 5000


def fourier_surface(cells, seed, amplitude):
    """Returns white noise filtered by `amplitude(kx, ky)`, with zero mean and unit variance."""
    noise = np.fft.fft2(np.random.default_rng(seed).standard_normal(cells))
    kx, ky = (2.0 * np.pi * np.fft.fftfreq(n, length / n) for n, length in zip(cells, SIZE))
    heights = np.fft.ifft2(noise * amplitude(kx[:, None], ky[None, :])).real
    heights -= heights.mean()
    return heights / heights.std()


def gaussian(length_x, length_y):
    """Returns the amplitudes for the autocorrelation exp(-(x/lx)^2 - (y/ly)^2): the square root of its spectrum."""
    return lambda kx, ky: np.exp(-((kx * length_x) ** 2 + (ky * length_y) ** 2) / 8.0)


def self_affine(hurst, longest):
    """Returns amplitudes with a power law below the longest wavelength and a plateau above."""
    return lambda kx, ky: np.maximum(np.hypot(kx, ky), 2.0 * np.pi / longest) ** -(1.0 + hurst)


@dataclass
class Case:
    name: str
    cells: tuple
    rq: float  # m
    amplitude: object
    seed: int
    boundary: str = "free"
    cap: float = math.inf  # Pa

    def heights(self):
        return self.rq * fourier_surface(self.cells, self.seed, self.amplitude)


ROUND = gaussian(0.5e-3, 0.5e-3)
# Ridges along x.
LONG = gaussian(2e-3, 0.4e-3)
FRACTAL = self_affine(0.8, 8e-3)
# tamaas and ContactMechanics also support rectangular grids.
CASES = [
    Case("rq5", (256, 256), 5e-6, ROUND, 11),
    Case("rq5-periodic", (256, 256), 5e-6, ROUND, 11, "periodic"),
    Case("rq0.5", (256, 256), 0.5e-6, ROUND, 12),
    Case("rq0.5-periodic", (256, 256), 0.5e-6, ROUND, 12, "periodic"),
    Case("self-affine", (192, 160), 2e-6, FRACTAL, 13),
    Case("self-affine-periodic", (192, 160), 2e-6, FRACTAL, 13, "periodic"),
    Case("ridges", (160, 250), 1e-6, LONG, 14),
    Case("ridges-periodic", (160, 250), 1e-6, LONG, 14, "periodic"),
    Case("rq5-capped", (256, 256), 5e-6, ROUND, 11, cap=600e6),
    Case("rq0.5-capped-periodic", (192, 160), 0.5e-6, ROUND, 12, "periodic", 200e6),
]


@dataclass
class Solution:
    program: str
    pressure: object  # Pa
    approach: float  # m
    seconds: float
    work: str


def fretwear(case, heights, program, folder):
    """Solves a case in a separate run."""
    np.save(folder / "heights.npy", heights * 1e3)
    with tempfile.TemporaryDirectory(dir=folder) as run:
        sets = [
            "surface.kind=file",
            f"surface.path={folder / 'heights.npy'}",
            "surface.unit=mm",
            "surface.detrend=none",
            f"joint.grid={list(case.cells)}",
            f"joint.size=['{SIZE[0]} m', '{SIZE[1]} m']",
            f"contact.normal_load={LOAD} N",
            f"contact.boundary={case.boundary}",
            f"fidelity.normal_tolerance={OUR_TOLERANCE}",
        ]
        if math.isfinite(case.cap):
            sets.append(f"contact.pressure_cap={case.cap} Pa")
        command = [program, "run", str(SCENE), "--run", str(Path(run) / "run"), "--json", "--quiet"]
        command += [word for key in sets for word in ("--set", key)]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        summary = json.loads(done.stdout)
        iteration = Path(run) / "run" / "iterations" / "wear_iteration=0"
        field = pq.read_table(iteration / "contact_field.parquet")
        timing = pq.read_table(iteration / "timing.parquet").to_pylist()
    pressure = np.zeros(case.cells)
    pressure[field["i"].to_numpy(), field["j"].to_numpy()] = field["pressure"].to_numpy()
    # Stiffness and curves, which the other programs do not compute, belong to the stage and have a separate row.
    (solve,) = (row for row in timing if row["stage"] == "static_contact")
    work = f"{summary['normal_iterations']} iterations, {solve['fft_pairs']:.0f} pairs"
    return Solution("fretwear", pressure, summary["approach"], solve["seconds"], work)


def contact_mechanics(case, heights, ours):
    kind = PeriodicFFTElasticHalfSpace if case.boundary == "periodic" else FreeFFTElasticHalfSpace
    substrate = kind(case.cells, MODULUS, SIZE)
    topography = Topography(heights, SIZE)
    cell_area = substrate.area_per_pt
    peak = ours.pressure.max()
    started = time.perf_counter()
    found = constrained_conjugate_gradients(
        substrate,
        topography,
        external_force=LOAD,
        hardness=case.cap * cell_area if math.isfinite(case.cap) else None,
        pentol=CONTACT_MECHANICS_TOLERANCE * peak * math.sqrt(cell_area) / MODULUS,
        forcetol=CONTACT_MECHANICS_TOLERANCE * peak * cell_area,
        thermotol=CONTACT_MECHANICS_TOLERANCE,
        maxiter=MAX_ITERATIONS,
    )
    seconds = time.perf_counter() - started
    if not found.success:
        return None
    # Two FFT pairs per iteration.
    work = f"{found.nit} iterations, {found.nfev} pairs"
    pressure = np.asarray(found.jac) / cell_area
    approach = float(found.offset)
    if case.boundary == "periodic":
        # ContactMechanics gives the mean pressure the compliance of the longest wave. fretwear and tamaas give it no compliance.
        approach -= float(found.x.mean())
    return Solution("ContactMechanics", pressure, approach, seconds, work)


def by_tamaas(case, heights, ours):
    if math.isfinite(case.cap):
        # The tamaas solver for a largest pressure (Kato) does not reach a tight tolerance.
        return None
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, list(SIZE), list(case.cells))
    model.E, model.nu = MODULUS, 0.0
    solver = tamaas.PolonskyKeerRey(model, heights, TAMAAS_TOLERANCE)
    if case.boundary == "free":
        tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
        solver.setIntegralOperator("dcfft")
    solver.max_iter = MAX_ITERATIONS
    started = time.perf_counter()
    error = solver.solve(LOAD / (SIZE[0] * SIZE[1]))
    seconds = time.perf_counter() - started
    if not error <= TAMAAS_TOLERANCE:
        return None
    pressure = np.array(model.traction)
    # The displacement of the solver is relative to the surface, so the approach follows from the pressure.
    if case.boundary == "free":
        displacement = np.zeros(case.cells)
        model.operators["dcfft"](pressure, displacement)
    else:
        model.solveNeumann()
        displacement = np.array(model.displacement)
    touching = pressure > 0.0
    approach = float((displacement - heights)[touching].mean())
    return Solution("tamaas", pressure, approach, seconds, "")


def compare(case, arguments, folder):
    """Solves one case with every program in turn and returns the largest difference of pressure."""
    heights = case.heights()
    ours = None
    found = {}
    for _ in range(arguments.repeats):
        ours = fretwear(case, heights, arguments.program, folder)
        for solution in (ours, by_tamaas(case, heights, ours), contact_mechanics(case, heights, ours)):
            if solution is not None:
                found.setdefault(solution.program, []).append(solution)
    # fretwear balances the load to rounding, independently of the other programs.
    balance = ours.pressure.mean() * SIZE[0] * SIZE[1] / LOAD - 1.0
    assert abs(balance) < 1e-12, f"{case.name}: the relative error of the load of fretwear is {balance:+.1e}"
    peers = [name for name in found if name != ours.program]
    if not peers:
        sys.exit(f"{case.name}: no other program converged")
    largest = 0.0
    for name, solutions in found.items():
        peer = solutions[-1]
        difference = np.abs(peer.pressure - ours.pressure).max() / ours.pressure.max()
        area = (peer.pressure > 0.0).mean()
        seconds = statistics.median(solution.seconds for solution in solutions)
        relative = (peer.approach - ours.approach) / abs(ours.approach)
        # Ratios within one round, because other work of the machine slows all programs.
        times = statistics.median(b.seconds / a.seconds for a, b in zip(found[ours.program], solutions))
        shown = "        -          -" if peer is ours else f"{difference:9.1e} {relative:+10.1e}"
        print(f"{case.name:22s} {name:17s} {shown} {100 * area:8.4f} {seconds:9.3f} {times:6.1f}  {peer.work}", flush=True)
        if peer is not ours:
            largest = max(largest, difference)
    return largest


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the fretwear program")
    parser.add_argument("folder", nargs="?", metavar="FOLDER", help="folder of the surfaces and runs")
    parser.add_argument("--repeats", type=int, default=1, help="number of rounds; times are medians [default: %(default)s]")
    parser.add_argument("--case", action="append", help="run only this case; may be repeated")
    arguments = parser.parse_args()
    arguments.program = str(Path(arguments.program).resolve())
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.folder or temporary).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        tamaas.set_log_level(tamaas.LogLevel.error)
        tamaas.initialize(1)
        cases = [case for case in CASES if not arguments.case or case.name in arguments.case]
        if not cases:
            sys.exit("no such case; the cases are " + ", ".join(case.name for case in CASES))
        print(f"{'case':22s} {'program':17s} {'max|dp|':>9s} {'approach':>10s} {'area [%]':>8s} {'time [s]':>9s} {'times':>6s}  work")
        largest = max(compare(case, arguments, folder) for case in cases)
    print(f"largest difference {largest:.1e} of the largest pressure, {SAME:.0e} allowed")
    if not largest <= SAME:
        sys.exit("the programs disagree")


if __name__ == "__main__":
    main()
