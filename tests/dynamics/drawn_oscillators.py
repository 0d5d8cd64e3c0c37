#!/usr/bin/env python3
"""Compares the peaks that `fretwear run` computes for random oscillators with time integration.

    python tests/dynamics/drawn_oscillators.py --program target/release/fretwear [--count N] [--seed S] [--only K] [--jobs J]
        [--first K] [--output RESULTS.jsonl] [--failures FOLDER] [--no-judge] [--set KEY=VALUE]
    python tests/dynamics/drawn_oscillators.py --program target/release/fretwear --held tests/dynamics/oscillators_7318.csv
    python tests/dynamics/drawn_oscillators.py --tell RESULTS.jsonl

The script needs numpy, scipy, numba and pyarrow. Scene K of seed S is the same in every start. The program runs each scene, and the judge,
time_integration.py, checks

1. the exit code; if a run did not converge, whether the motion settles to the period of the drive at five frequencies;
2. the peak, against the highest of all motions with this period in the range, its stability, and its error bar;
3. that the rows of `frf` and the phase resonance are not above the peak;
4. that the work of friction is not negative;
5. several forces on one port, against their sum as one force;
6. some rows of `frf`, against the motions at their frequencies.

RESULTS has one line of JSON per scene; a table of counts is printed at the end. FOLDER gets copies of failing scenes, with the failure in
the first line. The judge needs some seconds per scene.

`--held` runs the 200 scenes of seed 7318 without the judge and compares them with a table: the results of the program when it also
searched motions of oscillators in time, and the highest motion by time integration. The exit code is 1 if less than 95 % of the peaks with
a bar below one half are found again within 2 %, if more than 5 % of the runs do not converge, if a row of `frf` is above the peak, or if a
motion is above `peak_bound`.
"""

import argparse
import collections
import csv
import concurrent.futures
import json
import math
import os
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

sys.path.insert(0, str(Path(__file__).resolve().parent))
import time_integration as integration
from time_integration import Motion, Oscillator, Place, TURN

AXES = "xyz"
# Largest fraction of wrong scenes; 2 % of 300 were wrong.
MOST_WRONG = 0.05
# Limit of the CPU seconds of a run, limit of its wall time on a busy machine, and CPU seconds from which a run is slow [s].
LONGEST = 60
LONGEST_WAIT = 300.0
SLOW = 5.0
# Time limit of the judge for the curves of a scene; after it, some curves are missing [s].
LONGEST_CURVES = 40.0
# CPU seconds after which the judge gives up a scene, which then counts as not all seen.
LONGEST_JUDGED = 90.0
# Accuracy of the judge in addition to its own error estimate.
JUDGED = 1e-6
# A peak is prominent if it is higher than its surroundings by this fraction.
PROMINENT = 1e-3
# Rounding between rows of the same response.
ROUNDING = 1e-9
# Largest fraction by which a peak may be below a row: the search for a peak ends at an angle, and the amplitude decreases by half the
# square of this angle.
FLAT = 2e-5
# For `--held`: the bar below which a peak counts as known, and the tolerance within which it must be found again.
KNOWN_BAR = 0.5
AGAIN = 0.02
# Two scenes with the same loads must agree within this tolerance, or within their error bar.
SAME_LOADS = 1e-6
# Number of compared rows of the forced response, and their smallest amplitude relative to the highest row.
ROWS = 12
SMALLEST_ROW = 1e-3
# A row that is nearer than this to a motion at its frequency is not compared with the whole curve. A row with a larger distance than
# FAR_ROW is wrong if this distance also exceeds three bars of the peak.
NEAR_ENOUGH = 1e-3
FAR_ROW = 0.02
# Allowed error of a row in bars, because a branch may be steep.
BARS = 3.0
# Factors of a larger force along z, number of levels at which it is lowered, and number of periods at each level.
LARGER = (2.5, 10.0)
LEVELS = 16
WAITED = 500
# Largest number of failing scenes of each class that are copied.
KEPT = 5


# Draws


@dataclass
class Force:
    axis: int
    harmonic: int
    amplitude: float  # N
    phase: float = 0.0  # degrees, lead


@dataclass
class Scene:
    what: str
    mass: list
    damping: list
    stiffness: list
    kn: float
    kt: float
    mu: float
    load: float
    gap: float
    law: str
    forces: list
    response: int
    ratio: float = 0.0
    basis: str = "stuck"
    harmonics: list = None
    frequency: tuple = None
    points: int = None
    preset: str = None
    samples: int = None
    pair: list = None
    """The same loads as other forces."""

    def toml(self, forces=None):
        def three(values, unit):
            return json.dumps([f"{value!r} {unit}" for value in values])

        def one(force):
            phase = f', phase = "{force.phase!r} deg"' if force.harmonic > 0 else ""
            harmonic = f", harmonic = {force.harmonic}" if force.harmonic != 1 else ""
            return f'    {{ amplitude = "{force.amplitude!r} N", direction = "{AXES[force.axis]}"{phase}{harmonic} }},\n'

        rest = f'gap = "{self.gap!r} m"' if self.gap > 0.0 else f'normal_load = "{self.load!r} N"'
        lines = [
            f'title = "{self.what}"\n[structure]\nkind = "oscillator"\nmass = {three(self.mass, "kg")}',
            f'damping = {three(self.damping, "N s/m")}\nstiffness = {three(self.stiffness, "N/m")}',
            f'[contact]\nkn = "{self.kn!r} N/m"\nkt = "{self.kt!r} N/m"\nfriction_coefficient = {self.mu!r}\n{rest}',
            f'[dynamics]\nforce = [\n{"".join(one(force) for force in forces or self.forces)}]',
            f'response = {{ direction = "{AXES[self.response]}" }}\nfriction_law = "{self.law}"',
        ]
        if self.ratio > 0.0:
            lines.append(f'damping_ratio = {self.ratio!r}\ndamping_basis = "{self.basis}"')
        if self.harmonics is not None:
            lines.append(f"harmonics = {self.harmonics}")
        if self.frequency is not None:
            lines.append(f'frequency = ["{self.frequency[0]!r} Hz", "{self.frequency[1]!r} Hz"]')
        if self.points is not None:
            lines.append(f"points = {self.points}")
        if self.preset is not None or self.samples is not None:
            lines.append("[fidelity]")
            if self.preset is not None:
                lines.append(f'preset = "{self.preset}"')
            if self.samples is not None:
                lines.append(f"aft_samples = {self.samples}")
        return "\n".join(lines) + "\n"

    def drive(self):
        return next(force for force in self.forces if force.harmonic == 1)

    def oscillator(self):
        """Returns the oscillator for the time integration."""
        damping = list(self.damping)
        bears = self.load > 0.0 or (self.gap == 0.0 and self.kn > 0.0)
        for axis in range(3):
            spring = self.kn if axis == 2 else (self.kt if self.mu > 0.0 else 0.0)
            stiffness = self.stiffness[axis] + (spring if bears and self.basis == "stuck" else 0.0)
            damping[axis] += 2.0 * self.ratio * math.sqrt(stiffness * self.mass[axis])
        contact = integration.Contact(self.kn, self.kt, self.mu, self.load, self.gap)
        forces = [(f.axis, f.harmonic, f.amplitude, math.radians(f.phase)) for f in self.forces]
        return Oscillator(list(self.mass), damping, list(self.stiffness), contact, self.law, forces)

    def range(self):
        """Returns the range of frequencies [Hz]; without a given range, the documented default."""
        if self.frequency is not None:
            return self.frequency
        axis = self.drive().axis
        free, stuck = self.oscillator().frequencies(axis)
        return (0.5 * free if free > 0.0 else 0.3 * stuck, 1.5 * stuck)


