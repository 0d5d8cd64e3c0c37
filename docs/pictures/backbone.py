"""Backbones of the unworn and the worn joint of how_to/backbone.md."""

import sys

import matplotlib.pyplot as plt
import polars as pl

plt.rcParams |= {"svg.hashsalt": "fretwear", "font.size": 9}
curves = pl.read_parquet("joint.parquet")
figure, axes = plt.subplots(1, 2, figsize=(7, 2.9), layout="constrained")
for (cycles,), curve in curves.group_by("cycles", maintain_order=True):
    label = "unworn" if cycles == 0 else f"after {cycles / 1e6:.0f} million cycles"
    amplitude = 1e6 * curve["amplitude"]
    axes[0].semilogx(amplitude, curve["frequency"], "o-", ms=3, label=label)
    axes[1].loglog(amplitude, 100 * curve["damping_ratio"], "o-", ms=3, label=label)
axes[0].set_ylabel("resonance frequency (Hz)")
axes[1].set_ylabel("damping ratio (%)")
axes[1].set_yticks([0.3, 1, 3], ["0.3", "1", "3"])
axes[0].legend(frameon=False, loc="lower left")
for axis in axes:
    axis.minorticks_off()
    axis.set_xlabel("amplitude (µm)")
    axis.set_xticks([1, 10, 100], ["1", "10", "100"])
    axis.spines[["top", "right"]].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None} if sys.argv[1].endswith("svg") else None)
