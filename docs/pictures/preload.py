"""Draws the preload of runs/bolted and of two other clamp lengths over the cycles."""

import sys

import matplotlib.pyplot as plt
from fretwear import Run

plt.rcParams.update({"svg.hashsalt": "fretwear", "font.size": 10})
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for length, run in ((80, "runs/clamp_80"), (40, "runs/bolted"), (20, "runs/clamp_20")):
    history = Run(run).history("polars")
    cycles, load = history["cycles"].to_numpy() / 1e6, history["normal_load"].to_numpy() / 1e3
    bar = load * history["error_normal_load"].to_numpy()
    (line,) = axes.plot(cycles, load)
    axes.fill_between(cycles, load - bar, load + bar, color=line.get_color(), alpha=0.25, linewidth=0)
    axes.annotate(f"clamp length {length} mm", (cycles[-1], load[-1]), (5, 0), textcoords="offset points", va="center", color=line.get_color())
axes.axhline(0.97 * 30, color="0.6", linestyle="--", linewidth=1)
axes.text(6.4, 0.97 * 30 - 0.03, "97 % of 30 kN", va="top", color="0.4")
axes.set(xlabel="cycles (millions)", ylabel="preload (kN)", xlim=(0, 10))
for side in ("top", "right"):
    axes.spines[side].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None})
