#!/usr/bin/env python3
"""Computes steady vibrations of an oscillator on one contact element by time integration from event to event.

    python tests/dynamics/time_integration.py        # compares the integration with closed forms and with itself

The module needs numpy, scipy and numba. drawn_oscillators.py uses it as its judge; it shares no code with the program.

The differential equations describe a mass with springs and dashpots to the ground and one contact element with the friction law of a
slider: N = max(0, N0 + kn (z - gap)); T = kt (u - w). The position w moves if T would exceed the limit mu N, along T for the cone, axis by
axis for the box; without load w moves with u. The law has no penalty and no smoothing: the integration locates the instants at which the
contact opens, closes, sticks and slips.

- The motion along z does not depend on the other axes. Between events it is linear and has a closed form.
- A tangential axis that sticks, is open, or slips along a line is linear, too: Gauss quadrature integrates the forces against the exact
  propagator.
- If friction turns in the plane (the cone, both axes moving), Radau IIA collocation of order nine integrates the slip.

Time is the angle of the drive: a period is 2 pi, and velocities are displacements per radian.

For a given periodic load N(t), the distance of two solutions of the tangential motion decreases or stays constant (the law is a sweeping
process with a convex set, and the dashpots dissipate). So with damping the tangential velocity settles to one periodic motion from any
start, and only the motion along z can have several periodic motions, other periods, or no period.
"""

import math
import sys
from collections import namedtuple
from dataclasses import dataclass

import numpy as np
from numba import njit

TURN = 2.0 * math.pi

# Gauss quadrature on [0, 1] of the forces in a step: accurate to rounding for phases below half a radian.
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(6)
GAUSS_NODES = 0.5 * (GAUSS_NODES + 1.0)
GAUSS_WEIGHTS = 0.5 * GAUSS_WEIGHTS

# Largest phase of the fastest vibration in a step [rad].
STEP_PHASE = 0.4
# Two events at a smaller distance are the same event [rad].
SAME_TIME = 1e-13
# Slip in the plane ends shortly before the load ends, because its direction is the ratio of two numbers that both approach zero.
LAST_OF_LOAD = 1e-7
# Limit of the highest coefficient of the angle of friction over a step of collocation; the error at the end of the step is much smaller.
COLLOCATION = 1e-7
# Largest number of events or segments per period. A motion with more segments is not a comparable vibration.
MOST_SEGMENTS = 4000
# A displacement that exceeds the smallest relevant one by this factor grows without limit.
RUN_AWAY = 1e21
# Number of harmonics with stored amplitudes.
ORDERS = 8
# Largest change of the logarithm of the frequency in a Newton iteration; beyond it, the iteration has lost its branch.
LARGEST_LEAP = 1.0

# One direction: mass and damping in units of the angle, springs, and the forces by harmonics.
Axis = namedtuple("Axis", "m c k orders cosine sine")
Contact = namedtuple("Contact", "kn kt mu load gap")
# Normal motion: particular solutions of both states, start times of segments, states, deviations from the particular solution.
Normal = namedtuple("Normal", "m c k kn load gap orders cosine sine time closed deviation count")


def radau(stages):
    """Returns nodes and coefficients of the Radau IIA collocation, and the weights of the highest Legendre coefficient of a polynomial
    through the start of a step and its nodes."""
    legendre = np.polynomial.legendre.Legendre
    roots = (legendre.basis(stages) - legendre.basis(stages - 1)).roots()
    nodes = np.sort(0.5 * (np.real(roots) + 1.0))
    nodes[-1] = 1.0
    powers = np.vander(nodes, stages, increasing=True)
    integrals = np.array([[c ** (p + 1) / (p + 1) for p in range(stages)] for c in nodes])
    matrix = integrals @ np.linalg.inv(powers)
    all_nodes = np.concatenate([[0.0], nodes])
    basis = np.polynomial.legendre.legvander(2.0 * all_nodes - 1.0, stages)
    return nodes, matrix, np.linalg.inv(basis)[stages]


RADAU_NODES, RADAU_MATRIX, RADAU_HIGHEST = radau(5)
RADAU_WEIGHTS = RADAU_MATRIX[-1].copy()


@njit(cache=True)
def propagator(m, c, k, t):
    """Returns the responses after t to an initial deviation of one and to an initial velocity of one: x, v of the first, x, v of the
    second."""
    alpha, square = 0.5 * c / m, k / m
    split = alpha * alpha - square
    b = math.sqrt(abs(split))
    if b * t < 1e-3:
        d = split * t * t
        cosine = 1.0 + d / 2.0 * (1.0 + d / 12.0)
        sine = t * (1.0 + d / 6.0 * (1.0 + d / 20.0))
        e = math.exp(-alpha * t)
        return e * (cosine + alpha * sine), -e * square * sine, e * sine, e * (cosine - alpha * sine)
    if split < 0.0:
        e = math.exp(-alpha * t)
        cosine, sine = math.cos(b * t), math.sin(b * t) / b
        return e * (cosine + alpha * sine), -e * square * sine, e * sine, e * (cosine - alpha * sine)
    # Slow decay rate without cancellation.
    slow, fast = square / (alpha + b), alpha + b
    e_slow, e_fast = math.exp(-slow * t), math.exp(-fast * t)
    sine = (e_slow - e_fast) / (2.0 * b)
    return (
        (e_slow * fast - e_fast * slow) / (2.0 * b),
        -square * sine,
        sine,
        (e_fast * fast - e_slow * slow) / (2.0 * b),
    )


@njit(cache=True)
def rate(m, c, k):
    """Fastest rate of a linear oscillator [1/rad], on the scale of STEP_PHASE."""
    alpha, square = 0.5 * c / m, k / m
    if alpha * alpha < square:
        return math.sqrt(square)
    return max(math.sqrt(square), STEP_PHASE * (alpha + math.sqrt(alpha * alpha - square)))


@njit(cache=True)
def fourier(orders, cosine, sine, t):
    total = 0.0
    for i in range(len(orders)):
        if orders[i] == 0:
            total += cosine[i]
        else:
            angle = orders[i] * t
            total += cosine[i] * math.cos(angle) + sine[i] * math.sin(angle)
    return total


@njit(cache=True)
def fourier_with_slopes(orders, cosine, sine, t):
    value, slope, bend = 0.0, 0.0, 0.0
    for i in range(len(orders)):
        n = orders[i]
        if n == 0:
            value += cosine[i]
        else:
            a, b = math.cos(n * t), math.sin(n * t)
            term = cosine[i] * a + sine[i] * b
            value += term
            slope += n * (sine[i] * a - cosine[i] * b)
            bend -= n * n * term
    return value, slope, bend


@njit(cache=True)
def particular(m, c, k, orders, cosine, sine, constant):
    """Periodic solution of a linear oscillator; the constant is added to the forces."""
    a, b = np.zeros(len(orders)), np.zeros(len(orders))
    for i in range(len(orders)):
        n = orders[i]
        force = complex(cosine[i], -sine[i])
        if n == 0:
            force += constant
        answer = force / complex(k - m * n * n, c * n)
        a[i], b[i] = answer.real, -answer.imag
    return a, b


# Normal motion


@njit(cache=True)
def normal_motion(axis, contact):
    """Motion along z before its computation; order 0 is the first of the orders."""
    n = len(axis.orders)
    cosine, sine = np.zeros((2, n)), np.zeros((2, n))
    for state in range(2):
        kn = contact.kn if state == 1 else 0.0
        # Constant force of each state: the missing preload if open, the force of the gap if closed.
        constant = contact.kn * contact.gap if state == 1 else contact.load
        a, b = particular(axis.m, axis.c, axis.k + kn, axis.orders, axis.cosine, axis.sine, constant)
        cosine[state], sine[state] = a, b
    return Normal(
        axis.m, axis.c, axis.k, contact.kn, contact.load, contact.gap, axis.orders, cosine, sine,
        np.zeros(MOST_SEGMENTS + 1), np.zeros(MOST_SEGMENTS, np.int64), np.zeros((MOST_SEGMENTS, 2)), np.zeros(1, np.int64),
    )


@njit(cache=True)
def normal_state(z, i, t):
    """Displacement, velocity and acceleration along z at the time t of segment i."""
    state = z.closed[i]
    value, slope, bend = fourier_with_slopes(z.orders, z.cosine[state], z.sine[state], t)
    k = z.k + (z.kn if state == 1 else 0.0)
    a, b, c, d = propagator(z.m, z.c, k, t - z.time[i])
    x, v = a * z.deviation[i, 0] + c * z.deviation[i, 1], b * z.deviation[i, 0] + d * z.deviation[i, 1]
    return value + x, slope + v, bend - (z.k + (z.kn if state == 1 else 0.0)) / z.m * x - z.c / z.m * v


@njit(cache=True)
def normal_load(z, i, t):
    """N and its first two derivatives at the time t of segment i."""
    if z.closed[i] == 0:
        return 0.0, 0.0, 0.0
    if z.kn == 0.0:
        return z.load, 0.0, 0.0
    x, v, a = normal_state(z, i, t)
    return max(0.0, z.load + z.kn * (x - z.gap)), z.kn * v, z.kn * a


