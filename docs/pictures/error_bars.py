"""Measured error of the worn volume against its error bar, from docs/data/coverage.csv."""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

plt.rcParams["svg.hashsalt"] = "fretwear"
DATA = Path(__file__).resolve().parents[1] / "data" / "coverage.csv"
with open(DATA, encoding="utf-8", newline="") as file:
    rows = [row for row in csv.DictReader(file) if row["quantity"] == "worn volume"]

figure, axes = plt.subplots(figsize=(7, 4.2))
least, most = 1e-3, 1e3
for preset, marker, colour in (("balanced", "o", "tab:blue"), ("fast", "^", "tab:orange")):
    points = [row for row in rows if row["preset"] == preset and float(row["bar_ratio"]) > 0]
    bars = [100 * float(row["bar_ratio"]) for row in points]
    errors = [max(100 * abs(float(row["error_ratio"])), least) for row in points]
    axes.scatter(bars, errors, s=26, marker=marker, facecolors="none", edgecolors=colour, label=f"preset {preset}")
axes.plot([least, most], [least, most], color="black", linewidth=1)
axes.fill_between([least, most], [least, most], most, color="0.9", linewidth=0)
axes.text(0.3, 40, "error outside of the error bar", fontsize=9)
axes.text(9, 0.0025, "error within the error bar", fontsize=9)
axes.text(25, 5, "slip thinner than 1.5 cells", fontsize=9)
axes.set(xscale="log", yscale="log", xlim=(0.1, most), ylim=(least, most))
axes.set_xlabel("error bar of the worn volume [%]")
axes.set_ylabel("measured error of the worn volume [%]")
axes.legend(loc="upper left", fontsize=9, frameon=True)
axes.minorticks_off()
axes.grid(True, which="major", linewidth=0.4, alpha=0.5)
figure.tight_layout()
figure.savefig(sys.argv[1], metadata={"Date": None})
