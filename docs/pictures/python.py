"""Worn volume over the cycles for the bolt loads of the loop."""

import sys

import matplotlib.pyplot as plt
from fretwear import Run

plt.rcParams["svg.hashsalt"] = "fretwear"
loads = [15, 20, 30, 40]
figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
for load, color in zip(loads, plt.get_cmap("viridis")([0.0, 0.3, 0.6, 0.85]), strict=True):
    history = Run(f"loads/{load}kN").history("polars")
    cycles, volume = history["cycles"].to_numpy() / 1e6, history["wear_volume"].to_numpy() * 1e9
    axes.errorbar(cycles, volume, volume * history["error_wear_volume"].to_numpy(), fmt="o-", color=color, markersize=4, capsize=2)
    axes.text(cycles[-1] + 0.15, volume[-1], f"{load} kN", color=color, va="center")
axes.text(1.0, 1.0, "bolt load", transform=axes.transAxes, ha="right", color="0.3")
axes.set(xlabel="cycles in millions", ylabel="worn volume in mm³", xlim=(0, 11), ylim=(0, None))
for side in ("top", "right"):
    axes.spines[side].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None} if sys.argv[1].endswith("svg") else None)