@njit(cache=True)
def normal_step(z, closed):
    k = z.k + (z.kn if closed == 1 else 0.0)
    return STEP_PHASE / max(rate(z.m, z.c, k), float(z.orders[-1]), 1.0)


@njit(cache=True)
def closing(z, i, t):
    """Penetration of the contact in metres, and its rate."""
    x, v, _ = normal_state(z, i, t)
    return x - z.gap + z.load / z.kn, v


@njit(cache=True)
def extremum(z, i, low, high):
    """Time at which the velocity of a segment changes its sign."""
    _, before = closing(z, i, low)
    for _ in range(60):
        middle = 0.5 * (low + high)
        _, v = closing(z, i, middle)
        if v * before > 0.0:
            low = middle
        else:
            high = middle
        if high - low < SAME_TIME:
            break
    return 0.5 * (low + high)


@njit(cache=True)
def normal_event(z, i, low, high):
    """Time at which the contact of a segment opens or closes, between two times that enclose one such event."""
    sign = 1.0 if z.closed[i] == 1 else -1.0
    t = 0.5 * (low + high)
    for _ in range(200):
        value, slope = closing(z, i, t)
        if value * sign >= 0.0:
            low = t
        else:
            high = t
        newton = t - value / slope if slope != 0.0 else low
        # Newton's method with a bisection as its safeguard.
        if not low < newton < high:
            newton = 0.5 * (low + high)
        if abs(newton - t) < SAME_TIME or high - low < SAME_TIME:
            return newton
        t = newton
    return t


@njit(cache=True)
def normal_period(z, start, velocity, product):
    """Integrates one period along z: fills the segments, returns the end, and stores the derivative of the end along the start in
    `product`."""
    for i in range(2):
        for j in range(2):
            product[i, j] = 1.0 if i == j else 0.0
    t, x, v = 0.0, start, velocity
    if z.kn == 0.0:
        closed = 1 if z.load > 0.0 else 0
    else:
        depth = x - z.gap + z.load / z.kn
        closed = 1 if depth > 0.0 or (depth == 0.0 and v > 0.0) else 0
    count = 0
    while True:
        if count >= MOST_SEGMENTS:
            z.count[0] = -1
            return math.nan, math.nan
        i = count
        z.time[i], z.closed[i] = t, closed
        value, slope, _ = fourier_with_slopes(z.orders, z.cosine[closed], z.sine[closed], t)
        z.deviation[i, 0], z.deviation[i, 1] = x - value, v - slope
        count += 1
        step = normal_step(z, closed)
        end, found = TURN, z.kn == 0.0
        here, slope_here = t, v
        sign = 1.0 if closed == 1 else -1.0
        while not found and here < TURN:
            there = min(here + step, TURN)
            if TURN - there < 1e-9:
                there = TURN
            depth, slope_there = closing(z, i, there)
            if depth * sign < 0.0:
                end, found = normal_event(z, i, here, there), True
            elif slope_here * sign < 0.0 and slope_there * sign > 0.0:
                # The contact may have opened or closed and returned within the step.
                turn = extremum(z, i, here, there)
                depth, _ = closing(z, i, turn)
                if depth * sign < 0.0 and turn - t > SAME_TIME:
                    end, found = normal_event(z, i, here, turn), True
            here, slope_here = there, slope_there
        if z.kn == 0.0:
            end = TURN
        k = z.k + (z.kn if closed == 1 else 0.0)
        a, b, c, d = propagator(z.m, z.c, k, end - t)
        for j in range(2):
            p, q = product[0, j], product[1, j]
            product[0, j], product[1, j] = a * p + c * q, b * p + d * q
        x, v, _ = normal_state(z, i, end)
        t = end
        if not found or z.kn == 0.0 or TURN - end < SAME_TIME:
            z.time[count] = TURN
            z.count[0] = count
            return x, v
        # The velocity determines the next state; at a touch it is almost zero.
        x = z.gap - z.load / z.kn
        closed = 1 - closed


@njit(cache=True)
def normal_march(z, start, velocity, periods, states):
    """Integrates several periods; stores the states at their ends."""
    product = np.zeros((2, 2))
    x, v = start, velocity
    for p in range(periods):
        x, v = normal_period(z, x, v, product)
        states[p, 0], states[p, 1] = x, v
        if not (math.isfinite(x) and math.isfinite(v)):
            return p
    return periods


# Tangential motion along a line


@njit(cache=True)
def advance(axis, k, x, v, t, h, constant, slip, z, i):
    """Advances one axis by h from t: linear, under its forces, a constant, and friction of `slip` times the load of segment i."""
    a, b, c, d = propagator(axis.m, axis.c, k, h)
    x_end, v_end = a * x + c * v, b * x + d * v
    for j in range(len(GAUSS_NODES)):
        there = t + h * GAUSS_NODES[j]
        force = fourier(axis.orders, axis.cosine, axis.sine, there) + constant
        if slip != 0.0:
            force -= slip * normal_load(z, i, there)[0]
        _, _, c, d = propagator(axis.m, axis.c, k, h * (1.0 - GAUSS_NODES[j]))
        force *= h * GAUSS_WEIGHTS[j] / axis.m
        x_end += c * force
        v_end += d * force
    return x_end, v_end


@njit(cache=True)
def stick_margin(axis, contact, x, v, t, h, w, sign, z, i):
    """mu N - sign T after h of sticking, and its rate."""
    x, v = advance(axis, axis.k + contact.kt, x, v, t, h, contact.kt * w, 0.0, z, i)
    load, slope, _ = normal_load(z, i, t + h)
    return contact.mu * load - sign * contact.kt * (x - w), contact.mu * slope - sign * contact.kt * v


@njit(cache=True)
def slip_margin(axis, contact, x, v, t, h, sign, z, i):
    """Rate of slip along `sign` after h of slipping, and the derivative of this rate, times kt."""
    x, v = advance(axis, axis.k, x, v, t, h, 0.0, sign * contact.mu, z, i)
    load, slope, bend = normal_load(z, i, t + h)
    force = fourier(axis.orders, axis.cosine, axis.sine, t + h) - sign * contact.mu * load
    a = (force - axis.c * v - axis.k * x) / axis.m
    return contact.kt * sign * v - contact.mu * slope, contact.kt * sign * a - contact.mu * bend


@njit(cache=True)
def margin(slips, axis, contact, x, v, t, h, w, sign, z, i):
    if slips:
        return slip_margin(axis, contact, x, v, t, h, sign, z, i)
    return stick_margin(axis, contact, x, v, t, h, w, sign, z, i)


@njit(cache=True)
def line_event(slips, axis, contact, x, v, t, h, w, sign, z, i, at_start, at_end):
    """Time within h at which a margin becomes zero; h if it stays positive. `at_start` and `at_end` are margin and rate at both ends."""
    low, high = 0.0, h
    if at_end[0] >= 0.0:
        if not (at_start[1] < 0.0 and at_end[1] > 0.0):
            return h
        # The smallest margin is inside the step.
        while high - low > SAME_TIME:
            middle = 0.5 * (low + high)
            if margin(slips, axis, contact, x, v, t, middle, w, sign, z, i)[1] < 0.0:
                low = middle
            else:
                high = middle
            if high - low < 1e-3 * h and margin(slips, axis, contact, x, v, t, 0.5 * (low + high), w, sign, z, i)[0] < 0.0:
                break
        least = 0.5 * (low + high)
        if margin(slips, axis, contact, x, v, t, least, w, sign, z, i)[0] >= 0.0 or least < SAME_TIME:
            return h
        low, high = 0.0, least
    here = 0.5 * (low + high)
    for _ in range(200):
        value, slope = margin(slips, axis, contact, x, v, t, here, w, sign, z, i)
        if value >= 0.0:
            low = here
        else:
            high = here
        newton = here - value / slope if slope != 0.0 else low
        if not low < newton < high:
            newton = 0.5 * (low + high)
        if abs(newton - here) < SAME_TIME or high - low < SAME_TIME:
            return newton
        here = newton
    return here


@njit(cache=True)
def gather_line(sums, column, axis, k, x, v, t, h, constant, slip, kt, z, i):
    """Adds a step to the integrals of one axis: harmonics, then input, viscous and friction energy; the friction energy is the energy of
    the slip."""
    for j in range(len(GAUSS_NODES)):
        tau = h * GAUSS_NODES[j]
        there = t + tau
        x_there, v_there = advance(axis, k, x, v, t, tau, constant, slip, z, i)
        weight = h * GAUSS_WEIGHTS[j]
        gather(sums, column, axis, x_there, v_there, there, weight)
        if slip != 0.0:
            load, slope, _ = normal_load(z, i, there)
            sums[2 * ORDERS + 2, column] += weight * slip * load * (v_there - slip * slope / kt)


