"""Reads a joint exported by fretwear for pyHarm: `import pyHarm, pyharm_joint; pyHarm.Maestro(pyharm_joint.problem(pyHarm))`.

Needs contact.csv, matrices.npz and vibration.json of the same export in the folder of this file. Each contact element is one `FretwearElement`, a bank of parallel sliders between the bodies. Its displacement is upper less lower body,
along x, y and n; along n it is positive when the joint opens. A slider bears max(0, N0 - kn (u_n + gap)); the normal force is the change of this load from rest. |T| <= mu N, with the instantaneous
load N. Sliders start at rest and are marched over CYCLES cycles; the last cycle gives the forces.
"""

import csv
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from pyHarm.Elements.NodeToNodeElements.NodeToNodeElement import NodeToNodeElement

jax.config.update("jax_enable_x64", True)
HERE = Path(__file__).resolve().parent
CYCLES = 4


def forces(u, sliders, mu):
    """Returns the forces along x, y, n at the samples of a displacement: `u` is 3 x samples, each row of `sliders` is N0, gap, kn, kt."""
    rest, gap, kn, kt = (sliders[:, [k]] for k in range(4))
    load = jnp.maximum(0.0, rest - kn * (u[2] + gap))
    normal = -(load - rest).sum(axis=0)
    limit = mu * load

    def step(position, sample):
        displacement, strength = sample
        trial = kt * (displacement - position)
        size = jnp.sqrt((trial**2).sum(axis=1, keepdims=True) + 1e-300)
        factor = jnp.minimum(1.0, strength[:, None] / size)
        force = factor * trial
        # A slider without stiffness follows the displacement.
        position = displacement - jnp.where(kt > 0.0, force / jnp.where(kt > 0.0, kt, 1.0), 0.0)
        return position, force.sum(axis=0)

    samples = (u[:2].T[:, None, :], limit.T)
    position = jnp.zeros((sliders.shape[0], 2))
    for _ in range(CYCLES - 1):
        position, _ = jax.lax.scan(step, position, samples)
    _, tangential = jax.lax.scan(step, position, samples)
    return jnp.vstack([tangential.T, normal[None, :]])


@jax.jit
def residual(x, axes, select, sliders, mu, to_time, to_frequency):
    u = jnp.stack([(axes[d] @ select @ x) @ to_time for d in range(3)])
    element_forces = forces(u, sliders, mu)
    return sum(select.T @ axes[d].T @ (element_forces[d] @ to_frequency) for d in range(3))


jacobian = jax.jit(jax.jacfwd(residual))


class FretwearElement(NodeToNodeElement):
    factory_keyword = "FretwearElement"

    def __post_init__(self):
        self.sliders = jnp.array(self.data["sliders"], dtype=float)
        self.mu = float(self.data["mu"])
        self.nabo = np.linalg.matrix_power(self.nabla, 0)

    def __flag_update__(self):
        self.flag_nonlinear = True
        self.flag_AFT = True

    def adim(self, lc, wc):
        """Makes lengths dimensionless with `lc`."""
        rest, gap, kn, kt = self.sliders.T
        self.sliders = jnp.stack([rest, gap / lc, kn * lc, kt * lc], axis=1)
        self.flag_adim = True

    def _arguments(self, xg):
        return xg[self.indices], self.Pdir, self.Pslave - self.Pmaster, self.sliders, self.mu, self.D["ft"], self.D["tf"]

    def evalResidual(self, xg, om):
        self.R = np.asarray(residual(*self._arguments(xg)))
        return self.R

    def evalJacobian(self, xg, om):
        self.J = np.asarray(jacobian(*self._arguments(xg)))
        self.dJdom = np.zeros(len(self.J))
        return self.J, self.dJdom

    def _evalJaco_ana(self, xg, om):
        return self.evalJacobian(xg, om)


def elements():
    """Returns mu and the sliders (N0, gap, kn, kt) of each contact element."""
    with (HERE / "contact.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    banks = {}
    for row in rows:
        bank = banks.setdefault(int(row["element"]), {"mu": float(row["mu"]), "sliders": []})
        bank["sliders"].append([float(row[name]) for name in ("normal_load", "gap", "kn", "kt")])
    return [banks[element] for element in sorted(banks)]


def problem(pyharm, harmonics=None, samples=None, analysis=None):
    """Returns the input of pyHarm: the structure, its loads, and a connector for each contact element."""
    try:
        from pyHarm.BaseUtilFuncs import pyHarm_plugin
    except ImportError:
        pyHarm_plugin = pyharm.pyHarm_plugin
    pyHarm_plugin(FretwearElement)
    about = json.loads((HERE / "vibration.json").read_text(encoding="utf-8"))
    matrices = np.load(HERE / "matrices.npz")
    banks = elements()
    size = len(matrices["K"])
    matrix = {"M": matrices["M"], "K": matrices["K"], "C": matrices["C"] if "C" in matrices else np.zeros((size, size))}
    connectors = {
        f"contact_{e}": {"type": "FretwearElement", "connect": {"joint": [e]}, "dirs": [0, 1, 2], **bank} for e, bank in enumerate(banks)
    }
    for number, load in enumerate(about["loads"]):
        node, dirs = node_and_directions(load["row"], len(banks))
        connectors[f"load_{number}"] = {
            "type": "GOForcing", "connect": {"joint": [node]}, "dirs": dirs, "ho": load["harmonic"], "dto": 0,
            "amp": float(np.hypot(load["cosine"], load["sine"])), "phi": float(np.arctan2(load["sine"], load["cosine"])),
        }  # fmt: skip
    if "Ks" in matrices:
        raise NotImplementedError("pyHarm needs its own element for hysteretic damping: add one with Ks of matrices.npz")
    return {
        "system": {"type": "Base", "nh": harmonics or about["harmonics"][-1], "nti": samples or 512},
        "substructures": {"joint": {"matrix": matrix, "ndofs": 3, "nnodes": len(banks), "nmodes": size - 3 * len(banks)}},
        "connectors": connectors,
        "analysis": analysis
        or {
            "response": {
                "study": "frf",
                "solver": "NewtonRaphson",
                "puls_inf": 2 * np.pi * about["range"][0],
                "puls_sup": 2 * np.pi * about["range"][1],
            }
        },
    }


def node_and_directions(row, count):
    """Returns pyHarm's node and directions of a row (from 1). Contact elements have three rows per node, the other nodes one row."""
    if row <= 3 * count:
        return (row - 1) // 3, [(row - 1) % 3]
    return count + row - 1 - 3 * count, [-1]
