#!/usr/bin/env python3
"""Compares forced responses of small friction oscillators with pyHarm.

    python tests/peers/pyharm.py --program target/release/fretwear [--all] [FOLDER]

The script needs the packages pyHarm-os and pyarrow. Each case is a scene. `fretwear run` and pyHarm solve the same oscillator at the
same frequencies, harmonics and samples per cycle, from the same start of the slider. The script prints some points of both solutions
(all points with --all) and the largest differences of all harmonics along all driven axes and of the energies per cycle. Scenes and
runs go into FOLDER, or into a temporary folder.

Where both programs have the same law, they agree within the tolerance of Newton's method. The programs differ in two ways, and the cases
use only the common features:

- pyHarm turns the friction force towards the motion once per sample (an error of first order in the time step). fretwear integrates the
  turn over the step (second order). On the orbit, the script extrapolates pyHarm from two numbers of samples. pyHarm also computes three
  cycles to the steady cycle, which are too few for an element with little slip. The frequency range of the orbit excludes such elements.
- The three-dimensional element of pyHarm does not open. Without load, its normal force jumps to zero instead of minus the preload, and
  the friction remains. Without preload, the element has no friction. The cases of opening therefore use only the normal direction, with
  pyHarm's unilateral spring, preloaded by a gap below zero and a constant force.

pyHarm does not compute energies. The script computes the energies from its harmonics. The friction energy is the input minus the energy
of the dampers.
"""

import argparse
import cmath
import importlib
import json
import logging
import math
import os
import subprocess
import sys
import tempfile
import time
import warnings
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

# The oscillator of all cases, unless a case changes it.
MASS = 1.0  # kg
STIFFNESS = (4.0e4, 3.5e4, 5.0e4)  # N/m
KT, KN, MU = 2.0e4, 3.0e4, 0.5  # N/m, N/m, 1
CUBIC = 1.0e10  # N/m^3
LIGHT = (4.0, 4.0, 4.0)  # N s/m
# Opening bends the resonance. With this damping, each frequency still has one response.
HEAVY = (4.0, 4.0, 60.0)  # N s/m
HARMONICS = 5
SAMPLES = 512
AXES = "xyz"
ENERGIES = ("input", "friction", "viscous")

# Both programs solve the same algebraic equations, fretwear to a relative correction of 1e-7.
SAME = 5e-7
# Largest residual of an accepted pyHarm solution [N]. pyHarm reports "converged" for every first point.
SOLVED = 1e-8
# Tolerance on the orbit: the error of the extrapolation and of fretwear's samples.
EXTRAPOLATED = 5e-5
# Samples for a stop, which touches during a short part of the cycle.
KINK_SAMPLES = 4096


@dataclass
class Force:
    amplitude: float  # N
    direction: str
    phase: float = 0.0  # degrees, lead


@dataclass
class Case:
    name: str
    what: str
    forces: list
    element: dict
    """Contact element of pyHarm, or a spring."""
    response: str = "x"
    frequency: tuple = (30.0, 42.0)  # Hz
    points: int = 61
    damping: tuple = LIGHT
    normal_load: float = 10.0  # N
    gap: float = 0.0  # m
    samples: int = SAMPLES
    opens_along_z: bool = False
    """For pyHarm's element, a positive normal displacement opens the contact."""
    constant_force: float = 0.0
    """Constant force along z, only for pyHarm [N]."""
    extrapolate: bool = False
    tolerance: float = SAME
    springs: str = ""
    """Keys of springs to the ground, instead of a contact."""
    harmonics: list = field(default_factory=lambda: list(range(HARMONICS + 1)))


JENKINS = {"type": "Jenkins", "mu": MU, "N0": 10.0, "k": KT}
PENALTY_3D = {"type": "Penalty3D", "dirs": [2, 0, 1], "mu": MU, "N0": 10.0, "g": 0.0, "k_n": KN, "k_t": KT}
UNILATERAL = {"type": "PenaltyUnilateralGap", "dirs": [2], "k": KN}