@njit(cache=True)
def gather(sums, column, axis, x, v, t, weight):
    for n in range(ORDERS):
        sums[2 * n, column] += weight * x * math.cos(n * t)
        sums[2 * n + 1, column] += weight * x * math.sin(n * t)
    sums[2 * ORDERS, column] += weight * v * fourier(axis.orders, axis.cosine, axis.sine, t)
    sums[2 * ORDERS + 1, column] += weight * axis.c * v * v


@njit(cache=True)
def line_period(axis, contact, z, state, product, sums, column, wanted):
    """Integrates one period of one axis in place of `state` (x, v, T). Returns whether the axis stuck throughout; stores the derivative of
    the end along the start in `product`."""
    for a in range(3):
        for b in range(3):
            product[a, b] = 1.0 if a == b else 0.0
    x, v, force = state[0], state[1], state[2]
    kt, mu = contact.kt, contact.mu
    stuck = True
    grips = mu > 0.0 and kt > 0.0
    stuck_rate, free_rate = rate(axis.m, axis.c, axis.k + kt), rate(axis.m, axis.c, axis.k)
    highest = max(float(axis.orders[-1]), float(z.orders[-1]), 1.0)
    count = z.count[0]
    for i in range(count):
        t, end = z.time[i], z.time[i + 1]
        if end <= t:
            continue
        if not grips or z.closed[i] == 0:
            stuck = stuck and not grips
            force = 0.0
            if grips:
                for b in range(3):
                    product[2, b] = 0.0
            step = STEP_PHASE / max(free_rate, highest)
            steps = max(1, int(math.ceil((end - t) / step)))
            step = (end - t) / steps
            for n in range(steps):
                if wanted:
                    gather_line(sums, column, axis, axis.k, x, v, t + n * step, step, 0.0, 0.0, kt, z, i)
                x, v = advance(axis, axis.k, x, v, t + n * step, step, 0.0, 0.0, z, i)
            linear(product, axis, axis.k, end - t)
            continue
        load, slope, _ = normal_load(z, i, t)
        own = rate(z.m, z.c, z.k + z.kn) if z.kn > 0.0 else 0.0
        # A contact that has just closed sticks if its limit rises faster than the friction force would.
        if load <= 1e-14 * (abs(slope) + abs(force)) or (i > 0 and z.closed[i - 1] == 0):
            force = 0.0
            slips = kt * abs(v) > mu * slope
            sign = 1.0 if v > 0.0 else -1.0
        else:
            force = min(max(force, -mu * load), mu * load)
            sign = 1.0 if force > 0.0 else -1.0
            slips = abs(force) >= mu * load * (1.0 - 1e-14) and kt * sign * v - mu * slope > 0.0
        if slips:
            stuck = False
            for b in range(3):
                product[2, b] = 0.0
        w = x - force / kt
        rounds = 0
        while t < end:
            rounds += 1
            if rounds > 100000:
                state[0] = math.nan
                return False
            if slips:
                h = min(STEP_PHASE / max(free_rate, highest, own), end - t)
                if end - t - h < 1e-9:
                    h = end - t
                at_start = slip_margin(axis, contact, x, v, t, 0.0, sign, z, i)
                at_end = slip_margin(axis, contact, x, v, t, h, sign, z, i)
                taken = line_event(True, axis, contact, x, v, t, h, 0.0, sign, z, i, at_start, at_end)
                if wanted:
                    gather_line(sums, column, axis, axis.k, x, v, t, taken, 0.0, sign * mu, kt, z, i)
                x, v = advance(axis, axis.k, x, v, t, taken, 0.0, sign * mu, z, i)
                linear(product, axis, axis.k, taken)
                t += taken
                load, slope, _ = normal_load(z, i, t)
                force = sign * mu * load
                w = x - force / kt
                if taken < h:
                    slips = False
            else:
                h = min(STEP_PHASE / max(stuck_rate, highest, own), end - t)
                if end - t - h < 1e-9:
                    h = end - t
                taken, hit = h, 0.0
                for s in range(2):
                    sgn = 1.0 if s == 0 else -1.0
                    at_start = stick_margin(axis, contact, x, v, t, 0.0, w, sgn, z, i)
                    at_end = stick_margin(axis, contact, x, v, t, h, w, sgn, z, i)
                    there = line_event(False, axis, contact, x, v, t, h, w, sgn, z, i, at_start, at_end)
                    if there < taken:
                        taken, hit = there, sgn
                if wanted:
                    gather_line(sums, column, axis, axis.k + kt, x, v, t, taken, kt * w, 0.0, kt, z, i)
                stick_product(product, axis, kt, taken)
                x, v = advance(axis, axis.k + kt, x, v, t, taken, kt * w, 0.0, z, i)
                t += taken
                force = kt * (x - w)
                if hit != 0.0:
                    load, slope, _ = normal_load(z, i, t)
                    slips, sign, stuck = True, hit, False
                    force = sign * mu * load
                    w = x - force / kt
                    for b in range(3):
                        product[2, b] = 0.0
            if end - t < SAME_TIME:
                break
    state[0], state[1], state[2] = x, v, force
    return stuck


@njit(cache=True)
def linear(product, axis, k, h):
    a, b, c, d = propagator(axis.m, axis.c, k, h)
    for j in range(3):
        p, q = product[0, j], product[1, j]
        product[0, j], product[1, j] = a * p + c * q, b * p + d * q


@njit(cache=True)
def stick_product(product, axis, kt, h):
    """Derivatives of x, v and T over a time of sticking: they vibrate about the equilibrium for the changed position of the slider."""
    a, b, c, d = propagator(axis.m, axis.c, axis.k + kt, h)
    for j in range(3):
        p, q, force = product[0, j], product[1, j], product[2, j]
        w = p - force / kt
        rest = kt * w / (axis.k + kt)
        p = rest + a * (p - rest) + c * q
        product[1, j] = b * (product[0, j] - rest) + d * q
        product[0, j] = p
        product[2, j] = kt * (p - w)


# Tangential motion in the plane


@njit(cache=True)
def collocation(first, second, h):
    """Returns the integration matrix of a step, and for each axis the matrix from the right-hand side to the stage accelerations."""
    s = len(RADAU_NODES)
    inverse = np.zeros((2, s, s))
    a = h * RADAU_MATRIX
    square = a @ a
    for d in range(2):
        axis = first if d == 0 else second
        inverse[d] = np.linalg.inv(np.eye(s) + axis.c / axis.m * a + axis.k / axis.m * square)
    return a, inverse


@njit(cache=True)
def plane_step(first, second, contact, z, i, t, h, state, theta, stages, out):
    """One step of slip in the plane. Returns whether the step was solved and the size of the highest coefficient. Stores time, N, N',
    angle, x, vx, y, vy of each stage in `stages`, and the rate of slip at each stage in `out`."""
    s = len(RADAU_NODES)
    a, inverse = collocation(first, second, h)
    mu, kt = contact.mu, contact.kt
    load, slope = np.zeros(s), np.zeros(s)
    force = np.zeros((2, s))
    for j in range(s):
        there = t + h * RADAU_NODES[j]
        load[j], slope[j], _ = normal_load(z, i, there)
        force[0, j] = fourier(first.orders, first.cosine, first.sine, there)
        force[1, j] = fourier(second.orders, second.cosine, second.sine, there)
        if load[j] <= 0.0:
            return False, 0.0
    # Velocities without friction, and the effect of friction.
    base = np.zeros((2, s))
    gain = np.zeros((2, s, s))
    for d in range(2):
        axis = first if d == 0 else second
        x, v = state[2 * d], state[2 * d + 1]
        right = np.zeros(s)
        for j in range(s):
            right[j] = (force[d, j] - axis.c * v - axis.k * (x + h * RADAU_NODES[j] * v)) / axis.m
        base[d] = v + a @ (inverse[d] @ right)
        gain[d] = (a @ inverse[d]) / axis.m
    angle = np.full(s, theta)
    velocity = np.zeros((2, s))
    turn = np.zeros(s)
    solved = False
    before = 1e300
    for _ in range(30):
        cosine, sine = np.cos(angle), np.sin(angle)
        velocity[0] = base[0] - gain[0] @ (mu * load * cosine)
        velocity[1] = base[1] - gain[1] @ (mu * load * sine)
        stiff = kt / (mu * load)
        turn = stiff * (velocity[1] * cosine - velocity[0] * sine)
        residual = angle - theta - a @ turn
        slopes = np.zeros((s, s))
        for p in range(s):
            for q in range(s):
                along = cosine[p] * gain[1, p, q] * cosine[q] + sine[p] * gain[0, p, q] * sine[q]
                slopes[p, q] = -stiff[p] * mu * load[q] * along
            slopes[p, p] -= stiff[p] * (velocity[0, p] * cosine[p] + velocity[1, p] * sine[p])
        change = np.linalg.solve(np.eye(s) - a @ slopes, residual)
        angle = angle - change
        size = np.max(np.abs(change))
        if not size < 1e3:
            break
        if size < 1e-13 or (size < 1e-10 and size > 0.5 * before):
            solved = True
            break
        before = size
    if not solved:
        return False, 0.0
    cosine, sine = np.cos(angle), np.sin(angle)
    highest = RADAU_HIGHEST[0] * theta
    speeds = 0.0
    of_speed = np.zeros(2)
    for d in range(2):
        axis = first if d == 0 else second
        friction = mu * load * (cosine if d == 0 else sine)
        x, v = state[2 * d], state[2 * d + 1]
        right = np.zeros(s)
        for j in range(s):
            right[j] = (force[d, j] - friction[j] - axis.c * v - axis.k * (x + h * RADAU_NODES[j] * v)) / axis.m
        acceleration = inverse[d] @ right
        speed = v + a @ acceleration
        place = x + a @ speed
        of_speed[d] = RADAU_HIGHEST[0] * v
        for j in range(s):
            stages[j, 4 + 2 * d], stages[j, 5 + 2 * d] = place[j], speed[j]
            of_speed[d] += RADAU_HIGHEST[j + 1] * speed[j]
            speeds = max(speeds, abs(speed[j]))
    for j in range(s):
        stages[j, 0], stages[j, 1], stages[j, 2], stages[j, 3] = t + h * RADAU_NODES[j], load[j], slope[j], angle[j]
        highest += RADAU_HIGHEST[j + 1] * angle[j]
        out[j] = stages[j, 5] * cosine[j] + stages[j, 7] * sine[j] - mu * slope[j] / kt
    error = abs(highest)
    if speeds > 0.0:
        error = max(error, abs(of_speed[0]) / speeds, abs(of_speed[1]) / speeds)
    return True, error


