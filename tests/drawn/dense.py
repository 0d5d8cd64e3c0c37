"""Dense reference of the fretting wear of a rough joint on small grids; needs only numpy and scipy.

    import dense
    joint = dense.Joint.read("scene.toml")            # a scene of the program, of the kinds that draw.py writes
    cycle = joint.cycle(joint.heights, samples=64)    # the steady cycle of the unworn joint

The following command computes the steady cycle of a scene with two discretisations of time for several numbers of samples:

    python dense.py scene.toml [--samples 16 32 64 128]

The model, with all values in SI units:

- Two elastic half spaces of the same material, traction constant over a cell, displacement at its centre. The compliance
  matrices are full; their entries are the closed integrals of the point loads of Boussinesq and Cerruti over a rectangle
  (Love, Phil. Trans. R. Soc. A 228, 1929; Johnson, Contact Mechanics, 1985, ch. 3). Shear along x also displaces the surface
  along y.
- Normal contact: the linear complementarity problem of pressure and gap under a load, with an upper limit of the pressure,
  and with free rotations if the scene has them, by a primal-dual active set method (Hintermueller, Ito, Kunisch, SIAM J. Optim.
  13, 2003), accurate to rounding.
- Friction: Coulomb's law as a vector, |q| <= mu p. In a time step the slip is s = c - K q + (rigid motion), with q = mu p s/|s|
  if s is not zero. A semi-smooth Newton method with symmetric positive definite systems (Alart, Curnier, CMAME 92, 1991) solves
  q = P(q + rho s), where P is the projection on the discs. If this method does not converge, block Gauss-Seidel over the cells
  and continuation provide a better start.
- Time: backward Euler, or the two-step backward differentiation formula (BDF2): with ~ = (4 (.)_1 - (.)_2)/3 of the two previous
  states, one step from q~ by the displacement d - d~, whose slip times 3/2 is the slip of the time step. Energy per area and
  cycle is the sum of |q| |slip|. The march continues until the cycle repeats itself. If the drive of the second half of a period
  is opposite to the drive of the first half, and the load is constant, the steady cycle has the same symmetry, and the march
  covers only half of it.
- Wear: dw/dn = alpha E(w), with E the energy per area of a cycle on the surface h - w, by the explicit Runge-Kutta-Chebyshev
  method of second order (Sommeijer, Shampine, Verwer, J. Comput. Appl. Math. 88, 1998) with a tolerance for each step.

The steady dissipation does not depend on the shear at the start of a cycle: the difference of two solutions with the same drive and
pressure decreases until all slipping cells slip alike.
"""

import argparse
import csv
import dataclasses
import math
import pathlib
import tomllib

import numpy as np
from half_spaces import UNITS, compliance, pair, si
from scipy.linalg import LinAlgError, eigvalsh, lapack

# ------------------------------------------------------------------------------------------------------- linear algebra


def solve_spd(matrix, right):
    """Solves a symmetric positive definite system; overwrites `matrix`."""
    if not len(right):
        return right.copy()
    _, solution, info = lapack.dposv(matrix, right, lower=1, overwrite_a=1)
    if info:
        raise LinAlgError(f"not positive definite: {info}")
    return solution


def solve_bordered(matrix, border, right, target):
    """Returns y and l of  matrix y - border l = right,  border' y = target."""
    k = border.shape[1]
    if not k:
        return solve_spd(matrix, right), np.zeros(0)
    both = solve_spd(matrix, np.column_stack([border, right]))
    y_border, y_right = both[:, :k], both[:, k]
    multipliers = np.linalg.solve(border.T @ y_border, target - border.T @ y_right)
    return y_right + y_border @ multipliers, multipliers


# -------------------------------------------------------------------------------------------------------- normal contact


class NotSolved(Exception):
    pass


@dataclasses.dataclass
class Pressed:
    pressure: np.ndarray
    approach: float
    gap: np.ndarray
    violation: float  # violation of the contact conditions over the displacement of one cell under the peak pressure
    rigid: np.ndarray