CASES = [
    Case(
        "stick_slip",
        "one direction, constant load: below, at and above the onset of slip",
        [Force(5.0, "x")],
        JENKINS | {"dirs": [0]},
    ),
    Case(
        "full_slip",
        "one direction, constant load: slips through at the resonance",
        [Force(8.0, "x")],
        JENKINS | {"dirs": [0]},
    ),
    Case(
        "varying_load",
        "tangential and normal force with a lag: friction limit and slip vary together, nothing opens",
        [Force(5.0, "x"), Force(3.0, "z", 40.0)],
        PENALTY_3D,
        opens_along_z=True,
    ),
    Case(
        "orbit",
        "two tangential forces with a lag, constant load: the friction force turns",
        [Force(5.0, "x"), Force(4.0, "y", -70.0)],
        JENKINS | {"dirs": [0, 1]},
        frequency=(32.0, 39.0),
        points=29,
        samples=1024,
        extrapolate=True,
        tolerance=EXTRAPOLATED,
    ),
    Case(
        "gap",
        "normal direction alone: open at rest, closes in the cycle",
        [Force(24.0, "z")],
        UNILATERAL | {"g": 3.0e-4},
        response="z",
        frequency=(30.0, 60.0),
        damping=HEAVY,
        normal_load=0.0,
        gap=3.0e-4,
    ),
    Case(
        "lift_off",
        "normal direction alone: preloaded, opens in the cycle",
        [Force(12.0, "z")],
        UNILATERAL | {"g": -10.0 / KN},
        response="z",
        frequency=(30.0, 60.0),
        damping=HEAVY,
        constant_force=10.0,
    ),
    Case(
        "cubic_spring",
        "cubic springs along two axes: the resonance leans over to higher frequencies",
        [Force(2.0, "x"), Force(1.0, "y", 25.0)],
        {"type": "CubicSpring", "dirs": [0, 1], "k": CUBIC},
        frequency=(28.0, 40.0),
        damping=(24.0, 24.0, 24.0),
        springs=f'cubic_stiffness = ["{CUBIC} N/m^3", "{CUBIC} N/m^3", "0 N/m^3"]',
        harmonics=list(range(8)),
    ),
    Case(
        "stop",
        "a one-sided spring across a gap, along the second axis alone",
        [Force(3.0, "y"), Force(2.0, "x", -50.0)],
        {"type": "PenaltyUnilateralGap", "dirs": [1], "k": KN, "g": 2.0e-4},
        response="y",
        frequency=(24.0, 40.0),
        damping=(24.0, 24.0, 24.0),
        springs=f'stop_stiffness = ["0 N/m", "{KN} N/m", "0 N/m"]\nstop_gap = ["0 m", "2e-4 m", "0 m"]',
        samples=KINK_SAMPLES,
        harmonics=list(range(8)),
    ),
]


def scene(case, response):
    """Returns the scene of a case with this axis of the response, as TOML."""
    forces = ", ".join(
        f'{{ amplitude = "{force.amplitude} N", direction = "{force.direction}", phase = "{force.phase} deg" }}'
        for force in case.forces
    )

    def three(values, unit):
        return json.dumps([f"{value} {unit}" for value in values])

    preload = f'normal_load = "{case.normal_load} N"' if case.gap == 0.0 else f'gap = "{case.gap} m"'
    contact = f"""\
[contact]
kt = "{KT} N/m"
kn = "{KN} N/m"
friction_coefficient = {MU}
{preload}"""
    return f"""\
title = "{case.what}"
[structure]
kind = "oscillator"
mass = "{MASS} kg"
damping = {three(case.damping, "N s/m")}
stiffness = {three(STIFFNESS, "N/m")}
{case.springs or contact}
[dynamics]
force = [{forces}]
response = {{ direction = "{response}" }}
harmonics = {case.harmonics}
frequency = ["{case.frequency[0]} Hz", "{case.frequency[1]} Hz"]
points = {case.points}
[fidelity]
aft_samples = {case.samples}
"""


def by_fretwear(program, case, folder):
    """Runs fretwear and returns frequencies [Hz], complex amplitudes [m] by axis, frequency and harmonic, and energies [J]."""
    amplitudes, energies = {}, None
    for response in driven(case):
        name = f"{case.name}_{response}"
        (folder / f"{name}.toml").write_text(scene(case, response), encoding="utf-8")
        command = [program, "run", f"{name}.toml", "--run", name, "--json", "--quiet"]
        subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        path = folder / name / "iterations" / "wear_iteration=0"
        table = pq.ParquetFile(path / "frf.parquet").read()
        frequency = table.column("frequency").to_numpy()
        order = np.argsort(frequency)
        assert len(order) == case.points, f"{path} has {len(order)} points of {case.points}"
        rows = pq.ParquetFile(path / "frf_harmonic.parquet").read()
        row, harmonic, cosine, sine = (
            rows.column(name).to_numpy() for name in ("row", "harmonic", "displacement_cosine", "displacement_sine")
        )
        found = np.zeros((case.points, len(case.harmonics)), complex)
        found[row, np.searchsorted(case.harmonics, harmonic)] = cosine - 1j * sine
        amplitudes[response] = found[order]
        if response == case.response:
            energies = {name: table.column(f"{name}_energy").to_numpy()[order] for name in ENERGIES}
    return frequency[order], amplitudes, energies


