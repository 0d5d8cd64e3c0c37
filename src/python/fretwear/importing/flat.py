"""What a deck of Abaqus names, resolved: sets, positions, axes of displacements, and what is held."""

from __future__ import annotations

import re

import numpy as np

from fretwear.importing import Rejected, axes, deck, mesh
from fretwear.importing.deck import Block, Model, Scope

#: Number in the structure by instance and own number.
Numbers = dict[tuple[str, int], int]


class Flat:
    """Resolves what a model names to nodes (instance, number) and elements (instance, number)."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.known: dict[tuple[str, str], list[tuple[str, int]]] = {}

    def scope(self, name: str, place: str) -> Scope:
        if name not in self.model.scopes:
            raise Rejected(f"{place}: there is no instance {name}; there are {', '.join(filter(None, self.model.scopes))}")
        return self.model.scopes[name]

    def members(self, instance: str, member: str, kind: str, place: str, seen: tuple[str, ...] = ()) -> list[tuple[str, int]]:
        """Of "7", "INSTANCE.7", "1:9:2", a set, or "INSTANCE.SET"; `kind` is nsets or elsets."""
        instance, _, rest = ("." + member).rpartition(".") if "." in member else (instance, "", member)
        instance = instance.lstrip(".") if "." in member else instance
        scope = self.scope(instance, place)
        there = scope.nodes if kind == "nsets" else scope.elements
        if re.fullmatch(r"\d+", rest):
            if int(rest) not in there:
                raise Rejected(
                    f"{place}: found {member}, which {instance or 'the deck'} does not have as a {'node' if kind == 'nsets' else 'element'}"
                )
            return [(instance, int(rest))]
        if range_ := re.fullmatch(r"(\d+):(\d+):(\d+)", rest):
            first, last, step = map(int, range_.groups())
            return [(instance, label) for label in there if first <= label <= last and (label - first) % step == 0]
        key = f"{instance}.{rest}"
        sets = getattr(scope, kind)
        having = [other.name for other in self.model.scopes.values() if rest in getattr(other, kind)]
        if rest not in sets and not instance and len(having) == 1:
            return self.members(having[0], rest, kind, place, seen)
        if (key, kind) in self.known:
            return self.known[(key, kind)]
        if rest not in sets or key in seen:
            raise Rejected(f"{place}: found {member}; a number or a set that the deck has, and that does not hold itself, would be right")
        found = [found for inner, name in sets[rest] for found in self.members(inner, name, kind, place, (*seen, key))]
        for elements in scope.of_elements.get(rest, []) if kind == "nsets" else []:
            for owner, label in self.members(instance, elements, "elsets", place, (*seen, key)):
                found += [(owner, node) for node in self.model.scopes[owner].elements[label][1]]
        self.known[(key, kind)] = list(dict.fromkeys(found))
        return self.known[(key, kind)]

    def names(self, kind: str) -> dict[str, tuple[str, str]]:
        """Instance and name of each set by the name that it is written with: its own where only one instance has it."""
        having: dict[str, list[str]] = {}
        for scope in self.model.scopes.values():
            for name in getattr(scope, kind):
                having.setdefault(name, []).append(scope.name)
        found = [
            (name if len(scopes) == 1 else f"{scope}.{name}".lstrip("."), scope, name)
            for name, scopes in having.items()
            for scope in scopes
        ]
        plain = {mesh.plain_name(full): (scope, name) for full, scope, name in found}
        if len(plain) < len(found):
            raise Rejected(f"two of {', '.join(full for full, _, _ in found)[:200]} differ only by signs that decks do not tell apart")
        return plain


def positions_of(model: Model) -> dict[tuple[str, int], np.ndarray]:
    return {(scope.name, label): scope.matrix @ at + scope.shift for scope in model.scopes.values() for label, at in scope.nodes.items()}


def axes_of(flat: Flat, positions: dict[tuple[str, int], np.ndarray]) -> dict[tuple[str, int], np.ndarray]:
    """Directions of displacements of the nodes of *TRANSFORM, turned as their instances are."""
    found: dict[tuple[str, int], np.ndarray] = {}
    for scope in flat.model.scopes.values():
        for name, frame in scope.transforms:
            turned = axes.Frame(
                frame.kind, scope.matrix @ frame.origin + scope.shift, frame.directions @ scope.matrix.T, frame.spherical, frame.name
            )
            for node in flat.members(scope.name, name, "nsets", "*TRANSFORM"):
                found[node] = turned.along(positions[node], node[1])
    return {node: rows for node, rows in found.items() if np.abs(rows - np.eye(3)).max() > axes.SMALLEST}


def held_by(flat: Flat, blocks: list[tuple[str, Block]]) -> set[tuple[tuple[str, int], int]]:
    """Nodes and directions that *BOUNDARY holds at zero."""
    found = set()
    for instance, block in blocks:
        if block.keyword != "BOUNDARY":
            continue
        if unknown := [key for key in block.options if key not in ("OP", "step", "TYPE", "AMPLITUDE", "LOAD CASE")]:
            raise block.reject(unknown[0], "displacements held at zero")
        for place, fields in block.data:
            word = fields[1].upper() if len(fields) > 1 else ""
            if word in deck.HELD:
                first, last = deck.HELD[word]
            elif re.fullmatch(r"[1-6]", word):
                first = int(word)
                last = deck.whole(fields[2], place, "a last direction") if len(fields) > 2 and fields[2] else first
            else:
                raise Rejected(
                    f"{place}: found {', '.join(fields)}; a node or set, then its first and last direction, or ENCASTRE "
                    "or PINNED, would be right"
                )
            if len(fields) > 3 and fields[3] and deck.real(fields[3], place, "a displacement of zero") != 0.0:
                raise Rejected(f"{place}: found the displacement {fields[3]}; only displacements held at zero are a structure at rest")
            nodes = flat.members(instance, fields[0].strip('"').upper(), "nsets", place)
            found |= {(node, direction) for node in nodes for direction in range(first, min(last, 6) + 1)}
    return found
