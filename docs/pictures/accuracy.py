"""Cost of presets and grids, and how much the worn volume differs from the preset `reference`."""

import sys

import matplotlib.pyplot as plt
import polars as pl

plt.rcParams["svg.hashsalt"] = "fretwear"
trade = pl.read_parquet("trade/joint/trade.parquet").filter(pl.col("done"))
figure, axes = plt.subplots(figsize=(7, 3.8), layout="constrained")
for knob, color, marker, label in (("preset", "C0", "o", "preset, grid of the scene"), ("grid", "C1", "s", "preset balanced, other grid")):
    rows = trade.filter((pl.col("knob") == knob) & (pl.col("variant") != "reference")).sort("relative_cost")
    error = rows["error_wear_volume"].abs() * 100
    axes.plot(rows["relative_cost"], error, color=color, marker=marker, linestyle="none", markersize=8, label=label)
    for x, y, value in zip(rows["relative_cost"], error, rows["value"], strict=True):
        name = value.strip('"[]').replace(", ", " × ")
        right = x < 2
        axes.annotate(name, (x, y), xytext=(8 if right else -8, 4), ha="left" if right else "right", textcoords="offset points", color=color)
cost = trade.filter(pl.col("variant") == "reference")["relative_cost"][0]
axes.axvline(cost, color="0.5", linestyle="--", linewidth=1)
axes.margins(0.15, 0.1)
axes.set(xscale="log", yscale="log", xlabel="cost relative to the preset balanced", ylabel="difference in worn volume from reference, %")
top = axes.get_ylim()[1]
axes.text(cost * 0.95, top, "cost of reference", rotation=90, ha="right", va="top", color="0.3", fontsize=9)
for promise in (1, 5):
    axes.axhline(promise, color="C0", linestyle=":", linewidth=1)
    preset = "balanced" if promise == 1 else "fast"
    axes.text(axes.get_xlim()[0], promise, f" promise of {preset}: {promise} %", va="bottom", color="C0", fontsize=8)
axes.legend(loc="lower left", frameon=False, fontsize=9)
for axis in (axes.xaxis, axes.yaxis):
    axis.set_major_formatter(lambda value, _: f"{value:g}")
for side in ("top", "right"):
    axes.spines[side].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None} if sys.argv[1].endswith("svg") else None)