def driven(case):
    """Returns the axes of the forces, beginning with the axis of the response."""
    return sorted({force.direction for force in case.forces}, key=lambda axis: (axis != case.response, axis))


def load_pyharm(folder):
    """Loads pyHarm in `folder`, where pyHarm writes settings. Some elements use JAX, which needs a switch for 64 bits."""
    os.environ["JAX_ENABLE_X64"] = "1"
    os.environ["HOME"] = str(folder)
    os.chdir(folder)
    warnings.filterwarnings("ignore", message=".*is faster on contiguous arrays.*")
    logging.disable(logging.CRITICAL)
    return importlib.import_module("pyHarm")


def pyharm_problem(case, samples, frequencies):
    """Returns the input of pyHarm: one node with three degrees of freedom, its forces and its contact to the ground."""
    at = {"mass": [0]}
    connectors = {"contact": case.element | {"connect": dict(at)}}
    if case.constant_force:
        connectors["constant"] = {
            "type": "GOForcing", "connect": dict(at), "dirs": [2], "ho": 0, "dto": 0, "amp": case.constant_force,
        }
    for number, force in enumerate(case.forces):
        axis = AXES.index(force.direction)
        sign = -1.0 if case.opens_along_z and axis == 2 else 1.0
        connectors[f"force_{number}"] = {
            "type": "GOForcing", "connect": dict(at), "dirs": [axis], "ho": 1, "dto": 0,
            # pyHarm applies cos(phi) cos(wt) + sin(phi) sin(wt), so phi is a lag.
            "amp": sign * force.amplitude, "phi": -math.radians(force.phase),
        }
    matrices = {"M": MASS * np.eye(3), "C": np.diag(case.damping), "K": np.diag(STIFFNESS)}
    return {
        "system": {"type": "Base", "nh": case.harmonics[-1], "nti": samples},
        "substructures": {"mass": {"matrix": matrices, "ndofs": 3}},
        "connectors": connectors,
        "analysis": {
            "response": {
                "study": "frf",
                "verbose": False,
                "solver": "scipyroot",
                "solver_options": {"root": {"method": "hybr", "options": {"xtol": 1e-12, "maxfev": 2000}}},
                "puls_inf": math.tau * frequencies[0],
                "puls_sup": math.tau * frequencies[-1],
            }
        },
    }


def by_pyharm(pyharm, case, samples, frequencies):
    """Returns complex amplitudes [m] by axis, frequency and harmonic."""
    maestro = pyharm.Maestro(pyharm_problem(case, samples, frequencies))
    analysis = maestro.nls["response"]
    dofs = maestro.system.expl_dofs

    def place(axis, harmonic, part):
        return dofs[(dofs["harm"] == harmonic) & (dofs["dof_num"] == AXES.index(axis)) & (dofs["cs"] == part)].index[0]

    def amplitude(state, axis, harmonic):
        turn = -1.0 if case.opens_along_z and axis == "z" else 1.0
        sine = state[place(axis, harmonic, "s")] if harmonic > 0 else 0.0
        return turn * (state[place(axis, harmonic, "c")] - 1j * sine)

    states = []
    for frequency in frequencies:
        # Starts: along the secant, from the last point, from the linear response, from rest.
        starts = [2.0 * states[-1] - states[-2]] if len(states) > 1 else []
        starts += states[-1:] + [None, "null"]
        residuals = []
        for start in starts:
            analysis.analysis_options["puls_start"] = math.tau * frequency
            analysis.SolList = []
            analysis.initialise(start)
            solution = analysis.SolList[-1]
            residuals.append(float(np.linalg.norm(solution.R_solver)))
            if residuals[-1] <= SOLVED:
                break
        else:
            sys.exit(f"{case.name}: pyHarm finds no solution at {frequency} Hz; residuals {residuals} N")
        states.append(solution.x[:-1].copy())
    return {axis: np.array([[amplitude(state, axis, k) for k in case.harmonics] for state in states]) for axis in driven(case)}


