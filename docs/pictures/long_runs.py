"""Worn volume of a run, and of a sibling run that begins from iteration 5 with less friction."""

import sys

import matplotlib.pyplot as plt
from fretwear import Run

plt.rcParams["svg.hashsalt"] = "fretwear"
figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
for name, label, color in (("joint", "run, friction 0.6", "C0"), ("sibling", "sibling run, friction 0.5", "C1")):
    history = Run(f"runs/{name}").history("polars")
    cycles = history["cycles"].to_numpy() / 1e6
    volume = history["wear_volume"].to_numpy() * 1e9
    bar = volume * history["error_wear_volume"].to_numpy()
    axes.fill_between(cycles, volume - bar, volume + bar, color=color, alpha=0.3)
    axes.plot(cycles, volume, "o-", color=color, markersize=4, label=label, zorder=3 if name == "joint" else 2)
    if name == "joint":
        axes.annotate("iteration 5: the sibling run starts", (cycles[5], volume[5]), (2.0, 0.02), arrowprops={"arrowstyle": "->"})
axes.set(xlabel="cycles in millions", ylabel="worn volume in mm³", xlim=(0, None), ylim=(0, None))
axes.legend(loc="upper left", frameon=False, alignment="left", title="one dot per wear iteration; the band is the error bar")
for side in ("top", "right"):
    axes.spines[side].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None} if sys.argv[1].endswith("svg") else None)
