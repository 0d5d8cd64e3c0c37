"""Worn volume with its error bar, and the error bars of other figures."""

import sys

import matplotlib.pyplot as plt
import numpy as np
from fretwear import Run

plt.rcParams |= {"svg.hashsalt": "fretwear", "font.size": 9}
history = Run("runs/joint").history(library="pandas")
cycles, volume = history["cycles"] / 1e6, 1e9 * history["wear_volume"]
figure, (curve, bars) = plt.subplots(1, 2, figsize=(7, 2.8), layout="constrained", width_ratios=(3, 2))
for folder, colour, label in (("runs/checked", "#cfe2f3", "± bar with the grid check"), ("runs/joint", "tab:blue", "± bar of the default")):
    bar = Run(folder).history(library="pandas")["error_wear_volume"].fillna(0)
    curve.fill_between(cycles, volume * (1 - bar), volume * (1 + bar), color=colour, label=label, lw=1)
curve.plot(cycles, volume, "k.-", lw=1, ms=4, label="worn volume")
curve.set(xlabel="cycles [10⁶]", ylabel="worn volume [mm³]", xlim=(0, None), ylim=(0, None))
curve.legend(frameon=False, loc="upper left", reverse=True)

figures = {"largest pressure": "max_pressure", "stiffness kt": "kt", "stiffness kn": "kn", "worn volume": "wear_volume"}
figures |= {"corrected area": "corrected_area", "loaded area": "loaded_area", "friction of a cycle": "dissipated_energy"}
values = [100 * history[f"error_{column}"].iloc[-1] for column in figures.values()]
places = np.arange(len(figures))[::-1]
bars.barh(places, values, color="tab:blue")
for place, value in zip(places, values, strict=True):
    bars.text(value * 1.15, place, f"{value:.2g} %", va="center")
bars.set(yticks=places, yticklabels=figures, xscale="log", xlabel="error bar at the end [%]", xlim=(0.1, 500))
bars.spines[["top", "right"]].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None})