def log_uniform(draw, low, high):
    return float(10.0 ** draw.uniform(math.log10(low), math.log10(high))) if high > low else float(low)


def rounded(value, digits=6):
    """Rounds to few digits, for a readable scene."""
    return float(f"{value:.{digits - 1}e}")


KINDS = {"line": 0.22, "orbit": 0.2, "varying load": 0.2, "normal": 0.12, "all axes": 0.14, "more harmonics": 0.12}
HARMONICS = [[0, 1], [0, 1, 3], [0, 1, 2, 3], [0, 1, 3, 5], [0, 1, 2, 3, 4, 5], list(range(8)), list(range(12))]


def ratio_of_springs(draw):
    return log_uniform(draw, 0.1, 10.0) if draw.random() < 0.5 else log_uniform(draw, 1e-4, 1e4)


def drawn(seed, number):
    """Returns scene `number` of a seed. Most scenes that would neither slip nor lift off are replaced."""
    for attempt in range(20):
        draw = np.random.default_rng([seed, number, attempt])
        scene = of_kind(draw)
        if is_active(scene) or draw.random() < 0.05:
            break
    return scene


def is_active(scene):
    """Returns whether the linear response slips, opens or closes at any frequency of the range."""
    oscillator = scene.oscillator()
    low, high = scene.range()
    bears = scene.load > 0.0 or scene.gap == 0.0
    if scene.load == 0.0 and not oscillator.moves(2):
        return False
    springs = [scene.kt if bears and scene.mu > 0.0 else 0.0] * 2 + [scene.kn if bears else 0.0]
    own = [
        math.sqrt((k + spring) / m) / TURN / order
        for k, spring, m in zip(scene.stiffness, springs, scene.mass) for order in (1, 2, 3, 5)
    ]
    frequencies = [f for f in own if low <= f <= high] + list(np.geomspace(low, high, 50))
    for frequency in frequencies:
        reach, mean = [0.0] * 3, [0.0] * 3
        for force in scene.forces:
            axis, omega = force.axis, force.harmonic * TURN * frequency
            impedance = scene.stiffness[axis] + springs[axis] - scene.mass[axis] * omega**2 + 1j * oscillator.damping[axis] * omega
            if force.harmonic == 0:
                mean[axis] += force.amplitude / impedance.real if impedance.real > 0.0 else 0.0
            else:
                reach[axis] += force.amplitude / abs(impedance)
        least, most = (scene.load + scene.kn * (mean[2] + sign * reach[2] - scene.gap) for sign in (-1.0, 1.0))
        if not bears and most <= 0.0:
            continue
        if least < 0.0:
            return True
        if scene.mu > 0.0 and max(reach[:2]) * scene.kt > scene.mu * least:
            return True
    return False


def of_kind(draw):
    kind = str(draw.choice(list(KINDS), p=list(KINDS.values())))
    mass = [1.0] * 3 if draw.random() < 0.6 else [rounded(log_uniform(draw, 0.3, 3.0)) for _ in range(3)]
    kx = (TURN * log_uniform(draw, 30.0, 600.0)) ** 2 * mass[0]
    stiffness = [kx, kx * draw.uniform(0.7, 1.4) if draw.random() < 0.7 else kx, kx * log_uniform(draw, 0.1, 10.0)]
    if kind != "normal" and draw.random() < 0.03:
        stiffness[0] = 0.0
    stiffness = [rounded(k) for k in stiffness]
    kt = rounded(kx * ratio_of_springs(draw))
    kn = rounded(stiffness[2] * ratio_of_springs(draw))
    mu = 0.0 if draw.random() < 0.05 else rounded(draw.uniform(0.05, 0.8) if draw.random() < 0.85 else draw.uniform(0.8, 1.5), 3)
    damped = log_uniform(draw, 1e-3, 0.05) if draw.random() < 0.6 else log_uniform(draw, 1e-5, 0.2)
    ratio, damping, basis = 0.0, [0.0] * 3, "stuck"
    if draw.random() < 0.5:
        damping = [rounded(2.0 * damped * math.sqrt(max(k, 1e-3 * kx) * m)) for k, m in zip(stiffness, mass)]
    else:
        ratio = rounded(damped)
        basis = "free" if draw.random() < 0.3 and min(stiffness) > 0.0 else "stuck"
        if min(stiffness) == 0.0:
            damping = [rounded(2.0 * damped * math.sqrt(kx * m)) for m in mass]

    start = str(draw.choice(["preload", "zero", "gap"], p=[0.65, 0.1, 0.25]))
    has_z = kind in ("varying load", "normal", "all axes") or start != "preload"
    has_x = kind != "normal"
    has_y = kind in ("orbit", "all axes")
    load = rounded(log_uniform(draw, 1.0, 3000.0)) if start == "preload" else 0.0
    size = log_uniform(draw, 1.0, 3000.0)
    gap = rounded(size / stiffness[2]) if start == "gap" else 0.0

    # Damping ratio of an axis with its contact spring.
    def stuck_ratio(axis):
        spring = kn if axis == 2 else kt
        c = damping[axis] + 2.0 * ratio * math.sqrt((stiffness[axis] + (spring if basis == "stuck" else 0.0)) * mass[axis])
        return c / (2.0 * math.sqrt((stiffness[axis] + spring) * mass[axis]))

    forces = []
    normal = []
    if has_z:
        if start == "preload":
            onset = 2.0 * stuck_ratio(2) * (1.0 + stiffness[2] / kn)
            amplitude = load * log_uniform(draw, min(max(0.3 * onset, 1e-4), 3.0), 5.0)
        elif start == "gap":
            free = damping[2] + 2.0 * ratio * math.sqrt(stiffness[2] * mass[2])
            onset = free / math.sqrt(stiffness[2] * mass[2])
            amplitude = stiffness[2] * gap * log_uniform(draw, min(max(0.5 * onset, 1e-4), 2.0), 3.0)
        else:
            amplitude = size
        normal.append(Force(2, 1, rounded(amplitude), rounded(draw.uniform(-180.0, 180.0), 3)))
        if kind not in ("varying load", "normal", "all axes") and draw.random() < 0.6:
            # Only a constant force presses.
            normal = [Force(2, 0, rounded(log_uniform(draw, 0.5, 5.0) * max(size, stiffness[2] * gap)))]
        elif draw.random() < 0.4:
            push = log_uniform(draw, 0.1, 3.0) * amplitude * (1.0 if draw.random() < 0.75 else -1.0)
            normal.append(Force(2, 0, rounded(push)))
    pressing = load if load > 0.0 else sum(abs(force.amplitude) for force in normal)
    if has_x:
        limit = mu * pressing if mu > 0.0 else pressing
        onset = 2.0 * stuck_ratio(0) * (1.0 + stiffness[0] / kt)
        low = min(max(0.5 * onset, 3e-3), 2.0)
        amplitude = limit * log_uniform(draw, low, 4.0)
        forces.append(Force(0, 1, rounded(amplitude), 0.0 if draw.random() < 0.5 else rounded(draw.uniform(-180.0, 180.0), 3)))
        if has_y:
            other = amplitude * log_uniform(draw, 0.1, 3.0)
            phase = float(draw.choice([90.0, -90.0])) if draw.random() < 0.4 else rounded(draw.uniform(-180.0, 180.0), 3)
            forces.append(Force(1, 1, rounded(other), phase))
        if kind == "more harmonics":
            for _ in range(int(draw.integers(1, 3))):
                order = int(draw.choice([0, 0, 2, 3, 5]))
                own = rounded(amplitude * log_uniform(draw, 0.05, 1.0))
                axis = 0 if draw.random() < 0.7 else 1
                forces.append(Force(axis, order, own, 0.0 if order == 0 else rounded(draw.uniform(-180.0, 180.0), 3)))
    forces += normal
    if not has_x:
        forces[0].phase = 0.0
    drive = next(force for force in forces if force.harmonic == 1)

    moving = sorted({force.axis for force in forces if force.harmonic > 0})
    response = drive.axis if draw.random() < 0.88 else int(draw.choice(moving))
    scene = Scene(
        f"{kind}, {start}", mass, damping, stiffness, kn, kt, mu, load, gap, "cone" if draw.random() < 0.65 else "box", forces, response,
        ratio, basis,
    )
    free, stuck = scene.oscillator().frequencies(drive.axis)
    if draw.random() < 0.5 or free == 0.0:
        if free == 0.0:
            free = 0.3 * stuck
        if draw.random() < 0.15:
            middle = log_uniform(draw, free, stuck)
            scene.frequency = (rounded(middle * draw.uniform(0.7, 0.95)), rounded(middle * draw.uniform(1.05, 1.4)))
        else:
            scene.frequency = (rounded(free * draw.uniform(0.3, 0.95)), rounded(stuck * draw.uniform(1.05, 2.0)))
    if draw.random() < 0.5:
        orders = set(HARMONICS[int(draw.integers(len(HARMONICS)))]) | {force.harmonic for force in forces}
        scene.harmonics = sorted(orders)
    if draw.random() < 0.15:
        scene.points = int(draw.integers(15, 60))
    if draw.random() < 0.12:
        scene.preset = str(draw.choice(["fast", "reference"]))
    if draw.random() < 0.1:
        highest = max(scene.harmonics or [31])
        scene.samples = int(max(draw.choice([128, 256, 1024]), 4 * highest + 4))
    if draw.random() < 0.12:
        scene.pair = paired(draw, scene)
    return scene


