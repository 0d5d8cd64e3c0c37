"""Resolves the names of an Abaqus deck: sets, positions, axes of displacements, and fixed displacements."""

from __future__ import annotations

import re

import numpy as np

from fretwear.importing import Rejected, axes, deck, mesh
from fretwear.importing.deck import Block, Model, Scope

#: Number of a node or an element in the structure, by instance and number in the instance.
Numbers = dict[tuple[str, int], int]


class Flat:
    """Resolves the names in a model to nodes (instance, number) and elements (instance, number)."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.known: dict[tuple[str, str], list[tuple[str, int]]] = {}

    def scope(self, name: str, place: str) -> Scope:
        if name not in self.model.scopes:
            raise Rejected(f"{place}: the deck has no instance {name}; its instances are {', '.join(filter(None, self.model.scopes))}")
        return self.model.scopes[name]

    def members(self, instance: str, member: str, kind: str, place: str, seen: tuple[str, ...] = ()) -> list[tuple[str, int]]:
        """Returns the members of "7", "INSTANCE.7", "1:9:2", a set, or "INSTANCE.SET". `kind` is nsets or elsets."""
        instance, _, rest = ("." + member).rpartition(".") if "." in member else (instance, "", member)
        instance = instance.lstrip(".") if "." in member else instance
        scope = self.scope(instance, place)
        there = scope.nodes if kind == "nsets" else scope.elements
        if re.fullmatch(r"\d+", rest):
            if int(rest) not in there:
                raise Rejected(
                    f"{place}: the line gives {member}, but {instance or 'the deck'} has no such {'node' if kind == 'nsets' else 'element'}"
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
            raise Rejected(f"{place}: the deck has no set {member}, or the set contains itself; give a number or an existing set")
        found = [found for inner, name in sets[rest] for found in self.members(inner, name, kind, place, (*seen, key))]
        for elements in scope.of_elements.get(rest, []) if kind == "nsets" else []:
            for owner, label in self.members(instance, elements, "elsets", place, (*seen, key)):
                found += [(owner, node) for node in self.model.scopes[owner].elements[label][1]]
        self.known[(key, kind)] = list(dict.fromkeys(found))
        return self.known[(key, kind)]

    def names(self, kind: str) -> dict[str, tuple[str, str]]:
        """Returns the instance and the name of each set, by its name in the written folder.

        The name in the folder begins with the instance if several instances have a set with the same name.
        """
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
            raise Rejected(
                f"two of the names {', '.join(full for full, _, _ in found)[:200]} differ only in characters that a deck cannot contain; "
                "rename one of them"
            )
        return plain


def positions_of(model: Model) -> dict[tuple[str, int], np.ndarray]:
    return {(scope.name, label): scope.matrix @ at + scope.shift for scope in model.scopes.values() for label, at in scope.nodes.items()}


def axes_of(flat: Flat, positions: dict[tuple[str, int], np.ndarray]) -> dict[tuple[str, int], np.ndarray]:
    """Returns the displacement directions of the nodes with *TRANSFORM. The rotation of an instance also rotates the directions."""
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
    """Returns the nodes and directions that *BOUNDARY fixes at zero."""
    found = set()
    for instance, block in blocks:
        if block.keyword != "BOUNDARY":
            continue
        if unknown := [key for key in block.options if key not in ("OP", "step", "TYPE", "AMPLITUDE", "LOAD CASE")]:
            raise block.reject(f"the option {unknown[0]}", "displacements that are fixed at zero")
        for place, fields in block.data:
            word = fields[1].upper() if len(fields) > 1 else ""
            if word in deck.HELD:
                first, last = deck.HELD[word]
            elif re.fullmatch(r"[1-6]", word):
                first = int(word)
                last = deck.whole(fields[2], place, "the number of the last direction") if len(fields) > 2 and fields[2] else first
            else:
                raise Rejected(
                    f"{place}: the line is {', '.join(fields)}; fretwear-import expects a node or a set, then the first and the last "
                    "direction, or ENCASTRE, PINNED, XSYMM, YSYMM or ZSYMM"
                )
            if len(fields) > 3 and fields[3] and deck.real(fields[3], place, "the displacement 0") != 0.0:
                raise Rejected(f"{place}: the displacement is {fields[3]}; fretwear-import expects displacements that are fixed at zero")
            nodes = flat.members(instance, fields[0].strip('"').upper(), "nsets", place)
            found |= {(node, direction) for node in nodes for direction in range(first, min(last, 6) + 1)}
    return found
