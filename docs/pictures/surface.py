"""Heights of the example map of how_to/surface.md, and its worn depth after the run."""

import sys

import matplotlib.pyplot as plt
import numpy as np
from fretwear import Run

run = Run("runs/measured")
surface = run.table("surface", library="polars")
worn = run.table("wear_field", library="polars")
cells = (surface["i"].max() + 1, surface["j"].max() + 1)
heights, depth = np.zeros(cells), np.zeros(cells)
heights[surface["i"], surface["j"]] = 1e6 * surface["height"].to_numpy()
depth[worn["i"], worn["j"]] = 1e6 * worn["wear_depth"].to_numpy()

plt.rcParams["font.size"] = 9
figure, axes = plt.subplots(1, 2, figsize=(7, 2.6), layout="constrained", sharey=True)
for axis, field, colors, label in zip(axes, (heights, depth), ("viridis", "YlOrRd"), ("height (µm)", "worn depth (µm)"), strict=True):
    drawn = axis.imshow(field.T, origin="lower", extent=(0, 4, 0, 3), cmap=plt.get_cmap(colors, 16), interpolation="nearest")
    figure.colorbar(drawn, ax=axis, label=label)
    axis.set_xlabel("x (mm)")
axes[0].set_ylabel("y (mm)")
axes[0].set_title("unworn map", fontsize=9)
axes[1].set_title("after one million cycles", fontsize=9)
figure.savefig(sys.argv[1], dpi=110, metadata={"Software": None})