def paired(draw, scene):
    """Replaces the drive by several forces; returns all forces with their sum as one force."""
    drive = scene.drive()
    single = list(scene.forces)
    at = single.index(drive)
    lead, size = drive.phase, drive.amplitude
    if draw.random() < 0.5:
        parts = [Force(drive.axis, 1, size, lead), Force(drive.axis, 1, size, lead + 90.0)]
        whole = Force(drive.axis, 1, math.sqrt(2.0) * size, lead + 45.0)
    else:
        parts = [Force(drive.axis, 1, size, lead), Force(drive.axis, 1, 2.0 * size, lead + 180.0)]
        whole = Force(drive.axis, 1, size, lead + 180.0)
    scene.forces = single[:at] + parts + single[at + 1 :]
    return single[:at] + [whole] + single[at + 1 :]


# Runs


@dataclass
class Run:
    code: int
    seconds: float
    """CPU time in user and kernel mode."""
    error: str
    row: dict = None
    """Row of dynamic_response and summary; None without a resonance."""
    frf: dict = None
    killed: bool = False


def run(program, text, folder, name, sets=()):
    more = [argument for key in sets for argument in ("--set", key)]
    scene = folder / f"{name}.toml"
    scene.write_text(text, encoding="utf-8")
    where = folder / name
    with open(folder / f"{name}.err", "w+", encoding="utf-8") as errors:
        process = subprocess.Popen(
            [program, "run", scene.name, "--run", name, "--json", "--quiet", *more],
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST)),
        )
        killed = threading.Event()

        def end():
            killed.set()
            process.kill()

        timer = threading.Timer(LONGEST_WAIT, end)
        timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        message = errors.read().strip()
    seconds = usage.ru_utime + usage.ru_stime
    result = Run(process.returncode, seconds, message, killed=killed.is_set() or seconds > 0.95 * LONGEST)
    iteration = where / "iterations" / "wear_iteration=0"

    def table(name):
        path = iteration / f"{name}.parquet"
        return pq.ParquetFile(path).read() if path.exists() else None

    rows = table("dynamic_response")
    if rows is not None:
        result.row = rows.to_pylist()[0]
        summary = table("summary").to_pylist()[0]
        result.row["summary"] = {key: value for key, value in summary.items() if value is not None}
    frf = table("frf")
    if frf is not None:
        result.frf = {column: frf.column(column).to_numpy() for column in frf.column_names}
    return result


# Judging


@dataclass
class Truth:
    """Motions with the period of the drive over a range."""

    curves: list
    """Lists of places in their order along a branch."""
    peaks: list = field(default_factory=list)
    """Places of local maxima in descending order."""
    edge: float = 0.0
    """Largest amplitude at an end of the range."""
    highest_stable: float = 0.0
    """Largest amplitude of a stable motion."""
    error: float = 0.0
    """Estimated error of the judge at the highest peak."""
    unsolved: int = 0
    """Number of places whose motion is not periodic within JUDGED."""


