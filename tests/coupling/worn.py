"""One small rough joint with a wearing surface, and one cycle under a varying normal load.

    python worn.py FOLDER [--steps 40] [--instants 24 48]     (numpy, scipy, pypardiso, pyarrow)

Blocks, mesh with one element per cell, and surface `a` are the same as in truth.py.

`worn`: the head moves at a constant amplitude for a million cycles. At each node, the two faces together lose the depth w:

    dw/dn = alpha e,     e: energy per area and cycle, alpha: wear coefficient of both faces

Heun's method integrates w with the mean of two energies: the energy at the start of a step, and the energy of the predicted surface at
the end. For each energy, the script presses the worn surface anew and computes a cycle from rest as in truth.py. With 20 instead of 40
steps, the last volume changes by 0.002 %, and the depth of the cells by 0.02 %. No node comes back into contact.

`varying`: the normal load follows the head, N(t) = N0 (1 + 0.3 cos t) and x(t) = d cos t. The head starts at x = 0 under N0, a quarter of
a cycle before +d. The tables contain the second cycle; the third cycle has 0.2 % less energy. At each instant, the pressure p follows only
from N(t), and |q| <= mu p. A node without contact has no shear. A node that comes into contact has no shear at this instant, and its slip
starts from zero. The energy of a node is the sum of q ds over the steps, with the shear q at the end of each step.

    worn.parquet             one row per checkpoint: cycles, worn volume [m^3], energy per cycle [J], force at +d [N], contact area
    worn_element.parquet     one row per checkpoint and contact element: normal load, force at +d, energy per cycle
    worn_cell.parquet        one row per checkpoint and cell: mean wear depth [m], mean pressure [Pa]
    varying.parquet          one row per relative amplitude of the load and number of instants: forces at +d and -d, energy, mean load
    varying_element.parquet  one row per row of varying.parquet and contact element: mean load, load at +d, energy
    worn.json                the wear coefficient [um^3/J], amplitudes [m], and the steps

The first energy of `worn` and the cycle with constant load repeat truth.py; the script checks both. One core takes eight minutes. The
folder worn/ contains the result.
"""

import argparse
import json
import pathlib
import time

import numpy as np

import plates
import truth

SURFACE = "a"
# Wear coefficient [m^3/J].
ALPHA = 3900e-18
CHECKPOINTS = (0, 100_000, 300_000, 1_000_000)
# Shares of the friction limit at the amplitudes of the head.
WEAR_PART, VARYING_PART = 0.97, 0.8
SWING = 0.3


class Block(truth.Block):
    """A block that stores the computed columns of each node."""

    def columns(self, axis, places):
        known = self.__dict__.setdefault("known", {})
        keys = [(axis, *place) for place in places.tolist()]
        missing = [key for key in keys if key not in known]
        if missing:
            found = super().columns(axis, np.array([place for _, *place in missing]))
            known |= {key: found[:, n] for n, key in enumerate(missing)}
        axes = np.size(axis)
        return np.array([known[key] for key in keys]).reshape(len(keys), axes, axes, *(n + 1 for n in self.counts)).swapaxes(0, 1)


