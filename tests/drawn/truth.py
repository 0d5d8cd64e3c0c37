"""Reference solutions of drawn scenes with their error: worn volume and field, dissipation, pressure and force range.

    python truth.py scene.toml ... [--samples 32] [--tolerance 1.6e-2] [--goal 1e-3] [--again]

The dense reference (dense.py) wears each scene: its cycles use BDF2, extrapolated from `samples` and half of them, and its wear steps meet
a tolerance. The script doubles the samples, and divides the tolerance of the steps by eight, until each refinement changes the volume by
less than the goal. It writes to the folder of the scene

    NAME.truth.json      the figures, and the last changes due to samples and to wear steps (volume, and L1 norm of the field)
    NAME.truth.parquet   one row per cell: i, j, wear_depth, dissipation and pressure of the first and the last cycle

The pressure is the pressure under contact.normal_load, also if the load varies. The script skips scenes that have a reference.
"""

import argparse
import json
import pathlib
import time

import dense
import numpy as np
import polars as pl


def figures(joint, depth, cycle):
    pressed = joint.press(joint.heights - depth, joint.load, "figures")
    pressure = pressed.pressure
    return pressure, {
        "dissipated_energy": cycle.energy.sum() * joint.cell,
        "max_pressure": pressure.max(),
        "loaded_area_fraction": float((pressure > 1e-3 * pressure.max()).mean()),
        "contact_area_fraction": float((pressure > 0).mean()),
        "approach": pressed.approach,
        "contact_violation": pressed.violation,
        "force_x": [cycle.forces[:, 0].min(), cycle.forces[:, 0].max()],
        "force_y": [cycle.forces[:, 1].min(), cycle.forces[:, 1].max()],
        "moment_z": [cycle.forces[:, 2].min(), cycle.forces[:, 2].max()],
        "marches": cycle.marches,
    }


class Worn:
    """Runs of one scene, by samples and tolerance."""

    def __init__(self, path, limit):
        self.joint = dense.Joint.read(path)
        self.limit = limit
        self.began = time.process_time()
        self.runs = {}

    def __call__(self, samples, tolerance):
        if (samples, tolerance) not in self.runs:
            began = time.process_time()

            def progress(part, steps, rejected, depth):
                if time.process_time() - self.began > self.limit:
                    raise TimeoutError(f"{part:.2f} of the cycles with {samples} samples at {tolerance:.1e}")

            worn = dense.wear(self.joint, samples, tolerance, progress=progress)
            print(
                f"  {samples} samples, tolerance {tolerance:.1e}: {worn.depth.sum() * self.joint.cell:.6e} m^3, "
                f"{worn.steps} steps, {worn.rejected} rejected, {worn.evaluations} cycles, "
                f"{time.process_time() - began:.0f} s",
                flush=True,
            )
            self.runs[samples, tolerance] = worn
        return self.runs[samples, tolerance]


def relative(one, other):
    """Returns the differences of the volumes and of the fields (L1 norm) of two runs, over the volume of `one`."""
    volume = one.depth.sum()
    return abs(one.depth.sum() - other.depth.sum()) / volume, np.abs(one.depth - other.depth).sum() / volume


def truth(path, samples, tolerance, goal, limit):
    runs = Worn(path, limit)
    joint = runs.joint
    if joint.drive.rows:  # finally one step per row: BDF2 has second order if the velocity does not jump
        samples = joint.drive.rows // 2
    began = time.process_time()
    note = ""
    while True:
        fine = runs(2 * samples, tolerance / 8)
        by_steps = relative(fine, runs(2 * samples, tolerance))
        by_samples = relative(fine, runs(samples, tolerance / 8))
        best = (fine, by_steps, by_samples, 2 * samples, tolerance / 8)
        if by_steps[0] < goal and by_samples[0] < goal:
            break
        try:
            if by_steps[0] >= goal:
                tolerance /= 8
            if by_samples[0] >= goal:
                samples *= 2
            runs(2 * samples, tolerance / 8)
        except TimeoutError as late:
            note = f"stopped before the goal, at {late}"
            break
    fine, by_steps, by_samples, samples, tolerance = best
    first_pressure, first = figures(joint, np.zeros_like(fine.depth), fine.first)
    last_pressure, last = figures(joint, fine.depth, fine.last)
    # Second discretisation of time on the unworn surface: first order, extrapolated.
    one, two = (joint.cycle(joint.heights, m, "euler").energy.sum() * joint.cell for m in (samples, 2 * samples))
    result = {
        "volume": fine.depth.sum() * joint.cell,
        "error_volume": by_steps[0] + by_samples[0],
        "error_field": by_steps[1] + by_samples[1],
        "change_by_steps": by_steps,
        "change_by_samples": by_samples,
        "samples": samples,
        "tolerance": tolerance,
        "wear_steps": fine.steps,
        "estimate_of_steps": fine.estimate,
        "change_of_cycles": fine.change,
        "max_depth": fine.depth.max(),
        "rq": joint.heights.std(),
        "cycles": joint.wear["cycles"],
        "first": first,
        "last": last,
        "first_dissipation_euler": [one, two, 2 * two - one],
        "worst_friction_residual": joint.friction.worst,
        "seconds": time.process_time() - began,
        "note": note,
    }
    i, j = (index.ravel() for index in np.indices(joint.grid))
    table = pl.DataFrame(
        {
            "i": i,
            "j": j,
            "wear_depth": fine.depth,
            "dissipation_first": fine.first.energy,
            "dissipation_last": fine.last.energy,
            "pressure_first": first_pressure,
            "pressure_last": last_pressure,
        }
    )
    table.write_parquet(path.with_suffix(".truth.parquet"))
    path.with_suffix(".truth.json").write_text(json.dumps(result, indent=1, default=float) + "\n", encoding="utf-8")
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=pathlib.Path)
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--tolerance", type=float, default=1.6e-2)
    parser.add_argument("--goal", type=float, default=1e-3)
    parser.add_argument("--limit", type=float, default=1500.0, help="CPU seconds after which the refinement ends")
    parser.add_argument("--again", action="store_true")
    options = parser.parse_args()
    for path in options.scenes:
        if path.with_suffix(".truth.json").exists() and not options.again:
            continue
        print(path, flush=True)
        try:
            result = truth(path, options.samples, options.tolerance, options.goal, options.limit)
        except (dense.NotSolved, TimeoutError) as failure:
            print(f"  {type(failure).__name__}: {failure}", flush=True)
            continue
        print(
            f"  {result['volume']:.6e} m^3 +- {result['error_volume']:.1e}, field {result['error_field']:.1e}, "
            f"deepest {result['max_depth'] / result['rq']:.2f} Rq, {result['seconds']:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