def press(matrix, heights, modes, loads, cap=math.inf, start=None):
    """Pressure p with gap g = matrix p - heights - modes a: p = 0 and g >= 0, 0 < p < cap and g = 0, or p = cap and g <= 0.

    `modes` are rigid displacements (a column of ones first), `loads` the required values of modes' p."""
    n = len(heights)
    if start is None:
        contact = heights >= np.partition(heights, -max(n // 10, 4))[-max(n // 10, 4)]
        capped = np.zeros(n, bool)
    else:
        contact, capped = start.pressure > 0, start.pressure >= cap
    contact = contact.copy()
    best, stale, seen = n + 1, 0, set()
    for iteration in range(2000):
        free = np.flatnonzero(contact & ~capped)
        at_cap = np.flatnonzero(capped)
        p = np.zeros(n)
        right = heights[free].copy()
        target = loads.copy()
        if len(at_cap):
            p[at_cap] = cap
            right -= matrix[np.ix_(free, at_cap)].sum(axis=1) * cap
            target = target - modes[at_cap].sum(axis=0) * cap
        if len(free) <= modes.shape[1]:  # too few cells for the load: add the highest
            more = np.argsort(np.where(contact, -math.inf, heights))[-(len(modes[0]) + 2) :]
            contact[more] = True
            continue
        p[free], rigid = solve_bordered(np.asfortranarray(matrix[np.ix_(free, free)]), modes[free], right, target)
        gap = matrix @ p - heights - modes @ rigid
        scale = max(p.max(), 1e-300) * matrix[0, 0]
        wrong_open = contact & (p < 0)
        wrong_close = ~contact & (gap < -1e-13 * scale)
        wrong_cap = contact & ~capped & (p > cap)
        wrong_uncap = capped & (gap > 1e-13 * scale)
        wrong = wrong_open | wrong_close | wrong_cap | wrong_uncap
        count = int(wrong.sum())
        if not count:
            inner = np.abs(gap[free]).max(initial=0.0)
            sum_error = np.abs(modes.T @ p - loads).max() / np.abs(loads).max()
            gap[free] = 0.0
            return Pressed(p, rigid[0], gap, max(inner / scale, sum_error), rigid)
        # All changes at once as long as the number of errors decreases; then one change at a time, the last in order, which terminates
        # (Murty's rule).
        stale = 0 if count < best else stale + 1
        best = min(best, count)
        key = (contact.tobytes(), capped.tobytes())
        if key in seen:
            stale = max(stale, 12)
        seen.add(key)
        if stale >= 12:
            only = np.flatnonzero(wrong)[-1]
            mask = np.zeros(n, bool)
            mask[only] = True
            wrong_open, wrong_close, wrong_cap, wrong_uncap = (
                w & mask for w in (wrong_open, wrong_close, wrong_cap, wrong_uncap)
            )
        contact[wrong_open] = False
        contact[wrong_close] = True
        capped[wrong_cap] = True
        capped[wrong_uncap] = False
    raise NotSolved("normal contact")


# -------------------------------------------------------------------------------------------------------------- friction


def on_discs(z, bound):
    """Projects z (x of all cells, then y of all cells) on |z| <= bound; also returns |z|."""
    m = len(bound)
    norm = np.hypot(z[:m], z[m:])
    factor = np.where(norm > bound, bound / np.maximum(norm, 1e-30), 1.0)
    return z * np.concatenate([factor, factor]), norm


class Friction:
    """One step on cells under pressure: |q| <= bound, slip s = c + border l - matrix q, border' q = target."""

    tolerance = 1e-8  # error of q over the largest bound; after the last step of Newton's method it is usually much smaller

    def __init__(self):
        self.inverse = None  # inverse of the matrix, if all steps of a cycle have the same cells
        self.newton = self.steps = self.helped = 0
        self.worst = 0.0

    def residual(self, matrix, bound, c, border, target, q, multipliers, rho):
        s = c - matrix @ q
        if border.shape[1]:
            s += border @ multipliers
        projected, norm = on_discs(q + rho * s, bound)
        error = np.abs(q - projected).max() / bound.max()
        if border.shape[1]:
            size = np.abs(border).sum(axis=0) * bound.max()
            error = max(error, np.abs((border.T @ q - target) / size).max())
        return s, projected, norm, error

    def solve(self, matrix, bound, c, border, target, q, multipliers):
        """Returns q, s and the multipliers l, with q and the multipliers as a guess."""
        self.steps += 1
        m = len(bound)
        of_cells = 2.0 / (matrix.diagonal()[:m] + matrix.diagonal()[m:])  # x and y of a cell have the same value
        rho = np.concatenate([of_cells, of_cells])
        guess = q, multipliers
        q, multipliers, error = self.by_newton(matrix, bound, c, border, target, q, multipliers, rho, 40)
        if error > self.tolerance:
            self.helped += 1
            q, multipliers, error = self.near(matrix, bound, c, border, target, *guess, rho)
        self.worst = max(self.worst, error)
        if error > 1e-7:
            raise NotSolved(f"friction: {error:.1e}")
        s, _, _, _ = self.residual(matrix, bound, c, border, target, q, multipliers, rho)
        return q, s, multipliers

    def by_newton(self, matrix, bound, c, border, target, q, multipliers, rho, limit, damping=1.0):
        m = len(bound)
        best = (math.inf, q, multipliers)
        for _ in range(limit):
            s, projected, norm, error = self.residual(matrix, bound, c, border, target, q, multipliers, rho)
            if error < best[0]:
                best = (error, q, multipliers)
            if error < self.tolerance:
                break
            self.newton += 1
            slips = norm > bound
            slip, stick = np.flatnonzero(slips), np.flatnonzero(~slips)
            z = q + rho * s
            nx, ny = z[slip] / norm[slip], z[slip + m] / norm[slip]
            tx, ty = -ny, nx
            if self.inverse is not None and damping == 1.0 and len(slip) < 1.5 * len(stick):
                dq, dl = self.by_slip(bound, q, s, slip, nx, ny, norm[slip], rho[slip], border, target)
                if dq is None or not np.abs(dq).max() < 1e6 * bound.max():
                    break
                part = self.part(matrix, bound, border, dl)
                q, multipliers = q + part * dq, multipliers + part * dl
                continue
            stuck = np.concatenate([stick, stick + m])
            normal = bound[slip] - (nx * q[slip] + ny * q[slip + m])
            dq = np.zeros(2 * m)
            dq[slip], dq[slip + m] = nx * normal, ny * normal
            # The matrix is symmetric, so fast access by rows is possible.
            rest = s - matrix @ dq
            wide = np.vstack([matrix[stuck], tx[:, None] * matrix[slip] + ty[:, None] * matrix[slip + m]])
            system = np.hstack([wide[:, stuck], wide[:, slip] * tx + wide[:, slip + m] * ty])
            eta = norm[slip] / bound[slip]
            tail = np.arange(len(stuck), len(system))
            system[tail, tail] += (eta - 1.0) / rho[slip]
            right = np.concatenate([rest[stuck], tx * rest[slip] + ty * rest[slip + m]])
            right[len(stuck) :] -= (eta - 1.0) / rho[slip] * (tx * q[slip] + ty * q[slip + m])
            edge = np.vstack([border[stuck], tx[:, None] * border[slip] + ty[:, None] * border[slip + m]])
            try:
                y, dl = solve_bordered(system.T, edge, right, target - border.T @ (q + dq))
            except LinAlgError:
                break
            dq[stuck] = y[: len(stuck)]
            dq[slip] += tx * y[len(stuck) :]
            dq[slip + m] += ty * y[len(stuck) :]
            if not np.abs(dq).max() < 1e6 * bound.max():
                break
            part = damping * self.part(matrix, bound, border, dl)
            q = q + part * dq
            multipliers = multipliers + part * dl
        return best[1], best[2], best[0]

    def part(self, matrix, bound, border, dl):
        """Fraction of a step that limits the displacement of the bodies to twice the displacement at which all cells slide."""
        if not len(dl):
            return 1.0
        return min(1.0, 2 * np.abs(matrix[:, : len(bound)] @ bound).max() / max(np.abs(border @ dl).max(), 1e-300))

    def by_slip(self, bound, q, s, slip, nx, ny, norm, rho, border, target):
        """The same step of Newton's method if few cells slip: the inverse matrix reduces the system to the slip of these cells."""
        m, k = len(bound), len(slip)
        base = q + self.inverse @ s
        rows_x, rows_y = self.inverse[slip], self.inverse[slip + m]
        wide = np.vstack([nx[:, None] * rows_x + ny[:, None] * rows_y, -ny[:, None] * rows_x + nx[:, None] * rows_y])
        x, y = wide[:, slip], wide[:, slip + m]
        system = np.hstack([x * nx + y * ny, -x * ny + y * nx])
        tail = np.arange(k, 2 * k)
        system[tail, tail] += rho / (norm / bound[slip] - 1.0)
        bx, by = base[slip], base[slip + m]
        right = np.concatenate([nx * bx + ny * by - bound[slip], -ny * bx + nx * by])
        try:
            if not border.shape[1]:
                return base - wide.T @ solve_spd(system.T, right) - q, np.zeros(0)
            moved = self.inverse @ border
            edge = wide @ border
            both = solve_spd(system.T, np.column_stack([edge, right]))
            by_edge, by_right = both[:, :-1], both[:, -1]
            dl = np.linalg.solve(border.T @ moved - edge.T @ by_edge, target - border.T @ base + edge.T @ by_right)
            return base + moved @ dl - wide.T @ (by_right + by_edge @ dl) - q, dl
        except LinAlgError:
            return None, None

    def near(self, matrix, bound, c, border, target, q, multipliers, rho):
        """Finds a better start if Newton's method does not converge."""
        best = (math.inf, q, multipliers)
        q, _ = on_discs(q, bound)
        for attempt in range(6):
            if not border.shape[1]:
                q = self.sweeps(matrix, bound, c, q, 30 * (attempt + 1))
            else:
                q, multipliers = self.by_displacement(matrix, bound, c, border, target, q, multipliers, rho)
            for damping in (1.0, 0.5, 0.2):
                found = self.by_newton(
                    matrix, bound, c, border, target, q, multipliers, rho, int(60 / damping), damping
                )
                if found[2] < best[0]:
                    best = (found[2], found[0], found[1])
                if best[0] <= self.tolerance:
                    return best[1], best[2], best[0]
        return best[1], best[2], best[0]

    def sweeps(self, matrix, bound, c, q, count):
        """Block Gauss-Seidel: solves the disc problem of each cell in turn exactly."""
        m = len(bound)
        q = q.copy()
        s = c - matrix @ q
        columns_x, columns_y = matrix[:, :m].T.copy(), matrix[:, m:].T.copy()
        for _ in range(count):
            changed = 0.0
            for i in range(m):
                kx, ky, kxy = matrix[i, i], matrix[i + m, i + m], matrix[i, i + m]
                rx = s[i] + kx * q[i] + kxy * q[i + m]
                ry = s[i + m] + ky * q[i + m] + kxy * q[i]
                qx, qy = disc(kx, ky, rx, ry, bound[i])
                ax, ay = qx - q[i], qy - q[i + m]
                if ax or ay:
                    s -= columns_x[i] * ax + columns_y[i] * ay
                    q[i], q[i + m] = qx, qy
                    changed = max(changed, abs(ax), abs(ay))
            if changed < 1e-12 * bound.max():
                break
        return q

    def by_displacement(self, matrix, bound, c, border, target, q, multipliers, rho):
        """Solves for the displacement that causes the prescribed force by Newton's method: the dual problem is concave and has few
        unknowns."""
        none = np.zeros((len(c), 0))

        def at(l, q):
            q, _, error = self.by_newton(matrix, bound, c + border @ l, none, target[:0], q, target[:0], rho, 40)
            if error > self.tolerance:
                q, _, error = self.near(matrix, bound, c + border @ l, none, target[:0], q, target[:0], rho)
            q, _ = on_discs(q, bound)
            return q, 0.5 * q @ (matrix @ q) - (c + border @ l) @ q + l @ target

        scale = np.abs(border).sum(axis=0) * bound.max()
        l = multipliers if np.isfinite(multipliers).all() else np.zeros(len(target))
        q, value = at(l, on_discs(q, bound)[0])
        for _ in range(60):
            miss = target - border.T @ q
            if np.abs(miss / scale).max() < 1e-12:
                break
            # Derivative of the force along the displacement: stuck cells move with the bodies, and the shear of slipping cells rotates.
            m = len(bound)
            s = c + border @ l - matrix @ q
            z = q + rho * s
            norm = np.hypot(z[:m], z[m:])
            slips = norm > bound
            slip, stick = np.flatnonzero(slips), np.flatnonzero(~slips)
            tx, ty = -z[slip + m] / norm[slip], z[slip] / norm[slip]
            stuck = np.concatenate([stick, stick + m])
            wide = np.hstack([matrix[:, stuck], matrix[:, slip] * tx + matrix[:, slip + m] * ty])
            system = np.vstack([wide[stuck], tx[:, None] * wide[slip] + ty[:, None] * wide[slip + m]])
            tail = np.arange(len(stuck), len(system))
            system[tail, tail] += (norm[slip] / bound[slip] - 1.0) / rho[slip]
            edge = np.vstack([border[stuck], tx[:, None] * border[slip] + ty[:, None] * border[slip + m]])
            slope = edge.T @ solve_spd(np.asfortranarray(system), edge)
            change = np.linalg.solve(slope + 1e-14 * np.trace(slope) * np.eye(len(slope)), miss)
            # The step is at most half of the displacement at which all cells slide.
            reach = 0.5 * np.abs(matrix[:, :m] @ bound).max() / max(np.abs(border @ change).max(), 1e-300)
            if not np.isfinite(reach):
                raise NotSolved("displacement by force")
            change *= min(1.0, reach)
            part = 1.0
            for _ in range(40):
                new_q, new_value = at(l + part * change, q)
                if new_value >= value + 1e-4 * part * (change @ miss) or part * np.abs(change @ miss) < 1e-14 * abs(value):
                    break
                part *= 0.5
            l, q, value = l + part * change, new_q, new_value
        return q, l

def disc(kx, ky, rx, ry, bound):
    """Minimum of (kx x^2 + ky y^2)/2 - rx x - ry y over |(x, y)| <= bound."""
    x, y = rx / kx, ry / ky
    if x * x + y * y <= bound * bound:
        return x, y
    # |r/(k + a)| = bound for a > 0: Newton's method on the reciprocal, which is convex and monotone.
    a = max(0.0, math.hypot(rx, ry) / bound - max(kx, ky))
    for _ in range(60):
        x, y = rx / (kx + a), ry / (ky + a)
        norm = math.hypot(x, y)
        slope = -(x * x / (kx + a) + y * y / (ky + a)) / norm
        change = -(norm / bound - 1.0) * norm / slope
        a = max(a + change, 0.0)
        if abs(change) <= 1e-15 * (kx + a):
            break
    norm = math.hypot(x, y)
    return x * bound / norm, y * bound / norm


# ---------------------------------------------------------------------------------------------------------------- motion


@dataclasses.dataclass
class Drive:
    """One period of the drive: prescribed displacement or force (or moment) along x, along y and about z over time."""

    given: tuple  # three times "displacement" or "force"
    load: object  # function of an array of times in periods
    motion: tuple  # three functions of the same kind
    antisymmetric: bool  # whether the second half is the negative of the first, under a constant load
    constant_load: bool
    rows: int = 0  # number of rows of a history at equal time steps, with linear interpolation

    def at(self, samples):
        time = np.arange(samples) / samples
        return np.column_stack([f(time) for f in self.motion]), self.load(time)


def read_drive(motion, normal_load, transverse, folder):
    if "history" in motion:
        with open(folder / motion["history"], encoding="utf-8") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
        time = np.append(column["time"], 1.0) if column["time"][-1] < 1.0 else column["time"]

        def course(name, otherwise):
            if name not in column:
                return lambda t: np.full_like(t, otherwise)
            values = column[name]
            values = np.append(values, values[0]) if len(values) < len(time) else values
            return lambda t: np.interp(t, time, values)

        motions = (course("displacement_x", 0.0), course("displacement_y", 0.0), course("none", 0.0))
        load = course("normal_load", normal_load)
        constant = "normal_load" not in column or np.ptp(column["normal_load"]) == 0.0
        return Drive(("displacement",) * 3, load, motions, False, constant, len(time) - 1)
    phases = motion.get("phase", "0 deg")
    phases = si(phases) if isinstance(phases, list) else [si(phases)] * 2
    amplitudes = pair(motion.get("amplitude", 0.0))
    forces = pair(motion.get("force", 0.0))

    def wave(amplitude, phase):
        return lambda t: amplitude * np.cos(2 * math.pi * t + phase)

    given, motions = [], []
    for axis in range(2):
        if forces[axis]:
            given.append("force")
            motions.append(wave(forces[axis], phases[axis]))
        elif axis == 1 and transverse == "free" and not amplitudes[1]:
            given.append("force")
            motions.append(wave(0.0, 0.0))
        else:
            given.append("displacement")
            motions.append(wave(amplitudes[axis], phases[axis]))
    # A rotation has the first phase.
    if "moment" in motion:
        given.append("force")
        motions.append(wave(si(motion["moment"]), phases[0]))
    else:
        given.append("displacement")
        motions.append(wave(si(motion.get("rotation", 0.0)), phases[0]))
    varying = si(motion.get("normal_load_amplitude", 0.0))
    return Drive(
        tuple(given),
        lambda t: normal_load + varying * np.cos(2 * math.pi * t),
        tuple(motions),
        not varying,
        not varying,
    )


# ----------------------------------------------------------------------------------------------------------------- joint


@dataclasses.dataclass
class Cycle:
    energy: np.ndarray  # energy per area and cycle of each cell
    forces: np.ndarray  # forces along x and y and moment at the samples of the march
    displacement: np.ndarray
    marches: int  # number of periods (or half periods) of the march
    change: float  # relative change of the energy in the last period
    peak: np.ndarray  # largest pressure of each cell
    state: tuple


class Joint:
    def __init__(self, grid, size, heights, material, contact, drive, wear=None):
        self.grid, self.size = grid, size
        self.heights = np.asarray(heights, float).ravel()
        self.cell = size[0] / grid[0] * size[1] / grid[1]
        self.mu = contact["friction_coefficient"]
        self.load = contact["normal_load"]
        self.cap = contact.get("pressure_cap", math.inf)
        self.drive = drive
        self.wear = wear or {}
        self.normal, xx, xy, yy = compliance(grid, size, *material)
        self.tangential = (xx, xy, yy)
        i, j = (index.ravel() for index in np.indices(grid))
        self.x = (i + 0.5) * size[0] / grid[0] - size[0] / 2
        self.y = (j + 0.5) * size[1] / grid[1] - size[1] / 2
        n = len(self.heights)
        modes = [np.ones(n)]
        if contact.get("rotation", "fixed") == "free":
            modes += [self.y / size[1], self.x / size[0]]
        self.modes = np.column_stack(modes)
        self.moments = np.zeros(len(modes) - 1)
        self.pressed = {}
        self.friction = Friction()
        self.accelerated = True
        self.inverse = b"", None
        self.cycles = 0

    @classmethod
    def read(cls, path):
        path = pathlib.Path(path)
        with open(path, "rb") as file:
            scene = tomllib.load(file)
        joint, surface, contact = scene["joint"], scene["surface"], scene["contact"]
        grid, size = tuple(joint["grid"]), tuple(si(joint["size"]))
        if surface["kind"] != "file" or surface["detrend"] != "none":
            raise ValueError("only a surface of kind file with detrend none is supported")
        heights = np.load(path.parent / surface["path"]) * UNITS[surface["unit"]]
        if heights.shape != grid:
            raise ValueError("the map does not have the shape of the grid")
        if contact.get("boundary", "free") != "free" or contact.get("transverse", "fixed") == "absent":
            raise ValueError("only a free boundary with both axes is supported")
        material = si(scene["material"]["youngs_modulus"]), scene["material"]["poisson_ratio"]
        values = {key: si(contact[key]) for key in ("friction_coefficient", "normal_load", "pressure_cap") if key in contact}
        values["rotation"] = contact.get("rotation", "fixed")
        drive = read_drive(scene["motion"], values["normal_load"], contact.get("transverse", "fixed"), path.parent)
        wear = scene.get("wear", {})
        wear = {"coefficient": si(wear["coefficient"]), "cycles": wear["cycles"]} if wear else None
        return cls(grid, size, heights, material, values, drive, wear)

    def press(self, heights, load, key=None):
        """Solves the normal contact; the solution with the same key is the start."""
        loads = np.concatenate([[load / self.cell], self.moments])
        found = press(self.normal, heights, self.modes, loads, self.cap, self.pressed.get(key))
        self.pressed[key] = found
        return found

    def stiffness_of_wear(self, rate, peak):
        """Largest rate at which wear reduces a disturbance of the depth at constant slip paths: rate/p times dp/dh.

        `peak` is the largest pressure of each cell in the cycle."""
        cells = np.flatnonzero((peak > 0) & (rate > 0))
        if not len(cells):
            return 0.0
        root = np.sqrt(rate[cells] / peak[cells])
        inverse = np.linalg.inv(self.normal[np.ix_(cells, cells)])
        return float(eigvalsh(root[:, None] * inverse * root, subset_by_index=[len(cells) - 1, len(cells) - 1])[0])

    def modes_of_motion(self, cells):
        one, zero = np.ones(len(cells)), np.zeros(len(cells))
        x, y = self.x[cells], self.y[cells]
        return np.column_stack([np.concatenate([one, zero]), np.concatenate([zero, one]), np.concatenate([-y, x])])

    def cycle(self, heights, samples=64, scheme="bdf2", tolerance=1e-6, limit=200, start=None, least=0.0):
        """Steady cycle, from the state `start` of an earlier cycle, or from rest.

        The cycle repeats itself when the energy (L1 norm over the cells) changes by less than `tolerance` of its value, or of `least`."""
        motion, load = self.drive.at(samples)
        if self.drive.constant_load:
            bounds = [self.mu * self.press(heights, load[0], 0).pressure] * samples
        else:
            bounds, known = [], {}
            for n in load:
                key = round(n / self.load, 12)
                if key not in known:
                    known[key] = self.mu * self.press(heights, n, key).pressure
                bounds.append(known[key])
        largest = np.max(bounds, axis=0)
        cells = np.flatnonzero(largest > 1e-12 * largest.max())
        bounds = [bound[cells] for bound in bounds]
        m = len(cells)
        index = np.ix_(cells, cells)
        xx, xy, yy = (part[index] for part in self.tangential)
        matrix = np.block([[xx, xy], [xy, yy]])
        modes = self.modes_of_motion(cells)
        by_force = np.array([one == "force" for one in self.drive.given])
        border, moved = modes[:, by_force], modes[:, ~by_force]
        march = _March(self, cells, matrix, bounds, border, moved, motion, by_force, scheme)

        n = len(heights)
        if start is None:
            state = march.from_rest()
        else:
            both = np.concatenate([cells, cells + n])
            state = tuple(one[both] if len(one) == 2 * n else one for one in start)
            state = (on_discs(state[0], bounds[0])[0], on_discs(state[1], bounds[-1])[0], *state[2:])
        half = self.drive.antisymmetric and samples % 2 == 0
        count = samples // 2 if half else samples
        before, change, energy = None, math.inf, None
        faster = Anderson(self.mu * self.load / self.cell / m) if self.accelerated else None
        for marches in range(1, limit + 1):
            begin = state
            state, energy, forces, displacement = march.over(state, count)
            if half:
                energy = 2 * energy
                state = tuple(-one for one in state)
            total = energy.sum()
            if before is not None:
                change = np.abs(energy - before).sum() / max(total, least, 1e-300)
                if change < tolerance or total == 0.0:
                    break
            # If all cells slide at once, the state has no memory, and the second cycle is the steady one.
            missing = max(np.abs(state[k] - begin[k]).max() for k in (0, 1)) / max(bounds[0].max(), bounds[-1].max())
            if missing < 1e-2 * tolerance:
                change = min(change, missing)
                break
            before = energy
            if faster:
                q1, q2 = faster(np.concatenate(begin[:2]), np.concatenate(state[:2])).reshape(2, -1)
                state = (on_discs(q1, bounds[0])[0], on_discs(q2, bounds[-1])[0], *state[2:])
        self.cycles += marches
        whole = np.zeros(n)
        whole[cells] = energy
        full = []
        for one in state:
            if len(one) == 2 * m:
                spread = np.zeros(2 * n)
                spread[np.concatenate([cells, cells + n])] = one
                full.append(spread)
            else:
                full.append(one)
        if half:
            forces, displacement = np.vstack([forces, -forces]), np.vstack([displacement, -displacement])
        return Cycle(whole, forces * self.cell, displacement, marches, change, largest / self.mu, tuple(full))


class Anderson:
    """Anderson's acceleration (J. ACM 12, 1965) of the shear at the start of a cycle towards the shear of the steady cycle.

    The stopping criterion uses the change between plain repetitions."""

    def __init__(self, scale, depth=6):
        self.scale, self.depth = scale, depth
        self.begun, self.ended = [], []

    def __call__(self, begin, end):
        self.begun.append(begin)
        self.ended.append(end)
        del self.begun[: -self.depth], self.ended[: -self.depth]
        if len(self.begun) < 2:
            return end
        missing = [(e - b) / self.scale for b, e in zip(self.begun, self.ended, strict=True)]
        change = np.column_stack([missing[-1] - one for one in missing[:-1]])
        gram = change.T @ change
        weights = np.linalg.lstsq(
            gram + 1e-10 * np.trace(gram) * np.eye(len(gram)), change.T @ missing[-1], rcond=None
        )[0]
        return end - np.column_stack([end - one for one in self.ended[:-1]]) @ weights


class _March:
    """Time steps over a period on the cells that touch at any time in it."""

    def __init__(self, joint, cells, matrix, bounds, border, moved, motion, by_force, scheme):
        self.joint, self.matrix, self.bounds = joint, matrix, bounds
        self.border, self.moved, self.by_force = border, moved, by_force
        self.motion = motion[:, ~by_force]
        self.target = motion[:, by_force] / joint.cell
        self.scheme = scheme
        joint.friction.inverse = None
        if joint.drive.constant_load:
            if joint.inverse[0] != cells.tobytes():
                joint.inverse = cells.tobytes(), np.linalg.inv(matrix)
            joint.friction.inverse = joint.inverse[1]
        self.active = []
        last, reduced = None, None
        for bound in bounds:
            on = np.flatnonzero(bound > 1e-12 * np.max(bounds))
            if last is None or not np.array_equal(on, last):
                last = on
                both = np.concatenate([on, on + len(bound)])
                reduced = None if len(on) == len(bound) else both
            self.active.append((on, reduced))

    def step(self, k, q_before, shift, target, guess, multipliers):
        """One step from q_before with the displacement `shift` of the prescribed motions, to the forces `target`."""
        bound = self.bounds[k]
        on, both = self.active[k]
        c = self.moved @ shift + self.matrix @ q_before
        if both is None:
            guess, _ = on_discs(guess, bound)
            return self.joint.friction.solve(self.matrix, bound, c, self.border, target, guess, multipliers)
        self.joint.friction.inverse = None
        matrix = self.matrix[np.ix_(both, both)]
        guess, _ = on_discs(guess[both], bound[on])
        found, slip, multipliers = self.joint.friction.solve(
            matrix, bound[on], c[both], self.border[both], target, guess, multipliers
        )
        q, s = np.zeros(len(c)), np.zeros(len(c))
        q[both], s[both] = found, slip
        return q, s, multipliers

    def from_rest(self):
        """Applies the first load of the cycle in a few steps from rest."""
        q = np.zeros(2 * len(self.bounds[0]))
        d = np.zeros(self.motion.shape[1])
        free = np.zeros(self.border.shape[1])
        steps = 8
        for k in range(1, steps + 1):
            target = self.target[0] * k / steps
            new = self.motion[0] * k / steps
            q, _, moved = self.step(0, q, new - d, target, q, np.zeros_like(free))
            d, free = new, free + moved
        return q, q.copy(), d, d.copy(), free, free.copy()

    def over(self, state, count):
        """Marches over samples 1 to count from the state at sample 0: q, q one sample earlier, and likewise the prescribed and the free
        displacements."""
        q1, q2, d1, d2, f1, f2 = state
        m = len(self.bounds[0])
        energy = np.zeros(m)
        forces, displacements = [], []
        bdf2 = self.scheme == "bdf2"
        modes = np.empty((2 * m, 3))
        modes[:, self.by_force], modes[:, ~self.by_force] = self.border, self.moved
        for k in range(1, count + 1):
            at = k % len(self.bounds)
            new, target = self.motion[at], self.target[at]
            if bdf2:
                q0, d0, f0, factor = (4 * q1 - q2) / 3, (4 * d1 - d2) / 3, (4 * f1 - f2) / 3, 1.5
                guess, guess_free = q1 + (q1 - q2), f1 + (f1 - f2) - f0
            else:
                q0, d0, f0, factor = q1, d1, f1, 1.0
                guess, guess_free = q1 + (q1 - q2), f1 - f2
            q, s, free = self.step(at, q0, new - d0, target, guess, guess_free)
            energy += factor * np.hypot(q[:m], q[m:]) * np.hypot(s[:m], s[m:])
            q1, q2, d1, d2, f1, f2 = q, q1, new, d1, f0 + free, f1
            forces.append(modes.T @ q)
            displacement = np.empty(3)
            displacement[~self.by_force], displacement[self.by_force] = new, f1
            displacements.append(displacement)
        return (q1, q2, d1, d2, f1, f2), energy, np.array(forces), np.array(displacements)


# ------------------------------------------------------------------------------------------------------------------ wear


@dataclasses.dataclass
class Worn:
    depth: np.ndarray
    first: Cycle
    last: Cycle
    steps: int
    rejected: int
    evaluations: int
    estimate: float  # sum of the error estimates of the steps, over the volume
    change: float  # largest change of the energy in the last repetition of a cycle


class Steady:
    """Steady cycles one after another, each from the state of the one before.

    With the scheme "extrapolated", the energy of a cell is extrapolated from BDF2 with `samples` and with half of them to a step length of
    zero at second order."""

    def __init__(self, joint, samples, scheme="extrapolated", tolerance=1e-6):
        self.joint, self.tolerance, self.extrapolated = joint, tolerance, scheme == "extrapolated"
        self.scheme = "bdf2" if self.extrapolated else scheme
        self.samples = [samples // 2, samples] if self.extrapolated else [samples]
        self.starts = [None] * len(self.samples)
        self.worst_change = 0.0
        self.least = 0.0  # after the first cycle, a hundredth of its energy

    def __call__(self, depth):
        found = []
        for k, samples in enumerate(self.samples):
            cycle = self.joint.cycle(
                self.joint.heights - depth, samples, self.scheme, self.tolerance, start=self.starts[k], least=self.least
            )
            self.starts[k] = cycle.state
            self.worst_change = max(self.worst_change, cycle.change)
            found.append(cycle)
        fine = found[-1]
        self.least = self.least or 0.01 * fine.energy.sum()
        if self.extrapolated:
            energy = np.maximum((4 * fine.energy - found[0].energy) / 3, 0.0)
            fine = dataclasses.replace(fine, energy=energy)
        return fine


def wear(joint, samples, tolerance, scheme="extrapolated", cycle_tolerance=1e-6, progress=None):
    """Depth after the cycles of the scene; the error of each step is at most `tolerance` times the wear of the step (L1 norm)."""
    alpha, end = joint.wear["coefficient"], float(joint.wear["cycles"])
    state = {"cycle": None, "count": 0}
    steady = Steady(joint, samples, scheme, cycle_tolerance)

    def rate(depth):
        state["cycle"] = steady(depth)
        state["count"] += 1
        return alpha * state["cycle"].energy

    n, depth = 0.0, np.zeros(len(joint.heights))
    here = rate(depth)
    first = state["cycle"]
    peak = first.peak
    # The first step wears a hundredth of the root mean square height at the cell with the largest rate.
    step = min(end, 0.01 * joint.heights.std() / max(here.max(), 1e-300))
    steps = rejected = 0
    estimate = 0.0
    while n < end * (1 - 1e-12):
        stiff = 1.3 * joint.stiffness_of_wear(here, peak)
        step = min(step, end - n, chebyshev_limit(MOST_STAGES) / max(stiff, 1e-300))
        if n + 2 * step > end > n + step:
            step = (end - n) / 2
        new = chebyshev_step(rate, depth, here, step, stages_for(step * stiff))
        there = rate(new)
        error = np.abs(0.8 * (depth - new) + 0.4 * step * (here + there)).sum()
        grown = np.abs(new - depth).sum() + step / end * depth.sum()
        relative = error / max(grown, 1e-300)
        factor = 0.8 * (tolerance / max(relative, 1e-12)) ** (1 / 2)
        if relative <= tolerance:
            n, depth, here, peak = n + step, new, there, state["cycle"].peak
            steps += 1
            estimate += error
            if progress:
                progress(n / end, steps, rejected, depth)
        else:
            rejected += 1
        step *= min(3.0, max(0.2, factor))
    estimate /= max(depth.sum(), 1e-300)
    return Worn(depth, first, state["cycle"], steps, rejected, state["count"], estimate, steady.worst_change)


MOST_STAGES = 30
DAMPING = 2.0 / 13.0


def chebyshev_limit(stages):
    """Largest product of step and decay rate for which the method is stable."""
    return 2.0 / 3.0 * (stages**2 - 1) * (1 - 2.0 * DAMPING / 15.0)


def stages_for(product):
    stages = 2
    while stages < MOST_STAGES and chebyshev_limit(stages) < product:
        stages += 1
    return stages


def chebyshev_step(rate, y, rate_y, step, stages):
    """A step of the Runge-Kutta-Chebyshev method of second order."""
    w0 = 1.0 + DAMPING / stages**2
    t, dt, ddt = [1.0, w0], [0.0, 1.0], [0.0, 0.0]
    for j in range(2, stages + 1):
        t.append(2 * w0 * t[-1] - t[-2])
        dt.append(2 * t[j - 1] + 2 * w0 * dt[-1] - dt[-2])
        ddt.append(4 * dt[j - 1] + 2 * w0 * ddt[-1] - ddt[-2])
    w1 = dt[stages] / ddt[stages]
    b = [ddt[j] / dt[j] ** 2 if j > 1 else 0.0 for j in range(stages + 1)]
    b[0] = b[1] = b[2]
    before, now = y, y + b[1] * w1 * step * rate_y
    for j in range(2, stages + 1):
        mu, nu, mu_rate = 2 * b[j] * w0 / b[j - 1], -b[j] / b[j - 2], 2 * b[j] * w1 / b[j - 1]
        gamma = -(1 - b[j - 1] * t[j - 1]) * mu_rate
        new = (1 - mu - nu) * y + mu * now + nu * before + step * (mu_rate * rate(now) + gamma * rate_y)
        before, now = now, new
    return now


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scene")
    parser.add_argument("--samples", type=int, nargs="+", default=[16, 32, 64, 128])
    options = parser.parse_args()
    joint = Joint.read(options.scene)
    for scheme in ("euler", "bdf2"):
        for samples in options.samples:
            cycle = joint.cycle(joint.heights, samples, scheme)
            print(f"{scheme} {samples}: {cycle.energy.sum() * joint.cell:.8e} J, {cycle.marches} marches, {cycle.change:.1e}")


if __name__ == "__main__":
    main()