@njit(cache=True)
def plane_margin(first, second, contact, state, t, h, w, z, i):
    """(mu N)^2 - |T|^2 after h of sticking, its rate, and the state."""
    kt = contact.kt
    x, vx = advance(first, first.k + kt, state[0], state[1], t, h, kt * w[0], 0.0, z, i)
    y, vy = advance(second, second.k + kt, state[2], state[3], t, h, kt * w[1], 0.0, z, i)
    load, slope, _ = normal_load(z, i, t + h)
    tx, ty = kt * (x - w[0]), kt * (y - w[1])
    limit = contact.mu * load
    return limit * limit - tx * tx - ty * ty, 2.0 * (limit * contact.mu * slope - kt * (tx * vx + ty * vy)), x, vx, y, vy


@njit(cache=True)
def plane_stick_event(first, second, contact, state, t, h, w, z, i):
    """Time within h at which the limit is reached; h if it is not reached."""
    at_start = plane_margin(first, second, contact, state, t, 0.0, w, z, i)
    at_end = plane_margin(first, second, contact, state, t, h, w, z, i)
    low, high = 0.0, h
    if at_end[0] >= 0.0:
        if not (at_start[1] < 0.0 and at_end[1] > 0.0):
            return h
        while high - low > SAME_TIME:
            middle = 0.5 * (low + high)
            at = plane_margin(first, second, contact, state, t, middle, w, z, i)
            if at[1] < 0.0:
                low = middle
            else:
                high = middle
        least = 0.5 * (low + high)
        if plane_margin(first, second, contact, state, t, least, w, z, i)[0] >= 0.0 or least < SAME_TIME:
            return h
        low, high = 0.0, least
    here = 0.5 * (low + high)
    for _ in range(200):
        at = plane_margin(first, second, contact, state, t, here, w, z, i)
        if at[0] >= 0.0:
            low = here
        else:
            high = here
        newton = here - at[0] / at[1] if at[1] != 0.0 else low
        if not low < newton < high:
            newton = 0.5 * (low + high)
        if abs(newton - here) < SAME_TIME or high - low < SAME_TIME:
            return newton
        here = newton
    return here


@njit(cache=True)
def gather_plane(sums, first, second, kx, ky, state, t, h, cx, cy, z, i):
    gather_line(sums, 0, first, kx, state[0], state[1], t, h, cx, 0.0, 1.0, z, i)
    gather_line(sums, 1, second, ky, state[2], state[3], t, h, cy, 0.0, 1.0, z, i)


@njit(cache=True)
def plane_period(first, second, contact, z, whole, sums, wanted):
    """Integrates one period of both axes in place of `whole` (x, vx, y, vy, Tx, Ty). Returns whether they stuck throughout."""
    kt, mu = contact.kt, contact.mu
    grips = mu > 0.0 and kt > 0.0
    state = whole[:4].copy()
    force = whole[4:].copy()
    highest = max(float(first.orders[-1]), float(second.orders[-1]), float(z.orders[-1]), 1.0)
    free_rate = max(rate(first.m, first.c, first.k), rate(second.m, second.c, second.k))
    stuck_rate = max(rate(first.m, first.c, first.k + kt), rate(second.m, second.c, second.k + kt))
    own = rate(z.m, z.c, z.k + z.kn) if z.kn > 0.0 else 0.0
    stuck = True
    s = len(RADAU_NODES)
    stages, rates = np.zeros((s, 8)), np.zeros(s)
    w = np.zeros(2)
    for i in range(z.count[0]):
        t, end = z.time[i], z.time[i + 1]
        if end <= t:
            continue
        if not grips or z.closed[i] == 0:
            stuck = stuck and not grips
            force[:] = 0.0
            plane_open(first, second, z, i, t, end, state, sums, wanted, free_rate, highest)
            continue
        load, slope, _ = normal_load(z, i, t)
        theta = 0.0
        if load <= 1e-14 * (abs(slope) + abs(force[0]) + abs(force[1])) or (i > 0 and z.closed[i - 1] == 0):
            force[:] = 0.0
            slips = kt * math.hypot(state[1], state[3]) > mu * slope
            theta = math.atan2(state[3], state[1])
        else:
            size = math.hypot(force[0], force[1])
            if size > mu * load:
                force *= mu * load / size
                size = mu * load
            slips = False
            if size >= mu * load * (1.0 - 1e-13):
                theta = math.atan2(force[1], force[0])
                slips = kt * (state[1] * math.cos(theta) + state[3] * math.sin(theta)) > mu * slope
        w[0], w[1] = state[0] - force[0] / kt, state[2] - force[1] / kt
        # If the contact opens within the period, see LAST_OF_LOAD.
        opens = i + 1 < z.count[0]
        last = end - LAST_OF_LOAD if opens else end
        trial = STEP_PHASE
        rounds = 0
        while t < end:
            rounds += 1
            if rounds > 200000:
                whole[0] = math.nan
                return False
            if slips:
                stuck = False
                if t >= last:
                    plane_open(first, second, z, i, t, end, state, sums, wanted, free_rate, highest)
                    force[:] = 0.0
                    break
                h = min(trial, 1.5 * STEP_PHASE / highest, last - t)
                if last - t - h < 1e-9:
                    h = last - t
                solved, error = plane_step(first, second, contact, z, i, t, h, state, theta, stages, rates)
                if (not solved or error > COLLOCATION) and h > 1e-12:
                    trial = h * (0.25 if not solved else max(0.2, 0.9 * (COLLOCATION / error) ** (1.0 / s)))
                    continue
                growth = 2.5 if error == 0.0 else min(2.5, 0.9 * (COLLOCATION / error) ** (1.0 / s))
                trial = max(growth, 0.3) * h
                speed = math.hypot(state[1], state[3])
                before = state[1] * math.cos(theta) + state[3] * math.sin(theta) - mu * normal_load(z, i, t)[1] / kt
                backwards = s
                for j in range(s - 1, -1, -1):
                    if rates[j] < 0.0:
                        backwards = j
                sticks = backwards < s
                if sticks:
                    # The slip would reverse, so the slider sticks earlier.
                    low, high, side = 0.0, h * RADAU_NODES[backwards], 0
                    rate_low, rate_high = max(before, 0.0), rates[backwards]
                    for _ in range(100):
                        if high - low < SAME_TIME:
                            break
                        middle = 0.5 * (low + high)
                        if rate_low > 0.0 and rate_high < 0.0:
                            middle = (low * rate_high - high * rate_low) / (rate_high - rate_low)
                            if not low < middle < high:
                                middle = 0.5 * (low + high)
                        plane_step(first, second, contact, z, i, t, middle, state, theta, stages, rates)
                        there = rates[s - 1]
                        if there >= 0.0:
                            low, rate_low = middle, there
                            if side == 1:
                                rate_high *= 0.5
                            side = 1
                        else:
                            high, rate_high = middle, there
                            if side == -1:
                                rate_low *= 0.5
                            side = -1
                        if abs(there) <= 1e-15 * speed:
                            low = middle
                            break
                    h = max(low, SAME_TIME)
                    plane_step(first, second, contact, z, i, t, h, state, theta, stages, rates)
                if wanted:
                    for j in range(s):
                        weight = h * RADAU_WEIGHTS[j]
                        gather(sums, 0, first, stages[j, 4], stages[j, 5], stages[j, 0], weight)
                        gather(sums, 1, second, stages[j, 6], stages[j, 7], stages[j, 0], weight)
                        sums[2 * ORDERS + 2, 0] += weight * mu * stages[j, 1] * rates[j]
                for d in range(4):
                    state[d] = stages[s - 1, 4 + d]
                theta = stages[s - 1, 3]
                t += h
                load = stages[s - 1, 1]
                force[0], force[1] = mu * load * math.cos(theta), mu * load * math.sin(theta)
                w[0], w[1] = state[0] - force[0] / kt, state[2] - force[1] / kt
                slips = not sticks
            else:
                h = min(STEP_PHASE / max(stuck_rate, highest, own), end - t)
                if end - t - h < 1e-9:
                    h = end - t
                taken = plane_stick_event(first, second, contact, state, t, h, w, z, i)
                if wanted:
                    gather_plane(sums, first, second, first.k + kt, second.k + kt, state, t, taken, kt * w[0], kt * w[1], z, i)
                at = plane_margin(first, second, contact, state, t, taken, w, z, i)
                state[0], state[1], state[2], state[3] = at[2], at[3], at[4], at[5]
                t += taken
                force[0], force[1] = kt * (state[0] - w[0]), kt * (state[2] - w[1])
                if taken < h:
                    slips = True
                    theta = math.atan2(force[1], force[0])
                    trial = STEP_PHASE
            if end - t < SAME_TIME:
                break
    whole[:4] = state
    whole[4:] = force
    return stuck


