"""Reads Abaqus decks: keywords, parts and instances, sets, constraints, and the axes of nodes."""

from __future__ import annotations

import re
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fretwear.importing import Rejected
from fretwear.importing.axes import ABAQUS, SMALLEST, Frame, rotation, unit_vector

#: Largest depth of nested included files.
DEPTH = 16
#: Keywords of steps, loads, output, other physics and inelastic materials, which do not change a linear structure without load.
HARMLESS = set(
    """AMPLITUDE;BUCKLE;CFLUX;CLOAD;CONDUCTIVITY;CONTACT CONTROLS;CONTACT OUTPUT;CONTACT PRINT;CONTROLS;DFLUX;DLOAD;DSLOAD;DYNAMIC;EL FILE;
EL PRINT;ELEMENT OUTPUT;ENERGY OUTPUT;ENERGY PRINT;EXPANSION;FILE FORMAT;FILE OUTPUT;FILM;FILTER;FREQUENCY;FRICTION;
HEADING;HEAT TRANSFER;INCREMENTATION OUTPUT;MATRIX GENERATE;MATRIX OUTPUT;MODAL DYNAMIC;MODAL FILE;MODAL OUTPUT;MODAL PRINT;
MONITOR;NODE FILE;NODE OUTPUT;NODE PRINT;NO ANALYSIS;OUTPUT;PHYSICAL CONSTANTS;PLASTIC;PREPRINT;PRINT;RADIATE;RANDOM RESPONSE;
RATE DEPENDENT;RESPONSE SPECTRUM;RESTART;SECTION CONTROLS;SECTION FILE;SECTION PRINT;SELECT EIGENMODES;SOLVER CONTROLS;SPECIFIC HEAT;STATIC;
STEADY STATE DYNAMICS;SURFACE BEHAVIOR;SURFACE INTERACTION;TEMPERATURE;TIME POINTS;USER OUTPUT VARIABLES""".replace("\n", "").split(";")
)
#: Further keywords without effect on the stiffness, with the reason.
LEFT_OUT = {"ORIENTATION": "an isotropic material does not depend on the axes of the material"}
READ = set(
    "ASSEMBLY;BOUNDARY;DAMPING;DENSITY;ELASTIC;ELEMENT;ELSET;END ASSEMBLY;END INSTANCE;END PART;EQUATION;INSTANCE;MATERIAL;NODE;NSET;PART;"
    "END STEP;SOLID SECTION;STEP;SURFACE;SYSTEM;TIE;TRANSFORM".split(";")
)
#: Keywords of a material, which follow its *MATERIAL.
OF_MATERIAL = {"MATERIAL", "ELASTIC", "DENSITY", "DAMPING", "CONDUCTIVITY", "EXPANSION", "PLASTIC", "RATE DEPENDENT", "SPECIFIC HEAT"}
#: First and last direction that a named boundary condition fixes.
HELD = {"ENCASTRE": (1, 6), "PINNED": (1, 3), "XSYMM": (1, 1), "YSYMM": (2, 2), "ZSYMM": (3, 3)}


@dataclass
class Block:
    """A keyword with its options and its data lines."""

    keyword: str
    options: dict[str, str]
    place: str
    data: list[tuple[str, list[str]]] = field(default_factory=list)

    def reject(self, found: str, right: str) -> Rejected:
        return Rejected(f"{self.place}: *{self.keyword} has {found}; fretwear-import expects {right}")

    def numbers(self, k: int, count: int, what: str) -> np.ndarray:
        """Returns the first numbers of a data line. Blank fields are zero."""
        if k >= len(self.data):
            raise self.reject(f"only {k} data lines", what)
        place, fields = self.data[k]
        try:
            values = np.array([float(cell.upper().replace("D", "E")) if cell else 0.0 for cell in [*fields, *[""] * count][:count]])
        except ValueError:
            raise Rejected(f"{place}: the line is {', '.join(fields)}; fretwear-import expects {what}") from None
        if not np.all(np.isfinite(values)):
            raise Rejected(f"{place}: the line is {', '.join(fields)}; fretwear-import expects finite numbers")
        return values


