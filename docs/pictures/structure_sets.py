"""Draws a side view of bars.inp, the upper bar lifted, with the sets of nodes that the scene names."""

import sys

import matplotlib.pyplot as plt

plt.rcParams.update({"svg.hashsalt": "fretwear", "font.size": 10})
LIFT = 9  # mm
nodes, cells, sets, part = {}, [], {}, ""
for line in open("bars.inp", encoding="utf-8"):
    if line.startswith("*"):
        part = line.strip()
        name = part.rpartition("=")[2]
    elif part == "*NODE":
        number, x, y, z = line.split(",")
        nodes[int(number)] = (float(x), float(y), float(z) + LIFT * (int(number) >= 20000))
    elif part.startswith("*ELEMENT"):
        cells.append([int(number) for number in line.split(",")[1:]])
    elif part.startswith("*NSET"):
        sets.setdefault(name, []).append(int(line))
figure, axes = plt.subplots(figsize=(7, 2.6), layout="constrained")
for cell in cells:
    if nodes[cell[0]][1] == 0:
        x, _, z = zip(*(nodes[cell[k]] for k in (0, 1, 5, 4, 0)))
        axes.fill(x, z, facecolor="0.93", edgecolor="0.7", linewidth=0.6)
labels = {"TOP": (0, -13, "left"), "BOTTOM": (-24, 6, "right"), "HEAD": (0, 8, "center"), "NUT": (0, -16, "center"), "CLAMP": (0, 22, "left"), "TIP": (-4, 10, "right")}
for k, (name, members) in enumerate(sets.items()):
    places = sorted({(nodes[n][0], nodes[n][2]) for n in members})
    axes.plot(*zip(*places), "o", color=f"C{k}", markersize=4)
    x, z = (sum(each) / len(places) for each in zip(*places))
    right, up, side = labels[name]
    axes.annotate(name, (x, z), (right, up), textcoords="offset points", color=f"C{k}", ha=side, fontweight="bold")
axes.annotate("", (200, 34), (200, 26), arrowprops={"arrowstyle": "<->", "color": "C5"})
axes.text(203, 30, "force", color="C5", va="center")
axes.set(xlim=(-4, 220), ylim=(-7, 36), xlabel="x (mm)", ylabel="z (mm), upper bar lifted")
for side in ("top", "right"):
    axes.spines[side].set_visible(False)
figure.savefig(sys.argv[1], metadata={"Date": None})
