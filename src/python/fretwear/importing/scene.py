"""Writes a scene for the folder of an import: the given values, and a comment for each missing value."""

from __future__ import annotations

import json
import re
from argparse import Namespace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # This module imports numpy, which may be missing when `__main__` imports this module.
    from fretwear.importing.folder import Structure

TEMPLATE = """\
# fretwear-import wrote this scene. Replace each "?" by a value, and remove the "#" in front of its line.
# Then run `fretwear check scene.toml`.

[joint]
# size = ["? mm", "? mm"]                   # lengths of the joint along x and y
# grid = [?, ?]                             # numbers of cells along x and y

[material]
{material}
[surface]
# kind = "?"                                # "gaussian", "file" or another kind of surface
# rq = "? um"
# correlation_length = "? mm"

[contact]
# normal_load = "? N"
# friction_coefficient = ?

[structure]
kind = "{kind}"
file = "."
{unit}{interface}{fixed}
[dynamics]
{damping}# force = {{ amplitude = "? N", at = "?", direction = "?" }}
# frequency = ["? Hz", "? Hz"]              # range around one resonance; `fretwear inspect .` lists the resonances
"""


LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
MASSES = {"kg": 1.0, "g": 1e-3, "t": 1e3}
TIMES = {"s": 1.0, "ms": 1e-3}


def scale(text: str, units: dict[str, float]) -> float:
    """Returns a unit, or a multiple such as "25.4 mm", in SI units. Raises ValueError."""
    match = re.fullmatch(r"(?:(\d[\d.eE+-]*) *)?([a-z]+)", text)
    if not match or match[2] not in units or float(match[1] or 1.0) <= 0.0:
        raise ValueError(text)
    return float(match[1] or 1.0) * units[match[2]]


def _material(structure: Structure, unit: dict[str, str] | None) -> str:
    """Returns the lines of [material]: the material of the mesh if the mesh has one material and known units."""
    materials = {values[:2] for values in structure.materials.values()}
    if len(materials) != 1 or unit is None:
        return '# youngs_modulus = "? GPa"                  # modulus of both bodies at the joint\n# poisson_ratio = ?\n'
    modulus, ratio = materials.pop()
    factor = scale(unit["mass"], MASSES) / scale(unit["length"], LENGTHS) / scale(unit["time"], TIMES) ** 2
    return f'youngs_modulus = "{modulus * factor:.9g} Pa"               # modulus of the mesh\npoisson_ratio = {ratio!r}\n'


def write(structure: Structure, options: Namespace) -> str:
    """Returns the text of the scene."""
    unit: dict[str, str] | None = options.units
    if unit:
        unit_line = "unit = {{ {} }}\n".format(", ".join(f'{key} = "{value}"' for key, value in unit.items()))
    else:
        unit_line = '# unit = { length = "?", mass = "?", time = "?" }\n'
    if structure.pairs:
        interface = 'interface = "pairs.csv"\n'
    elif options.upper:
        interface = f"interface = {{ upper = {json.dumps(options.upper)}, lower = {json.dumps(options.lower)} }}\n"
    else:
        names = ", ".join(structure.sets) or "none"
        interface = f'# interface = {{ upper = "?", lower = "?" }}  # two node sets; the folder has the sets {names}\n'
    fixed = f"fixed = {json.dumps(options.fixed)}\n" if options.fixed and not structure.is_mesh else ""
    has_damping = structure.damping or structure.loss_factor or any(name in structure.matrices for name in ("C", "Ks"))
    damping = f"# damping_ratio = ?                         # of each mode{', besides damping from the files' if has_damping else ''}\n"
    if structure.loss_factor:
        damping += f"loss_factor = {structure.loss_factor!r}\n"
    return TEMPLATE.format(
        kind="mesh" if structure.is_mesh else "matrices",
        material=_material(structure, unit),
        unit=unit_line,
        interface=interface,
        fixed=fixed,
        damping=damping,
    )
