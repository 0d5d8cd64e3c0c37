"""Converts SPC, MPC and RBE2 of Nastran to fixed displacements and equations along the global axes."""

from __future__ import annotations

import re

import numpy as np
from scipy import linalg

from fretwear.importing import Rejected, axes, bulk
from fretwear.importing.bulk import Bulk, Card
from fretwear.importing.folder import Structure

#: A value below this fraction of the largest value counts as zero.
ZERO = 1e-10


def _selection(case: list[str], word: str) -> int | None:
    """Returns the set that the case control selects with "SPC = n" or "MPC = n".

    Raises Rejected if two subcases select different sets.
    """
    scope = ""
    found: dict[str, set[int]] = {"": set()}
    for line in case:
        if match := re.match(r"\s*(?:subc(?!om)\w*|sym)\b\s*=?\s*(\d+)", line, re.IGNORECASE):
            scope = f"subcase {match[1]}"
            found.setdefault(scope, set())
        elif match := re.match(rf"\s*{word}\s*[=\s]\s*(\d+)\s*$", line, re.IGNORECASE):
            found[scope].add(int(match[1]))
        elif re.match(rf"\s*{word}\s*=", line, re.IGNORECASE):
            raise Rejected(f"the case control has the line {line.strip()[:60]}; fretwear-import expects {word} = n")
    each = {scope: own or found[""] for scope, own in found.items() if scope} or found
    first = next(iter(each.values()))
    if len(first) > 1 or any(own != first for own in each.values()):
        said = "; ".join(f"{' and '.join(map(str, sorted(own))) or 'none'}{scope and ' in '}{scope}" for scope, own in each.items())
        raise Rejected(f"the case control selects several sets of {word}: {said}; select one set for all subcases")
    return next(iter(first), None)


def selected(structure: Structure, data: Bulk) -> tuple[set[tuple[int, int]], list[tuple[list[tuple[int, int, float]], Card]], list[Card]]:
    """Returns the displacements that SPC fixes, the MPC equations and the RBE2 entries, along the axes of the nodes.

    The case control selects the sets of SPC and MPC.
    """
    has_case = any(re.match(r"\s*(cend|subc\w*|spc|mpc)\b", line, re.IGNORECASE) for line in data.case)

    def chosen_by(word: str, *names: str) -> list[Card]:
        chosen = _selection(data.case, word)
        cards = data.named(*names, f"{word}ADD")
        there = {card.whole(0) for card in cards}
        if structure.is_mesh and chosen is not None and chosen not in there:
            known = ", ".join(map(str, sorted(there))) or "none"
            raise Rejected(f"the case control selects {word} = {chosen}, but no entry has this number; the existing sets are {known}")
        if not has_case and len(there) > 1:
            raise cards[0].reject(f"one of the sets {sorted(there)}, and no case control selects a set", f"{word} = n in a case control")
        if not has_case and there:
            chosen = next(iter(there))
            structure.left_out.append(f"The files have no case control, so the import applies the only set of {word}, {chosen}.")
        if idle := sorted(there - {chosen}):
            sets = ", ".join(map(str, idle))
            structure.left_out.append(f"The import ignores the sets of {word} that the case control does not select: {sets}.")
        return [card for card in cards if card.whole(0) == chosen and card.name in names]

    held = {(node, int(digit)) for node, digits in data.permanent.items() for digit in digits}
    for card in chosen_by("SPC", "SPC", "SPC1"):
        if card.name == "SPC1":
            nodes = [(node, card.get(1)) for node in bulk.ids(card, 2, data.positions)]
        else:
            nodes = [(card.whole(k), card.get(k + 1)) for k in (1, 4) if card.get(k) != ""]
            if any(card.number(k, 0.0) for k in (3, 6)):
                raise card.reject("a displacement that is not zero", "displacements of zero")
        for node, directions in nodes:
            if not re.fullmatch(r"[1-6]+", str(directions)):
                raise card.reject(f"the directions {directions!r}", "digits from 1 to 6")
            held |= {(node, int(digit)) for digit in str(directions)}
    equations = []
    for card in chosen_by("MPC", "MPC"):
        terms = [
            (card.whole(k), card.whole(k + 1), card.number(k + 2))
            for start in range(0, len(card.fields), 8)
            for k in (start + 1, start + 4)
            if card.get(k) != ""
        ]
        equations.append((terms, card))
    return held, equations, data.named("RBE2")


def dependents(card: Card) -> tuple[int, str, list[int]]:
    """Returns the independent node, the directions and the dependent nodes of an RBE2."""
    fields = [value for value in card.fields if value != ""]
    if fields and isinstance(fields[-1], float):  # The last field is the thermal expansion coefficient.
        fields = fields[:-1]
    short = Card(card.name, fields, card.place, card.file)
    if not re.fullmatch(r"[1-6]+", str(short.get(2))):
        raise card.reject(f"the directions {short.get(2)!r}", "digits from 1 to 6")
    if not (others := bulk.ids(short, 3)):
        raise card.reject("no dependent node", "one or more dependent nodes")
    return short.whole(1), str(short.get(2)), others


