"""Map of the worn depth of the first joint, and a section through its deepest point away from the edges."""

import sys

import matplotlib.pyplot as plt
import numpy as np
from fretwear import Run

run = Run("runs/joint")
x, y = (1e3 * each for each in run.centres())
depth = 1e6 * run.field("wear_depth")
height = 1e6 * run.field("height")
half = [500.0 * side for side in run.scene["joint"]["size"]]
inner = (np.abs(x) < 0.8 * half[0])[:, None] & (np.abs(y) < 0.8 * half[1])
deepest = np.unravel_index(np.nanargmax(np.where(inner, depth, np.nan)), depth.shape)
near = np.abs(x - x[deepest[0]]) < 2.0

figure, (plan, section) = plt.subplots(1, 2, figsize=(7, 3), layout="constrained")
image = plan.imshow(depth.T, origin="lower", extent=(-half[0], half[0], -half[1], half[1]), cmap="magma_r", vmax=np.nanpercentile(depth, 99.7))
figure.colorbar(image, ax=plan, label="worn depth [µm]", extend="max", shrink=0.9)
plan.axhline(y[deepest[1]], color="tab:blue", lw=0.8)
plan.set(xlabel="x [mm]", ylabel="y [mm]")
section.plot(x[near], height[near, deepest[1]], color="0.6", label="unworn")
section.plot(x[near], (height - depth)[near, deepest[1]], color="tab:blue", label="worn")
section.set(xlabel="x along the blue line [mm]", ylabel="height [µm]")
section.legend(frameon=False)
figure.savefig(sys.argv[1], dpi=100)