class Judge:
    """All periodic motions of an oscillator over a range, and their first harmonic along an axis."""

    def __init__(self, oscillator, axis, low, high):
        self.oscillator, self.axis = oscillator, axis
        self.low, self.high = math.log(low), math.log(high)
        self.draw = np.random.default_rng(12345)
        self.worst = 0.0
        self.is_cut = False
        self.curves = []

    def measure(self, place, near=None):
        """Computes the first harmonic of a place."""
        motion = Motion(self.oscillator, place.frequency)
        tangential = np.zeros(6)
        motion.normal_period(place.state)
        left = 0.0
        if self.axis < 2:
            start = near.tangential if near is not None and near.tangential is not None else place.tangential
            tangential, left = motion.tangential_periodic(start)
        sums = np.zeros((2 * integration.ORDERS + 3, 3))
        if self.axis < 2:
            motion.tangential_period(tangential, sums)
        else:
            integration.gather_normal(motion.axes[2], motion.normal, sums)
        place.tangential = tangential
        place.amplitude = complex(sums[2, self.axis], -sums[3, self.axis]) / math.pi
        place.left = left
        return place

    # The curves

    def find(self, marks):
        """Finds the branches; `marks` are frequencies around which the search is finer [Hz]."""
        if self.oscillator.oscillates(2):
            self.follow(marks)
        else:
            middle = math.exp(0.5 * (self.low + self.high))
            state = Motion(self.oscillator, middle).at_rest()
            logs = np.linspace(self.low, self.high, 81)
            self.curves = [[Place(float(log), state, 0.0) for log in logs]]
        if self.axis < 2:
            self.curves = [self.with_marks(thinned(curve, 250), marks) for curve in self.curves]
        begin, measured = time.thread_time(), []
        for curve in self.curves:
            done = []
            for place in curve:
                if time.thread_time() - begin > LONGEST_CURVES:
                    self.is_cut = True
                    break
                done.append(self.measure(place, done[-1] if done else None))
            if len(done) > 1:
                measured.append(done)
        self.curves = measured

    def with_marks(self, curve, marks):
        """Adds places at geometric distances from the marks, to resolve narrow peaks."""
        axes = [self.axis] + ([1 - self.axis] if self.oscillator.turns else [])
        damping = 1.0
        centres = [math.log(mark) for mark in marks]
        for axis in axes:
            for frequency in self.oscillator.frequencies(axis):
                if frequency > 0.0:
                    centres.append(math.log(frequency))
                    mass = self.oscillator.mass[axis]
                    damping = min(damping, self.oscillator.damping[axis] / (2.0 * mass * TURN * frequency))
        least = max(0.2 * damping, 1e-9)
        distances = [0.0]
        distance = least
        while distance < 0.3 * (self.high - self.low):
            distances += [distance, -distance]
            distance *= 1.7
        wanted = np.array(sorted({c + d for c in centres for d in distances}))
        out = []
        for one, two in zip(curve, curve[1:]):
            out.append(one)
            ends = sorted((one.log, two.log))
            inside = wanted[(wanted > ends[0] + 1e-12) & (wanted < ends[1] - 1e-12)]
            if one.log > two.log:
                inside = inside[::-1]
            for log in inside:
                place = self.place_at(one, two, float(log))
                if place is not None:
                    out.append(place)
        out.append(curve[-1])
        return out

    def place_at(self, one, two, log):
        if not self.oscillator.oscillates(2):
            return Place(log, one.state, 0.0)
        return integration.at_frequency(self.oscillator, one, two, log)

    def place_between(self, one, two, share):
        if not self.oscillator.oscillates(2):
            return Place(one.log + share * (two.log - one.log), one.state, 0.0, one.tangential)
        return integration.between(self.oscillator, one, two, share)

    def start(self, log, state):
        motion = Motion(self.oscillator, math.exp(log))
        state, product, found = motion.normal_periodic(state)
        return Place(log, state, integration.spectral(product)) if found else None

    def is_known(self, place):
        for other in self.all_at(place.log):
            size = max(np.abs(place.state).max(), np.abs(other.state).max())
            if np.abs(place.state - other.state).max() <= 1e-5 * size:
                return True
        return False

    def all_at(self, log):
        """Returns the places of the curves at a frequency."""
        found = []
        for curve in self.curves:
            if not self.oscillator.oscillates(2):
                pair = min(range(len(curve) - 1), key=lambda n: abs(curve[n].log + curve[n + 1].log - 2.0 * log))
                found.append(Place(log, curve[pair].state, 0.0, curve[pair].tangential))
                continue
            for one, two in zip(curve, curve[1:]):
                if min(one.log, two.log) - 1e-13 <= log <= max(one.log, two.log) + 1e-13:
                    place = integration.at_frequency(self.oscillator, one, two, log)
                    if place is not None:
                        found.append(place)
        return found

    def distance(self, log, height):
        """Returns the least distance of a point from the curves, in logarithms of frequency and amplitude."""
        point = np.array([log, height])
        least = math.inf
        for curve in self.curves:
            line = np.array([[place.log, math.log(max(abs(place.amplitude), 1e-300))] for place in curve])
            way = np.diff(line, axis=0)
            size = np.maximum((way**2).sum(axis=1), 1e-300)
            share = np.clip(((point - line[:-1]) * way).sum(axis=1) / size, 0.0, 1.0)
            least = min(least, float(np.sqrt(((line[:-1] + share[:, None] * way - point) ** 2).sum(axis=1)).min()))
        return least

    def follow(self, marks):
        """Finds the branches of the motion along z: from the lower end, from the motions after larger loads are lowered, and from random
        states by Newton's method."""
        first = self.start(self.low, [0.0, 0.0])
        if first is None:
            _, state, _ = Motion(self.oscillator, math.exp(self.low)).settle([0.0, 0.0], 5000)
            first = self.start(self.low, state)
        if first is not None:
            self.curves.append(integration.branch(self.oscillator, first, self.low, self.high, 1.0))
        last = self.start(self.high, [0.0, 0.0])
        if last is not None and not self.is_known(last):
            self.curves.append(integration.branch(self.oscillator, last, self.low, self.high, -1.0)[::-1])
        begin = time.thread_time()
        inside = [math.log(mark) for mark in marks if self.low < math.log(mark) < self.high]
        for log in inside + list(np.linspace(self.low, self.high, 14)[1:-1]):
            for factor in LARGER:
                if time.thread_time() - begin > 10.0 or len(self.curves) > 8:
                    break
                self.through(self.lowered(float(log), factor))
        begin = time.thread_time()
        for swings in (1, 2, 3):
            for log in np.linspace(self.low, self.high, 26)[1:-1]:
                for state in self.bouncing(float(log), swings):
                    if time.thread_time() - begin > 5.0 or len(self.curves) > 8:
                        break
                    self.through(self.start(float(log), state))
        begin = time.thread_time()
        for log in np.linspace(self.low, self.high, 14)[1:-1]:
            floor = Motion(self.oscillator, math.exp(log)).floor(2)
            sizes = [np.abs(place.state).max() for curve in self.curves for place in curve]
            top = max(sizes, default=1e9 * floor)
            for _ in range(8):
                if time.thread_time() - begin > 10.0 or len(self.curves) > 8:
                    return
                size = top * 10.0 ** self.draw.uniform(-2.0, 0.5)
                angle = self.draw.uniform(0.0, TURN)
                self.through(self.start(float(log), [size * math.cos(angle), size * math.sin(angle)]))

    def bouncing(self, log, swings):
        """Returns states along z of motions without damping and harmonic forces that swing `swings` times per period, at several phases of
        a swing."""
        mass, spring, contact = self.oscillator.mass[2], self.oscillator.stiffness[2], self.oscillator.contact
        kn, load, gap, rate = contact.kn, contact.load, contact.gap, TURN * math.exp(log)
        if spring <= 0.0 or kn <= 0.0:
            return []
        steady = sum(amplitude * math.cos(phase) for along, order, amplitude, phase in self.oscillator.forces if along == 2 and order == 0)
        # The state rotates about the equilibrium of each spring at the rate of this spring; both arcs meet where the contact opens.
        edge = gap - load / kn
        rates = math.sqrt(spring / mass), math.sqrt((spring + kn) / mass)
        open_rest = (steady + load) / spring - edge
        closed_rest = (steady + kn * gap) / (spring + kn) - edge

        def halves(speed):
            return (
                math.atan2(speed / rates[0], open_rest) / rates[0],
                math.atan2(speed / rates[1], -closed_rest) / rates[1],
            )

        wanted = TURN / rate / swings
        speeds = np.geomspace(1e-3, 1e6, 400) * max(abs(closed_rest) * rates[1], 1e-300)
        misses = [2.0 * sum(halves(speed)) - wanted for speed in speeds]
        out = []
        for n in range(len(speeds) - 1):
            if misses[n] * misses[n + 1] > 0.0:
                continue
            low, high = speeds[n], speeds[n + 1]
            for _ in range(40):
                middle = math.sqrt(low * high)
                low, high = (middle, high) if (2.0 * sum(halves(middle)) - wanted) * misses[n] > 0.0 else (low, middle)
            out += [
                [edge + open_rest - math.hypot(open_rest, low / rates[0]), 0.0],
                [edge + closed_rest + math.hypot(closed_rest, low / rates[1]), 0.0],
                [edge, low / rate],
                [edge, -low / rate],
            ]
        return out

    def through(self, place):
        """Adds the branch through a place if the branch is new."""
        if place is None or self.is_known(place):
            return
        back = integration.branch(self.oscillator, place, self.low, self.high, -1.0)
        on = integration.branch(self.oscillator, place, self.low, self.high, 1.0)
        self.curves.append(back[::-1] + on[1:])

    def lowered(self, log, factor):
        """Returns the motion along z after a larger force of the drive is lowered to its actual size."""
        own, state, begin = self.oscillator, None, time.thread_time()
        for size in np.geomspace(factor, 1.0, LEVELS):
            if time.thread_time() - begin > 1.0:
                return None
            forces = [
                (axis, order, amplitude * (size if axis == 2 and order > 0 else 1.0), phase)
                for axis, order, amplitude, phase in own.forces
            ]
            motion = Motion(Oscillator(own.mass, own.damping, own.stiffness, own.contact, own.law, forces), math.exp(log))
            found = False
            if state is not None:
                there, _, found = motion.normal_periodic(state)
            if not found:
                there = [0.0, 0.0] if state is None else state
                before = time.thread_time()
                motion.normal_period(there)
                each = max(time.thread_time() - before, 1e-6)
                _, there, _ = motion.settle(there, int(min(WAITED, max(8, 0.3 / each))))
            state = there
        return self.start(log, state)

    # The peaks

    def truth(self):
        found = Truth(self.curves)
        height = max((abs(place.amplitude) for curve in self.curves for place in curve), default=0.0)
        for curve in self.curves:
            for place in (curve[0], curve[-1]):
                if min(abs(place.log - self.low), abs(place.log - self.high)) < 1e-9:
                    found.edge = max(found.edge, abs(place.amplitude))
            size = [abs(place.amplitude) for place in curve]
            tops = [n for n in range(1, len(curve) - 1) if size[n] >= size[n - 1] and size[n] >= size[n + 1]]
            tops.sort(key=lambda n: -size[n])
            for rank, n in enumerate(tops):
                refined = self.refined(curve[n - 1 : n + 2]) if rank < 4 and size[n] > 0.2 * height else curve[n]
                refined.prominence = min(size[n] / max(min(size[: n + 1]), 1e-300), size[n] / max(min(size[n:]), 1e-300)) - 1.0
                found.peaks.append(refined)
        found.peaks.sort(key=lambda place: -abs(place.amplitude))
        # Highest stable motion, because the highest peaks may be unstable.
        stable = [place for curve in self.curves for place in curve if place.multiplier < 1.0]
        found.highest_stable = max((abs(place.amplitude) for place in stable), default=0.0)
        found.error = max((place.left for place in found.peaks[:1]), default=0.0)
        found.unsolved = sum(place.left > JUDGED for curve in self.curves for place in curve)
        return found

    def refined(self, three):
        """Finds the place of the largest amplitude among neighbours by golden section along the branch."""
        golden = 0.5 * (math.sqrt(5.0) - 1.0)
        cache = {0.0: three[0], 1.0: three[1], 2.0: three[2]}

        def at(share):
            if share not in cache:
                one, two, part = (three[0], three[1], share) if share < 1.0 else (three[1], three[2], share - 1.0)
                place = self.place_between(one, two, part)
                if place is None:
                    return None
                cache[share] = self.measure(place, three[1])
            return cache[share]

        low, high = 0.0, 2.0
        best = three[1]
        one, two = high - golden * (high - low), low + golden * (high - low)
        for _ in range(60):
            a, b = at(one), at(two)
            if a is None or b is None:
                break
            sizes = [abs(a.amplitude), abs(b.amplitude)]
            for place in (a, b):
                if abs(place.amplitude) > abs(best.amplitude):
                    best = place
            if sizes[0] >= sizes[1]:
                high, two = two, one
                one = high - golden * (high - low)
            else:
                low, one = one, two
                two = low + golden * (high - low)
            if high - low < 1e-7 or (high - low < 0.02 and abs(sizes[0] - sizes[1]) < 1e-10 * max(sizes)):
                break
        return best


