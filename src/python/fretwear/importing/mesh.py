"""Checks a mesh of solid elements, and writes the mesh as a flat deck that CalculiX runs."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from fretwear.importing import Rejected
from fretwear.importing.folder import Structure

#: Number of corner nodes of each element type, and the two corners of the edge of each midside node.
TETRA = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
WEDGE = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
HEXA = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
TYPES: dict[str, tuple[int, list[tuple[int, int]]]] = {
    "C3D4": (4, []),
    "C3D10": (4, TETRA),
    "C3D6": (6, []),
    "C3D15": (6, WEDGE),
    "C3D8": (8, []),
    "C3D8I": (8, []),
    "C3D20": (8, HEXA),
    "C3D20R": (8, HEXA),
}
#: Tetrahedra at the corners of an element: each corner with its three neighbours. Their volumes give the orientation of the element.
CORNERS = {
    4: [(0, 1, 2, 3)],
    6: [(0, 1, 2, 3), (1, 2, 0, 4), (2, 0, 1, 5), (3, 5, 4, 0), (4, 3, 5, 1), (5, 4, 3, 2)],
    8: [(0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7), (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)],
}
#: Largest number of values per line of a set.
IN_LINE = 12


def plain_name(name: str) -> str:
    """Returns a name with "_" in place of characters that a deck does not accept."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name)


def count(kind: str) -> int:
    """Returns the number of nodes of an element type."""
    corners, edges = TYPES[kind]
    return corners + len(edges)


def check(structure: Structure, where: str) -> None:
    """Checks that each element has existing nodes, positive volumes at its corners, and midside nodes near their own edges.

    Raises Rejected.
    """
    if not structure.elements:
        raise Rejected(f"{where}: the files have no solid elements; give a mesh of solid elements")
    if not np.all(np.isfinite(structure.positions)):
        raise Rejected(f"{where}: a node has a coordinate that is not finite; all coordinates must be finite numbers")
    place = {label: k for k, label in enumerate(structure.labels)}
    by_kind: dict[str, list[tuple[str, int, list[int]]]] = {}
    for element in structure.elements:
        missing = [node for node in element[2] if node not in place]
        if missing:
            raise Rejected(f"{where}: element {element[1]} has the node {missing[0]}, which the files do not define; add the node")
        by_kind.setdefault(element[0], []).append(element)
    for kind, elements in by_kind.items():
        corners, edges = TYPES[kind]
        at = structure.positions[np.array([[place[node] for node in element[2]] for element in elements])]
        for a, b, c, d in CORNERS[corners]:
            volumes = np.einsum("ij,ij->i", np.cross(at[:, b] - at[:, a], at[:, c] - at[:, a]), at[:, d] - at[:, a])
            if (wrong := ~((volumes > 0.0) & (volumes < np.inf))).any():
                bad = elements[int(np.argmax(wrong))][1]
                raise Rejected(
                    f"{where}: element {bad} ({kind}) is inside out or flat; correct the order or the positions of its nodes"
                )
        if edges:
            middles = np.stack([(at[:, a] + at[:, b]) / 2 for a, b in edges], axis=1)
            between = np.linalg.norm(at[:, corners:, None] - middles[:, None], axis=3)
            wrong = between.argmin(axis=2) != np.arange(len(edges))
            if wrong.any():
                element, edge = np.argwhere(wrong)[0]
                raise Rejected(
                    f"{where}: element {elements[element][1]} ({kind}) has its node {corners + edge + 1} near the middle of a wrong edge; "
                    "correct the order of the nodes"
                )


def check_constraints(structure: Structure) -> None:
    """Checks that each dependent displacement is in one equation only, and is not fixed. Raises Rejected."""
    leads = [terms[0][:2] for terms in structure.equations]
    twice = {lead for lead in leads if leads.count(lead) > 1} if len(set(leads)) < len(leads) else set()
    for node, direction in sorted(twice | (set(leads) & structure.held)):
        raise Rejected(
            f"node {node}, direction {direction} depends on other displacements by an equation, and is also fixed or in another equation; "
            "remove one of the constraints"
        )


