"""Rectangular, cylindrical and spherical coordinate systems for positions and displacements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fretwear.importing import Rejected

#: Smallest sine, or smallest fraction of a length, that defines a direction.
SMALLEST = 1e-9
#: Order of spherical coordinates: (r, polar angle, azimuth) in Nastran, (r, azimuth, latitude) in Abaqus.
NASTRAN, ABAQUS = "nastran", "abaqus"


def unit_vector(vector: np.ndarray, what: str) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    if not np.isfinite(length) or length == 0.0:
        raise Rejected(f"{what} has no direction, because two of its points coincide; give different points")
    return vector / length


@dataclass
class Frame:
    """A coordinate system: R (rectangular), C (cylindrical) or S (spherical).

    The rows of `directions` are the unit vectors x, y and z of the system, along the global axes.
    """

    kind: str
    origin: np.ndarray
    directions: np.ndarray
    spherical: str = NASTRAN
    name: str = "the axes"

    @property
    def is_global(self) -> bool:
        return self.kind == "R" and bool(np.all(np.abs(self.directions - np.eye(3)) < SMALLEST))

    def position(self, coordinates: np.ndarray) -> np.ndarray:
        """Returns the global position of a point from its coordinates in this system. Angles are in degrees."""
        first, second, third = (float(value) for value in coordinates)
        if self.kind == "C":
            angle = np.radians(second)
            local = np.array([first * np.cos(angle), first * np.sin(angle), third])
        elif self.kind == "S":
            polar, azimuth = (second, third) if self.spherical == NASTRAN else (90.0 - third, second)
            polar, azimuth = np.radians(polar), np.radians(azimuth)
            local = first * np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
        else:
            local = np.array([first, second, third])
        return np.asarray(self.origin + local @ self.directions)

    def along(self, position: np.ndarray, node: object) -> np.ndarray:
        """Returns the displacement directions 1, 2, 3 of a node at a global position, as rows along the global axes."""
        if self.kind == "R":
            return self.directions
        local = self.directions @ (position - self.origin)
        radius = float(np.hypot(local[0], local[1]))
        if radius <= SMALLEST * max(1e-300, float(np.abs(position).max()), float(np.abs(self.origin).max()), abs(local[2])):
            raise Rejected(
                f"node {node} lies on the axis of {self.name}, where radial and tangential directions are not defined; "
                "move the node, or give the node another coordinate system"
            )
        cosine, sine = local[0] / radius, local[1] / radius
        tangential = np.array([-sine, cosine, 0.0])
        if self.kind == "C":
            rows = np.array([[cosine, sine, 0.0], tangential, [0.0, 0.0, 1.0]])
        else:
            radial = local / np.linalg.norm(local)
            if self.spherical == NASTRAN:
                rows = np.array([radial, np.cross(tangential, radial), tangential])
            else:
                rows = np.array([radial, tangential, np.cross(radial, tangential)])
        return np.asarray(rows @ self.directions)


def frame_of_points(kind: str, points: list[np.ndarray], name: str) -> Frame:
    """Returns a coordinate system from its origin, a point on z and a point in the half plane of x and z (CORD1*, CORD2*)."""
    origin, on_z, in_xz = points
    z = unit_vector(on_z - origin, name)
    y = np.cross(z, in_xz - origin)
    if np.linalg.norm(y) <= SMALLEST * np.linalg.norm(in_xz - origin):
        raise Rejected(f"the three points of {name} lie on one line; move the third point off the line")
    y = unit_vector(y, name)
    return Frame(kind, np.asarray(origin, float), np.array([np.cross(y, z), y, z]), NASTRAN, name)


def rotation(first: np.ndarray, second: np.ndarray, degrees: float, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns the matrix and the shift of a rotation about the axis from the first point to the second point.

    The rotation maps a position x to matrix @ x + shift.
    """
    axis = unit_vector(second - first, name)
    angle = np.radians(degrees)
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    matrix = np.cos(angle) * np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * np.outer(axis, axis)
    matrix[np.abs(matrix) < 1e-15] = 0.0
    return matrix, first - matrix @ first


def to_global(matrices: dict[str, Any], rows: np.ndarray, axes: dict[int, np.ndarray], where: str) -> None:
    """Transforms the rows and columns of matrices to the global axes, in place.

    `axes` contains the displacement directions of each node with local axes. Such a node must have rows for all three displacements or
    for none of them, and for all three rotations or for none of them. Otherwise the function raises Rejected.
    """
    from scipy import sparse

    if not axes:
        return
    at: dict[int, dict[int, int]] = {}
    for row, (node, direction) in enumerate(rows.tolist()):
        if node in axes and direction:
            at.setdefault(node, {})[direction] = row
    turned = {row for found in at.values() for row in found.values()}
    straight = [row for row in range(len(rows)) if row not in turned]
    values: list[float] = [1.0] * len(straight)
    lines, columns = list(straight), list(straight)
    for node, found in at.items():
        for block in ((1, 2, 3), (4, 5, 6)):
            here = [found[d] for d in block if d in found]
            if not here:
                continue
            if len(here) < 3:
                missing = [d for d in block if d not in found]
                raise Rejected(
                    f"{where}: node {node} has local axes but no rows for the directions {missing}, so a transformation to the "
                    "global axes is not possible; write the rows of all three directions, or give the node global axes"
                )
            for i in range(3):
                for j in range(3):
                    lines.append(here[i])
                    columns.append(here[j])
                    values.append(float(axes[node][i, j]))
    turn = sparse.csr_array((values, (lines, columns)), shape=(len(rows), len(rows)))
    for name, matrix in matrices.items():
        matrices[name] = sparse.csr_array(turn.T @ matrix @ turn).astype(matrix.dtype)


def held(axes: np.ndarray, directions: list[int]) -> tuple[list[int], list[list[tuple[int, float]]]]:
    """Converts fixed displacements along the axes of a node to fixed global directions and equations Σ c u = 0.

    The first term of each equation depends on the other terms. No other equation of the node contains this first term.
    """
    rows = np.array([axes[d - 1] for d in directions], float)
    pivots: list[int] = []
    for k in range(len(rows)):
        free = [j for j in range(3) if j not in pivots]
        pivot = free[int(np.argmax(np.abs(rows[k, free])))]
        rows[k] /= rows[k, pivot]
        for other in range(len(rows)):
            if other != k:
                rows[other] -= rows[other, pivot] * rows[k]
        pivots.append(pivot)
    fixed, equations = [], []
    for row, pivot in zip(rows, pivots, strict=True):
        others = [(j + 1, float(row[j])) for j in range(3) if j != pivot and abs(row[j]) > SMALLEST]
        if others:
            equations.append([(pivot + 1, 1.0), *others])
        else:
            fixed.append(pivot + 1)
    return fixed, equations
