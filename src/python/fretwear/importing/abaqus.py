"""Reads Abaqus files: a deck as a flat mesh, or the matrices of *MATRIX OUTPUT with the nodes and sets of their deck."""

from __future__ import annotations

import re
from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np

from fretwear.importing import Rejected, abaqus_mesh, axes, deck, folder, mesh
from fretwear.importing.flat import Flat, axes_of, held_by, positions_of
from fretwear.importing.folder import Structure

#: Matrix by the ending of its file name, before the number of the step.
ROLES = {"STIF": "K", "MASS": "M", "DMPV": "C", "DMPS": "Ks"}
LABELS_ADVICE = (
    "Abaqus renumbers the nodes of an assembly; give --labels FILE, a CSV file with the columns label,instance,node, or "
    "give the .dat file with the node map (*PREPRINT, MODEL=YES)"
)


def _label_map(flat: Flat, labels: Path | None, dats: list[Path], files: list[Path], matrix: Path) -> dict[int, tuple[str, int]]:
    """Returns the instance and the node of each label of the matrices."""
    found: dict[int, tuple[str, int]] = {}
    lines: list[tuple[str, str, str]] = []
    if labels:
        files.append(labels)
        lines = [(cells[0], cells[1], cells[2]) for cells in folder.read_csv(labels, ["label", "instance", "node"])]
    elif flat.model.is_flat:
        return {label: ("", label) for label in flat.model.scopes[""].nodes}
    for file in [] if labels else dats:
        files.append(file)
        text = file.read_text(encoding="utf-8", errors="replace").upper()
        begin = text.find("GLOBAL TO LOCAL NODE")
        end = text.find("ELEMENT MAP", begin + len("GLOBAL TO LOCAL NODE AND ELEMENT MAPS"))
        part = text[begin : end if end > 0 else None] if begin >= 0 else ""
        lines += [(a, c, b) for a, b, c in re.findall(r"^\s*(\d+)\s+(\d+)\s+(\S+)\s*$", part, re.MULTILINE)]
    if not lines:
        raise Rejected(f"{matrix}: the deck has instances, but no file maps the labels of the matrices to nodes; {LABELS_ADVICE}")
    for label, instance, node in lines:
        scope = flat.scope(instance.upper(), f"the label map, label {label}")
        if not re.fullmatch(r"-?\d+", label) or not re.fullmatch(r"\d+", node) or int(node) not in scope.nodes or int(label) in found:
            raise Rejected(
                f"the label map has the row {label},{instance},{node}; each label must occur once, with a node of its instance"
            )
        found[int(label)] = (scope.name, int(node))
    if len(set(found.values())) < len(found):
        raise Rejected("the label map gives two labels to one node; each node must have one label")
    return found