class Joint(truth.Joint):
    """The joint with changing load and heights."""

    def __init__(self, block, name):
        super().__init__(block, name)
        self.guesses = {}

    def march(self, loads, places):
        """Shear (2, nodes ever in contact), energy of the nodes and duality gap [J] after each step of the head. The march starts from
        rest at the first position under the first load."""
        self.contact = np.any(loads, axis=0)
        compliance = self.dense(self.contact)
        self.steepest = truth.power(compliance)
        pressed = [load[self.contact] for load in loads]
        shear, out = np.zeros(2 * len(pressed[0])), []
        for n in range(1, len(places)):
            touching = (pressed[n] > 0) & (pressed[n - 1] > 0)
            both = np.tile(touching, 2)
            # The release of shear at nodes that lose contact moves the other nodes.
            released = (compliance @ np.where(both, 0.0, shear))[both]
            guess = self.guesses[n][:, self.contact].ravel()[both] if n in self.guesses else None
            limit = truth.FRICTION * pressed[n][touching]
            matrix = compliance if both.all() else compliance[np.ix_(both, both)]
            found, slip, gap = self.step(matrix, limit, shear[both], places[n] - places[n - 1], released, guess)
            shear, energy = np.zeros(len(both)), np.zeros(len(touching))
            shear[both] = found
            energy[touching] = (found * slip).reshape(2, -1).sum(axis=0)
            out.append((shear.reshape(2, -1), energy, gap * limit @ np.hypot(*slip.reshape(2, -1))))
        return out

    def field(self, values):
        """Values of the nodes in contact as fields."""
        field = np.zeros((*values.shape[:-1], *self.contact.shape))
        field[..., self.contact] = values
        return field

    def steady(self, amplitude):
        """Fields of the newly pressed joint: load of the nodes, shear along x at +d, energy of the steady cycle."""
        load, _, _ = self.normal()
        steps = truth.STEPS
        branch = np.linspace(1, -1, 2 * steps + 1)[1:]
        places = amplitude * np.r_[np.linspace(0, 1, steps + 1), branch, -branch]
        out = self.march([load] * len(places), places)
        # The next surface is similar, so each step of its march starts from the shear of this march.
        self.guesses = {n + 1: self.field(shear) for n, (shear, *_) in enumerate(out)}
        return load, self.field(out[-1][0][0]), self.field(2 * sum(energy for _, energy, _ in out[3 * steps :]))

    def wear(self, amplitude, steps):
        """Rows of the tables `worn`, `worn_element` and `worn_cell`."""
        began, rows = time.time(), {"worn": [], "worn_element": [], "worn_cell": []}
        fresh, depth, step = self.height, np.zeros_like(self.height), CHECKPOINTS[-1] / steps
        before, entries = np.zeros(fresh.shape, bool), np.zeros(fresh.shape, int)
        for n in range(steps + 1):
            self.height = fresh - depth
            load, shear, energy = self.steady(amplitude)
            entries += (load > 0) & ~before
            before = load > 0
            key = {"cycles": round(n * step)}
            row = key | {
                "worn_volume": (depth * self.area).sum(), "energy": energy.sum(), "force_x": shear.sum(),
                "contact_area": self.area[before].sum(),
            }
            if key["cycles"] in CHECKPOINTS:
                rows["worn"].append(row)
                shares = self.element_shares()
                for e, (p, q, w) in enumerate(shares @ np.array([load, shear, energy])[:, self.contact].T):
                    rows["worn_element"].append(key | {"element": e, "normal_load": p, "force_x": q, "energy": w})
                # Worn nodes may have lost contact.
                self.contact = np.ones_like(before)
                pressure, worn = (self.to_cells(field.ravel()) for field in (load, depth * self.area))
                for (i, j), w in np.ndenumerate(worn):
                    rows["worn_cell"].append(key | {"i": i, "j": j, "wear_depth": w, "pressure": pressure[i, j]})
            print(f"{time.time() - began:.0f} s, {before.sum()} nodes", *(f"{value:.6g}" for value in row.values()), flush=True)
            if n == steps:
                break
            rate = ALPHA * energy / self.area
            self.height = fresh - depth - step * rate
            predicted = ALPHA * self.steady(amplitude)[2] / self.area
            depth = depth + step * (rate + predicted) / 2
        assert entries.max() == 1, "a node comes back into contact: increase --steps"
        return rows

    def vary(self, amplitude, swing, instants):
        """Rows of the tables `varying` and `varying_element` for a number of instants per cycle."""
        mean_load = self.load
        cosine = np.round(np.cos(2 * np.pi * np.arange(-instants // 4, 2 * instants + 1) / instants), 12)
        pressed = {}
        for value in np.unique(cosine):
            self.load = mean_load * (1 + swing * value)
            pressed[value] = self.normal()[0]
        self.load = mean_load
        loads = [pressed[value] for value in cosine]
        out = self.march(loads, amplitude * cosine)
        shares = self.element_shares()
        _, energies, gaps = zip(*out[-instants:])
        energy = sum(energies)
        top, bottom, first_top = (out[n][0] for n in (-1, -1 - instants // 2, -1 - instants))
        key = {"swing": swing, "instants": instants}
        mean, largest = (load[self.contact] for load in (np.mean(loads[-instants:], axis=0), loads[-1]))
        row = key | {
            "force_plus": top[0].sum(), "force_minus": bottom[0].sum(), "energy": energy.sum(), "mean_load": mean.sum(),
            "closed": np.abs(top - first_top).sum() / np.abs(top).sum(), "gap": sum(gaps) / energy.sum(),
        }
        print("varying", *(f"{value:.6g}" for value in row.values()), flush=True)
        values = zip(shares @ mean, shares @ largest, shares @ energy)
        elements = [key | {"element": e, "mean_load": p, "load_plus": m, "energy": w} for e, (p, m, w) in enumerate(values)]
        return {"varying": [row], "varying_element": elements}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--steps", type=int, default=40, help="number of wear steps, a multiple of 10")
    parser.add_argument("--instants", type=int, nargs="+", default=[24, 48], help="numbers of instants per cycle, multiples of 4")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    joint = Joint(Block(1), SURFACE)
    amplitude = dict(zip(truth.FORCES, truth.AMPLITUDES[SURFACE]))
    found = [joint.vary(amplitude[VARYING_PART], swing, n) for swing in (0.0, SWING) for n in options.instants]
    varying = {table: sum((rows[table] for rows in found), []) for table in found[0]}
    worn = joint.wear(amplitude[WEAR_PART], options.steps)
    known = plates.pq.read_table(pathlib.Path(__file__).parent / "truth" / "joint.parquet").to_pylist()
    known = {row["part"]: row["energy"] for row in known if row["surface"] == SURFACE and row["refinement"] == 1}
    for part, row in (VARYING_PART, varying["varying"][0]), (WEAR_PART, worn["worn"][0]):
        assert abs(row["energy"] / known[part] - 1) < 0.01, f"{part}: {row['energy']} J, but {known[part]} J in truth.py"
    plates.write_tables(options.folder, varying, ["swing", "instants"])
    plates.write_tables(options.folder, worn, ["cycles"])
    settings = {
        "alpha": round(ALPHA * 1e18), "surface": SURFACE, "refinement": 1, "wear_amplitude": amplitude[WEAR_PART],
        "varying_amplitude": amplitude[VARYING_PART], "swing": SWING, "steps": options.steps, "instants": options.instants,
    }
    (options.folder / "worn.json").write_text(json.dumps(settings))


if __name__ == "__main__":
    main()
