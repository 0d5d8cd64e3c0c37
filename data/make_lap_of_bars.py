"""Writes lap_of_bars.inp, the mesh of two overlapping steel bars (see README.md):

    python3 data/make_lap_of_bars.py data/lap_of_bars.inp

The script needs only the standard library and writes the same file on every machine. Lengths are in mm, masses in t, times in s.
"""

import sys
from dataclasses import dataclass
from itertools import product

# Corners of a cell in the order of a C3D8I element.
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


@dataclass
class Bar:
    """Box of equal cells. Node and element numbers begin with `first` and increase fastest along z."""

    name: str
    first: int
    cell: tuple  # mm, along x, y and z
    cells: tuple
    corner: tuple  # mm, where x, y and z are least

    def __post_init__(self):
        places = product(*(range(n + 1) for n in self.cells))
        self.nodes = {place: self.first + n for n, place in enumerate(places)}
        self.positions = {
            node: [least + size * n for least, size, n in zip(self.corner, self.cell, place)]
            for place, node in self.nodes.items()
        }
        cells = enumerate(product(*map(range, self.cells)))
        self.elements = {self.first + n: [self.nodes[i + a, j + b, k + c] for a, b, c in CORNERS] for n, (i, j, k) in cells}


def two_bars(cell, cells, lap):
    """Returns two equal bars with their named node sets. The upper bar lies on the last `lap` cells of the lower bar."""
    nx, ny, nz = cells
    # 2/5 of the lap along x, and 5/9 of the width.
    under_x = range(round(0.3 * lap), round(0.7 * lap) + 1)
    under_y = range(round(2 * ny / 9), round(7 * ny / 9) + 1)
    lower = Bar("LOWER", 1, cell, cells, (0, 0, 0))
    upper = Bar("UPPER", 10_001, cell, cells, (cell[0] * (nx - lap), 0, cell[2] * nz))
    sets = {
        # The touching faces, which match node for node.
        "BOTTOM": [node for (i, _, k), node in lower.nodes.items() if k == nz and i >= nx - lap],
        "TOP": [node for (i, _, k), node in upper.nodes.items() if k == 0 and i <= lap],
        # Faces under head and nut of the bolt, in the middle of the lap.
        "HEAD": [node for (i, j, k), node in upper.nodes.items() if k == nz and i in under_x and j in under_y],
        "NUT": [node for (i, j, k), node in lower.nodes.items() if k == 0 and i - (nx - lap) in under_x and j in under_y],
        "CLAMP": [node for (i, _, _), node in lower.nodes.items() if i == 0],
        # The far edge of the upper bar, and one corner of the edge.
        "TIP": [node for (i, _, k), node in upper.nodes.items() if (i, k) == (nx, nz)],
        "SENSOR": [upper.nodes[cells]],
    }
    return [lower, upper], sets


def deck(bars, sets, more=()):
    """Returns the text of an input deck that is clamped at CLAMP, followed by the lines `more`."""
    lines = ["** Bars of steel; made by data/make_lap_of_bars.py. Lengths in mm, masses in t, times in s.", "*NODE"]
    for bar in bars:
        lines += [f"{node}, {x:g}, {y:g}, {z:g}" for node, (x, y, z) in bar.positions.items()]
    for bar in bars:
        lines.append(f"*ELEMENT, TYPE=C3D8I, ELSET={bar.name}")
        lines += [", ".join(map(str, [element, *nodes])) for element, nodes in bar.elements.items()]
    for name, nodes in sets.items():
        lines.append(f"*NSET, NSET={name}")
        # At most sixteen numbers per line.
        lines += [", ".join(map(str, nodes[k : k + 16])) for k in range(0, len(nodes), 16)]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3", "*DENSITY", "7.85E-9"]
    lines += [f"*SOLID SECTION, ELSET={bar.name}, MATERIAL=STEEL" for bar in bars]
    return "\n".join([*lines, "*BOUNDARY", "CLAMP, 1, 3", *more]) + "\n"


def main(path):
    # Bars of 120 x 27 x 8 mm with an overlap of 40 mm.
    with open(path, "w", encoding="utf-8") as file:
        file.write(deck(*two_bars(cell=(4, 3, 2), cells=(30, 9, 4), lap=10)))


if __name__ == "__main__":
    main(sys.argv[1])