@njit(cache=True)
def plane_open(first, second, z, i, t, end, state, sums, wanted, free_rate, highest):
    step = STEP_PHASE / max(free_rate, highest)
    steps = max(1, int(math.ceil((end - t) / step)))
    step = (end - t) / steps
    for n in range(steps):
        here = t + n * step
        if wanted:
            gather_plane(sums, first, second, first.k, second.k, state, here, step, 0.0, 0.0, z, i)
        state[0], state[1] = advance(first, first.k, state[0], state[1], here, step, 0.0, 0.0, z, i)
        state[2], state[3] = advance(second, second.k, state[2], state[3], here, step, 0.0, 0.0, z, i)


@njit(cache=True)
def gather_normal(axis, z, sums):
    """Adds the integrals of the motion along z over the segments of its period."""
    for i in range(z.count[0]):
        t, end = z.time[i], z.time[i + 1]
        steps = max(1, int(math.ceil((end - t) / normal_step(z, z.closed[i]))))
        h = (end - t) / steps
        for n in range(steps):
            for j in range(len(GAUSS_NODES)):
                there = t + (n + GAUSS_NODES[j]) * h
                x, v, _ = normal_state(z, i, there)
                gather(sums, 2, axis, x, v, there, h * GAUSS_WEIGHTS[j])


# Steady motions


class Oscillator:
    """Parameters of a scene; lists are x, y, z. A force is (axis, harmonic, amplitude, lead in rad)."""

    def __init__(self, mass, damping, stiffness, contact, law, forces):
        self.mass, self.damping, self.stiffness = mass, damping, stiffness
        self.contact, self.law, self.forces = contact, law, forces

    def moves(self, axis):
        return any(force[0] == axis for force in self.forces)

    def oscillates(self, axis):
        return any(force[0] == axis and force[1] > 0 for force in self.forces)

    @property
    def turns(self):
        """Whether friction turns in the plane."""
        return self.law == "cone" and self.moves(0) and self.moves(1) and self.contact.mu > 0.0 and self.contact.kt > 0.0

    def frequencies(self, axis):
        """Natural frequencies [Hz] without and with the spring of the contact."""
        spring = self.contact.kn if axis == 2 else self.contact.kt
        return [math.sqrt(k / self.mass[axis]) / TURN for k in (self.stiffness[axis], self.stiffness[axis] + spring)]


class Motion:
    """An oscillator at one frequency [Hz]."""

    def __init__(self, oscillator, frequency):
        self.oscillator, self.frequency = oscillator, frequency
        self.contact = oscillator.contact
        omega = TURN * frequency
        self.axes = []
        for axis in range(3):
            terms = {0: [0.0, 0.0]}
            for of, harmonic, amplitude, lead in oscillator.forces:
                if of == axis:
                    term = terms.setdefault(harmonic, [0.0, 0.0])
                    term[0] += amplitude * math.cos(lead)
                    term[1] -= amplitude * math.sin(lead) if harmonic > 0 else 0.0
            orders = sorted(terms)
            self.axes.append(Axis(
                oscillator.mass[axis] * omega**2, oscillator.damping[axis] * omega, oscillator.stiffness[axis], np.array(orders),
                np.array([terms[n][0] for n in orders]), np.array([terms[n][1] for n in orders]),
            ))
        self.normal = normal_motion(self.axes[2], self.contact)

    def floor(self, axis):
        """A negligible displacement [m]."""
        one = self.axes[axis]
        force = np.abs(one.cosine).sum() + np.abs(one.sine).sum()
        spring = self.contact.kn if axis == 2 else self.contact.kt
        return 1e-9 * force / (one.k + spring + one.m) + 1e-300

    # Along z

    def normal_period(self, state):
        product = np.zeros((2, 2))
        end = np.array(normal_period(self.normal, state[0], state[1], product))
        return end, product

    def at_rest(self):
        """State along z under the constant forces only; the motion along z settles to it if no other forces act along z."""
        force = self.axes[2].cosine[self.axes[2].orders == 0].sum()
        k, c = self.axes[2].k, self.contact
        closed = (force + c.kn * c.gap) / (k + c.kn)
        is_closed = c.load + c.kn * (closed - c.gap) > 0.0
        return np.array([closed if is_closed else (force + c.load) / k, 0.0])

    def normal_periodic(self, state, most=60):
        """Finds the periodic motion along z near a state by Newton's method on the period. Returns its state, the derivative of the end of
        the period along the state, and whether the method converged."""
        state = np.array(state, float)
        end, product = self.normal_period(state)
        for _ in range(most):
            scale = max(np.abs(state).max(), np.abs(end).max(), self.floor(2))
            residual = end - state
            try:
                step = np.linalg.solve(np.eye(2) - product, residual)
            except np.linalg.LinAlgError:
                return state, product, False
            if not np.all(np.isfinite(step)):
                return state, product, False
            if np.abs(step).max() <= 1e-12 * scale or np.abs(residual).max() <= 1e-16 * scale:
                state = state + step
                _, product = self.normal_period(state)
                return state, product, True
            share = 1.0
            for _ in range(8):
                trial = state + share * step
                end_there, product_there = self.normal_period(trial)
                if np.abs(end_there - trial).max() < (1.0 - 0.1 * share) * np.abs(residual).max():
                    break
                share *= 0.5
            else:
                # At the level of rounding, no step improves the residual.
                return state, product, bool(np.abs(step).max() <= 1e-9 * scale)
            state, end, product = trial, end_there, product_there
        return state, product, False

    def settle(self, state, periods=20000):
        """Returns the motion along z to which a state settles: the name, the state and the derivative of the end of a period along the
        state."""
        if not self.oscillator.oscillates(2):
            state = self.at_rest()
            _, product = self.normal_period(state)
            return "period 1", state, product
        state = np.array(state, float)
        block = 64
        states = np.zeros((block, 2))
        done = 0
        least = math.inf
        while done < periods:
            count = normal_march(self.normal, state[0], state[1], block, states)
            done += block
            if count < block or not np.all(np.isfinite(states)):
                return "undecided", state, None
            state = states[-1].copy()
            scale = max(np.abs(states).max(), self.floor(2))
            if scale > RUN_AWAY * self.floor(2):
                return "runs away", state, None
            change = np.abs(states[-1] - states[-2]).max()
            if change <= 1e-8 * scale or done in (block, 4 * block, 16 * block) or done % (64 * block) == 0:
                found, product, is_found = self.normal_periodic(state)
                if is_found and spectral(product) < 1.0:
                    away = np.abs(found - state).max()
                    if away <= 1e-6 * scale:
                        return "period 1", found, product
                    # Light damping decays slowly: a motion that comes nearer after some time converges to the period.
                    if away < least * 0.9 and least < math.inf and away <= 0.3 * scale:
                        return "period 1", found, product
                    least = min(least, away)
            if done % (16 * block) == 0:
                for n in range(2, 17):
                    if np.abs(states[-1] - states[-1 - n]).max() <= 1e-8 * scale and change > 1e-6 * scale:
                        return f"period {n}", state, None
        return "undecided", state, None

    # In the plane

    def tangential_period(self, state, sums=None):
        """Integrates one period of (x, vx, y, vy, Tx, Ty) with the last computed motion along z. Also returns whether the axes stuck, and
        derivatives."""
        wanted = sums is not None
        sums = np.zeros((2 * ORDERS + 3, 3)) if sums is None else sums
        end = np.array(state, float)
        x, y, _ = self.axes
        if self.oscillator.turns:
            stuck = plane_period(x, y, self.contact, self.normal, end, sums, wanted)
            return end, [stuck], None
        stuck, products = [], []
        for axis in range(2):
            own = np.array([state[2 * axis], state[2 * axis + 1], state[4 + axis]])
            product = np.zeros((3, 3))
            stuck.append(line_period(self.axes[axis], self.contact, self.normal, own, product, sums, axis, wanted))
            end[2 * axis], end[2 * axis + 1], end[4 + axis] = own
            products.append(product)
        return end, stuck, products

    def scales(self, *states):
        s = [max(max(abs(state[2 * a]), abs(state[2 * a + 1])) for state in states) for a in range(2)]
        s = [max(s[a], self.floor(a)) for a in range(2)]
        if self.oscillator.turns:
            s = [max(s)] * 2
        kt = max(self.contact.kt, 1e-300)
        return np.array([s[0], s[0], s[1], s[1], kt * s[0], kt * s[1]])

    def newton_step(self, state, end, stuck, products):
        """Change of a state that closes its period to first order."""
        residual = end - state
        scale = self.scales(state, end)
        kt = self.contact.kt
        step = np.zeros(6)
        if products is not None:
            for axis in range(2):
                at = [2 * axis, 2 * axis + 1, 4 + axis]
                own = np.eye(3) - products[axis]
                if stuck[axis] and kt > 0.0 and self.contact.mu > 0.0:
                    # The slider does not move.
                    part = own[:2, :2] + np.outer(own[:2, 2], [kt, 0.0])
                    change = solved(part, residual[at[:2]], scale[at[:2]], scale[at[:2]])
                    step[at] = [change[0], change[1], kt * change[0]]
                else:
                    step[at] = solved(own, residual[at], scale[at], scale[at])
            return step
        derivative = np.zeros((6, 6))
        if stuck[0]:
            # Two oscillators with springs kt and fixed sliders.
            for axis in range(2):
                one = self.axes[axis]
                a, b, c, d = propagator(one.m, one.c, one.k + kt, TURN)
                at = [2 * axis, 2 * axis + 1]
                change = solved(np.eye(2) - np.array([[a, c], [b, d]]), residual[at], scale[at], scale[at])
                step[at] = change
                step[4 + axis] = kt * change[0]
            return step
        for j in range(6):
            moved = np.array(state, float)
            moved[j] += 1e-6 * scale[j]
            derivative[:, j] = (self.tangential_period(moved)[0] - end) / (1e-6 * scale[j])
        return solved(np.eye(6) - derivative, residual, scale, scale)

    def tangential_periodic(self, state=None, most=3000):
        """Finds the periodic tangential motion with the last computed motion along z. Returns its state and its relative closing error: the
        remaining Newton step."""
        state = np.zeros(6) if state is None else np.array(state, float)
        if not (self.oscillator.moves(0) or self.oscillator.moves(1)):
            return np.zeros(6), 0.0
        laps, march = 0, 2
        found, left = self.by_newton(state)
        best = (left, found)
        while best[0] > 1e-8 and laps < most:
            # Friction only reduces the distance of motions, so marching converges, but slowly.
            for _ in range(march):
                state, _, _ = self.tangential_period(state)
            laps += march + 10
            march = min(2 * march, 256)
            state = self.nearer(state)
            found, left = self.by_newton(state)
            if left < best[0]:
                best = (left, found)
        return best[1], best[0]

    def by_newton(self, state, most=12):
        """Newton's method without marching: returns the state and the remaining step, or infinity if the method does not converge."""
        before = math.inf
        for _ in range(most):
            end, stuck, products = self.tangential_period(state)
            scale = self.scales(state, end)
            size = np.abs((end - state) / scale).max()
            step = self.newton_step(state, end, stuck, products)
            left = np.abs(step / scale).max()
            if not (np.isfinite(size) and np.isfinite(left)):
                break
            if left <= 1e-11 or size <= 1e-15 or (left <= 1e-8 and left > 0.5 * before):
                return state + step, left
            state, before = state + step, left
        return state, math.inf

    def nearer(self, state, most=6):
        """Takes Newton steps as long as each step reduces the closing error to less than a half."""
        end, stuck, products = self.tangential_period(state)
        for _ in range(most):
            scale = self.scales(state, end)
            trial = state + self.newton_step(state, end, stuck, products)
            end_there, stuck, products = self.tangential_period(trial)
            if not np.abs((end_there - trial) / scale).max() < 0.5 * np.abs((end - state) / scale).max():
                break
            state, end = trial, end_there
        return state

    # All together

    def figures(self, state, tangential):
        """Harmonics and energies of a steady motion."""
        sums = np.zeros((2 * ORDERS + 3, 3))
        end, product = self.normal_period(state)
        if self.oscillator.moves(0) or self.oscillator.moves(1):
            after, stuck, _ = self.tangential_period(tangential, sums)
            closing = np.abs((after - tangential) / self.scales(after, tangential)).max()
        else:
            stuck, closing = [True], 0.0
        gather_normal(self.axes[2], self.normal, sums)
        closing = max(closing, np.abs(end - state).max() / max(np.abs(state).max(), self.floor(2)))
        amplitude = np.zeros((3, ORDERS), complex)
        for axis in range(3):
            amplitude[axis] = (sums[0 : 2 * ORDERS : 2, axis] - 1j * sums[1 : 2 * ORDERS : 2, axis]) / math.pi
            amplitude[axis, 0] *= 0.5
        energy = [sums[2 * ORDERS + j].sum() for j in range(3)]
        count = self.normal.count[0]
        return Steady(
            self.frequency, np.array(state), np.array(tangential), amplitude, *energy, closing, spectral(product),
            all(stuck), bool(np.any(self.normal.closed[:count] == 0)),
        )

    def steady(self, state, tangential=None):
        """Finds the periodic motion near a state of z, stable or not; None without such a motion."""
        if self.oscillator.oscillates(2):
            state, _, found = self.normal_periodic(state)
            if not found:
                return None
        else:
            state = self.at_rest()
        self.normal_period(state)
        tangential, left = self.tangential_periodic(tangential)
        steady = self.figures(state, tangential)
        steady.left = left
        return steady


