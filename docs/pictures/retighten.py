"""Bolt load over the cycles, and the cycles at which 10 % of the load is lost."""

import sys

import fretwear
import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import PchipInterpolator

plt.rcParams["svg.hashsalt"] = "fretwear"
run = fretwear.Run("runs/joint")
history = run.history("polars")
milestone = fretwear.when(run, preload="90%")["milestones"][0]
cycles = history["cycles"].to_numpy() / 1e6
load = history["normal_load"].to_numpy() / 1e3
bar = load * history["error_normal_load"].to_numpy()
x = np.linspace(0, cycles[-1], 400)

figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
low, high = (PchipInterpolator(cycles, load + sign * bar)(x) for sign in (-1, 1))
axes.fill_between(x, low, high, alpha=0.3, label="error bar of the bolt load")
axes.plot(x, PchipInterpolator(cycles, load)(x), color="C0", label="bolt load")
level = milestone["level"] / 1e3
axes.axhline(level, color="0.5", linestyle="--", linewidth=1)
axes.text(0.1, level - 0.08, "90 % of the preload", va="top", color="0.3")
found = [milestone[name] and milestone[name] / 1e6 for name in ("earliest", "nominal", "latest")]
if all(found):
    axes.plot(found, [level] * 3, color="C3", linewidth=2.5, marker="|", markersize=14)
    for at, name in zip(found, ("earliest", "most likely", "latest"), strict=True):
        axes.annotate(name, (at, level + 0.12), rotation=45, color="C3", fontsize=9)
axes.set(xlabel="cycles in millions", ylabel="bolt load in kN", xlim=(0, cycles[-1]))
axes.legend(loc="upper right", frameon=False)
for side in ("top", "right"):
    axes.spines[side].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None} if sys.argv[1].endswith("svg") else None)
