"""Draws kt over the preload: of the whole joint, of smooth bodies, and of the roughness in series with them."""

import sys

import matplotlib.pyplot as plt
import numpy as np
from fretwear import Run

plt.rcParams.update({"svg.hashsalt": "fretwear", "font.size": 10})
names = ["load_1", "load_3", "load_10", "joint", "load_100"]
load, whole = np.array([[row[key] for key in ("normal_load", "kt")] for row in (Run(f"runs/{name}").history().to_pylist()[0] for name in names)]).T
smooth = Run("runs/flat").history().to_pylist()[0]["kt"]
roughness = 1 / (1 / whole - 1 / smooth)
figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
for values, style, text, (at, x, y) in (
    (roughness, "C1o-", "roughness only:\nfor finite elements", (3, -8, 12)),
    (np.full_like(load, smooth), "k--", "smooth bodies", (0, 4, 5)),
    (whole, "C0o-", "whole joint:\nfor rigid bodies", (2, 8, -28)),
):
    (line,) = axes.loglog(load / 1e3, values / 1e6, style, markersize=4, linewidth=1.5)
    axes.annotate(text, (load[at] / 1e3, values[at] / 1e6), (x, y), textcoords="offset points", ha="right" if x < 0 else "left", color=line.get_color())
loads, stiffnesses = (1, 3, 10, 30, 100), (500, 1000, 2000, 5000, 10000, 20000)
axes.set(xlabel="preload (kN)", ylabel="tangential stiffness kt (N/µm)", xlim=(0.9, 110))
axes.set_xticks(loads, map(str, loads), minor=False)
axes.set_yticks(stiffnesses, map(str, stiffnesses), minor=False)
axes.minorticks_off()
axes.grid(alpha=0.3)
for side in ("top", "right"):
    axes.spines[side].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None})