@dataclass
class Scope:
    """The contents of a part, an instance, the assembly or a flat deck. All names are in capitals."""

    name: str = ""
    nodes: dict[int, np.ndarray] = field(default_factory=dict)
    elements: dict[int, tuple[str, list[int], str]] = field(default_factory=dict)
    #: Members of each set: (instance, number or name). Members of surfaces also have a face.
    nsets: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    elsets: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    of_elements: dict[str, list[str]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str, str]]] = field(default_factory=dict)
    sections: list[tuple[str, str, str]] = field(default_factory=list)
    transforms: list[tuple[str, Frame]] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    #: Placement of an instance: its position x becomes matrix @ x + shift.
    matrix: np.ndarray = field(default_factory=lambda: np.eye(3))
    shift: np.ndarray = field(default_factory=lambda: np.zeros(3))


@dataclass
class Model:
    scopes: dict[str, Scope] = field(default_factory=lambda: {"": Scope()})
    materials: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    left_out: dict[str, int] = field(default_factory=dict)
    is_flat: bool = True


def _lines(file: Path, files: list[Path], depth: int = 0) -> list[tuple[str, str]]:
    """Returns the lines without comments and blank lines, each with its place. Reads included files too."""
    if depth > DEPTH:
        raise Rejected(f"{file}: files include each other more than {DEPTH} levels deep; remove the circular *INCLUDE")
    try:
        text = file.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise Rejected(f"fretwear-import cannot read {file}: {error.strerror}") from None
    files.append(file)
    lines: list[tuple[str, str]] = []
    for k, line in enumerate(text.splitlines()):
        line = line.strip()
        if line and not line.startswith("**"):
            if lines and lines[-1][1].startswith("*") and lines[-1][1].endswith(","):
                lines[-1] = (lines[-1][0], lines[-1][1] + line)
            else:
                lines.append((f"{file}, line {k + 1}", line))
    found = []
    for place, line in lines:
        found.append((place, line))
        if line.startswith("*"):
            block = _keyword(place, line)
            if "INPUT" in block.options and block.keyword in ("INCLUDE", "NODE", "ELEMENT"):
                if block.keyword == "INCLUDE":
                    found.pop()
                found += _lines(file.parent / block.options["INPUT"].strip('"'), files, depth + 1)
    return found


def _keyword(place: str, line: str) -> Block:
    words = [word.strip() for word in line[1:].split(",")]
    options = {}
    for word in filter(None, words[1:]):
        key, _, value = word.partition("=")
        options[" ".join(key.split()).upper()] = value.strip().strip('"')
    return Block(" ".join(words[0].split()).upper(), options, place)


def blocks(file: Path, files: list[Path]) -> list[Block]:
    found: list[Block] = []
    for place, line in _lines(file, files):
        if line.startswith("*"):
            found.append(_keyword(place, line))
        elif not found:
            raise Rejected(f"{place}: the line {line[:40]!r} precedes all keywords; begin the deck with a keyword such as *NODE")
        else:
            found[-1].data.append((place, [cell.strip() for cell in line.split(",")]))
    return found


def whole(text: str, place: str, what: str) -> int:
    if not re.fullmatch(r"[+-]?\d+", text):
        raise Rejected(f"{place}: the value is {text!r}; fretwear-import expects {what}")
    return int(text)


def real(text: str, place: str, what: str) -> float:
    try:
        value = float(text.upper().replace("D", "E"))
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise Rejected(f"{place}: the value is {text!r}; fretwear-import expects {what}")
    return value