def _labels_matrix(file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Reads a matrix. Returns an array (entries, 4) of node, direction, node, direction, and the values of the entries."""
    lines = []
    for k, line in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines()):
        if not line.strip() or line.lstrip().startswith("**"):
            continue
        words = line.replace(",", " ").split()
        if line.lstrip().startswith("*") and words[0].upper() != "*MATRIX":
            raise Rejected(
                f"{file}, line {k + 1}: the keyword {words[0]} belongs to a substructure, which `fretwear` reads directly; "
                "give the file as structure.file in the scene"
            )
        if line.lstrip().startswith("*"):
            continue
        try:
            lines.append((*map(int, words[:4]), float(words[4].upper().replace("D", "E"))))
            if len(words) != 5:
                raise IndexError
        except (ValueError, IndexError):
            raise Rejected(
                f"{file}, line {k + 1}: the line is {line.strip()[:60]}; "
                "fretwear-import expects node, direction, node, direction and value (FORMAT=LABELS)"
            ) from None
    table = np.array(lines, float).reshape(-1, 5)
    return table[:, :4].astype(np.int64), table[:, 4]


def _matrices(flat: Flat, structure: Structure, files: list[Path], options: Namespace, file: Path) -> None:
    from scipy import sparse

    read: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for path in files:
        role = re.search(r"_([A-Z]{4})\d*$", path.stem.upper())
        if not role or role[1] not in ROLES or ROLES[role[1]] in read:
            raise Rejected(
                f"{path}: the file name must end with _STIF1, _MASS1, _DMPV1 or _DMPS1, such as NAME_STIF1.mtx, with one file per matrix"
            )
        read[ROLES[role[1]]] = _labels_matrix(path)
    structure.files += files
    rows = np.unique(np.concatenate([ends.reshape(-1, 2) for ends, _ in read.values()]), axis=0)
    place = {(node, direction): k for k, (node, direction) in enumerate(rows.tolist())}
    for name, (ends, values) in read.items():
        i = np.array([place[(a, b)] for a, b in ends[:, :2].tolist()], np.int64)
        j = np.array([place[(a, b)] for a, b in ends[:, 2:].tolist()], np.int64)
        low, high = np.minimum(i, j), np.maximum(i, j)
        pairs, times = np.unique(np.stack([low, high]), axis=1, return_counts=True)
        matrix: Any = sparse.coo_array((values, (i, j)), shape=(len(rows),) * 2).tocsr()
        if np.unique(np.stack([i, j]), axis=1).shape[1] != len(i):
            raise Rejected(f"{file}: the matrix {name} has an entry twice; each entry must occur once")
        if (times == 1).all():
            matrix = matrix + matrix.T - sparse.diags_array(matrix.diagonal())
        structure.matrices[name] = matrix
    labels = _label_map(flat, options.labels, [f for f in options.files if f.suffix.lower() == ".dat"], structure.files, files[0])
    unknown = sorted({int(node) for node in rows[:, 0] if node > 0 and int(node) not in labels})
    if unknown:
        raise Rejected(
            f"{files[0]}: {len(unknown)} labels of the matrices have no node in the deck, such as label {unknown[0]}; {LABELS_ADVICE}"
        )
    positions = positions_of(flat.model)
    structure.labels, structure.positions = list(labels), np.array([positions[node] for node in labels.values()]).reshape(-1, 3)
    label_of = {node: label for label, node in labels.items()}
    blocks = [(scope.name, block) for scope in flat.model.scopes.values() for block in scope.blocks]
    held = {(label_of[node], direction) for node, direction in held_by(flat, blocks) if node in label_of}
    kept = [k for k, row in enumerate(rows.tolist()) if tuple(row) not in held]
    if len(kept) < len(rows):
        structure.left_out.append(f"The import omits {len(rows) - len(kept)} rows of displacements, because *BOUNDARY fixes them at zero.")
        rows = rows[kept]
        structure.matrices = {name: sparse.csr_array(matrix)[kept][:, kept] for name, matrix in structure.matrices.items()}
    structure.rows = np.array([(node, direction if node > 0 else 0) for node, direction in rows.tolist()], np.int64).reshape(-1, 2)
    axes.to_global(
        structure.matrices,
        structure.rows,
        {label_of[node]: turn for node, turn in axes_of(flat, positions).items() if node in label_of},
        str(file),
    )
    for name, (scope_name, own) in flat.names("nsets").items():
        members = flat.members(scope_name, own, "nsets", str(file))
        structure.sets[name] = [label_of[node] for node in members if node in label_of]
        if lost := len(members) - len(structure.sets[name]):
            structure.left_out.append(f"The import omits {lost} nodes of the set {name}, because the nodes have no label in the matrices.")
    elements = sum(len(scope.elements) for scope in flat.model.scopes.values())
    constraints = {block.keyword for _, block in blocks} - {"BOUNDARY"}
    structure.left_out.append(
        f"The import does not assemble {elements} elements of the deck{''.join(f', *{word}' for word in sorted(constraints))}, "
        "because the matrices already contain their effect."
    )
    folder.check_matrices(structure, str(files[0]))


def read(files: list[Path], options: Namespace) -> Structure:
    matrices, decks = ([file for file in files if file.suffix.lower() == suffix] for suffix in (".mtx", ".inp"))
    if matrices and not decks:
        stem = re.sub(r"_[A-Za-z]{4}\d*$", "", matrices[0].stem)
        decks = [matrices[0].with_name(f"{stem}.inp")]
        if not decks[0].is_file():
            raise Rejected(f"{matrices[0]}: the matrices contain no positions of nodes; give the deck {decks[0].name} too")
    if len(decks) != 1:
        raise Rejected(f"{len(decks)} decks are given; give one .inp file; fretwear-import also reads its included files")
    structure = Structure([])
    model = deck.read(decks[0], structure.files, {kind: mesh.count(kind) for kind in mesh.TYPES}, strict=not matrices)
    for word, number in model.left_out.items():
        harmless = (
            "it changes neither stiffness nor mass" if word in deck.HARMLESS else "the matrices already contain its effect, or it has none"
        )
        why = deck.LEFT_OUT.get(word, harmless)
        structure.left_out.append(f"The import ignores *{word} ({number} ×), because {why}.")
    flat = Flat(model)
    if matrices:
        _matrices(flat, structure, matrices, options, decks[0])
        return structure
    beside = sorted(decks[0].parent.glob(f"{decks[0].stem}_STIF*.mtx"))
    structure.left_out += [
        f"The import assembles the mesh and ignores {file.name} in the folder of the deck, because {file.name} is not given."
        for file in beside
    ]
    abaqus_mesh.read(flat, structure, decks[0])
    return structure