def _body(card: Card, data: Bulk, held: set[tuple[int, int]], used: set[int]) -> tuple[list[tuple[int, int]], np.ndarray]:
    """Expresses the displacements of the nodes of an RBE2 by the free motions of its rigid body.

    Returns pairs of node and direction, and one row per pair: the displacement per unit of each free motion. The free motions are the
    three displacements and three small rotations of the independent node, without the motions that SPC fixes.
    """
    centre, directions, others = dependents(card)
    for node in [centre, *others]:
        if node not in data.positions:
            raise card.reject(f"the node {node}", "nodes that GRID entries define")
        if node != centre and node in data.axes and not {"1", "2", "3"} <= set(directions):
            raise card.reject(f"the directions {directions} of node {node} with local axes", "the directions 123 or 123456")
    turn = data.axes.get(centre, np.eye(3))
    blocked = [
        np.concatenate([turn[d - 1], np.zeros(3)]) if d <= 3 else np.concatenate([np.zeros(3), turn[d - 4]])
        for d in range(1, 7)
        if (centre, d) in held
    ]
    motions = linalg.null_space(np.array(blocked)) if blocked else np.eye(6)
    freedoms, rows = [], []
    for node in [*([centre] if centre in used else []), *others]:
        arm = data.positions[node] - data.positions[centre]
        spin = np.array([[0.0, arm[2], -arm[1]], [-arm[2], 0.0, arm[0]], [arm[1], -arm[0], 0.0]])
        for d in (1, 2, 3):
            if node == centre or str(d) in directions:
                freedoms.append((node, d))
                rows.append(np.concatenate([np.eye(3)[d - 1], spin[d - 1]]) @ motions)
    return freedoms, np.array(rows).reshape(len(freedoms), -1)


def constrain(
    structure: Structure,
    data: Bulk,
    held: set[tuple[int, int]],
    equations: list[tuple[list[tuple[int, int, float]], Card]],
    rigid: list[Card],
) -> None:
    used = {node for element in structure.elements for node in element[2]}
    dependent: dict[tuple[int, int], Card] = {}

    def depends(freedom: tuple[int, int], card: Card) -> None:
        if dependent.setdefault(freedom, card) is not card or freedom in structure.held:
            raise card.reject(
                f"node {freedom[0]}, direction {freedom[1]}, which another entry already constrains",
                "one constraint per dependent displacement",
            )

    centres = set()
    by_node: dict[int, list[int]] = {}
    for card in rigid:
        centres.add(dependents(card)[0])
    for node, direction in sorted(held):
        if direction <= 3 and node in used | {term[0] for terms, _ in equations for term in terms}:
            by_node.setdefault(node, []).append(direction)
    for node, directions in by_node.items():
        if node in centres:
            continue  # The function `_body` applies the constraints of this node.
        fixed, turned = axes.held(data.axes.get(node, np.eye(3)), directions)
        structure.held |= {(node, direction) for direction in fixed}
        structure.equations += [[(node, direction, factor) for direction, factor in equation] for equation in turned]
    for terms, card in equations:
        spread: dict[tuple[int, int], float] = {}
        first: list[tuple[int, int]] = []
        for k, (node, direction, factor) in enumerate(terms):
            if node not in data.positions or not 1 <= direction <= 3:
                raise card.reject(f"direction {direction} of node {node}", "directions 1 to 3 of nodes that GRID entries define")
            row = data.axes.get(node, np.eye(3))[direction - 1]
            for d in range(3):
                if abs(row[d]) > axes.SMALLEST:
                    spread[(node, d + 1)] = spread.get((node, d + 1), 0.0) + factor * float(row[d])
                    first += [(node, d + 1)] if k == 0 else []
        lead = max(first, key=lambda freedom: abs(spread[freedom]))
        depends(lead, card)
        others = [freedom for freedom in spread if freedom != lead and spread[freedom] != 0.0]
        if not others:
            structure.held.add(lead)
            continue
        structure.equations.append([(*lead, spread[lead]), *((*freedom, spread[freedom]) for freedom in others)])
    for card in rigid:
        freedoms, rows = _body(card, data, held, used)
        if not freedoms:
            continue
        size = float(np.abs(rows).max(initial=0.0))
        rank, pivots = 0, np.zeros(0, int)
        if rows.size and size > 0.0:
            scaled = rows / np.linalg.norm(rows, axis=0).clip(ZERO * size)
            _, upper, pivots = linalg.qr(scaled.T, mode="economic", pivoting=True)
            diagonal = np.abs(np.diag(upper))
            rank = int((diagonal > ZERO * diagonal[0]).sum())
        independent = list(pivots[:rank])
        factors = np.linalg.lstsq(rows[independent].T, rows.T, rcond=None)[0].T if rank else np.zeros((len(freedoms), 0))
        for k, freedom in enumerate(freedoms):
            if k in independent:
                continue
            depends(freedom, card)
            terms = [(*freedoms[i], -float(factor)) for i, factor in zip(independent, factors[k], strict=True) if abs(factor) > ZERO]
            if terms:
                structure.equations.append([(*freedom, 1.0), *terms])
            else:
                structure.held.add(freedom)
    leads = {terms[0][:2] for terms in structure.equations}
    for terms in structure.equations:
        for node, direction, _ in terms[1:]:
            if (node, direction) in leads:
                card = dependent.get((node, direction)) or (rigid[0] if rigid else equations[0][1])
                raise card.reject(
                    f"node {node}, direction {direction}, which two constraints share", "constraints without common dependent displacements"
                )
