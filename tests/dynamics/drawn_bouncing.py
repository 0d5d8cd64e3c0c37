#!/usr/bin/env python3
"""Masses that bounce along their normal under light damping: what `fretwear run` says of their peak, against motions in closed form.

    python tests/dynamics/drawn_bouncing.py --program target/release/fretwear [--count N] [--seed S] [--only K] [--keep FOLDER]

Wants numpy, numba and pyarrow. Each mass is pressed on a contact 3 to 60 times as stiff as its spring, under damping ratios of
1e-4 to 1e-3, and driven at 0.25 to 1 times the frequency of the closed contact. It may bounce once or several times in a period,
seldom stable, far above what stays closed.

Between opening and closing the motion is a sum of harmonics and one that decays. Its periodic motions are begun in two ways: from
those without loads and damping, at six instants of their swing; and from those without damping that stand still where the force is
largest and half a period later. They are followed by arc length in state and frequency, beyond the range by 30 %. The largest
first harmonic in the range is what a peak may not be below by more than its bar. It may be above it by what lies between two
points of a path, as it may be a motion that the judge has not found.
"""

import argparse
import cmath
import json
import math
import resource
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from numba import njit

TURN = 2.0 * math.pi
# A path is followed so far beyond the range.
AWAY = 1.3
# What rounding leaves of a motion in closed form, and what lies between two points of a path.
ROUNDING = 1e-6
COARSE = 0.02
SAMPLES = 256


@njit(cache=True)
def driven(mass, damping, stiffness, rest, force, rate, time):
    """Steady motion on one spring under the real part of force exp(i rate t): displacement, velocity."""
    wave = force / complex(stiffness - mass * rate * rate, damping * rate) * complex(math.cos(rate * time), math.sin(rate * time))
    return rest + wave.real, -rate * wave.imag


@njit(cache=True)
def later(model, force, rate, spring, time, z, v, after):
    mass, damping, edge = model[0], model[1], model[6]
    stiffness, rest = model[2 + spring], model[4 + spring] / model[2 + spring]
    z0, v0 = driven(mass, damping, stiffness, rest, force, rate, time)
    z1, v1 = driven(mass, damping, stiffness, rest, force, rate, time + after)
    decay = 0.5 * damping / mass
    own = math.sqrt(stiffness / mass - decay * decay)
    sine, cosine, left = math.sin(own * after), math.cos(own * after), math.exp(-decay * after)
    dz, dv = z - z0, v - v0
    slope = (dv + decay * dz) / own
    return z1 + left * (dz * cosine + slope * sine), v1 + left * (dv * cosine - (own * dz + decay * slope) * sine)


@njit(cache=True)
def moved(model, force, rate, time, z, v, span):
    """The state a span after a time, through openings and closings, and whether they came to an end."""
    mass, edge, end = model[0], model[6], time + span
    spring = 1 if z > edge or (z == edge and v > 0.0) else 0
    for _ in range(4000):
        step = TURN / 16.0 / max(rate, math.sqrt(model[2 + spring] / mass))
        while True:
            h = min(step, end - time)
            z1, v1 = later(model, force, rate, spring, time, z, v, h)
            if (z1 > edge) == (spring == 1) or z1 == edge:
                time, z, v = time + h, z1, v1
                if time >= end:
                    return z, v, True
                continue
            low, high = 0.0, h
            for _ in range(60):
                middle = 0.5 * (low + high)
                zm, _ = later(model, force, rate, spring, time, z, v, middle)
                if (zm > edge) == (spring == 1):
                    low = middle
                else:
                    high = middle
            z, v = later(model, force, rate, spring, time, z, v, high)
            time, spring = time + high, 1 - spring
            break
        if time >= end:
            return z, v, True
    return z, v, False


@njit(cache=True)
def sizes(model, force, rate, z, v):
    """Half ranges of the first harmonic and of the motion."""
    wave, low, high = 0j, z, z
    step = TURN / rate / SAMPLES
    for k in range(SAMPLES):
        angle = TURN * k / SAMPLES
        wave += z * complex(math.cos(angle), -math.sin(angle))
        low, high = min(low, z), max(high, z)
        z, v, _ = moved(model, force, rate, k * step, z, v, step)
    return 2.0 / SAMPLES * abs(wave), 0.5 * (high - low)