def thinned(curve, most):
    if len(curve) <= most:
        return curve
    chosen = np.unique(np.linspace(0, len(curve) - 1, most).astype(int))
    return [curve[n] for n in chosen]


def settles(oscillator, frequency):
    """Returns the name of the motion to which the motion from rest settles; "undecided" if its period does not close."""
    motion = Motion(oscillator, frequency)
    begin = time.thread_time()
    motion.normal_period([0.0, 0.0])
    each = max(time.thread_time() - begin, 1e-6)
    name, state, _ = motion.settle([0.0, 0.0], int(min(20000, max(512, 3.0 / each))))
    if name != "period 1":
        return name
    motion.normal_period(state)
    _, left = motion.tangential_periodic()
    return name if left <= 1e-8 else "undecided"


# One scene


def judge(scene, result, record):
    """Compares a run with time integration and stores the result in `record`."""
    oscillator = scene.oscillator()
    low, high = scene.range()
    if result.code == 3 or result.killed:
        logs = np.linspace(math.log(low), math.log(high), 11)[1::2]
        record["settles"] = [settles(oscillator, math.exp(log)) for log in logs]
        if not result.killed and any(name != "period 1" for name in record["settles"]):
            return
    if result.code != 0 and result.code != 3 and not result.killed:
        return
    marks = []
    if result.row is not None:
        marks.append(result.row["peak_frequency"])
    if result.frf is not None and len(result.frf["frequency"]):
        marks.append(float(result.frf["frequency"][np.nanargmax(result.frf["amplitude"])]))
    own = Judge(oscillator, scene.response, low, high)
    own.find([mark for mark in marks if mark > 0.0])
    truth = own.truth()
    record["branches"] = len(truth.curves)
    record["judge_cut"] = own.is_cut
    record["edge"] = truth.edge
    record["highest_stable"] = truth.highest_stable
    record["judge_error"], record["judge_unsolved"] = truth.error, truth.unsolved
    record["places"] = sum(len(curve) for curve in truth.curves)
    if truth.peaks:
        top = truth.peaks[0]
        record["true_peak"] = abs(top.amplitude)
        record["true_frequency"] = top.frequency
        record["true_multiplier"] = top.multiplier
        record["prominence"] = top.prominence
        motion = Motion(oscillator, top.frequency)
        figures = motion.steady(top.state, top.tangential)
        if figures is not None:
            record["judge_imbalance"] = figures.imbalance
            record["judge_harmonics"] = [float(abs(a)) for a in figures.amplitude[scene.response]]
            record["true_friction_energy"] = figures.friction
            record["opens"], record["sticks"] = figures.opens, figures.stuck
        stable = [place for place in truth.peaks if place.multiplier < 1.0]
        record["true_stable_peak"] = abs(stable[0].amplitude) if stable else None
    if own.is_cut:
        record["peak"] = "not all seen"
        return
    if result.row is not None:
        peak_against(result, record, truth)
    if result.frf is not None:
        rows_against(own, result, record)


