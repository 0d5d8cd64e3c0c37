"""Paths and friction loops of the motions of how_to/motion.md."""

import sys

import matplotlib.pyplot as plt
from fretwear import Run

plt.rcParams |= {"svg.hashsalt": "fretwear", "font.size": 9}
figure, (path, loop) = plt.subplots(1, 2, figsize=(7, 3), layout="constrained", width_ratios=(2, 3))
scenes = (("line_stepped", "line"), ("orbit", "orbit"), ("load", "varying load"), ("table", "own table"))
for (folder, label), color in zip(scenes, ("C0", "C1", "C2", "C3"), strict=True):
    cycle = Run(f"runs/{folder}").table("cycle", 0, "polars")
    x = 1e6 * cycle["displacement_x"]
    if label in ("line", "orbit"):
        y = 1e6 * cycle["displacement_y"] if "displacement_y" in cycle.columns else 0.0 * x
        path.plot(x, y, color=color, label=label)
    loop.plot(x, cycle["force_x"], color=color, label=label)
path.set(xlabel="displacement along x (µm)", ylabel="displacement along y (µm)", aspect="equal", ylim=(-1.4, 1.4))
loop.set(xlabel="displacement along x (µm)", ylabel="friction force along x (N)")
loop.legend(frameon=False, loc="upper left")
for axis in (path, loop):
    axis.spines[["top", "right"]].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None} if sys.argv[1].endswith("svg") else None)