def solved(matrix, right, rows, columns):
    """Smallest change, in the scales of the columns, that solves a system in the least-squares sense."""
    scaled = matrix * columns / rows[:, None]
    if not np.all(np.isfinite(scaled)):
        return np.full(len(columns), math.nan)
    return np.linalg.lstsq(scaled, right / rows, rcond=1e-14)[0] * columns


def spectral(product):
    """Largest absolute value of a multiplier: below one, small disturbances decay."""
    if product is None or not np.all(np.isfinite(product)):
        return math.inf
    return float(np.abs(np.linalg.eigvals(product)).max())


@dataclass
class Steady:
    """A steady motion with the period of the drive."""

    frequency: float
    state: np.ndarray
    tangential: np.ndarray
    amplitude: np.ndarray
    """Complex, by axis and harmonic, in the sense of Re(a exp(i n t)) [m]; the mean first."""
    input: float
    viscous: float
    friction: float
    closing: float
    """Closing error of a period, relative to the motion."""
    multiplier: float
    """Largest absolute value of a multiplier of the motion along z."""
    stuck: bool
    opens: bool
    left: float = 0.0
    """Remaining Newton step, relative to the motion."""

    @property
    def imbalance(self):
        largest = max(abs(self.input), abs(self.viscous), abs(self.friction), 1e-300)
        return (self.input - self.viscous - self.friction) / largest

# Branches


@dataclass
class Place:
    """A periodic motion along z on a branch: logarithm of the frequency [Hz], state, largest multiplier."""

    log: float
    state: np.ndarray
    multiplier: float
    tangential: np.ndarray = None
    amplitude: complex = 0.0
    left: float = 0.0
    prominence: float = 0.0

    @property
    def frequency(self):
        return math.exp(self.log)


def period_map(oscillator, y):
    """Closing error of a period at y = (x, v, log f), and its derivatives."""
    motion = Motion(oscillator, math.exp(y[2]))
    end, product = motion.normal_period(y[:2])
    slope = np.zeros(2)
    step = 1e-6
    for sign in (1.0, -1.0):
        beside, _ = Motion(oscillator, math.exp(y[2] + sign * step)).normal_period(y[:2])
        slope += sign * beside / (2.0 * step)
    return end - y[:2], np.column_stack([product - np.eye(2), slope]), product


def corrected(oscillator, guess, scale, normal):
    """Periodic motion on the plane through `guess` normal to `normal` (scaled); None if Newton's method does not find it."""
    y = guess.copy()
    before = math.inf
    for _ in range(12):
        residual, slopes, product = period_map(oscillator, y)
        matrix = np.vstack([slopes * scale / scale[0], normal])
        right = np.concatenate([-residual / scale[0], [-np.dot(normal, (y - guess) / scale)]])
        if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(right))):
            return None
        try:
            change = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            return None
        y = y + change * scale
        # Far below the range, a period has an extremely large number of steps.
        if abs(y[2] - guess[2]) > LARGEST_LEAP:
            return None
        size = np.abs(change).max()
        if size <= 1e-10 or (size <= 1e-7 and size > 0.3 * before):
            _, slopes, product = period_map(oscillator, y)
            return y, slopes, product
        if size > 10.0 * before or not size < 1e3:
            return None
        before = size
    return None