def peak_against(result, record, truth):
    row = result.row
    size, bar = row["peak_amplitude"], row["error_peak_amplitude"]
    allowed = bar + JUDGED + truth.error

    def off(amplitude):
        """Returns the deviation of a true amplitude from the amplitude of the run, relative to the latter, as error bars are."""
        return amplitude / size - 1.0

    # The largest amplitude may be at an end of the range, and the run reports this.
    highest = max((abs(place.amplitude) for place in truth.peaks), default=0.0)
    if truth.edge > highest and abs(off(truth.edge)) <= allowed:
        record["peak"], record["peak_error"] = "right", off(truth.edge)
        return
    if not truth.peaks:
        record["peak"] = "no such peak"
        return
    away = [(abs(off(abs(place.amplitude))), place) for place in truth.peaks if abs(place.amplitude) > 0.0]
    record["peak_error"] = off(abs(truth.peaks[0].amplitude))
    top = truth.peaks[0]
    stable = record["true_stable_peak"]
    if abs(record["peak_error"]) <= allowed:
        record["peak"] = "right" if top.multiplier < 1.0 else "right, unstable"
    elif stable is not None and abs(off(stable)) <= allowed:
        record["peak"] = "right, of the stable"
    elif abs(off(record["highest_stable"])) <= allowed:
        record["peak"] = "right, of the stable"
    elif any(error <= allowed for error, _ in away):
        record["peak"] = "lower peak"
    else:
        record["peak"] = "too low" if record["peak_error"] > 0.0 else "too high"
        record["peak_beyond"] = abs(record["peak_error"]) / allowed
        record["other_frequency"] = abs(row["peak_frequency"] / top.frequency - 1.0)


def row_bars(frf, name):
    """Returns the error bars of the rows, 0 for rows without an error bar."""
    return np.nan_to_num(np.asarray(frf[name], dtype=float)) if name in frf else np.zeros(len(frf["frequency"]))


def rows_against(own, result, record):
    frf = result.frf
    size, bars = frf["amplitude"], row_bars(frf, "error_amplitude")
    low, high = (1.0 - 1e-9) * math.exp(own.low), (1.0 + 1e-9) * math.exp(own.high)
    inside = (frf["frequency"] >= low) & (frf["frequency"] <= high)
    tall = np.flatnonzero((size >= SMALLEST_ROW * np.nanmax(size)) & inside)
    if len(tall) == 0:
        return
    chosen = sorted({int(tall[n]) for n in np.linspace(0, len(tall) - 1, ROWS - 1).astype(int)} | {int(tall[np.argmax(size[tall])])})
    errors, unstable, without = [], 0, 0
    for n in chosen:
        log = math.log(frf["frequency"][n])
        places = [own.measure(place) for place in own.all_at(min(max(log, own.low), own.high))]
        places = [place for place in places if abs(place.amplitude) > 0.0]
        if not places:
            without += 1
            continue
        best = min(places, key=lambda place: abs(size[n] / abs(place.amplitude) - 1.0))
        error = abs(size[n] / abs(best.amplitude) - 1.0)
        away = error if error < NEAR_ENOUGH else min(error, own.distance(log, math.log(size[n])))
        errors.append((error, float(frf["frequency"][n]), float(size[n]), abs(best.amplitude), away, float(bars[n])))
        unstable += best.multiplier >= 1.0
    if errors:
        record["rows_median"] = statistics.median(error for error, *_ in errors)
        names = ("rows_worst", "rows_worst_frequency", "rows_worst_ours", "rows_worst_true")
        record.update(zip(names, max(errors)))
        # On a steep branch, a small difference in frequency is a large difference in amplitude.
        off = max(errors, key=lambda error: error[4])
        record["rows_off"] = off[4]
        beyond = max(errors, key=lambda error: error[4] if error[4] > BARS * error[5] else 0.0)
        if beyond[4] > BARS * beyond[5]:
            record["rows_beyond"], record["rows_beyond_row"] = beyond[4], [*beyond[1:4], beyond[5]]
        record["rows_top"] = next((e[0] for e in errors if e[2] == float(np.nanmax(size))), None)
    record["rows_unstable"], record["rows_without"] = int(unstable), without


def own_words(scene, result, record):
    """Checks the tables of a run for consistency."""
    frf, row = result.frf, result.row
    bar = row["error_peak_amplitude"] if row is not None else 0.0
    if row is not None:
        # Without a phase resonance, its columns are missing.
        record.update({key: row.get(key) for key in (
            "peak_frequency", "peak_amplitude", "error_peak_amplitude", "resonance_frequency", "resonance_amplitude", "friction_energy",
            "input_energy", "viscous_energy", "error_energy", "highest_harmonic", "error_friction_energy",
        )})
        record["peak_bound"] = row.get("peak_bound")
        record["summary_error_peak_amplitude"] = row["summary"].get("error_peak_amplitude")
        record["friction_ratio"] = row["friction_energy"] / max(abs(row["input_energy"]), 1e-300)
        record["resonance_above"] = (row.get("resonance_amplitude") or 0.0) / row["peak_amplitude"] - 1.0
    if frf is not None and len(frf["frequency"]):
        low, high = scene.range()
        record["rows"] = len(frf["frequency"])
        if scene.points is not None:
            record["rows_missing"] = scene.points - len(frf["frequency"])
        record["rows_reach"] = [float(frf["frequency"].min() / low - 1.0), float(frf["frequency"].max() / high - 1.0)]
        supplied, taken = np.maximum(np.abs(frf["input_energy"]), 1e-300), frf["friction_energy"]
        record["frf_friction_worst"] = float(np.nanmin(taken / supplied))
        most = taken + row_bars(frf, "error_friction_energy") * np.abs(taken)
        record["frf_friction_most"] = float(np.nanmin(most / supplied))
        if row is not None:
            above = frf["amplitude"] / row["peak_amplitude"] - 1.0
            record["frf_above"] = float(np.nanmax(above))
            n = int(np.nanargmax(above))
            record["frf_above_frequency"] = float(frf["frequency"][n])
            at_edge = min(abs(frf["frequency"][n] / low - 1.0), abs(frf["frequency"][n] / high - 1.0)) < 1e-6
            record["frf_above_at_edge"] = bool(at_edge)
    return bar


