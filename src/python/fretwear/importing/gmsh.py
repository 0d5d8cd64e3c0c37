"""Reads Gmsh meshes, `.msh` files of the versions 2.2 and 4.1, with meshio."""

from __future__ import annotations

import re
from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np

from fretwear.importing import Rejected, child, mesh
from fretwear.importing.folder import Structure

#: Element type of each solid of meshio. meshio orders the nodes as VTK and Abaqus do.
SOLIDS = {"tetra": "C3D4", "tetra10": "C3D10", "wedge": "C3D6", "wedge15": "C3D15", "hexahedron": "C3D8I", "hexahedron20": "C3D20"}
SECOND_ORDER = "for second order, set Mesh.ElementOrder = 2 and Mesh.SecondOrderIncomplete = 1 (hexahedra of 20 and wedges of 15 nodes)"
DIMENSION = {"vertex": 0, "line": 1, "triangle": 2, "quad": 2, "tetra": 3, "hexahedron": 3, "wedge": 3, "pyramid": 3}


def _dimension(kind: str) -> int:
    return DIMENSION[re.match("[a-z]+", kind)[0]]  # type: ignore[index]


def _section(data: bytes, name: str, file: str) -> bytes:
    begin, end = data.find(b"$" + name.encode() + b"\n"), data.rfind(b"$End" + name.encode())
    if begin < 0 or end < begin:
        raise Rejected(f"{file}: the section ${name} is missing or does not end with $End{name}; the file may be cut off")
    return data[begin + len(name) + 2 : end]


def _declared(data: bytes, name: str, version: str, binary: bool, file: str) -> int:
    """Returns the number of nodes or elements that a section declares. meshio does not check this number."""
    body = _section(data, name, file)
    if not version.startswith("4"):
        said = int(body.split(b"\n", 1)[0])
        lines = said if binary else sum(1 for line in body.split(b"\n")[1:] if line.strip())
        if lines != said:
            raise Rejected(f"{file}: the section ${name} declares {said} lines but has {lines}; the file may be damaged")
        return said
    return int(np.frombuffer(body[8:16], "<u8")[0]) if binary else int(body.split(None, 2)[1])


def _short_lines(data: bytes, counts: dict[int, int], file: str) -> None:
    """Checks the number of values per element in an ASCII file of version 2. Raises Rejected.

    meshio would use the last values of a line with a wrong number of values.
    """
    for line in _section(data, "Elements", file).split(b"\n")[1:]:
        words = line.split()
        if words and (len(words) < 3 or int(words[1]) not in counts or len(words) != 3 + int(words[2]) + counts[int(words[1])]):
            raise Rejected(
                f"{file}: the element line is {line.decode(errors='replace')[:60]}; "
                "fretwear-import expects a number, a type, the tags and the nodes"
            )


def read_msh(file: str) -> dict[str, Any]:
    """Reads a mesh. Runs in the child process."""
    import meshio
    from meshio._common import num_nodes_per_cell
    from meshio._mesh import topological_dimension
    from meshio.gmsh.common import _gmsh_to_meshio_type

    # meshio 5.3 lacks the number of nodes and the dimension of these two types.
    num_nodes_per_cell.update({"wedge15": 15, "pyramid13": 13})
    topological_dimension.update({"wedge15": 3, "pyramid13": 3})
    data = Path(file).read_bytes().replace(b"\r\n", b"\n")
    header = re.match(rb"(?:\$Comments\n.*?\$EndComments\n)?\$MeshFormat\n([\d.]+) ([01]) (\d+)\n", data, re.DOTALL)
    if not header or header[1] not in (b"2.2", b"2", b"4.1"):
        found = header[1].decode() if header else repr(data[:20])
        raise Rejected(
            f"{file}: the mesh format is {found}; fretwear-import expects mesh format 2.2 or 4.1; "
            "save the mesh again with Mesh.MshFileVersion = 4.1"
        )
    version, binary = header[1].decode(), header[2] == b"1"
    if version != "4.1" and not binary:
        _short_lines(data, {number: num_nodes_per_cell[kind] for number, kind in _gmsh_to_meshio_type.items()}, file)
    names = [
        (int(d), int(tag), name.decode("utf-8", "replace")) for d, tag, name in re.findall(rb'^(\d) (\d+) "(.*)"\s*$', data, re.MULTILINE)
    ]
    if twice := [name for _, _, name in names if sum(name == other for *_, other in names) > 1]:
        raise Rejected(f"{file}: two physical groups have the name {twice[0]!r}; give each group a different name")
    from meshio import gmsh

    try:
        read = gmsh.read(file)
    except MemoryError:
        raise
    except Exception as error:
        raise Rejected(
            f"{file}: meshio cannot read the file: {type(error).__name__}: {' '.join(str(error).split())[:200]}; the file may be "
            "damaged; if the file is not damaged, save the mesh with Mesh.MshFileVersion = 4.1, Mesh.SaveAll = 0 and "
            "Mesh.SaveParametric = 0"
        ) from None
    counts = {"Nodes": len(read.points), "Elements": sum(len(block.data) for block in read.cells)}
    for name, found in counts.items():
        if (said := _declared(data, name, version, binary, file)) != found:
            raise Rejected(f"{file}: the section ${name} declares {said} entries but has {found}; the file may be damaged")
    blocks, arrays = [], {"points": np.asarray(read.points, float)}
    for k, block in enumerate(read.cells):
        cells = np.asarray(block.data, np.int64)
        if cells.size and (cells.min() < 0 or cells.max() >= len(read.points)):
            raise Rejected(f"{file}: an element of type {block.type} has a node that the file does not define; the file may be damaged")
        dimension = _dimension(block.type)
        for d, tag, name in names:
            if d != dimension:
                continue
            if version == "4.1":
                members = np.asarray(read.cell_sets[name][k], np.int64)
            else:
                physical = read.cell_data.get("gmsh:physical")
                members = (
                    np.flatnonzero(physical[k] == tag) if physical is not None and len(physical[k]) == len(cells) else np.zeros(0, np.int64)
                )
            if len(members):
                arrays[f"set {k} {name}"] = members
        arrays[f"cells {k}"] = cells
        blocks.append(block.type)
    known = {"Comments", "MeshFormat", "PhysicalNames", "Entities", "Nodes", "Elements", "Periodic"}
    others = {name.decode() for name in re.findall(rb"^\$([A-Z]\w+)\s*$", data, re.MULTILINE) if not name.startswith(b"End")} - known
    return {
        "others": sorted(others),
        "blocks": blocks,
        "names": names,
        "version": meshio.__version__,
        "periodic": bool(read.gmsh_periodic),
    } | arrays