def _frame(block: Block, kind: str) -> Frame:
    """Returns the axes of *TRANSFORM."""
    values = block.numbers(0, 6, "the six coordinates of two points")
    a, b = values[:3], values[3:]
    if kind == "R":
        x = unit_vector(a, f"{block.place}: *TRANSFORM")
        z = unit_vector(np.cross(x, b), f"{block.place}: *TRANSFORM")
        return Frame("R", np.zeros(3), np.array([x, np.cross(z, x), z]), ABAQUS, "*TRANSFORM")
    if kind not in ("C", "S"):
        raise block.reject(f"TYPE={kind}", "TYPE=R, C or S")
    z = unit_vector(b - a, f"{block.place}: *TRANSFORM")
    x = unit_vector(np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))]), block.place)
    return Frame(kind, a, np.array([x, np.cross(z, x), z]), ABAQUS, f"*TRANSFORM of {block.place}")


def _system(block: Block) -> Frame:
    """Returns the axes of *SYSTEM for the positions of the following *NODE lines. Without data, returns the axes of the part."""
    if not block.data:
        return Frame("R", np.zeros(3), np.eye(3))
    values = block.numbers(0, 6, "the coordinates of one or two points")
    origin, given = values[:3], len([cell for cell in block.data[0][1] if cell])
    if given <= 3:
        return Frame("R", origin, np.eye(3))
    x = unit_vector(values[3:] - origin, f"{block.place}: *SYSTEM")
    if len(block.data) > 1:
        z = unit_vector(np.cross(x, block.numbers(1, 3, "the coordinates of a third point") - origin), f"{block.place}: *SYSTEM")
    else:
        z = np.array([0.0, 0.0, 1.0])
        if abs(x[2]) > SMALLEST:
            raise block.reject("two points with different z", "a third point on a second data line")
    return Frame("R", origin, np.array([x, np.cross(z, x), z]))


def _nodes(block: Block, scope: Scope, system: Frame) -> None:
    kind = block.options.get("SYSTEM", "R").upper()
    if kind not in ("R", "C", "S"):
        raise block.reject(f"SYSTEM={kind}", "SYSTEM=R, C or S")
    here = Frame(kind, np.zeros(3), np.eye(3), ABAQUS)
    for k, (place, fields) in enumerate(block.data):
        label = whole(fields[0], place, "the number of a node")
        values = block.numbers(k, 4, "a node and its coordinates")[1:]
        position = system.position(here.position(values))
        if label in scope.nodes and not np.allclose(scope.nodes[label], position):
            raise Rejected(f"{place}: the deck defines node {label} again at another position; define each node once")
        scope.nodes[label] = position
        if name := block.options.get("NSET"):
            scope.nsets.setdefault(name.upper(), []).append((scope.name, str(label)))


def _elements(block: Block, scope: Scope, counts: dict[str, int]) -> None:
    kind = block.options.get("TYPE", "").upper()
    wanted = counts.get(kind, 0)
    open_: list[int] = []
    for k, (place, fields) in enumerate(block.data):
        open_ += [whole(cell, place, "the number of an element or a node") for cell in fields if cell]
        goes_on = len(open_) <= wanted if wanted else not fields[-1] and k + 1 < len(block.data)
        if goes_on and k + 1 < len(block.data):
            continue
        if wanted and len(open_) != wanted + 1:
            raise Rejected(f"{place}: element {open_[0]} has {len(open_) - 1} nodes; give {wanted} nodes for the type {kind}")
        if open_[0] in scope.elements:
            raise Rejected(f"{place}: the deck defines element {open_[0]} again; define each element once")
        scope.elements[open_[0]] = (kind, open_[1:], place)
        if name := block.options.get("ELSET"):
            scope.elsets.setdefault(name.upper(), []).append((scope.name, str(open_[0])))
        open_ = []