def branch(oscillator, start, low, high, direction, most=2500):
    """Branch of periodic motions along z from a place to the point where it closes or reaches an end of the range of log f."""
    floor = Motion(oscillator, start.frequency).floor(2)

    def scale_of(y):
        size = max(np.abs(y[:2]).max(), floor)
        return np.array([size, size, 1.0])

    y = np.concatenate([start.state, [start.log]])
    scale = scale_of(y)
    _, slopes, _ = period_map(oscillator, y)
    tangent = np.cross(slopes[0] * scale, slopes[1] * scale)
    tangent /= np.linalg.norm(tangent)
    if tangent[2] * direction < 0.0:
        tangent = -tangent
    places, step = [start], 0.02
    origin = y.copy()
    while len(places) < most:
        # A step also covers at most a fiftieth of the range.
        length = min(step, (high - low) / 50.0 / max(abs(tangent[2]), 1e-12))
        guess = y + length * tangent * scale
        found = corrected(oscillator, guess, scale, tangent)
        turned = None
        if found is not None:
            there, slopes, product = found
            off = np.linalg.norm((there - guess) / scale)
            new_scale = scale_of(there)
            new = np.cross(slopes[0] * new_scale, slopes[1] * new_scale)
            size = np.linalg.norm(new)
            if size > 0.0:
                new /= size
                # Both tangents in the same scales.
                old = tangent * scale / new_scale
                old /= np.linalg.norm(old)
                if np.dot(new, old) < 0.0:
                    new = -new
                turned = np.dot(new, old)
            if turned is None or off > 0.3 * length or turned < 0.9:
                found = None
        if found is None:
            step = 0.4 * length
            if step < 1e-10:
                break
            continue
        y, tangent, scale = there, new, new_scale
        places.append(Place(float(y[2]), y[:2].copy(), spectral(product)))
        if off < 0.05 * length and turned > 0.99:
            step = min(1.6 * length, 0.25)
        else:
            step = length
        if not low <= y[2] <= high:
            places[-1] = at_frequency(oscillator, places[-2], places[-1], low if y[2] < low else high) or places[-1]
            if not low - 1e-12 <= places[-1].log <= high + 1e-12:
                places.pop()
            break
        if len(places) > 20 and np.linalg.norm((y - origin) / scale) < 0.5 * length:
            break
    return places


def between(oscillator, first, second, share):
    """Periodic motion on the plane normal to the line from one place to the next."""
    one = np.concatenate([first.state, [first.log]])
    two = np.concatenate([second.state, [second.log]])
    size = max(np.abs(one[:2]).max(), np.abs(two[:2]).max(), 1e-300)
    scale = np.array([size, size, 1.0])
    way = (two - one) / scale
    if np.linalg.norm(way) == 0.0:
        return first
    guess = one + share * (two - one)
    found = corrected(oscillator, guess, scale, way / np.linalg.norm(way))
    if found is None:
        return None
    y, _, product = found
    return Place(float(y[2]), y[:2].copy(), spectral(product), first.tangential)


def at_frequency(oscillator, first, second, log):
    """Periodic motion at a frequency between two places."""
    share = (log - first.log) / (second.log - first.log) if second.log != first.log else 0.5
    guess = first.state + share * (second.state - first.state)
    motion = Motion(oscillator, math.exp(log))
    state, product, found = motion.normal_periodic(guess)
    if not found:
        return None
    size = max(np.abs(first.state).max(), np.abs(second.state).max())
    if np.abs(state - guess).max() > 0.5 * size:
        return None
    return Place(log, state, spectral(product), first.tangential)


# Checks of the integration


def check_linear():
    """Sticking, and sliding without friction, against the linear response."""
    worst = 0.0
    for mu, load in ((0.3, 1e9), (0.0, 10.0)):
        for damping in (1e-5, 1e-2, 0.3, 3.0):
            mass, stiffness, kt, force = 0.7, 3.0e5, 5.0e5, 11.0
            c = 2.0 * damping * math.sqrt(stiffness * mass)
            contact = Contact(1e5, kt, mu, load, 0.0)
            oscillator = Oscillator([mass] * 3, [c] * 3, [stiffness] * 3, contact, "cone", [(0, 1, force, 0.4), (0, 3, force, 0.0)])
            for frequency in (50.0, 104.2, 170.0, 300.0):
                steady = Motion(oscillator, frequency).steady([0.0, 0.0])
                for n, lead in ((1, 0.4), (3, 0.0)):
                    omega = n * TURN * frequency
                    spring = stiffness + (kt if mu > 0.0 else 0.0)
                    exact = force * np.exp(1j * lead) / (spring - mass * omega**2 + 1j * c * omega)
                    worst = max(worst, abs(steady.amplitude[0, n] / exact - 1.0))
    return worst, 1e-10


def check_given_motion():
    """Dissipation of a slider under a motion that friction hardly changes: 4 mu N (A - mu N / kt)."""
    worst = 0.0
    for kt in (2e4, 1e6, 1e8):
        load, mu, amplitude, stiffness = 50.0, 0.4, 2e-3, 1e13
        # The resonance is far from any multiple of the frequency.
        mass = stiffness / (4.5 * TURN) ** 2
        contact = Contact(1e5, kt, mu, load, 0.0)
        for law in ("cone", "box"):
            force = abs(complex(stiffness - mass * TURN**2, 0.1 * mass * TURN)) * amplitude
            oscillator = Oscillator([mass] * 3, [0.1 * mass] * 3, [stiffness] * 3, contact, law, [(0, 1, force, 0.0)])
            steady = Motion(oscillator, 1.0).steady([0.0, 0.0])
            exact = 4.0 * mu * load * (amplitude - mu * load / kt)
            worst = max(worst, abs(steady.friction / exact - 1.0))
    return worst, 1e-8


def check_circle():
    """Circular orbit that slips throughout: the friction force lags the motion by a constant angle."""
    mass, stiffness, c, load, mu, force = 1.0, 4e6, 20.0, 1000.0, 0.3, 1000.0
    worst = 0.0
    for kt in (6e6, 6e8, 4e10):
        radius = mu * load / kt
        forces = [(0, 1, force, 0.0), (1, 1, force, -0.5 * math.pi)]
        oscillator = Oscillator([mass] * 3, [c] * 3, [stiffness] * 3, Contact(8e6, kt, mu, load, 0.0), "cone", forces)
        for frequency in (250.0, 330.0, 400.0):
            omega = TURN * frequency
            low, high = radius * (1.0 + 1e-12), 10.0 * force / (c * omega)
            for _ in range(200):
                middle = 0.5 * (low + high)
                elastic = (stiffness - mass * omega**2) * middle + (mu * load) ** 2 / (kt * middle)
                lossy = c * omega * middle + mu * load * math.sqrt(max(middle**2 - radius**2, 0.0)) / middle
                if math.hypot(elastic, lossy) < force:
                    low = middle
                else:
                    high = middle
            steady = Motion(oscillator, frequency).steady([0.0, 0.0], np.array([1e-5, 0.0, 0.0, 1e-5, 0.0, 0.0]))
            worst = max(worst, abs(abs(steady.amplitude[0, 1]) / low - 1.0), abs(abs(steady.amplitude[1, 1]) / low - 1.0))
    return worst, 1e-10


def example(draw, law, forces_along):
    """An oscillator that slips and, if it is driven along z, opens."""
    start = int(draw.integers(3))
    load, gap = [100.0, 0.0, 0.0][start], [0.0, 0.0, 1e-4][start]
    stiffness = [4e6, 4e6 * draw.uniform(0.7, 1.4), 4e6 * draw.uniform(0.5, 2.0)]
    contact = Contact(4e6 * 10.0 ** draw.uniform(-1.0, 1.5), 4e6 * 10.0 ** draw.uniform(-1.5, 2.0), draw.uniform(0.1, 1.0), load, gap)
    c = 4000.0 * 10.0 ** draw.uniform(-2.5, -0.5)
    forces = []
    for axis in forces_along:
        forces.append((axis, 1, 100.0 * 10.0 ** draw.uniform(-0.5, 1.2), draw.uniform(0.0, TURN)))
    if load == 0.0 and 2 not in forces_along:
        forces.append((2, 0, 500.0 + 4e6 * gap, 0.0))
    return Oscillator([1.0] * 3, [c] * 3, stiffness, contact, law, forces), 318.0 * draw.uniform(0.5, 2.0)


def settled(oscillator, frequency):
    motion = Motion(oscillator, frequency)
    name, state, _ = motion.settle([0.0, 0.0], 4000)
    return motion, (motion.steady(state) if name == "period 1" else None)


def check_turned():
    """Motion along a line at 45 degrees, computed in the plane and along an axis: collocation against the linear integration."""
    draw, worst = np.random.default_rng(3), 0.0
    for _ in range(30):
        one, frequency = example(draw, "box", (0, 2))
        one.stiffness[1] = one.stiffness[0]
        half = math.sqrt(0.5)
        forces = [(0, n, half * size, lead) for axis, n, size, lead in one.forces if axis == 0]
        forces += [(1, n, size, lead) for _, n, size, lead in forces] + [force for force in one.forces if force[0] == 2]
        other = Oscillator(one.mass, one.damping, one.stiffness, one.contact, "cone", forces)
        _, a = settled(one, frequency)
        _, b = settled(other, frequency)
        if a is not None and b is not None and not a.stuck:
            worst = max(worst, abs(b.amplitude[0, 1] / (half * a.amplitude[0, 1]) - 1.0))
    return worst, 1e-9