class Mass:
    """Displacements are from where the pressed contact rests."""

    def __init__(self, scene):
        m, c, k, kn, load = (scene[name] for name in ("mass", "damping", "k", "kn", "load"))
        self.model = np.array([m, c, k, k + kn, load, 0.0, -load / kn])
        self.force = scene["force"] * cmath.exp(1j * math.radians(scene["phase"]))
        self.own = [math.sqrt(stiffness / m) for stiffness in self.model[2:4]]

    def altered(self, damping, force):
        other = Mass.__new__(Mass)
        other.model, other.force, other.own = self.model.copy(), complex(force), self.own
        other.model[1] *= damping
        return other

    def after(self, rate, time, y, span):
        z, v, ended = moved(self.model, self.force, rate, time, y[0], y[1], span)
        return np.array([z, v]) if ended else None

    def sizes(self, rate, y):
        return sizes(self.model, self.force, rate, y[0], y[1])

    def defect(self, point, units):
        """How far a point (state and logarithm of frequency in units) is from periodic, and the slopes of that."""
        def at(point):
            y, rate = point[:2] * units[:2], math.exp(point[2] * units[2])
            return (self.after(rate, 0.0, y, TURN / rate) - y) / units[:2]

        here = at(point)
        shifted = [at(point + 1e-6 * axis) for axis in np.eye(3)]
        return here, np.column_stack([(there - here) / 1e-6 for there in shifted])

    def corrected(self, guess, across, units, steps):
        """The point in the plane through a guess across a direction, the direction of the path there, and Newton's steps."""
        point = guess.copy()
        for step in range(1, steps + 1):
            try:
                defect, slopes = self.defect(point, units)
                change = np.linalg.solve(np.vstack([slopes, across]), -np.append(defect, across @ (point - guess)))
            except (TypeError, np.linalg.LinAlgError):
                return None
            if not np.linalg.norm(change) < 1.5:
                return None
            point = point + change
            if np.linalg.norm(change) < 1e-9:
                along = np.cross(slopes[0], slopes[1])
                return point, along / np.linalg.norm(along), step
        return None

    def periodic(self, rate, y):
        """The periodic state near another at a frequency."""
        size = max(abs(y[0]), abs(y[1]) / self.own[1], 1e-12)
        units = np.array([size, size * max(rate, self.own[0]), 1.0])
        guess = np.array([y[0] / units[0], y[1] / units[1], math.log(rate)])
        found = self.corrected(guess, np.array([0.0, 0.0, 1.0]), units, 20)
        if found is None:
            return None
        y = found[0][:2] * units[:2]
        whole = self.sizes(rate, y)[1]
        off = self.after(rate, 0.0, y, TURN / rate) - y
        is_periodic = whole > 0.0 and max(abs(off[0]), abs(off[1]) / self.own[1]) < 1e-7 * whole
        return y if is_periodic else None

    def path(self, rate, y, low, high, sign, most=300):
        """Points (frequency, state, first harmonic) from a periodic state, towards higher or lower frequencies first."""
        size, whole = self.sizes(rate, y)
        points = [(rate, y, size)]

        def units_of(whole, rate):
            return np.array([whole, whole * max(rate, self.own[0]), 0.5])

        units = units_of(whole, rate)
        point = np.array([y[0] / units[0], y[1] / units[1], math.log(rate) / units[2]])
        along = np.cross(*self.defect(point, units)[1])
        along *= sign * np.sign(along[2]) / np.linalg.norm(along)
        step = 0.01
        while len(points) < most and step > 1e-5:
            guess = point + step * along
            found = self.corrected(guess, along, units, 8)
            if found is None or np.linalg.norm(found[0] - guess) > 0.5 * step or abs(found[1] @ along) < 0.9:
                step *= 0.5
                continue
            point, along = found[0], found[1] * np.sign(found[1] @ along)
            rate, y = math.exp(point[2] * units[2]), point[:2] * units[:2]
            size, whole = self.sizes(rate, y)
            points.append((rate, y, size))
            if not low <= rate <= high:
                break
            step = min(1.5 * step, 0.1) if found[2] <= 3 else step
            other = units_of(whole, rate)
            point, along, units = point * units / other, along * units / other, other
            along /= np.linalg.norm(along)
        return points

    def swinging(self, low, high):
        """Frequencies and states of motions without loads and damping, at six instants, that swing up to four times in a period."""
        edge, free = self.model[6], self.altered(0.0, 0.0)
        rests = self.model[4:6] / self.model[2:4] - edge
        unit = abs(rests[1]) * self.own[1]
        for swings in (1, 2, 3, 4):
            for k in range(24):
                speed = 0.02 * 1.35**k * unit
                out = 2.0 / self.own[0] * math.atan2(speed / self.own[0], rests[0])
                within = 2.0 / self.own[1] * math.atan2(speed / self.own[1], -rests[1])
                period = out + within
                rate = TURN / period / swings
                if low <= rate <= high:
                    for j in range(6):
                        yield rate, free.after(rate, 0.0, np.array([edge, speed]), j / 6.0 * period)

    def standing(self, low, high):
        """Periodic states that grow with damping from motions that stand still at the largest force and half a period later."""
        edge, turned, alone = self.model[6], self.altered(0.0, abs(self.force)), self.altered(0.0, self.force)
        unit = abs(self.model[5] / self.model[3] - edge)
        apart = unit * np.geomspace(1e-2, 1e3, 200)
        places = np.concatenate([edge - apart[::-1], edge + apart])
        for rate in np.geomspace(low, high, 9):
            def speed(z):
                half = turned.after(rate, 0.0, np.array([z, 0.0]), 0.5 * TURN / rate)
                return math.nan if half is None else half[1]

            speeds = [speed(z) for z in places]
            for a, b, fa, fb in zip(places, places[1:], speeds, speeds[1:]):
                if not fa * fb < 0.0:
                    continue
                for _ in range(20):
                    middle = 0.5 * (a + b)
                    a, b = (middle, b) if speed(middle) * fa > 0.0 else (a, middle)
                begin = (-cmath.phase(self.force)) % TURN / rate
                y = alone.after(rate, begin, np.array([a, 0.0]), TURN / rate - begin)
                share, step = 0.0, 1.0
                while y is not None and share < 1.0 and step > 0.02:
                    next_share = min(1.0, share + step)
                    found = self.altered(next_share, self.force).periodic(rate, y)
                    if found is None:
                        step *= 0.5
                    else:
                        share, y = next_share, found
                if y is not None and share == 1.0:
                    yield rate, y

    def peak(self, low, high):
        """The largest first harmonic in a range that is found, and where."""
        paths, best = [], (0.0, 0.0)
        begun = list(self.swinging(low / AWAY, high * AWAY)) + list(self.standing(low, high))
        # What stays closed.
        steady = [driven(*self.model[[0, 1, 3]], 0.0, self.force, rate, 0.0) for rate in np.geomspace(low, high, 9)]
        begun += zip(np.geomspace(low, high, 9), map(np.array, steady))
        for rate, state in begun:
            y = None if state is None else self.periodic(rate, state)
            if y is None:
                continue
            size = self.sizes(rate, y)[0]
            pairs = (pair for path in paths for pair in zip(path, path[1:]))
            if any((a[0] - rate) * (b[0] - rate) <= 0.0 and (a[2] / size - 1.03) * (b[2] / size - 0.97) <= 0.0 for a, b in pairs):
                continue
            path = self.path(rate, y, low / AWAY, high * AWAY, -1.0)[::-1] + self.path(rate, y, low / AWAY, high * AWAY, 1.0)[1:]
            paths.append(path)
            inside = [(point[2], point[0]) for point in path if low <= point[0] <= high]
            for a, b in zip(path, path[1:]):
                for end in (low, high):
                    if (a[0] - end) * (b[0] - end) < 0.0:
                        share = math.log(end / a[0]) / math.log(b[0] / a[0])
                        y = self.periodic(end, a[1] + share * (b[1] - a[1]))
                        inside += [] if y is None else [(self.sizes(end, y)[0], end)]
            best = max([best, *inside])
        return best