def _written(name: str, structure: Structure) -> str:
    """Returns a name with only the characters that a deck accepts, and records a changed name."""
    written = mesh.plain_name(name)
    if written != name:
        structure.left_out.append(f"The import renames the physical group {name!r} to {written}.")
    return written


def read(files: list[Path], options: Namespace) -> Structure:
    if len(files) > 1:
        raise Rejected(f"{files[1]}: fretwear-import reads one .msh file at a time; merge the meshes in Gmsh")
    file = str(files[0])
    found = child.call("fretwear.importing.gmsh:read_msh", {"file": file}, files=files, library="meshio", extra="gmsh")
    structure = Structure(files, libraries=["meshio"])
    points = found["points"]
    structure.labels, structure.positions = list(range(1, len(points) + 1)), points
    structure.left_out.append("The import renumbers the nodes and elements of Gmsh in the order of the file.")
    structure.left_out += [f"The import ignores the section ${name}." for name in found["others"]]
    if found["periodic"]:
        structure.left_out.append("The import ignores the section $Periodic, because it constrains no displacements.")
    names = {name: _written(name, structure) for *_, name in found["names"]}
    if len({name.upper() for name in names.values()}) < len(names):
        raise Rejected(
            f"{file}: the names of two physical groups differ only in case or in characters that a deck cannot contain; "
            "rename one of the groups"
        )
    number_of: dict[tuple[int, ...], int] = {}
    others: dict[str, int] = {}
    for k, kind in enumerate(found["blocks"]):
        cells = found[f"cells {k}"] + 1
        sets = {name: found[f"set {k} {name}"] for name in names if f"set {k} {name}" in found}
        if _dimension(kind) == 3:
            if kind not in SOLIDS:
                raise Rejected(
                    f"{file}: the file has elements of type {kind}, which fretwear does not assemble; {SECOND_ORDER}; "
                    "replace pyramids with other solids"
                )
            # Version 2 repeats an element for each of its groups.
            labels = [number_of.setdefault(tuple(nodes), len(number_of) + 1) for nodes in cells.tolist()]
            known = len(structure.elements)
            structure.elements += [
                (SOLIDS[kind], label, nodes) for label, nodes in dict(zip(labels, cells.tolist(), strict=True)).items() if label > known
            ]
            for name, members in sets.items():
                structure.element_sets.setdefault(names[name], []).extend(labels[i] for i in members)
        elif not sets:
            others[kind] = others.get(kind, 0) + len(cells)
        for name, members in sets.items():
            structure.sets.setdefault(names[name], []).extend(np.unique(cells[members]).tolist())
    for kind, number in others.items():
        structure.left_out.append(
            f"The import omits {number} elements of type {kind}, because no named physical group contains them."
        )
    mesh.drop_unused(structure)
    _materials(structure, options, file)
    mesh.check(structure, file)
    return structure


def _materials(structure: Structure, options: Namespace, file: str) -> None:
    """Assigns each material of --material to its physical group. Raises Rejected if an element has no material or two materials."""
    known = ", ".join(structure.element_sets) or "none"
    having: dict[int, str] = {}
    for text in options.material:
        match = re.fullmatch(r"([^=]+)=([^,]+),([^,]+),([^,]+)", text)
        try:
            if not match:
                raise ValueError(text)
            name, values = match[1], (float(match[2]), float(match[3]), float(match[4]))
        except ValueError:
            raise Rejected(f"--material {text} is not valid; give SET=E,nu,rho, such as STEEL=210000,0.3,7.85e-9") from None
        if not (0.0 < values[0] < np.inf and -1.0 < values[1] < 0.5 and 0.0 < values[2] < np.inf):
            raise Rejected(f"--material {text}: E and rho must be finite and above zero, and nu must be between -1 and 0.5")
        name = mesh.plain_name(name)
        if name not in structure.element_sets:
            raise Rejected(
                f"--material {text}: the file has no physical group of solids with this name; its groups of solids are {known}; "
                "save the mesh with Mesh.SaveAll = 0, because Mesh.SaveAll = 1 writes no groups"
            )
        if f"M_{name}" in structure.materials:
            raise Rejected(f"--material {text}: the group {name} already has a material; give each group one material")
        for label in structure.element_sets[name]:
            if having.setdefault(label, name) != name:
                raise Rejected(
                    f"--material: element {label} is in the groups {having[label]} and {name}; give each element one material"
                )
        structure.materials[f"M_{name}"] = values
        structure.sections.append((name, f"M_{name}"))
    if without := len(structure.elements) - len(having):
        raise Rejected(
            f"{file}: {without} solid elements have no material; give --material SET=E,nu,rho for each physical group of solids; "
            f"the groups of solids are {known}"
        )