def drop_unused(structure: Structure) -> None:
    """Removes nodes without an element from the structure and from its sets, and records the removal."""
    used = {node for element in structure.elements for node in element[2]}
    used |= {node for terms in structure.equations for node, _, _ in terms}
    kept = [k for k, label in enumerate(structure.labels) if label in used]
    dropped = len(structure.labels) - len(kept)
    if not dropped:
        return
    structure.left_out.append(f"The import omits {dropped} nodes that belong to no solid element.")
    if held := {row for row in structure.held if row[0] not in used}:
        structure.left_out.append(f"The import omits {len(held)} fixed displacements of nodes that belong to no solid element.")
        structure.held -= held
    structure.labels, structure.positions = [structure.labels[k] for k in kept], structure.positions[kept]
    for name, nodes in list(structure.sets.items()):
        structure.sets[name] = [node for node in nodes if node in used]
        if nodes and not structure.sets[name]:
            del structure.sets[name]
            structure.left_out.append(f"The import omits the set {name}, because none of its nodes belongs to a solid element.")


def _numbers(numbers: Iterable[int]) -> Iterable[str]:
    numbers = list(numbers)
    for k in range(0, len(numbers), IN_LINE):
        yield ", ".join(map(str, numbers[k : k + IN_LINE])) + ("," if k + IN_LINE < len(numbers) else "")


def _real(value: float) -> str:
    """Returns a number as text with at most 20 characters, because CalculiX reads no more."""
    return repr(value) if len(repr(value)) <= 20 else f"{value:.13g}"


def _deck(structure: Structure) -> Iterable[str]:
    yield "** fretwear-import wrote this flat deck. Displacements are along the global axes."
    yield "*NODE"
    for label, position in zip(structure.labels, structure.positions.tolist(), strict=True):
        yield f"{label}, " + ", ".join(map(_real, position))
    for kind in TYPES:
        lines = [element for element in structure.elements if element[0] == kind]
        if lines:
            yield f"*ELEMENT, TYPE={kind}"
        for _, label, nodes in lines:
            yield from _numbers([label, *nodes])
    for keyword, sets in (("*NSET, NSET", structure.sets), ("*ELSET, ELSET", structure.element_sets)):
        for name, members in sets.items():
            if members:
                yield f"{keyword}={name}"
                yield from (line.rstrip(",") for line in _numbers(sorted(set(members))))
    for name, faces in structure.surfaces.items():
        of_nodes = not faces[0][1]
        yield f"*SURFACE, NAME={name}, TYPE={'NODE' if of_nodes else 'ELEMENT'}"
        yield from (f"{label}" if of_nodes else f"{label}, {face}" for label, face in faces)
    for name, (modulus, ratio, density) in structure.materials.items():
        yield f"*MATERIAL, NAME={name}"
        yield from ("*ELASTIC", f"{_real(modulus)}, {_real(ratio)}", "*DENSITY", _real(density))
        if name in structure.damping:
            yield f"*DAMPING, STRUCTURAL={_real(structure.damping[name])}"
    for elements, material in structure.sections:
        yield f"*SOLID SECTION, ELSET={elements}, MATERIAL={material}"
    for options, slave, master in structure.ties:
        yield f"*TIE{options}"
        yield f"{slave}, {master}"
    for terms in structure.equations:
        yield "*EQUATION"
        yield f"{len(terms)}"
        for k in range(0, len(terms), 4):
            yield ", ".join(f"{node}, {direction}, {_real(factor)}" for node, direction, factor in terms[k : k + 4])
    if structure.held:
        yield "*BOUNDARY"
        yield from (f"{node}, {direction}, {direction}" for node, direction in sorted(structure.held))


def write(structure: Structure, file: Path) -> None:
    file.write_text("\n".join(_deck(structure)) + "\n", encoding="ascii")