def drawn(seed, number):
    draw = np.random.default_rng([seed, number])

    def log_uniform(low, high):
        return float(f"{10.0 ** draw.uniform(math.log10(low), math.log10(high)):.6g}")

    mass = log_uniform(0.1, 5.0)
    k = float(f"{(TURN * log_uniform(30.0, 300.0)) ** 2 * mass:.6g}")
    kn = float(f"{k * log_uniform(3.0, 60.0):.6g}")
    closed = math.sqrt((k + kn) / mass)
    load = log_uniform(1.0, 300.0)
    middle = closed / TURN * log_uniform(0.25, 1.0)
    return {
        "mass": mass,
        "k": k,
        "kn": kn,
        "damping": float(f"{2.0 * log_uniform(1e-4, 1e-3) * closed * mass:.6g}"),
        "load": load,
        "force": float(f"{load * log_uniform(3e-2, 1.5):.6g}"),
        "phase": round(draw.uniform(-180.0, 180.0), 1),
        "range": [round(middle * draw.uniform(0.9, 0.98), 4), round(middle * draw.uniform(1.02, 1.15), 4)],
    }


def toml(scene):
    def three(value, unit):
        return json.dumps([f"{value!r} {unit}"] * 3)

    low, high = scene["range"]
    return f"""title = "a mass that may bounce"
[structure]
kind = "oscillator"
mass = {three(scene["mass"], "kg")}
damping = {three(scene["damping"], "N s/m")}
stiffness = {three(scene["k"], "N/m")}
[contact]
kn = "{scene["kn"]!r} N/m"
kt = "{0.7 * scene["kn"]!r} N/m"
friction_coefficient = 0.3
normal_load = "{scene["load"]!r} N"
[dynamics]
force = [{{ amplitude = "{scene["force"]!r} N", direction = "z", phase = "{scene["phase"]!r} deg" }}]
response = {{ direction = "z" }}
frequency = ["{low!r} Hz", "{high!r} Hz"]
"""


