"""Reads a mesh of solid elements in Nastran bulk data, and the parameters that scale stiffness, mass and damping."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from fretwear.importing import Rejected, constraints, mesh
from fretwear.importing.bulk import Bulk, Card
from fretwear.importing.folder import Structure

#: Element type and order of the nodes, by entry and number of nodes. Nastran lists the midside nodes of bottom, upright and top edges. A
#: deck lists the midside nodes of bottom, top and upright edges.
SOLIDS = {
    ("CTETRA", 4): ("C3D4", []),
    ("CTETRA", 10): ("C3D10", []),
    ("CPENTA", 6): ("C3D6", []),
    ("CPENTA", 15): ("C3D15", [*range(9), *range(12, 15), *range(9, 12)]),
    ("CHEXA", 8): ("C3D8I", []),
    ("CHEXA", 20): ("C3D20R", [*range(12), *range(16, 20), *range(12, 16)]),
}
READ = {
    *("GRID GRDSET CORD1R CORD1C CORD1S CORD2R CORD2C CORD2S CHEXA CPENTA CTETRA PSOLID MAT1 SPC SPC1 MPC RBE2 PARAM".split()),
    *("DMIG EXTRN SPOINT SECONCT SET1".split()),
}
#: Entries of loads, methods, output and sets, which do not change a linear structure without load.
HARMLESS = re.compile(
    r"EIGR\w*|EIGC|FORCE\d?|MOMENT\d?|PLOAD\d?|GRAV|LOAD|DLOAD|[RT]LOAD\d|DAREA|DPHASE|DELAY|FREQ\d?|TSTEP\w*|TABLE\w+|TABDMP1|SET3|TEMP\w*|"
    r"SUPORT1?|ASET1?|BSET1?|CSET1?|QSET1?|OMIT1?|SEBULK|SELOC|SETREE|RELEASE|DTI|PLOTEL|EXTRN|SESET|SEUPLUP"
)
#: Parameters that scale stiffness or mass. The import accepts only the value 1.
SCALES = {"CK1", "CK2", "CK3", "CM1", "CM2", "CP1", "CP2", "CB1", "CB2"}
#: Parameters of damping that the import ignores, with the reason or advice.
DAMPING = {
    "ALPHA1": "give damping proportional to the mass as dynamics.rayleigh.mass in the scene",
    "ALPHA2": "give damping proportional to the stiffness as dynamics.rayleigh.stiffness in the scene",
    "W3": "structural damping remains hysteretic, and the import does not convert it to viscous damping at this frequency",
    "W4": "structural damping remains hysteretic, and the import does not convert it to viscous damping at this frequency",
    "GFL": "the parameter gives the damping of fluids, which the import does not read",
}


def parameters(structure: Structure, data: Bulk) -> float:
    """Applies or records each PARAM. Returns the factor on the masses of a mesh."""
    factor = 1.0
    values: dict[str, object] = {}
    for card in data.named("PARAM"):
        name, value = str(card.get(0)).upper(), card.get(1)
        if name in values and (name in SCALES or name in DAMPING or name in ("WTMASS", "G")):
            if values[name] != value:
                raise card.reject(f"{name} = {value} beside {name} = {values[name]}", "each parameter once")
            continue
        values[name] = value
        if name in SCALES and value not in ("", 1.0, 1):
            raise card.reject(f"{name} = {value}", "the value 1, which means no scaling")
        if name == "WTMASS" and structure.is_mesh:
            factor = card.number(1)
        elif name == "G" and not structure.is_mesh:
            damping = structure.matrices["K"] * card.number(1)
            structure.matrices["Ks"] = structure.matrices["Ks"] + damping if "Ks" in structure.matrices else damping
        elif name == "G":
            structure.loss_factor = card.number(1)
            if structure.loss_factor < 0.0:
                raise card.reject(f"G = {value}", "a loss factor of zero or more")
            structure.left_out.append(f"The import writes PARAM G = {value} as dynamics.loss_factor in scene.toml.")
        elif name in DAMPING:
            structure.left_out.append(f"The import ignores PARAM {name} = {value}: {DAMPING[name]}.")
        elif name not in SCALES:
            structure.left_out.append(
                f"The import ignores PARAM {name}, because the matrices already contain its effect, "
                "or because it changes neither stiffness nor mass."
            )
    return factor


def read(structure: Structure, data: Bulk, file: Path) -> None:
    others: dict[str, int] = {}
    for card in data.cards:
        if HARMLESS.fullmatch(card.name):
            others[card.name] = others.get(card.name, 0) + 1
        elif card.name not in READ:
            raise card.reject(
                "a possible effect on stiffness, mass or constraints, which fretwear-import does not read",
                "matrices of the structure (OUTPUT4 or DMIG), or a mesh without this entry",
            )
    structure.left_out += [
        f"The import ignores {name} ({number} ×), because it changes neither stiffness nor mass." for name, number in others.items()
    ]
    structure.labels, structure.positions = list(data.positions), np.array(list(data.positions.values())).reshape(-1, 3)
    solids = {card.whole(0): card for card in data.named("PSOLID")}
    materials = {card.whole(0): card for card in data.named("MAT1")}
    factor = parameters(structure, data)
    for card in data.named("CTETRA", "CPENTA", "CHEXA"):
        nodes = [card.whole(k) for k in range(2, len(card.fields)) if any(value != "" for value in card.fields[k:])]
        if (card.name, len(nodes)) not in SOLIDS:
            raise card.reject(f"{len(nodes)} nodes", "all corner nodes, with all or none of the midside nodes")
        kind, order = SOLIDS[(card.name, len(nodes))]
        section = solids.get(card.whole(1))
        if section is None or section.whole(1) not in materials:
            raise card.reject(f"the property {card.get(1)}", "the property of a PSOLID entry that has a MAT1 entry")
        if section.get(6) not in ("", "SMECH"):
            raise section.reject(f"FCTN = {section.get(6)}", "FCTN = SMECH")
        kind = _integration(section, kind)
        structure.elements.append((kind, card.whole(0), [nodes[k] for k in order] if order else nodes))
        structure.element_sets.setdefault(f"P{card.whole(1)}", []).append(card.whole(0))
        structure.sets.setdefault(f"P{card.whole(1)}", []).extend(nodes)
        structure.sections = list(dict.fromkeys([*structure.sections, (f"P{card.whole(1)}", f"MAT{section.whole(1)}")]))
    if len({element[1] for element in structure.elements}) < len(structure.elements):
        raise Rejected(f"{file}: two elements have the same number; give each element a different number")
    for number in sorted({section.whole(1) for section in solids.values() if section.whole(1) in materials}):
        card = materials[number]
        modulus, shear, ratio = (card.number(k, float("nan")) for k in (1, 2, 3))
        if np.isnan([modulus, shear, ratio]).sum() > 1:
            raise card.reject("fewer than two of E, G and NU", "two of E, G and NU")
        modulus = 2.0 * shear * (1.0 + ratio) if np.isnan(modulus) else modulus
        ratio = modulus / (2.0 * shear) - 1.0 if np.isnan(ratio) else ratio
        if not np.isnan(shear) and abs(modulus / (2.0 * (1.0 + ratio)) / shear - 1.0) > 1e-3:
            raise card.reject(f"G = {shear:g}, which contradicts E and NU", "a blank G, or G = E/(2(1+NU))")
        structure.materials[f"MAT{number}"] = (modulus, ratio, card.number(4) * factor)
        if loss_factor := card.number(7, 0.0):
            if loss_factor < 0.0:
                raise card.reject(f"GE = {loss_factor:g}", "a loss factor of zero or more")
            structure.damping[f"MAT{number}"] = loss_factor
    constraints.constrain(structure, data, *constraints.selected(structure, data))
    mesh.drop_unused(structure)
    mesh.check(structure, str(file))


def _integration(section: Card, kind: str) -> str:
    """Returns the element type with the integration that a PSOLID selects (IN, ISOP)."""
    points, scheme = str(section.get(3)).upper(), str(section.get(5)).upper()
    if kind == "C3D8I":
        if points in ("", "0", "BUBBLE"):
            return kind
        if points in ("2", "TWO") and scheme in ("1", "FULL"):
            return "C3D8"
    elif kind == "C3D20R":
        if points in ("", "2", "TWO") and scheme in ("", "0", "REDUCED"):
            return kind
        if points in ("3", "THREE"):
            return "C3D20"
    elif points in ("", "0", "BUBBLE", "2", "TWO", "3", "THREE"):
        return kind
    raise section.reject(f"IN = {points or 'blank'}, ISOP = {scheme or 'blank'}", "a blank IN and a blank ISOP")
