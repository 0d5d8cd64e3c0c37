"""Input decks of the bodies of plates.py, truth.py and unequal.py, for the program and for other solvers:

    python decks.py FOLDER

    plates_4.inp, plates_3.inp, plates_2.inp     the two free plates, with the edge length of the elements in mm
    blocks_6x5.inp, blocks_12x10.inp             the two blocks of truth.py, with the numbers of elements along x and y
    unequal_7x5.inp, unequal_14x10.inp           the two blocks of unequal.py, with the numbers of elements along x and y

Elements are C3D8I, about as thick as long. Lengths are in mm, masses in t, times in s. The joint is at z = 0, and its centre is the
origin. All decks have the sets TOP and BOTTOM, the faces of the upper and the lower body at the joint.

Plates: HEAD and NUT are the nodes of the pad `inner` on the upper and the lower plate; HEAD_EDGE and NUT_EDGE are the nodes of the pad
`edge`. The surfaces with the suffix _FACES are the faces of these sets. TIP is a corner of the upper plate, and SENSOR is the opposite
corner of the lower plate.

Blocks: BASE is the lower face of the lower block, and the deck fixes this face. HEAD is the upper face of the upper block. Equations
couple HEAD to the node HEADREF along x, y and z, so HEAD does not tilt. A stiff frame supports HEADREF along x and y; HEADREF is free
along z. A force on HEADREF therefore moves it by the force over FRAME_STIFFNESS, nearly independently of the joint. FRAME is one box in
shear.
"""

import pathlib
import sys

import plates
import truth
import unequal

sys.path.append(str(pathlib.Path(__file__).parents[2] / "data"))
from make_lap_of_bars import Bar  # noqa: E402

FIRST_OF_UPPER = 10_001
REFERENCE = 100_001
BLOCK_DENSITY = 7850.0
# Stiffness of the frame along x and y [N/m]; the stiffness of the blocks in full stick is a tenth of it.
FRAME_STIFFNESS = 5e9
FRAME_NODES = range(REFERENCE + 1, REFERENCE + 9)
FRAME_ELEMENT = 900_001
# Lower and upper face of a C3D8I element.
BELOW, ABOVE = "S1", "S2"


def bodies(size, heights, counts, layers):
    """The lower and the upper body [m], with the joint between them at z = 0."""
    cell = [1e3 * s / n for s, n in zip(size, counts)]
    corner = [-500 * s for s in size]
    (low, high), (below, above) = heights, layers
    lower = Bar("LOWER", 1, (*cell, 1e3 * low / below), (*counts, below), (*corner, -1e3 * low))
    upper = Bar("UPPER", FIRST_OF_UPPER, (*cell, 1e3 * high / above), (*counts, above), (*corner, 0.0))
    return lower, upper


def layer(body, k):
    return [node for place, node in body.nodes.items() if place[2] == k]


def joint(lower, upper):
    return {"BOTTOM": layer(lower, lower.cells[2]), "TOP": layer(upper, 0)}


def text(title, both, sets, elastic, density, surfaces=None, more=()):
    """A deck of two bodies of one material (Pa, kg/m³)."""
    lines = [f"** {title}; made by tests/coupling/decks.py. Lengths in mm, masses in t, times in s.", "*NODE"]
    for body in both:
        lines += [f"{node}, {x:.9g}, {y:.9g}, {z:.9g}" for node, (x, y, z) in body.positions.items()]
    for body in both:
        lines.append(f"*ELEMENT, TYPE=C3D8I, ELSET={body.name}")
        lines += [", ".join(map(str, [element, *nodes])) for element, nodes in body.elements.items()]
    for name, nodes in sets.items():
        lines.append(f"*NSET, NSET={name}")
        # A line has at most sixteen numbers.
        lines += [", ".join(map(str, nodes[k : k + 16])) for k in range(0, len(nodes), 16)]
    for name, faces in (surfaces or {}).items():
        lines += [f"*SURFACE, NAME={name}", *(f"{element}, {face}" for element, face in faces)]
    young, poisson = elastic
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{young * 1e-6:g}, {poisson:g}", "*DENSITY", f"{density * 1e-12:g}"]
    lines += [f"*SOLID SECTION, ELSET={body.name}, MATERIAL=STEEL" for body in both]
    return "\n".join([*lines, *more]) + "\n"