def told(program, scene, folder):
    """Peak, its bar and the CPU seconds of a run; none where it does not converge."""
    path = folder / "scene.toml"
    path.write_text(toml(scene))
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([program, "run", path, "--run", folder / "run", "--threads", "1", "-q"], capture_output=True, text=True)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    if done.returncode != 0:
        return None, done.stderr.strip().splitlines()[-1], seconds
    row = pq.read_table(folder / "run" / "history.parquet").to_pylist()[-1]
    return row["peak_amplitude"], row["error_peak_amplitude"], seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int)
    parser.add_argument("--keep", type=Path, help="folder for the scenes that are wrong")
    arguments = parser.parse_args()
    numbers = range(arguments.count) if arguments.only is None else [arguments.only]
    counts = dict.fromkeys(["right", "not known", "below by more than the bar", "above what is found", "not converged"], 0)
    for number in numbers:
        scene = drawn(arguments.seed, number)
        low, high = (TURN * end for end in scene["range"])
        true, at = Mass(scene).peak(low, high)
        with tempfile.TemporaryDirectory() as folder:
            peak, bar, seconds = told(arguments.program, scene, Path(folder))
        if peak is None:
            verdict = "not converged"
        elif true > peak * (1.0 + bar + ROUNDING):
            verdict = "below by more than the bar"
        elif bar >= 1.0:
            verdict = "not known"
        else:
            verdict = "above what is found" if peak * (1.0 - bar) > true * (1.0 + COARSE) else "right"
        counts[verdict] += 1
        figures = f"{peak:.5e} m +- {bar:.1e}" if peak is not None else bar
        print(f"{number:5} {true:.5e} m at {at / TURN:.4f} Hz; told {figures}, {seconds:.1f} CPU s: {verdict}", flush=True)
        if verdict == "below by more than the bar" and arguments.keep is not None:
            arguments.keep.mkdir(parents=True, exist_ok=True)
            (arguments.keep / f"{arguments.seed}_{number}.toml").write_text(toml(scene))
    print(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    raise SystemExit(counts["below by more than the bar"] > 0)


if __name__ == "__main__":
    main()
