"""Reads the mesh of an Abaqus deck, and merges its instances into one flat structure."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from fretwear.importing import Rejected, axes, deck, mesh
from fretwear.importing.deck import Block, Model
from fretwear.importing.flat import Flat, Numbers, axes_of, held_by, positions_of
from fretwear.importing.folder import Structure


def _numbering(model: Model, structure: Structure) -> dict[tuple[str, int], int]:
    """Returns the number of each node in the structure.

    All nodes keep their numbers if the numbers are different. Otherwise the numbers of each further instance get an offset.
    """
    scopes = [scope for scope in model.scopes.values() if scope.nodes]
    labels = [label for scope in scopes for label in scope.nodes]
    if len(set(labels)) == len(labels):
        return {(scope.name, label): label for scope in scopes for label in scope.nodes}
    numbers: Numbers = {}
    added = 0
    for scope in scopes:
        numbers |= {(scope.name, label): label + added for label in scope.nodes}
        if added:
            structure.left_out.append(
                f"The import adds {added} to the node numbers of {scope.name or 'the assembly'}, because several instances share numbers."
            )
        added += max(scope.nodes)
    return numbers


def read(flat: Flat, structure: Structure, file: Path) -> None:
    model, positions = flat.model, positions_of(flat.model)
    numbers = _numbering(model, structure)
    structure.labels, structure.positions = [numbers[node] for node in positions], np.array(list(positions.values())).reshape(-1, 3)
    material_of: dict[tuple[str, int], str] = {}
    for scope in model.scopes.values():
        for name, material, place in scope.sections:
            for element in flat.members(scope.name, name, "elsets", place):
                if material_of.setdefault(element, material) != material:
                    raise Rejected(
                        f"{place}: element {element[1]} has the materials {material_of[element]} and {material}; "
                        "each element must have one material"
                    )
    element_number: dict[tuple[str, int], int] = {}
    others: dict[str, int] = {}
    for scope in model.scopes.values():
        for label, (kind, nodes, place) in scope.elements.items():
            if kind in mesh.TYPES:
                if (scope.name, label) not in material_of:
                    raise Rejected(f"{place}: element {label} is in no *SOLID SECTION; each solid element needs a section with a material")
                number = element_number[(scope.name, label)] = len(element_number) + 1
                if missing := [node for node in nodes if (scope.name, node) not in numbers]:
                    raise Rejected(f"{place}: element {label} has the node {missing[0]}, which the deck does not define; add the node")
                structure.elements.append((kind, number, [numbers[(scope.name, node)] for node in nodes]))
            elif (scope.name, label) in material_of:
                raise Rejected(
                    f"{place}: the element has the type {kind}, which fretwear does not assemble; use the types {', '.join(mesh.TYPES)}"
                )
            else:
                others[kind] = others.get(kind, 0) + 1
    structure.left_out += [
        f"The import omits {number} elements of type {kind}, because no section gives them a material." for kind, number in others.items()
    ]
    for element, material in material_of.items():
        constants = model.materials.get(material, {})
        if "ELASTIC" not in constants or "DENSITY" not in constants:
            raise Rejected(f"{file}: the material {material} has no *ELASTIC or no *DENSITY; give both")
        material = mesh.plain_name(material)
        structure.materials[material] = (*map(float, constants["ELASTIC"]), float(constants["DENSITY"][0]))  # type: ignore[assignment]
        if "DAMPING" in constants:
            structure.damping[material] = float(constants["DAMPING"][0])
        if element in element_number:
            structure.element_sets.setdefault(f"E_{material}", []).append(element_number[element])
    structure.sections = [(f"E_{material}", material) for material in structure.materials]
    _surfaces(flat, structure, numbers, element_number, file)
    blocks = [(scope.name, block) for scope in model.scopes.values() for block in scope.blocks]
    turned = axes_of(flat, positions)
    held: dict[tuple[str, int], list[int]] = {}
    for node, direction in sorted(held_by(flat, blocks)):
        if direction <= 3:
            held.setdefault(node, []).append(direction)
    for node, directions in held.items():
        fixed, equations = axes.held(turned.get(node, np.eye(3)), directions)
        structure.held |= {(numbers[node], direction) for direction in fixed}
        structure.equations += [[(numbers[node], direction, factor) for direction, factor in terms] for terms in equations]
    for instance, block in blocks:
        if block.keyword == "EQUATION":
            structure.equations += _equations(flat, instance, block, numbers, turned)
        if block.keyword == "TIE":
            _tie(block, structure)
    for name, (scope_name, own) in flat.names("nsets").items():
        structure.sets[name] = [numbers[node] for node in flat.members(scope_name, own, "nsets", str(file))]
    mesh.drop_unused(structure)
    mesh.check(structure, str(file))


def _equations(
    flat: Flat, instance: str, block: Block, numbers: Numbers, turned: dict[tuple[str, int], np.ndarray]
) -> list[list[tuple[int, int, float]]]:
    found, k = [], 0
    while k < len(block.data):
        place, fields = block.data[k]
        cells: list[str] = []
        count, k = int(block.numbers(k, 1, "the number of terms")[0]), k + 1
        while len(cells) < 3 * count and k < len(block.data):
            cells += [cell for cell in block.data[k][1] if cell]
            k += 1
        if count < 2 or len(cells) != 3 * count:
            raise Rejected(
                f"{place}: the first line of *EQUATION is {', '.join(fields)}; "
                "fretwear-import expects the number of terms, then node, direction and factor of each of two or more terms"
            )
        nodes = [flat.members(instance, cell.strip('"').upper(), "nsets", place) for cell in cells[::3]]
        if {len(members) for members in nodes} - {1, len(nodes[0])}:
            raise Rejected(f"{place}: the sets of the *EQUATION have different numbers of nodes; give sets with equal numbers of nodes")
        for i in range(len(nodes[0])):
            terms: list[tuple[int, int, float]] = []
            for members, direction, factor in zip(nodes, cells[1::3], cells[2::3], strict=True):
                node = members[i if len(members) > 1 else 0]
                if direction not in ("1", "2", "3") or node in turned:
                    raise Rejected(
                        f"{place}: the *EQUATION has direction {direction} of node {node[1]}; "
                        "fretwear-import expects direction 1, 2 or 3 of a node without *TRANSFORM"
                    )
                terms.append((numbers[node], int(direction), deck.real(factor, place, "a factor")))
            found.append(terms)
    return found


def _surfaces(flat: Flat, structure: Structure, numbers: Numbers, element_number: Numbers, file: Path) -> None:
    for name, (scope_name, own) in flat.names("surfaces").items():
        faces: list[tuple[int, str]] = []
        try:
            for instance, member, face in flat.model.scopes[scope_name].surfaces[own]:
                of_nodes = not face
                if not re.fullmatch("(S[1-6])?", face) or (of_nodes and member in flat.model.scopes[instance].elsets):
                    raise Rejected(f"the line {member}, {face} gives elements without a face S1 to S6")
                for item in flat.members(instance, member, "nsets" if of_nodes else "elsets", str(file)):
                    if not of_nodes and item not in element_number:
                        raise Rejected(f"element {item[1]} is not a solid element")
                    faces.append((numbers[item], "") if of_nodes else (element_number[item], face))
        except Rejected as error:
            structure.left_out.append(f"The import omits the surface {name}: {error}.")
            continue
        if faces:
            structure.surfaces[name] = faces


def _tie(block: Block, structure: Structure) -> None:
    for key in block.options:
        if key not in ("NAME", "POSITION TOLERANCE", "ADJUST", "TYPE", "NO ROTATION", "step"):
            raise block.reject(f"the option {key}", "only the options NAME, POSITION TOLERANCE and ADJUST")
    options = "".join(f", {key}={block.options[key]}" for key in ("NAME", "POSITION TOLERANCE", "ADJUST") if key in block.options)
    for place, fields in block.data:
        written = []
        for name in (mesh.plain_name(cell.strip('"').upper()) for cell in fields[:2]):
            found = [known for known in (name, name.rpartition(".")[2]) if known in structure.surfaces]
            if not found:
                raise Rejected(
                    f"{place}: the deck has no surface {name} of solid elements or nodes; "
                    f"its surfaces are {', '.join(structure.surfaces) or 'none'}"
                )
            written.append(found[0])
        if len(written) != 2:
            raise Rejected(f"{place}: the line is {', '.join(fields)}; fretwear-import expects a slave surface and a master surface")
        structure.ties.append((options, written[0], written[1]))