def _set(block: Block, scope: Scope) -> None:
    of_nodes = block.keyword == "NSET"
    name = block.options.get(block.keyword, "").upper()
    if not name:
        raise block.reject("no name", f"{block.keyword}=NAME")
    members = (scope.nsets if of_nodes else scope.elsets).setdefault(name, [])
    instance = block.options.get("INSTANCE", scope.name).upper()
    if of_nodes and "ELSET" in block.options:
        scope.of_elements.setdefault(name, []).append(
            f"{instance}.{block.options['ELSET'].upper()}" if "INSTANCE" in block.options else block.options["ELSET"].upper()
        )
    for place, fields in block.data:
        if "GENERATE" in block.options:
            cells = [whole(cell, place, "first number, last number and step of a set") for cell in fields if cell]
            if len(cells) not in (2, 3) or cells[1] < cells[0] or cells[-1] < 1:
                raise Rejected(
                    f"{place}: the line is {', '.join(fields)}; fretwear-import expects first number, last number and step of a set"
                )
            members.append((instance, f"{cells[0]}:{cells[1]}:{cells[2] if len(cells) > 2 else 1}"))
        else:
            members += [(instance, cell.strip('"').upper()) for cell in fields if cell]


def _instance(block: Block, parts: dict[str, Scope]) -> Scope:
    part = block.options.get("PART", "").upper()
    if part not in parts:
        raise block.reject(f"PART={part}", f"one of the parts {', '.join(parts) or '(none)'}")
    scope = deepcopy(parts[part])
    scope.name = block.options.get("NAME", "").upper()
    for sets in (scope.nsets, scope.elsets):
        for name, members in sets.items():
            sets[name] = [(scope.name, member) for _, member in members]
    scope.surfaces = {name: [(scope.name, member, face) for _, member, face in members] for name, members in scope.surfaces.items()}
    if len(block.data) > 2:
        raise block.reject(f"{len(block.data)} data lines", "one line with a translation and one line with a rotation")
    for k, (place, fields) in enumerate(block.data):
        if any(fields[3 + 4 * k :]) or (k and not any(fields[6:])):
            right = "two points and an angle" if k else "three numbers of a translation, and a rotation on a second line"
            raise Rejected(
                f"{place}: *INSTANCE, NAME={scope.name} has the line {', '.join(fields)}; fretwear-import expects {right}"
            )
    if block.data:
        scope.shift = block.numbers(0, 3, "a translation")
    if len(block.data) > 1:
        values = block.numbers(1, 7, "two points and an angle")
        matrix, shift = rotation(values[:3], values[3:6], values[6], f"{block.place}: the axis of the instance {scope.name}")
        scope.matrix, scope.shift = matrix, matrix @ scope.shift + shift
    return scope


def _constants(block: Block, strict: bool) -> np.ndarray:
    """Returns the constants of *ELASTIC or *DENSITY."""
    kind = block.options.get("TYPE", "ISOTROPIC").upper()
    if strict and (len(block.data) != 1 or not kind.startswith("ISO")):
        raise block.reject(
            f"{len(block.data)} data lines and TYPE={kind}",
            "one data line of an isotropic material that does not depend on temperature",
        )
    return block.numbers(0, 2, "the constants of a material")


def _loss_factor(block: Block, is_in_material: bool) -> np.ndarray:
    """Returns the loss factor of the *DAMPING of a material."""
    if not is_in_material:
        raise block.reject("no *MATERIAL directly above", "*DAMPING among the keywords below its *MATERIAL")
    if set(block.options) != {"STRUCTURAL"}:
        found = ", ".join(block.options) or "no option"
        raise block.reject(found, "only STRUCTURAL; give ALPHA and BETA as dynamics.rayleigh in the scene")
    factor = real(block.options["STRUCTURAL"], block.place, "a loss factor")
    if factor < 0.0:
        raise block.reject(f"STRUCTURAL={factor:g}", "a loss factor of zero or more")
    return np.array([factor])