def check_balance():
    """Work of the forces against the dissipation of dashpots and slip."""
    draw, worst = np.random.default_rng(4), 0.0
    for n in range(90):
        oscillator, frequency = example(draw, ("cone", "box")[n % 2], ((0,), (0, 1), (0, 2), (0, 1, 2), (2,))[n % 5])
        _, steady = settled(oscillator, frequency)
        if steady is not None:
            worst = max(worst, abs(steady.imbalance))
    return worst, 1e-9


@njit(cache=True)
def stepped(m, c, k, kn, kt, mu, load, gap, is_cone, orders, cosine, sine, state, steps, periods):
    """The average-acceleration scheme with a return of the friction force to its limit in every step; returns the first harmonics of the
    last period. It shares no code with the integration between events."""
    u, v, a, w = state[:3].copy(), state[3:6].copy(), np.zeros(3), state[6:8].copy()
    h = TURN / steps
    harmonic = np.zeros((3, 2))
    force = np.zeros(3)
    for p in range(periods):
        for n in range(steps):
            t = (n + 1) * h
            external = np.zeros(3)
            for i in range(len(orders)):
                for d in range(3):
                    external[d] += cosine[d, i] * math.cos(orders[i] * t) + sine[d, i] * math.sin(orders[i] * t)
            base = 4.0 / (h * h) * u + 4.0 / h * v + a
            inertia = 4.0 / (h * h) * m + 2.0 / h * c + k
            right = external + m * base + c * (2.0 / h * u + v)
            # The motion along z is open or closed.
            z = (right[2] + load) / inertia[2]
            depth = load + kn * (z - gap)
            if depth > 0.0:
                z = (right[2] + kn * gap) / (inertia[2] + kn)
                depth = load + kn * (z - gap)
            limit = mu * max(depth, 0.0)
            new = np.array([0.0, 0.0, z])
            if limit <= 0.0:
                for d in range(2):
                    new[d] = right[d] / inertia[d]
                    w[d] = new[d]
            else:
                trial = np.zeros(2)
                for d in range(2):
                    new[d] = (right[d] + kt * w[d]) / (inertia[d] + kt)
                    trial[d] = kt * (new[d] - w[d])
                if is_cone and math.hypot(trial[0], trial[1]) > limit:
                    # The slip has the direction of the force at the end of the step: T (1 + s) = kt (u - w), s >= 0.
                    low, high = 0.0, 1.0
                    while True:
                        size = 0.0
                        for d in range(2):
                            x = (right[d] + kt / (1.0 + high) * w[d]) / (inertia[d] + kt / (1.0 + high))
                            size += (kt / (1.0 + high) * (x - w[d])) ** 2
                        if math.sqrt(size) <= limit:
                            break
                        high *= 2.0
                    for _ in range(80):
                        s = 0.5 * (low + high)
                        size = 0.0
                        for d in range(2):
                            x = (right[d] + kt / (1.0 + s) * w[d]) / (inertia[d] + kt / (1.0 + s))
                            size += (kt / (1.0 + s) * (x - w[d])) ** 2
                        if math.sqrt(size) > limit:
                            low = s
                        else:
                            high = s
                    for d in range(2):
                        soft = kt / (1.0 + high)
                        new[d] = (right[d] + soft * w[d]) / (inertia[d] + soft)
                        force[d] = soft * (new[d] - w[d])
                        w[d] = new[d] - force[d] / kt
                elif not is_cone:
                    for d in range(2):
                        if abs(trial[d]) > limit:
                            force[d] = math.copysign(limit, trial[d])
                            new[d] = (right[d] - force[d]) / inertia[d]
                            w[d] = new[d] - force[d] / kt
            for d in range(3):
                now = 4.0 / (h * h) * (new[d] - u[d]) - 4.0 / h * v[d] - a[d]
                v[d] += 0.5 * h * (a[d] + now)
                a[d] = now
                u[d] = new[d]
                if p == periods - 1:
                    harmonic[d, 0] += u[d] * math.cos(t) * h / math.pi
                    harmonic[d, 1] += u[d] * math.sin(t) * h / math.pi
    return harmonic


def check_stepped():
    """First harmonics of a scheme with many steps, which is of first order if friction turns."""
    draw, worst = np.random.default_rng(5), 0.0
    for n in range(16):
        oscillator, frequency = example(draw, ("cone", "box")[n % 2], ((0, 1), (0, 2), (0, 1, 2), (0, 1, 2))[n // 2 % 4])
        # The stiffness is low enough for the steps, and the damping is high enough for the transient to decay.
        oscillator.contact = oscillator.contact._replace(kt=min(oscillator.contact.kt, 2e7), kn=min(oscillator.contact.kn, 1e7))
        oscillator.damping = [max(c, 200.0) for c in oscillator.damping]
        motion, steady = settled(oscillator, frequency)
        if steady is None:
            continue
        orders = np.array([0, 1])
        cosine, sine = np.zeros((3, 2)), np.zeros((3, 2))
        for d, axis in enumerate(motion.axes):
            for i, order in enumerate(axis.orders):
                cosine[d, order], sine[d, order] = axis.cosine[i], axis.sine[i]
        contact = oscillator.contact
        tangential = steady.tangential
        state = np.array([
            tangential[0], tangential[2], steady.state[0], tangential[1], tangential[3], steady.state[1],
            tangential[0] - tangential[4] / contact.kt, tangential[2] - tangential[5] / contact.kt,
        ])
        parts = [np.array([getattr(axis, name) for axis in motion.axes]) for name in "mck"]
        is_cone = oscillator.law == "cone"
        found = stepped(
            *parts, contact.kn, contact.kt, contact.mu, contact.load, contact.gap, is_cone, orders, cosine, sine, state, 32768, 30
        )
        for d in range(2 if not oscillator.oscillates(2) else 3):
            if not oscillator.moves(d):
                continue
            worst = max(worst, abs(complex(found[d, 0], -found[d, 1]) / steady.amplitude[d, 1] - 1.0))
    return worst, 1e-4


def check_bilinear():
    """Without preload and gap, the resonance of a lightly damped oscillator on a one-sided spring is at 2 f1 f2 / (f1 + f2)."""
    worst = 0.0
    for kn in (2e5, 4e6, 8e7):
        oscillator = Oscillator([1.0] * 3, [1.0] * 3, [1e6] * 3, Contact(kn, 1e5, 0.0, 0.0, 0.0), "cone", [(2, 1, 10.0, 0.0)])
        free, stuck = oscillator.frequencies(2)
        exact = 2.0 * free * stuck / (free + stuck)
        low, high = math.log(0.95 * exact), math.log(1.05 * exact)
        motion = Motion(oscillator, math.exp(low))
        _, state, product = motion.settle([0.0, 0.0])
        places = branch(oscillator, Place(low, state, spectral(product)), low, high, 1.0)
        top = max(places, key=lambda place: np.abs(place.state).max())
        worst = max(worst, abs(top.frequency / exact - 1.0))
    # Tolerance for the shift due to the damping, and for the distance of places.
    return worst, 5e-4


def check_derivatives():
    """Derivatives of the end of a period along its start, against differences."""
    draw, worst = np.random.default_rng(6), 0.0
    for _ in range(20):
        oscillator, frequency = example(draw, "box", (0, 2))
        motion, steady = settled(oscillator, frequency)
        if steady is None or steady.stuck:
            continue
        motion.normal_period(steady.state)
        middle, _, products = motion.tangential_period(steady.tangential)
        scale = motion.scales(middle)
        for j, at in enumerate((0, 1)):
            ends = []
            for sign in (1.0, -1.0):
                moved = steady.tangential.copy()
                moved[at] += sign * 1e-7 * scale[at]
                if j == 0:
                    # The slider does not move.
                    moved[4] = steady.tangential[4]
                ends.append(motion.tangential_period(moved)[0])
            difference = (ends[0] - ends[1]) / (2e-7 * scale[at])
            own = products[0][:, j]
            error = np.abs((difference[[0, 1, 4]] - own) / scale[[0, 1, 4]]).max() * scale[at]
            worst = max(worst, error)
    return worst, 1e-5


CHECKS = {
    "linear response": check_linear,
    "energy of a slider under a given motion": check_given_motion,
    "circular orbit in full slip": check_circle,
    "line at 45 degrees, in the plane and along an axis": check_turned,
    "balance of energy": check_balance,
    "average acceleration in steps": check_stepped,
    "resonance on a one-sided spring": check_bilinear,
    "derivatives of the period": check_derivatives,
}


def main():
    failed = []
    for name, check in CHECKS.items():
        worst, allowed = check()
        print(f"{name:52} {worst:8.1e}, {allowed:.0e} allowed", flush=True)
        if not worst <= allowed:
            failed.append(name)
    if failed:
        sys.exit(f"the integration fails: {', '.join(failed)}")


if __name__ == "__main__":
    main()
