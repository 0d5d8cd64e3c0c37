"""Elastic half spaces as full matrices, and values of a scene in SI units; needs only numpy. Used by dense.py and fields.py."""

import math

import numpy as np

UNITS = {
    "": 1.0, "m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9,
    "N": 1.0, "kN": 1e3, "Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9,
    "rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": math.pi / 180.0, "N m": 1.0,
    "um^3/J": 1e-18, "um^3": 1e-18, "mm^3": 1e-9,
}  # fmt: skip


def si(value):
    """Returns a value of a scene, such as "3 um", in SI units; for a list, all its values."""
    if isinstance(value, list):
        return [si(one) for one in value]
    if isinstance(value, str):
        number, _, unit = value.strip().partition(" ")
        return float(number) * UNITS[unit.strip()]
    return float(value)


def pair(value):
    """Returns the values along x and along y; a single value is the value along x."""
    values = si(value)
    return values if isinstance(values, list) else [values, 0.0]


def corners(antiderivative, x, y, dx, dy):
    """Integral over a cell around (x, y), from the antiderivative at the four corners."""
    f = antiderivative
    return (
        f(x + dx / 2, y + dy / 2) - f(x - dx / 2, y + dy / 2) - f(x + dx / 2, y - dy / 2) + f(x - dx / 2, y - dy / 2)
    )


def compliance(grid, size, youngs_modulus, poisson_ratio):
    """Full matrices (normal, xx, xy, yy) of two half spaces: relative displacement at cell centres over cell tractions.

    The cell index varies fastest along y."""
    nx, ny = grid
    dx, dy = size[0] / nx, size[1] / ny
    x = dx * np.arange(-(nx - 1), nx)[:, None]
    y = dy * np.arange(-(ny - 1), ny)[None, :]
    # The second derivatives d2/dxdy of xx, yy and xy are x^2/r^3, y^2/r^3 and x y/r^3. In the sum over the corners, a term y ln|y| of xx
    # and a term x ln|x| of yy cancel.
    xx = corners(lambda x, y: y * np.arcsinh(x / np.abs(y)), x, y, dx, dy)
    yy = corners(lambda x, y: x * np.arcsinh(y / np.abs(x)), x, y, dx, dy)
    xy = corners(lambda x, y: -np.hypot(x, y), x, y, dx, dy)
    r = xx + yy  # 1/r = x^2/r^3 + y^2/r^3
    e, nu = youngs_modulus, poisson_ratio
    both = 2.0  # number of bodies, of the same material
    kernels = (
        both * (1 - nu**2) / (math.pi * e) * r,
        both * (1 + nu) / (math.pi * e) * ((1 - nu) * r + nu * xx),
        both * (1 + nu) / (math.pi * e) * nu * xy,
        both * (1 + nu) / (math.pi * e) * ((1 - nu) * r + nu * yy),
    )
    i, j = (index.ravel() for index in np.indices((nx, ny)))
    di = i[:, None] - i[None, :] + nx - 1
    dj = j[:, None] - j[None, :] + ny - 1
    return tuple(kernel[di, dj] for kernel in kernels)