def classes(record):
    """Returns the failure classes of a record, each with a message."""
    out = {}
    if record["killed"]:
        out["killed"] = f"ended after {LONGEST} CPU seconds; time integration settles to {record.get('settles')}"
    elif record["code"] == 3:
        names = record.get("settles", [])
        if names and all(name == "period 1" for name in names):
            out["not_converged"] = f"exit code 3; time integration settles to the period of the drive: {record['error']}"
    elif record["code"] != 0:
        out["failed"] = f"exit code {record['code']}: {record['error']}"
    if record["seconds"] > SLOW and not record["killed"]:
        out["slow"] = f"{record['seconds']:.1f} CPU seconds"
    said = record.get("peak")
    ours, true = record.get("peak_amplitude"), record.get("true_peak")
    if said in ("too low", "too high", "lower peak", "no such peak"):
        against = f"time integration {true:.9e} m at {record['true_frequency']:.6f} Hz" if true else "no peak in time integration"
        out["peak_" + said.replace(" ", "_")] = (
            f"peak {ours:.9e} m at {record['peak_frequency']:.6f} Hz, bar {record['error_peak_amplitude']:.2e}; {against}, "
            f"off by {record.get('peak_error', math.nan):+.2e}"
        )
    if record["code"] == 0 and ours is None and record.get("prominence", 0.0) > PROMINENT and true > record.get("edge", 0.0):
        out["peak_missing"] = f"the run has no peak; time integration has a peak of {true:.9e} m at {record['true_frequency']:.6f} Hz"
    bar = record.get("error_peak_amplitude", 0.0)
    above = record.get("frf_above", -1.0)
    if above > FLAT:
        line = f"the row of frf at {record['frf_above_frequency']:.6f} Hz is above the peak by {above:.2e}, bar {bar:.2e}"
        edge = "_at_edge" if record["frf_above_at_edge"] else ""
        out["frf_above" + edge] = line
        if above > bar + 1e-6:
            out["frf_above_bar" + edge] = line
    reach = record.get("rows_reach", [0.0, 0.0])
    if reach[0] < -1e-6 or reach[1] > 1e-6:
        out["frf_outside"] = f"rows of frf are outside the range: by {reach[0]:.2e} below, {reach[1]:.2e} above"
    if reach[0] > 1e-6 or reach[1] < -1e-6 or record.get("rows_missing", 0) != 0:
        missing = record.get("rows_missing", 0)
        out["frf_short"] = f"frf begins {reach[0]:.2e} above the range and ends {-reach[1]:.2e} below, {missing} points missing"
    if record.get("resonance_above", -1.0) > ROUNDING:
        line = f"resonance_amplitude is above peak_amplitude by {record['resonance_above']:.2e}, bar {bar:.2e}"
        out["resonance_above"] = line
    if record.get("friction_ratio", 0.0) < -max(record.get("error_friction_energy", 0.0), 1e-9):
        out["friction_negative"] = f"friction_energy is {record['friction_ratio']:.2e} of the input"
    if record.get("frf_friction_most", 0.0) < -1e-9:
        out["frf_friction_negative"] = f"friction_energy in frf, with its bar, is {record['frf_friction_most']:.2e} of the input"
    if record.get("pair_error", 0.0) > SAME_LOADS + bar or record.get("pair_code", record["code"]) != record["code"]:
        out["pair_differs"] = (
            f"as one load: peak {record.get('pair_peak')} m, exit code {record['pair_code']}; as several: {ours} m, {record['code']}"
        )
    off = record.get("rows_beyond", 0.0)
    if off > FAR_ROW and off > BARS * bar:
        frequency, row, there, own = record["rows_beyond_row"]
        out["frf_row"] = (
            f"frf at {frequency:.6f} Hz: {row:.6e} m; time integration {there:.6e} m there, and no motion nearer than {off:.2e} "
            f"(logarithms of frequency and amplitude), bar of the row {own:.2e}, of the peak {bar:.2e}"
        )
    return out


class TooLong(Exception):
    """Raised when the judge exceeds its time limit."""


def too_long(number, frame):
    raise TooLong


def one(program, seed, number, judged=True, sets=()):
    """Draws, runs and judges a scene."""
    scene = drawn(seed, number)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        result = run(program, scene.toml(), folder, "scene", sets)
        record = {
            "seed": seed, "number": number, "what": scene.what, "code": result.code, "seconds": result.seconds, "killed": result.killed,
            "error": result.error.splitlines()[-1] if result.error and result.code else "",
        }
        own_words(scene, result, record)
        if scene.pair is not None:
            other = run(program, scene.toml(scene.pair), folder, "pair", sets)
            record["pair_code"] = other.code
            if other.row is not None and result.row is not None:
                record["pair_peak"] = other.row["peak_amplitude"]
                record["pair_error"] = abs(other.row["peak_amplitude"] / result.row["peak_amplitude"] - 1.0)
            elif (other.row is None) != (result.row is None):
                record["pair_error"] = 1.0
                record["pair_peak"] = None if other.row is None else other.row["peak_amplitude"]
    if judged:
        begin = time.process_time()
        signal.signal(signal.SIGVTALRM, too_long)
        signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST_JUDGED)
        try:
            judge(scene, result, record)
        except TooLong:
            record["judge_cut"], record["peak"] = True, "not all seen"
        except Exception as error:  # The record reports the failure of the judge, and the other scenes continue.
            record["judge_failed"] = f"{type(error).__name__}: {error}"
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        record["judge_seconds"] = time.process_time() - begin
    record["classes"] = classes(record)
    return record


def tell(records, out=sys.stdout):
    """Prints the table of counts."""
    total = len(records)
    for record in records:
        record["classes"] = classes(record)

    def line(name, count, of, more=""):
        share = f"{100.0 * count / of:5.1f} %" if of else "      -"
        print(f"{name:58} {count:5d} of {of:5d}  {share}  {more}", file=out)

    codes = collections.Counter("killed" if r["killed"] else r["code"] for r in records)
    print(f"\n{total} scenes; exit codes: " + ", ".join(f"{code}: {n}" for code, n in sorted(codes.items(), key=str)), file=out)
    seconds = sorted(r["seconds"] for r in records)
    slow = sum(s > SLOW for s in seconds)
    line(f"more than {SLOW:g} CPU seconds", slow, total, f"median {statistics.median(seconds):.2f}, largest {seconds[-1]:.1f}")
    failed = [r for r in records if r["code"] == 3]
    periodic = [r for r in failed if r.get("settles") and all(name == "period 1" for name in r["settles"])]
    line("exit code 3 where time integration has period 1", len(periodic), total, f"{len(failed)} in all")
    told = [r for r in records if "peak" in r]
    kinds = collections.Counter(r["peak"] for r in told)
    for name in ("right", "right, of the stable", "right, unstable", "lower peak", "too low", "too high", "no such peak", "not all seen"):
        line(f"peak: {name}", kinds.get(name, 0), len(told))
    wrong = [r for r in told if r["peak"] in ("too low", "too high", "lower peak", "no such peak")]
    for limit in (1e-4, 1e-3, 1e-2, 0.1):
        line(f"peak: error beyond its bar and above {limit:g}", sum(abs(r.get("peak_error", 1.0)) > limit for r in wrong), len(told))
    counts = collections.Counter(name for r in records for name in r["classes"])
    for name, count in sorted(counts.items()):
        line(f"class {name}", count, total)
    rows = [r for r in records if "rows_worst" in r]
    if rows:
        worst = [r["rows_worst"] for r in rows]
        off = [r["rows_off"] for r in rows]
        print(f"rows of frf: largest distance from any motion, median {statistics.median(off):.1e}, the worst {max(off):.1e}", file=out)
        print(f"rows of frf, at their frequency: median of medians {statistics.median(r['rows_median'] for r in rows):.1e}, "
              f"median of the worst {statistics.median(worst):.1e}, the worst {max(worst):.1e}; without a motion there: "
              f"{sum(r['rows_without'] for r in rows)}, unstable: {sum(r['rows_unstable'] for r in rows)}", file=out)
    pairs = [r for r in records if "pair_code" in r]
    line("pairs of the same loads that differ", sum("pair_differs" in r["classes"] for r in pairs), len(pairs))
    frictions = [r["frf_friction_worst"] for r in records if "frf_friction_worst" in r]
    if frictions:
        print(f"smallest friction energy of a row over its input: {min(frictions):.1e}", file=out)
    balances = [abs(r["judge_imbalance"]) for r in records if "judge_imbalance" in r]
    if balances:
        print(f"judge: worst energy balance {max(balances):.1e}, median {statistics.median(balances):.1e}; "
              f"failed on {sum('judge_failed' in r for r in records)} scenes, "
              f"on {sum(r.get('judge_unsolved', 0) for r in records)} of {sum(r.get('places', 0) for r in records)} motions; "
              f"seconds per scene: median {statistics.median(r['judge_seconds'] for r in records):.1f}, "
              f"largest {max(r['judge_seconds'] for r in records):.1f}", file=out)


