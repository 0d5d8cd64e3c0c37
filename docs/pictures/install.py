"""What is installed, and what it reads and writes."""

import sys

import matplotlib.pyplot as plt

plt.rcParams |= {"svg.hashsalt": "fretwear", "font.size": 9}
figure, axes = plt.subplots(figsize=(7, 2.4))
axes.set(xlim=(0, 16), ylim=(0, 4.8))
axes.axis("off")


def box(x, y, text, colour):
    """A box that is 3 wide and 1.2 high, around its middle."""
    axes.add_patch(plt.Rectangle((x - 1.5, y - 0.6), 3, 1.2, facecolor=colour, edgecolor="0.4"))
    axes.text(x, y, text, ha="center", va="center")


def arrow(start, end, text=""):
    axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": "0.2", "shrinkA": 0, "shrinkB": 0})
    axes.text((start[0] + end[0]) / 2, start[1] + 0.3, text, ha="center", family="monospace", fontsize=8.5)


file, folder, result = "#dce9f5", "#fdebd0", "#e2f0d9"
box(1.6, 2.4, "joint.toml\nthe scene", file)
box(7.4, 2.4, "runs/joint\nthe run", folder)
box(14.4, 4.0, "report.html\nall figures", result)
box(14.4, 2.4, "terminal\nfigures with ±", result)
box(14.4, 0.8, "Python\ntables, fields", result)
arrow((3.1, 2.4), (5.9, 2.4), "fretwear run")
for end, command in ((4.0, "fretwear report"), (2.4, "fretwear status"), (0.8, "import fretwear")):
    axes.plot((8.9, 9.4, 9.4), (2.4, 2.4, end), color="0.2", lw=1)
    arrow((9.4, end), (12.9, end), command)
figure.savefig(sys.argv[1], bbox_inches="tight", metadata={"Date": None})