def pad_faces(body, pad, face):
    """The elements of a body whose lower or upper faces tile a pad, and the nodes of these faces."""
    centre, sides = plates.PADS[pad]
    outer = layer(body, 0 if face == BELOW else body.cells[2])
    is_inside = lambda place: all(abs(p - 1e3 * c) < 500 * s + 1e-6 for p, c, s in zip(place, centre, sides))
    nodes = {node for node in outer if is_inside(body.positions[node])}
    elements = [element for element, corners in body.elements.items() if len(nodes & set(corners)) == 4]
    area = len(elements) * body.cell[0] * body.cell[1]
    assert abs(area - 1e6 * sides[0] * sides[1]) < 1e-6, "the faces of the elements must tile the pad"
    return [(element, face) for element in elements], sorted(nodes)


def plates_deck(edge):
    """Deck of the plates with elements of this edge length [m]."""
    counts = [round(s / edge) for s in plates.SIZE]
    layers = round(plates.HEIGHT / edge)
    lower, upper = bodies(plates.SIZE, 2 * [plates.HEIGHT], counts, 2 * [layers])
    sets, surfaces = joint(lower, upper), {}
    for pad, suffix in (("inner", ""), ("edge", "_EDGE")):
        for name, body, face in (("HEAD", upper, ABOVE), ("NUT", lower, BELOW)):
            surfaces[f"{name}{suffix}_FACES"], sets[name + suffix] = pad_faces(body, pad, face)
    sets["TIP"] = [upper.nodes[(*counts, layers)]]
    sets["SENSOR"] = [lower.nodes[(0, 0, 0)]]
    return text("Two free plates", (lower, upper), sets, (plates.YOUNG, plates.POISSON), plates.DENSITY, surfaces)


def blocks_deck(heights, size, counts, layers, elastic):
    """Deck of a block on a fixed base, and of a block below a head that does not rotate."""
    lower, upper = bodies(size, heights, counts, layers)
    head = layer(upper, layers[1])
    upper.positions[REFERENCE] = [0.0, 0.0, 1e3 * heights[1]]
    sets = joint(lower, upper) | {"BASE": layer(lower, 0), "HEAD": head, "HEADREF": [REFERENCE]}
    equations = [
        line for node in head for axis in (1, 2, 3) for line in ("2", f"{node}, {axis}, 1., {REFERENCE}, {axis}, -1.")
    ]
    # The frame is a box of 1 mm above the head. Its lower nodes follow HEADREF along x and y, and its upper nodes are fixed.
    corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    for node, (x, y, z) in zip(FRAME_NODES, corners):
        upper.positions[node] = [x, y, 1e3 * heights[1] + 5 + z]
    low, high = FRAME_NODES[:4], FRAME_NODES[4:]
    equations += [line for node in low for axis in (1, 2) for line in ("2", f"{node}, {axis}, 1., {REFERENCE}, {axis}, -1.")]
    more = [
        "*ELEMENT, TYPE=C3D8, ELSET=FRAME",
        ", ".join(map(str, [FRAME_ELEMENT, *FRAME_NODES])),
        "*MATERIAL, NAME=FRAME",
        "*ELASTIC",
        # With a Poisson's ratio of 0, G A / L of the box is half of Young's modulus times 1 mm.
        f"{2e-3 * FRAME_STIFFNESS:g}, 0.",
        "*DENSITY",
        "1e-9",
        "*SOLID SECTION, ELSET=FRAME, MATERIAL=FRAME",
        "*EQUATION",
        *equations,
        "*BOUNDARY",
        "BASE, 1, 3",
        *(f"{node}, 3, 3" for node in low),
        *(f"{node}, 1, 3" for node in high),
    ]
    return text("Two blocks", (lower, upper), sets, elastic, BLOCK_DENSITY, more=more)


def main(folder):
    folder = pathlib.Path(folder)
    for edge in plates.ELEMENT_EDGES:
        (folder / f"plates_{1e3 * edge:g}.inp").write_text(plates_deck(edge))
    elastic = (truth.YOUNG, truth.POISSON)
    for name, heights, size in (("blocks", 2 * [truth.HEIGHT], truth.SIZE), ("unequal", unequal.HEIGHTS, unequal.SIZE)):
        for edge in (2e-3, 1e-3):
            counts = [round(s / edge) for s in size]
            deck = blocks_deck(heights, size, counts, [round(h / edge) for h in heights], elastic)
            (folder / f"{name}_{counts[0]}x{counts[1]}.inp").write_text(deck)


if __name__ == "__main__":
    main(sys.argv[1])