def held(records, table):
    """Compares records with a table and prints the counts; returns whether all requirements are met."""
    with open(table, encoding="utf-8") as lines:
        before = {int(row["number"]): row for row in csv.DictReader(lines)}
    known = [r for r in records if before[r["number"]]["peak_amplitude"] and float(before[r["number"]]["error_peak_amplitude"]) < KNOWN_BAR]
    again, lost = 0, []
    for record in known:
        row = before[record["number"]]
        off = (record.get("peak_amplitude") or 0.0) / float(row["peak_amplitude"]) - 1.0
        again += abs(off) <= AGAIN
        if abs(off) > AGAIN:
            bar = record.get("error_peak_amplitude")
            lost.append(f"{record['number']}: error {off:+.1%}, bar {'none' if bar is None else f'{bar:.1e}'}")
    failed = [r["number"] for r in records if r["code"] == 3]
    above = [r["number"] for r in records if r.get("frf_above", -1.0) > FLAT]
    bound = [(r["number"], r["peak_bound"], before[r["number"]]["true_peak"]) for r in records if r.get("peak_bound")]
    beyond = [number for number, most, true in bound if true and float(true) > most]
    print(f"peaks found again within {AGAIN:.0%}: {again} of {len(known)}; missed: {'; '.join(lost) or 'none'}")
    print(f"exit code 3: {len(failed)} of {len(records)} {failed}")
    print(f"a row above the peak: {above}")
    print(f"a motion in time above peak_bound: {beyond} of {len(bound)}")
    print(f"CPU seconds: median {statistics.median(r['seconds'] for r in records):.2f}")
    return again >= 0.95 * len(known) and len(failed) <= 0.05 * len(records) and not above and not beyond


def plain(value):
    """Converts a number of numpy for JSON."""
    return value.item()


def keep(record, folder, kept):
    """Copies a failing scene."""
    for name, line in record["classes"].items():
        if kept[name] < KEPT:
            kept[name] += 1
            scene = drawn(record["seed"], record["number"])
            path = folder / f"{name}_{record['seed']}_{record['number']}.toml"
            text = scene.toml()
            if name == "pair_differs":
                text += "\n# As one load:\n" + "".join(f"# {row}\n" for row in scene.toml(scene.pair).splitlines())
            path.write_text(f"# {line}\n{text}", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", help="the fretwear program")
    parser.add_argument("--count", type=int, default=40, help="number of scenes")
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="number of scenes at a time")
    parser.add_argument("--only", type=int, action="append", help="run only the scene with this number; may be repeated")
    parser.add_argument("--output", type=Path, help="file for one line of JSON per scene")
    parser.add_argument("--failures", type=Path, help="folder for copies of failing scenes")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="passed to fretwear run")
    parser.add_argument("--no-judge", action="store_true", help="run the scenes, without time integration")
    parser.add_argument("--print", action="store_true", help="print the scenes without running them")
    parser.add_argument("--held", type=Path, metavar="TABLE", help="compare the 200 scenes of seed 7318 with a table")
    parser.add_argument("--tell", type=Path, nargs="+", metavar="RESULTS", help="print only the table of counts of earlier results")
    arguments = parser.parse_args()
    if arguments.tell:
        tell([json.loads(line) for path in arguments.tell for line in path.read_text(encoding="utf-8").splitlines()])
        return
    if arguments.held:
        arguments.seed, arguments.count, arguments.no_judge = 7318, 200, True
    numbers = arguments.only or range(arguments.first, arguments.first + arguments.count)
    if arguments.print:
        for number in numbers:
            print(f"# seed {arguments.seed}, number {number}\n{drawn(arguments.seed, number).toml()}")
        return
    if arguments.program is None:
        parser.error("--program is required")
    program = str(Path(arguments.program).resolve())
    if arguments.failures:
        arguments.failures.mkdir(parents=True, exist_ok=True)
    kept, records = collections.Counter(), []
    output = open(arguments.output, "w", encoding="utf-8") if arguments.output else None

    def take(record):
        records.append(record)
        if output:
            output.write(json.dumps(record, default=plain) + "\n")
            output.flush()
        if arguments.failures:
            keep(record, arguments.failures, kept)
        words = "; ".join(f"{name}: {line}" for name, line in record["classes"].items()) or record.get("peak") or "the run has no peak"
        if record["code"] == 3 and not record["classes"]:
            words = f"exit code 3; settles to {', '.join(record.get('settles', ['not judged']))}"
        if "judge_failed" in record:
            words += f"; judge failed: {record['judge_failed']}"
        seconds = f"{record['seconds']:6.2f} s {record.get('judge_seconds', 0.0):6.1f} s"
        print(f"{record['number']:5d} {record['what']:24} {seconds}  {words}", flush=True)

    judged = not arguments.no_judge
    if arguments.jobs == 1:
        for number in numbers:
            take(one(program, arguments.seed, number, judged, arguments.set))
    else:
        with concurrent.futures.ProcessPoolExecutor(arguments.jobs) as pool:
            for record in pool.map(one, *zip(*[(program, arguments.seed, number, judged, arguments.set) for number in numbers])):
                take(record)
    if output:
        output.close()
    if arguments.held:
        sys.exit(not held(records, arguments.held))
    tell(records)
    if arguments.only and len(records) == 1:
        print(json.dumps(records[0], indent=1, default=plain))
    wrong = sum(bool(record["classes"]) for record in records)
    sys.exit(wrong > MOST_WRONG * len(records))


if __name__ == "__main__":
    main()
