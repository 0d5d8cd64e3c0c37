"""Reads Nastran bulk data: entries, grid points and their coordinate systems.

pyyeti reads the fields of entries. This module checks continuation lines first, because pyyeti drops unexpected continuation lines.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fretwear.importing import Rejected, child
from fretwear.importing.axes import Frame, frame_of_points

#: Largest depth of nested included files.
DEPTH = 16
#: Largest length of a THRU range if the existing numbers are unknown.
MOST_IN_RANGE = 1_000_000


@dataclass
class Card:
    """An entry of the bulk data: its name in capitals, and the fields after the name. A blank field is ""."""

    name: str
    fields: list[Any]
    place: str
    file: Path

    def get(self, k: int) -> Any:
        return self.fields[k] if k < len(self.fields) else ""

    def whole(self, k: int, default: int | None = None) -> int:
        value = self.get(k)
        if value == "" and default is not None:
            return default
        if not isinstance(value, int):
            raise self.reject(f"the value {value!r}", f"a whole number in field {k + 2}")
        return value

    def number(self, k: int, default: float | None = None) -> float:
        value = self.get(k)
        if value == "" and default is not None:
            return default
        if isinstance(value, str) or not np.isfinite(value):
            raise self.reject(f"the value {value!r}", f"a number in field {k + 2}")
        return float(value)

    def reject(self, found: object, right: str) -> Rejected:
        return Rejected(f"{self.place}: {self.name} has {found}; fretwear-import expects {right}")


@dataclass
class Bulk:
    cards: list[Card] = field(default_factory=list)
    case: list[str] = field(default_factory=list)
    sets: dict[str, list[int]] = field(default_factory=dict)
    positions: dict[int, np.ndarray] = field(default_factory=dict)
    #: Displacement directions of each node with local axes.
    axes: dict[int, np.ndarray] = field(default_factory=dict)
    #: Result of `read_cards`, with the DMIG matrices.
    dmig: dict[str, Any] = field(default_factory=dict)
    #: Directions that the field PS of a GRID fixes.
    permanent: dict[int, str] = field(default_factory=dict)

    def named(self, *names: str) -> list[Card]:
        return [card for card in self.cards if card.name in names]


def _text(file: Path, files: list[Path], depth: int = 0) -> list[tuple[str, Path, str]]:
    """Returns the lines without comments and blank lines, each with its place and file. Reads files of INCLUDE too."""
    if depth > DEPTH:
        raise Rejected(f"{file}: files include each other more than {DEPTH} levels deep; remove the circular INCLUDE")
    try:
        text = file.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise Rejected(f"fretwear-import cannot read {file}: {error.strerror}") from None
    files.append(file)
    found = []
    lines = iter(enumerate(text.splitlines(), 1))
    for k, line in lines:
        line = line.split("$", 1)[0].expandtabs(8).rstrip()
        if re.match(r"\s*include\b", line, re.IGNORECASE):
            while line.count("'") == 1:
                line += next(lines, (0, "'"))[1].strip()
            path = re.match(r"\s*include\s*['\"]?([^'\"]+)['\"]?\s*$", line, re.IGNORECASE)
            if not path:
                raise Rejected(f"{file}, line {k}: the line is {line.strip()[:60]}; fretwear-import expects INCLUDE 'file'")
            found += _text(file.parent / path[1].strip(), files, depth + 1)
        elif line:
            found.append((f"{file}, line {k}", file, line))
    return found


def _fields(line: str, width: str) -> list[str]:
    """Returns fields 2 to 9 of a line with small fields, or the four fields of a line with large fields."""
    size, count = (16, 4) if width == "16" else (8, 8)
    return [line[8 + k * size : 8 + (k + 1) * size].strip() for k in range(count)]


def _large(card: list[tuple[str, str]]) -> list[str]:
    """Returns the lines of an entry with mixed field widths, rewritten with large fields only."""
    fields: list[str] = []
    for k, (line, width) in enumerate(card):
        if width == "8" and len(fields) % 8:
            fields += [""] * (8 - len(fields) % 8)
        fields += _fields(line, width)
        if k == 0:
            name = line[:8].replace("*", "").strip()
    lines = ["".join(f"{cell:<16}" for cell in fields[k : k + 4]) for k in range(0, len(fields), 4)]
    return [f"{name + '*' if k == 0 else '*':<8}{line}" for k, line in enumerate(lines)]


def _cards(lines: list[tuple[str, Path, str]]) -> tuple[list[str], list[tuple[str, Path]]]:
    """Returns the lines in the form that pyyeti expects, and the place of each entry.

    Raises Rejected for a continuation line that pyyeti would drop.
    """
    cards: list[list[tuple[str, str]]] = []
    places: list[tuple[str, Path]] = []
    for place, file, line in lines:
        is_free = "," in line
        first = line.split(",", 1)[0] if is_free else line[:8]
        width = "free" if is_free else "16" if "*" in first else "8"
        if is_free and "*" in first:
            raise Rejected(
                f"{place}: the entry {first.strip()!r} combines large fields with commas; write commas and 8 fields per line without *"
            )
        if re.match(r"\s*[A-Za-z]", first):
            name = first.strip().replace("*", "").strip()
            cards.append([(line.strip() if is_free else f"{name + ('*' if width == '16' else ''):<8}" + line[8:], width)])
            places.append((place, file))
        elif not cards or not re.match(r"[\s+*,]", line):
            raise Rejected(
                f"{place}: the line {line[:40]!r} neither begins nor continues an entry; "
                "begin a line with the name of an entry, or with a blank, +, * or comma for a continuation"
            )
        elif (cards[-1][0][1] == "free") != is_free:
            raise Rejected(
                f"{place}: the line {line[:40]!r} differs in format from the first line of its entry; "
                "use commas in all lines of an entry or in no line"
            )
        else:
            mark = "*" if width == "16" else "+"
            cards[-1].append(("," + line.split(",", 1)[1] if is_free else mark.ljust(8) + line[8:], width))
    out = []
    for card in cards:
        out += [line for line, _ in card] if len({width for _, width in card}) == 1 else _large(card)
    return out, places


def _digits(dmig: str) -> dict[str, int]:
    """Returns the largest number of digits of the values of each DMIG matrix."""
    found: dict[str, int] = {}
    name = ""
    for line in dmig.splitlines():
        fields = line.split(",")[1:] if "," in line else _fields(line, "16" if "*" in line[:8] else "8")
        if line[0].isalpha():
            name = fields[0].strip().upper()
        for field_ in fields:
            if "." in field_:
                mantissa = re.match(r"\s*[+-]?0*([\d.]*)", field_)[1]  # type: ignore[index]
                found[name] = max(found.get(name, 0), len(mantissa.replace(".", "").lstrip("0")))
    return found


def read_cards(text: str, case: str, dmig: str) -> dict[str, Any]:
    """Returns entries as lists, the sets of the case control, and the entries of each DMIG matrix. Runs in the child process."""
    from pyyeti.nastran import bulk

    cards = bulk.rdcards(io.StringIO(text), "[a-z]", regex=True, return_var="list", keep_name=True, no_data_return=[])
    sets = bulk.rdsets(io.StringIO(case)) if case else {}
    numbers = {str(key): [number for number in value if isinstance(number, int)] for key, value in (sets or {}).items()}
    result: dict[str, Any] = {"cards": cards, "sets": numbers, "dmig": "", "matrices": [], "digits": _digits(dmig)}
    try:
        for name, frame in (bulk.rddmig(io.StringIO(dmig), square=True) if dmig else {}).items():
            values = frame.to_numpy()
            i, j = np.nonzero(values)
            result["matrices"].append(name)
            result |= {f"{name} at": np.array([i, j]), f"{name} values": values[i, j]}
            for end, index in (("rows", frame.index), ("columns", frame.columns)):
                result[f"{name} {end}"] = np.array(index.to_list(), np.int64)
    except MemoryError:
        raise
    except Exception as error:  # The module `nastran` checks each DMIG entry and reports its line.
        result["dmig"] = f"{type(error).__name__}: {error}"[:200]
    return result


def read(files: list[Path], seen: list[Path]) -> Bulk:
    """Reads the bulk data of all files."""
    bulk, lines = Bulk(), []
    for file in files:
        found = _text(file, seen)
        begin = next((k for k, (*_, line) in enumerate(found) if re.match(r"\s*begin\b", line, re.IGNORECASE)), None)
        if begin is not None:
            for place, path, line in found[:begin]:
                if re.match(r"\s*param\b", line, re.IGNORECASE):
                    lines.append((place, path, ",".join(re.split(r"[\s,=]+", line.strip()))))
                else:
                    bulk.case.append(line)
            found = found[begin + 1 :]
        end = next((k for k, (*_, line) in enumerate(found) if re.match(r"\s*enddata\b", line, re.IGNORECASE)), len(found))
        lines += found[:end]
    text, places = _cards(lines)
    case = "\n".join(line.strip() for line in bulk.case)
    sets = re.findall(r"(?im)^set\s+\d+\s*=(?:[^\n]*,\s*\n)*[^\n]*", case)
    dmig, taken = "", False
    for line in text:
        if line[0].isalpha():
            taken = re.match(r"dmig\b", line, re.IGNORECASE) is not None
        dmig += line + "\n" if taken else ""
    arguments = {"text": "\n".join(text) + "\n", "case": "\n".join(sets), "dmig": dmig}
    answer = child.call("fretwear.importing.bulk:read_cards", arguments, files=seen, library="pyyeti", extra="nastran")
    if len(answer["cards"]) != len(places):
        raise Rejected(f"{files[0]}: the file has {len(places)} entries, but pyyeti reads {len(answer['cards'])}; the file may be damaged")
    for (place, file), (name, *fields) in zip(places, answer["cards"], strict=True):
        bulk.cards.append(Card(str(name).replace("*", "").strip().upper(), fields, place, file))
    for name, nodes in answer["sets"].items():
        bulk.sets[f"SET{name}"] = nodes
    _grids(bulk)
    bulk.dmig = answer
    return bulk


def ids(card: Card, begin: int, known: Iterable[int] | None = None) -> list[int]:
    """Returns the numbers from the field `begin` on, with THRU ranges. If `known` is given, ranges return only known numbers."""
    fields = [value for value in card.fields[begin:] if value != ""]
    found: list[int] = []
    k = 0
    while k < len(fields):
        if isinstance(fields[k], str) and fields[k].upper() == "THRU" and found and k + 1 < len(fields) and isinstance(fields[k + 1], int):
            if fields[k + 1] < found[-1] or (known is None and fields[k + 1] - found[-1] > MOST_IN_RANGE):
                raise card.reject(f"the range {found[-1]} THRU {fields[k + 1]}", f"an ascending range of at most {MOST_IN_RANGE} numbers")
            first, last = found[-1] + 1, fields[k + 1]
            found += range(first, last + 1) if known is None else sorted(number for number in known if first <= number <= last)
            k += 2
        elif isinstance(fields[k], int):
            found.append(fields[k])
            k += 1
        else:
            raise card.reject(f"the value {fields[k]!r}", "a whole number, or THRU between two whole numbers")
    return found


def _grids(bulk: Bulk) -> None:
    """Computes the positions, axes and permanent constraints of all grid points."""
    grids: dict[int, Card] = {}
    for card in bulk.named("GRID"):
        before = grids.setdefault(card.whole(0), card)
        if before.fields[:7] != card.fields[:7]:
            raise card.reject(f"the number {card.whole(0)} again, with other values than {before.place}", "each GRID once")
    default = next(iter(bulk.named("GRDSET")), Card("GRDSET", [], "", Path()))
    frames: dict[int, tuple[Card, int]] = {}
    for card in bulk.named("CORD1R", "CORD1C", "CORD1S", "CORD2R", "CORD2C", "CORD2S"):
        starts = [k for k in (0, 4) if card.get(k) != ""] if card.name[4] == "1" else [0]
        for start in starts:
            before, _ = frames.setdefault(card.whole(start), (card, start))
            if before.fields != card.fields or before.name != card.name:
                raise card.reject(
                    f"the number {card.whole(start)} again, with other values than {before.place}", "each coordinate system once"
                )
    known: dict[int, Frame] = {0: Frame("R", np.zeros(3), np.eye(3))}
    open_: set[tuple[str, int]] = set()

    def guard(kind: str, number: int, card: Card) -> None:
        if (kind, number) in open_:
            raise card.reject(f"{kind} {number}, which depends on itself", "a chain of coordinate systems that ends at the global system")
        open_.add((kind, number))

    def frame(number: int, asking: Card) -> Frame:
        if number in known:
            return known[number]
        if number not in frames:
            raise asking.reject(f"the coordinate system {number}", "a coordinate system that a CORD1 or CORD2 entry defines")
        card, start = frames[number]
        guard("axes", number, card)
        if card.name[4] == "1":
            points = [position(card.whole(start + k), card) for k in (1, 2, 3)]
        else:
            base = frame(card.whole(1, 0), card)
            points = [base.position(np.array([card.number(2 + 3 * p + k, 0.0) for k in range(3)])) for p in range(3)]
        known[number] = frame_of_points(card.name[5], points, f"{card.place}: {card.name} {number}")
        return known[number]

    def position(number: int, asking: Card) -> np.ndarray:
        if number not in bulk.positions:
            if number not in grids:
                raise asking.reject(f"the grid point {number}", "a grid point that a GRID entry defines")
            card = grids[number]
            guard("grid", number, card)
            base = frame(card.whole(1, default.whole(1, 0)), card)
            bulk.positions[number] = base.position(np.array([card.number(k, 0.0) for k in (2, 3, 4)]))
        return bulk.positions[number]

    for number, card in grids.items():
        at = position(number, card)
        of_displacements = frame(card.whole(5, default.whole(5, 0)), card)
        if not of_displacements.is_global:
            bulk.axes[number] = of_displacements.along(at, number)
        permanent = card.get(6) if card.get(6) != "" else default.get(6)
        if permanent not in ("", 0):
            bulk.permanent[number] = str(permanent)