def read(file: Path, files: list[Path], counts: dict[str, int], *, strict: bool) -> Model:
    """Reads a deck. If `strict`, raises Rejected for an unsupported keyword that may change the stiffness."""
    model, parts = Model(), {}
    here, is_part, system, material, steps = model.scopes[""], False, Frame("R", np.zeros(3), np.eye(3)), "", 0
    is_in_material = False
    for block in blocks(file, files):
        word = block.keyword
        is_in_material = word == "MATERIAL" or (is_in_material and word in OF_MATERIAL)
        if strict and word.endswith(" DAMPING"):
            raise block.reject(
                "damping of more than one material",
                "*DAMPING of each material, or dynamics.damping_ratio or dynamics.loss_factor in the scene",
            )
        if word not in READ and (word == "NMAP" or (strict and word not in HARMLESS and word not in LEFT_OUT)):
            raise Rejected(
                f"{block.place}: fretwear-import does not read *{word}, which may change the structure; "
                "remove the keyword, or write the matrices with Abaqus (*MATRIX OUTPUT)"
            )
        if word not in READ:
            model.left_out[word] = model.left_out.get(word, 0) + 1
        if steps and not strict and word == "BOUNDARY":
            model.left_out["BOUNDARY in a step"] = 1
            continue
        if word == "DAMPING" and not strict:
            model.left_out[word] = model.left_out.get(word, 0) + 1
            continue
        if word == "PART":
            name, is_part, model.is_flat = block.options.get("NAME", "").upper(), True, False
            here = parts[name] = Scope()
        elif word == "INSTANCE":
            here, is_part, model.is_flat = _instance(block, parts), False, False
            if not here.name or here.name in model.scopes:
                raise block.reject(f"NAME={here.name}", "a different name for each instance")
            model.scopes[here.name] = here
        elif word in ("END PART", "END INSTANCE", "ASSEMBLY", "END ASSEMBLY"):
            here, is_part = model.scopes[""], False
        elif word == "SYSTEM":
            system = _system(block)
        elif word == "NODE":
            _nodes(block, here, system)
        elif word == "ELEMENT":
            _elements(block, here, counts)
        elif word in ("NSET", "ELSET"):
            _set(block, here)
        elif word == "SURFACE":
            kind = block.options.get("TYPE", "ELEMENT").upper()
            if kind not in ("ELEMENT", "NODE"):
                raise block.reject(f"TYPE={kind}", "TYPE=ELEMENT or NODE")
            members = here.surfaces.setdefault(block.options.get("NAME", "").upper(), [])
            members += [
                (here.name, fields[0].strip('"').upper(), "" if kind == "NODE" else (fields + [""])[1].upper()) for _, fields in block.data
            ]
        elif word == "TRANSFORM":
            here.transforms.append((block.options.get("NSET", "").upper(), _frame(block, block.options.get("TYPE", "R").upper())))
        elif word == "SOLID SECTION":
            if "COMPOSITE" in block.options:
                raise block.reject("COMPOSITE", "one isotropic material")
            here.sections.append((block.options.get("ELSET", "").upper(), block.options.get("MATERIAL", "").upper(), block.place))
        elif word == "MATERIAL":
            material = block.options.get("NAME", "").upper()
            model.materials.setdefault(material, {})
        elif word in ("ELASTIC", "DENSITY", "DAMPING"):
            constants = model.materials.setdefault(material, {})
            if strict and word in constants:
                raise block.reject(f"a second occurrence in the material {material}", "one occurrence per material")
            constants[word] = _loss_factor(block, is_in_material) if word == "DAMPING" else _constants(block, strict)
        elif word == "STEP":
            steps += 1
            if strict and block.options.get("NLGEOM", "NO").upper() != "NO":
                raise block.reject("the option NLGEOM", "a linear step without NLGEOM")
        elif word in ("BOUNDARY", "EQUATION", "TIE"):
            if steps > 1 and word == "BOUNDARY":
                raise block.reject("fixed displacements in a second step", "all fixed displacements before the second step")
            if is_part:
                raise block.reject("a place inside a part", "a place in the assembly")
            if block.options.get("OP", "").upper() == "NEW":
                for scope in model.scopes.values():
                    scope.blocks = [
                        other for other in scope.blocks if other.keyword != "BOUNDARY" or other.options.get("step") == str(steps)
                    ]
            block.options["step"] = str(steps)
            here.blocks.append(block)
    return model
