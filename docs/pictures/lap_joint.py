"""Draws the picture of the README from the run of the published case.

    fretwear run pipelines/lap_joint.toml
    python docs/pictures/lap_joint.py docs/pictures/lap_joint.png
"""

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

run, picture = "runs/lap_joint", sys.argv[1]
count = len(list(pathlib.Path(run, "iterations").iterdir()))


def table(iteration, name):
    return pd.read_parquet(f"{run}/iterations/wear_iteration={iteration}/{name}.parquet")


def field(frame, column):
    image = np.full((frame.i.max() + 1, frame.j.max() + 1), np.nan)
    image[frame.i, frame.j] = frame[column]
    return image


last = count - 1
summaries = pd.concat([table(k, "summary") for k in range(count)])
worn = field(table(last, "wear_field"), "wear_depth") * 1e6
deepest = np.unravel_index(np.nanargmax(worn), worn.shape)
surface = pd.read_parquet(f"{run}/once/surface.parquet")
height = field(surface, "height") * 1e6

figure, axes = plt.subplots(2, 3, figsize=(13.5, 7), constrained_layout=True)
map_axis, profile_axis, response_axis, curve_axis, resonance_axis, loop_axis = axes.flat

shown = map_axis.imshow(worn.T, origin="lower", extent=(0, 40, 0, 40), cmap="magma_r", vmax=np.nanpercentile(worn, 99.7))
figure.colorbar(shown, ax=map_axis, label="worn depth [µm]")
map_axis.axhline((deepest[1] + 0.5) * 40 / 256, color="tab:blue", lw=0.8)
map_axis.set(title="worn depth after 10⁷ cycles", xlabel="x [mm]", ylabel="y [mm]")

x = (np.arange(worn.shape[0]) + 0.5) * 40 / worn.shape[0]
window = slice(max(deepest[0] - 20, 0), deepest[0] + 20)
before = height[window, deepest[1]]
profile_axis.plot(x[window], before, color="0.6", label="unworn")
profile_axis.plot(x[window], before - worn[window, deepest[1]], color="tab:blue", label="worn")
profile_axis.set(title="section through the deepest point", xlabel="x [mm]", ylabel="height [µm]")
profile_axis.legend()

for iteration, color in ((0, "0.6"), (last, "tab:blue")):
    frf = table(iteration, "frf")
    response_axis.plot(frf.frequency, frf.amplitude * 1e6, ".-", ms=3, lw=0.8, color=color, label="worn" if iteration else "unworn")
response_axis.set(title="response to 1000 N", xlabel="frequency [Hz]", ylabel="amplitude at the far wall [µm]")
response_axis.legend()

cycles = summaries.cycles / 1e6
resonance_axis.step(cycles, summaries.resonance_frequency, "-", where="post", color="tab:purple")
updated = summaries.updated.to_numpy()
resonance_axis.plot(cycles[updated], summaries.resonance_frequency[updated], "o", ms=4, color="tab:purple", label="model update")
resonance_axis.set(title="resonance in force", xlabel="cycles [10⁶]", ylabel="resonance frequency [Hz]")
resonance_axis.legend()
curve_axis.plot(cycles, summaries.wear_volume * 1e9, "o-", ms=3, color="tab:red")
curve_axis.set_xlabel("cycles [10⁶]")
curve_axis.set_ylabel("worn volume [mm³]", color="tab:red")
stiffness_axis = curve_axis.twinx()
stiffness_axis.plot(cycles, summaries.kn / 1e9, "s-", ms=3, color="tab:green")
stiffness_axis.set_ylabel("normal contact stiffness [kN/µm]", color="tab:green")
curve_axis.set_title("wear and stiffness")

for iteration, color in ((0, "0.6"), (last, "tab:blue")):
    loop = table(iteration, "hysteresis")
    label = f"{summaries.cycles.iloc[iteration] / 1e6:g}·10⁶ cycles" if iteration else "unworn"
    loop_axis.plot(loop.displacement * 1e6, loop.load / 1e3, "-", color=color, label=label)
loop_axis.set(title="hysteresis", xlabel="relative displacement [µm]", ylabel="tangential force [kN]")
loop_axis.legend()
figure.savefig(picture, dpi=110)
