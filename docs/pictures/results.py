"""Two tables of runs: the hysteresis loop before and after wear, and the worn volume of two loads over the cycles."""

import sys

import matplotlib.pyplot as plt
from fretwear import Run

plt.rcParams["svg.hashsalt"] = "fretwear"
run = Run("runs/joint")
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
for iteration, label, color in ((0, "unworn", "C0"), (run.latest, "worn", "C1")):
    loop = run.table("hysteresis", iteration, library="polars")
    left.plot(loop["displacement"] * 1e6, loop["load"] / 1e3, color=color, label=label)
left.set(xlabel="displacement in µm", ylabel="tangential load in kN")
left.set_title("table hysteresis", fontsize=10)
for name, label, color in (("joint", "30 kN", "0.2"), ("light", "20 kN", "C2")):
    history = Run(f"runs/{name}").history("polars")
    cycles, volume = history["cycles"] / 1e6, history["wear_volume"] * 1e9
    right.errorbar(cycles, volume, volume * history["error_wear_volume"], fmt="o-", markersize=3, color=color, label=label)
right.set(xlabel="cycles in millions", ylabel="worn volume in mm³", xlim=(0, None), ylim=(0, None))
right.set_title("table history", fontsize=10)
for axes in (left, right):
    axes.legend(frameon=False, loc="upper left" if axes is left else "lower right", title="bolt load" if axes is right else None)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None} if sys.argv[1].endswith("svg") else None)
