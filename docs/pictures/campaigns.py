"""Worn volume over the cycles: the runs of a campaign, and their bands."""

import sys

import matplotlib.pyplot as plt
import polars as pl

plt.rcParams["svg.hashsalt"] = "fretwear"
runs = pl.scan_parquet("friction/collected/*.parquet").filter(pl.col("index") < 8).sort("wear_iteration").collect()
band = pl.read_parquet("friction/campaign_band.parquet").filter(pl.col("figure") == "wear_volume").sort("cycles")

figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
x = band["cycles"] / 1e6
axes.fill_between(x, band["q05"] * 1e9, band["q95"] * 1e9, color="C0", alpha=0.15, linewidth=0, label="5 to 95 % of the runs")
axes.fill_between(x, band["q25"] * 1e9, band["q75"] * 1e9, color="C0", alpha=0.3, linewidth=0, label="25 to 75 % of the runs")
for number, (_, run) in enumerate(runs.group_by("index", maintain_order=True)):
    label = "one run" if number == 0 else None
    axes.plot(run["cycles"] / 1e6, run["wear_volume"] * 1e9, color="0.45", linewidth=0.8, label=label)
axes.plot(x, band["q50"] * 1e9, color="C0", linewidth=2.5, label="median")
axes.set(xlabel="cycles in millions", ylabel="worn volume in mm³", xlim=(0, x.max()), ylim=(0, None))
axes.legend(loc="upper left", frameon=False, fontsize=9)
for side in ("top", "right"):
    axes.spines[side].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None} if sys.argv[1].endswith("svg") else None)