def energies_of(case, frequencies, amplitudes):
    """Returns the work of the forces, of friction and of the dampers per cycle [J]."""
    first = case.harmonics.index(1)
    work = {"input": np.zeros(len(frequencies)), "viscous": np.zeros(len(frequencies))}
    for force in case.forces:
        load = force.amplitude * cmath.exp(1j * math.radians(force.phase))
        work["input"] += -math.pi * (amplitudes[force.direction][:, first] * load.conjugate()).imag
    for axis, rows in amplitudes.items():
        squares = (np.array(case.harmonics) ** 2 * np.abs(rows) ** 2).sum(axis=1)
        work["viscous"] += math.pi * math.tau * frequencies * case.damping[AXES.index(axis)] * squares
    return work | {"friction": work["input"] - work["viscous"]}


def compare(pyharm, case, arguments, folder):
    """Solves a case with both programs and prints the differences. Returns whether the programs agree."""
    started = time.monotonic()
    frequencies, ours, energies = by_fretwear(arguments.program, case, folder)
    first = case.harmonics.index(1)
    middle = time.monotonic()
    theirs = by_pyharm(pyharm, case, case.samples, frequencies)
    note = ""
    if case.extrapolate:
        coarse = np.max(np.abs(ours[case.response][:, first] / theirs[case.response][:, first] - 1.0))
        fine = by_pyharm(pyharm, case, 2 * case.samples, frequencies)
        note = f"; pyHarm extrapolated from {case.samples} and {2 * case.samples} samples, difference {coarse:.1e} at {case.samples}"
        theirs = {axis: 2.0 * fine[axis] - theirs[axis] for axis in theirs}
    ended = time.monotonic()
    # Amplitudes relative to the largest first harmonic of their axis, and energies relative to the largest input.
    apart = {
        axis: np.abs(ours[axis] - theirs[axis]).max(axis=0) / np.abs(theirs[axis][:, first]).max() for axis in ours
    }
    work = energies_of(case, frequencies, theirs)
    energy = {name: float(np.abs(energies[name] - work[name]).max() / work["input"].max()) for name in ENERGIES}
    turn = cmath.exp(-1j * math.radians(case.forces[0].phase))
    ours, theirs = (turn * rows[case.response][:, first] for rows in (ours, theirs))
    difference = np.abs(ours / theirs - 1.0)
    largest = max(float(np.max(difference)), *(float(rows.max()) for rows in apart.values()), *energy.values())

    print(f"\n{case.name}: {case.what}")
    print("  frequency    amplitude [um]            phase lag [rad]         difference")
    print("       [Hz]    fretwear     pyHarm       fretwear     pyHarm     relative")
    shown = range(len(frequencies)) if arguments.all else range(0, len(frequencies), max(1, len(frequencies) // 6))
    for i in shown:
        amplitudes = f"{1e6 * abs(ours[i]):11.5f} {1e6 * abs(theirs[i]):11.5f}"
        lags = f"{-cmath.phase(ours[i]):11.6f} {-cmath.phase(theirs[i]):11.6f}"
        print(f"  {frequencies[i]:9.4f}  {amplitudes}   {lags}    {difference[i]:8.1e}")
    for axis, rows in apart.items():
        print(f"  along {axis}, harmonics {case.harmonics[0]} to {case.harmonics[-1]}: " + " ".join(f"{row:.1e}" for row in rows))
    print("  energies: " + ", ".join(f"{name} {value:.1e}" for name, value in energy.items()))
    verdict = "agree" if largest <= case.tolerance else "DISAGREE"
    print(f"  {verdict}: largest difference {largest:.1e} of {len(frequencies)} points, {case.tolerance:.0e} allowed{note}")
    print(f"  fretwear {middle - started:.1f} s, pyHarm {ended - middle:.1f} s")
    return largest <= case.tolerance


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="the fretwear program")
    parser.add_argument("--all", action="store_true", help="print every point")
    parser.add_argument("folder", nargs="?", metavar="FOLDER", help="folder of the scenes and runs")
    arguments = parser.parse_args()
    arguments.program = str(Path(arguments.program).resolve())
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.folder or temporary).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        pyharm = load_pyharm(folder)
        apart = [case.name for case in CASES if not compare(pyharm, case, arguments, folder)]
    if apart:
        sys.exit(f"pyHarm and fretwear disagree on {', '.join(apart)}")


if __name__ == "__main__":
    main()
