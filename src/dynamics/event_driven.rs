//! Force of a slider over a cycle whose displacement is a Fourier series, without samples: the instants at which it sticks, slips,
//! opens and closes are roots of trigonometric polynomials, and the coefficients of its force between them are closed forms.
//!
//! A slider that moves along one axis has three phases: it sticks, T = k_t u + κ; it slips, T = ±µN; it is open, T = 0. The force is
//! continuous where they change, so that the Jacobian of its coefficients is the integral of the derivatives between the instants;
//! the instants themselves enter only through κ. Each slip forgets all that was before, so that a cycle is steady after the next.
//!
//! Two displacements in the plane under the cone `|T| ≤ µN` turn the force while it slips, which is no closed form:
//! such motions are sampled ([`super::aft`]).

use std::f64::consts::TAU;

use super::aft::Closure;
use super::krylov::dot;
use super::series::{Nodes, Products, ROUNDING, Series};
use super::slider::{self, Dual, FrictionLaw, Slider, Step};
use super::spring::Spring;
use super::{ContactElement, Harmonics};

/// Cycles at most until the steady one: the first comes from the preload, the second may be the first that slips.
const MOST_CYCLES: usize = 6;
/// Changes of phase in a cycle per harmonic; a polynomial of order k has 2 k roots at most, and there are four.
const MOST_CHANGES: usize = 16;
/// Share of the displacement along one axis of the plane up to which one along the other is rounding: what is left of it where modes of
/// equal frequencies along both axes mix.
const REST: f64 = 1e-10;

impl ContactElement {
    /// Coefficients of the force and their Jacobian as [`Sampling::evaluate`](super::Sampling::evaluate) has them, without samples; none
    /// where the law has no closed form: two displacements in the plane under the cone. Springs are left out.
    ///
    /// A displacement that rests under the cone counts for the Jacobian as if it were limited by itself: it has no force.
    pub(super) fn closed_form(
        &self,
        harmonics: &Harmonics,
        displacement: &[f64],
        force: &mut [f64],
        jacobian: Option<&mut [f64]>,
    ) -> Option<Closure> {
        let n = harmonics.coefficients();
        let (plane, normal) = displacement.split_at(2 * n);
        if !self.moves_apart(harmonics, displacement) {
            return None;
        }
        force.fill(0.0);
        let nodes = Nodes::of(harmonics);
        let mut slopes = vec![0.0; 5 * n * n];
        let (of_axes, by_load) = slopes.split_at_mut(4 * n * n);
        let mut closure = Closure::EXACT;
        for slider in &self.sliders {
            add_normal(slider, &nodes, normal, &mut force[2 * n..], by_load);
            if slider.gripping_stiffness(self.friction_coefficient) == 0.0 {
                continue;
            }
            for (axis, slopes) in of_axes.chunks_exact_mut(2 * n * n).enumerate() {
                let line = self.line(slider, &nodes, &plane[axis * n..][..n], normal);
                let cycle = line.cycle()?;
                let (by_tangential, by_normal) = slopes.split_at_mut(n * n);
                line.add(
                    &cycle,
                    &mut Sums {
                        tangential: &mut force[axis * n..][..n],
                        by_tangential,
                        by_normal,
                    },
                );
                closure = closure.and(cycle.closure);
            }
        }
        if let Some(jacobian) = jacobian {
            jacobian.fill(0.0);
            for c in 0..n {
                for axis in 0..2 {
                    let row = &mut jacobian[(axis * n + c) * 3 * n..][..3 * n];
                    let own = &of_axes[axis * 2 * n * n..];
                    row[axis * n..][..n].copy_from_slice(&own[c * n..][..n]);
                    row[2 * n..].copy_from_slice(&own[(n + c) * n..][..n]);
                }
                let row = &mut jacobian[(2 * n + c) * 3 * n..][..3 * n];
                row[2 * n..].copy_from_slice(&by_load[c * n..][..n]);
            }
        }
        Some(closure)
    }

    /// Whether all sliders follow their reference at every instant; none where that is not known without samples.
    pub(super) fn follows_throughout(
        &self,
        harmonics: &Harmonics,
        displacement: &[f64],
    ) -> Option<bool> {
        let n = harmonics.coefficients();
        let (plane, normal) = displacement.split_at(2 * n);
        if !self.moves_apart(harmonics, displacement) {
            return None;
        }
        let rows = |spring: &Spring| &displacement[spring.direction() * n..][..n];
        let mut springs = self.springs.iter();
        if !springs.all(|spring| spring.is_free(harmonics, rows(spring))) {
            return Some(false);
        }
        let nodes = Nodes::of(harmonics);
        for slider in &self.sliders {
            if !slider.bears() {
                if !stays_open(slider, &nodes, normal) {
                    return Some(false);
                }
                continue;
            }
            let load = load(slider, &nodes, normal);
            if !load.is_positive_after(0.0) || load.first_below_zero(0.0).is_some() {
                return Some(load.is_zero() && plane.iter().all(|u| *u == 0.0));
            }
            if slider.gripping_stiffness(self.friction_coefficient) == 0.0 {
                continue;
            }
            for axis in 0..2 {
                let line = self.line(slider, &nodes, &plane[axis * n..][..n], normal);
                if !line.cycle()?.follows() {
                    return Some(false);
                }
            }
        }
        Some(true)
    }

    fn line<'a>(
        &self,
        slider: &'a Slider,
        nodes: &'a Nodes<'a>,
        tangential: &[f64],
        normal: &[f64],
    ) -> Line<'a> {
        Line {
            slider,
            friction: self.friction_coefficient,
            nodes,
            moved: Series::new(nodes, tangential.to_vec()),
            load: load(slider, nodes, normal),
        }
    }

    /// Whether friction acts along x and y independently: by its law, or as one of them rests.
    fn moves_apart(&self, harmonics: &Harmonics, displacement: &[f64]) -> bool {
        if self.law.is_by_axes() || self.friction_coefficient == 0.0 || self.sliders.is_empty() {
            return true;
        }
        let n = harmonics.coefficients();
        let size = |axis: usize| {
            let row = &displacement[axis * n..][..n];
            row.iter().fold(0.0_f64, |most, u| most.max(u.abs()))
        };
        let (x, y) = (size(0), size(1));
        x.min(y) <= REST * x.max(y)
    }
}

/// A slider and how it moves along one axis of its plane.
struct Line<'a> {
    slider: &'a Slider,
    friction: f64,
    nodes: &'a Nodes<'a>,
    /// Displacement along the axis \[m\].
    moved: Series<'a>,
    /// Normal load without the limit at zero \[N\].
    load: Series<'a>,
}

/// Where rows of coefficients of a force go, and the derivatives of the tangential force by both displacements.
struct Sums<'a> {
    tangential: &'a mut [f64],
    by_tangential: &'a mut [f64],
    by_normal: &'a mut [f64],
}

/// What a slider does between two instants.
#[derive(Debug, Clone, PartialEq)]
enum Phase {
    Open,
    /// T = k_t u + κ, with the derivative of κ by the coefficients of the tangential, then of the normal displacement.
    Stick {
        offset: f64,
        slope: Vec<f64>,
    },
    /// T = ±µN.
    Slip {
        sign: f64,
    },
}

/// A phase from one instant to another \[rad\].
struct Segment {
    phase: Phase,
    from: f64,
    to: f64,
}

/// What was found of a steady cycle.
struct Cycle {
    segments: Vec<Segment>,
    /// How well it closes, and its largest force.
    closure: Closure,
}

impl Cycle {
    /// Whether the slider sticks throughout without a force that an earlier slip left, as at rest.
    fn follows(&self) -> bool {
        matches!(&self.segments[..], [Segment { phase: Phase::Stick { offset, .. }, .. }] if *offset == 0.0)
    }
}

impl<'a> Line<'a> {
    /// The steady cycle that the march from the preload leads to; none if there is no end to its changes.
    fn cycle(&self) -> Option<Cycle> {
        let (mut phase, mut segments) = (self.first(), Vec::new());
        for cycle in 1..=MOST_CYCLES {
            let start = phase.clone();
            segments.clear();
            phase = self.lap(phase, &mut segments)?;
            if same(&start, &phase, self.scale()) {
                let largest = self.largest(&segments);
                let closure = Closure {
                    cycles: cycle,
                    largest,
                    ..Closure::EXACT
                };
                return Some(Cycle { segments, closure });
            }
        }
        None
    }

    /// Adds the coefficients of the tangential force of a `cycle`, and their derivatives.
    fn add(&self, cycle: &Cycle, sums: &mut Sums<'_>) {
        let n = self.nodes.harmonics.coefficients();
        let kt = self.slider.tangential_stiffness;
        let kn = self.slider.normal_stiffness;
        for segment in &cycle.segments {
            let products = match segment.phase {
                Phase::Open => continue,
                _ => Products::over(self.nodes.harmonics, segment.from, segment.to),
            };
            for c in 0..n {
                let row = products.row(c);
                let by_tangential = &mut sums.by_tangential[c * n..][..n];
                let by_normal = &mut sums.by_normal[c * n..][..n];
                match &segment.phase {
                    Phase::Open => {}
                    Phase::Stick { offset, slope } => {
                        let mean = products.mean(c);
                        sums.tangential[c] += kt * dot(row, &self.moved.row) + offset * mean;
                        let (first, second) = slope.split_at(n);
                        for e in 0..n {
                            by_tangential[e] += kt * row[e] + mean * first[e];
                            by_normal[e] += mean * second[e];
                        }
                    }
                    Phase::Slip { sign } => {
                        let limit = sign * self.friction;
                        sums.tangential[c] += limit * dot(row, &self.load.row);
                        for e in 0..n {
                            by_normal[e] += limit * kn * row[e];
                        }
                    }
                }
            }
        }
    }

    /// A force that all others are measured by \[N\].
    fn scale(&self) -> f64 {
        let kt = self.slider.tangential_stiffness;
        kt * self.moved.row.iter().map(|u| u.abs()).sum::<f64>()
    }

    /// The phase at the beginning of the first cycle, to which one step leads from the preload.
    fn first(&self) -> Phase {
        let n = self.nodes.harmonics.coefficients();
        let basis = self.nodes.basis(0.0);
        let kt = self.slider.tangential_stiffness;
        let (u, now) = (dot(&basis, &self.moved.row), self.load.value(0.0));
        let at_rest = self.slider.bilateral_load(0.0);
        let zero = Dual::<4>::input(0.0, 4);
        // Derivatives by the displacement and by the load at the end of the step.
        let (force, step) = slider::step(
            // Along a line all laws are one.
            FrictionLaw::default(),
            kt,
            self.friction,
            [zero; 2],
            [Dual::input(u, 0), zero],
            [Dual::input(at_rest, 4), Dual::input(now, 1)],
        );
        match step {
            Step::Open => Phase::Open,
            Step::Slip => Phase::Slip {
                sign: force[0].value.signum(),
            },
            Step::Stick => {
                let kn = self.slider.normal_stiffness;
                let [by_displacement, by_load, ..] = force[0].slope;
                let mut slope = vec![0.0; 2 * n];
                for (e, b) in basis.iter().enumerate() {
                    slope[e] = (by_displacement - kt) * b;
                    slope[n + e] = by_load * kn * b;
                }
                let offset = force[0].value - kt * u;
                Phase::Stick {
                    // A step from rest that sticks is the spring itself.
                    offset: if at_rest >= 0.0 { 0.0 } else { offset },
                    slope,
                }
            }
        }
    }

    /// One cycle: the phases that follow `phase`, and the one at its end; none if there is no end to them.
    fn lap(&self, mut phase: Phase, segments: &mut Vec<Segment>) -> Option<Phase> {
        let most = MOST_CHANGES * (1 + self.nodes.harmonics.highest() as usize);
        let mut from = 0.0;
        while segments.len() < most {
            let (to, next) = match self.change(&phase, from) {
                Some((at, next)) if at < TAU => (at, Some(next)),
                _ => (TAU, None),
            };
            let is_last = next.is_none();
            let before = match next {
                Some(next) => std::mem::replace(&mut phase, next),
                None => phase.clone(),
            };
            segments.push(Segment {
                phase: before,
                from,
                to,
            });
            if is_last {
                return Some(phase);
            }
            from = to;
        }
        None
    }

    /// The instant at which `phase` ends, if it does within the cycle, and what follows.
    fn change(&self, phase: &Phase, from: f64) -> Option<(f64, Phase)> {
        let kt = self.slider.tangential_stiffness;
        // What is left of the limit on a side.
        let left = |sign: f64, offset: f64| {
            self.load
                .combined(self.friction, &self.moved, -sign * kt, -sign * offset)
        };
        match phase {
            Phase::Open => {
                let at = self.load.opposite().first_below_zero(from)?;
                Some((at, self.closed(at)))
            }
            Phase::Stick { offset, .. } => {
                let ends = [1.0, -1.0].map(|sign| {
                    let at = left(sign, *offset).first_below_zero(from);
                    at.map(|at| (at, sign))
                });
                let (at, sign) = ends
                    .into_iter()
                    .flatten()
                    .min_by(|a, b| a.0.total_cmp(&b.0))?;
                Some((at, Phase::Slip { sign }))
            }
            Phase::Slip { sign } => {
                // While it slips, what would be left if it stuck falls: k_t times the speed of the slider.
                let holds = left(*sign, 0.0).opposite().first_slope_below_zero(from);
                let opens = self.load.first_below_zero(from);
                match (holds, opens) {
                    (Some(holds), opens) if opens.is_none_or(|opens| holds < opens) => {
                        Some((holds, self.held(*sign, holds)))
                    }
                    (_, Some(opens)) => Some((opens, Phase::Open)),
                    (_, None) => None,
                }
            }
        }
    }

    /// The slider as it is caught by friction out of slip.
    fn held(&self, sign: f64, at: f64) -> Phase {
        let (kt, kn) = (
            self.slider.tangential_stiffness,
            self.slider.normal_stiffness,
        );
        let basis = self.nodes.basis(at);
        let limit = sign * self.friction;
        let by_tangential = basis.iter().map(|b| -kt * b);
        let by_normal = basis.iter().map(|b| limit * kn * b);
        Phase::Stick {
            offset: limit * self.load.value(at) - kt * self.moved.value(at),
            slope: by_tangential.chain(by_normal).collect(),
        }
    }

    /// The slider as it closes: it grips from then on, or slips at once where its force would rise faster than its limit.
    fn closed(&self, at: f64) -> Phase {
        let kt = self.slider.tangential_stiffness;
        let kn = self.slider.normal_stiffness;
        let (rise, speed) = (self.load.slope(at), self.moved.slope(at));
        if kt * speed.abs() > self.friction * rise {
            return Phase::Slip {
                sign: speed.signum(),
            };
        }
        let basis = self.nodes.basis(at);
        // The instant moves with the load: dθ = −dN / N′.
        let by_normal = |b: &f64| {
            if rise > 0.0 {
                kt * speed * kn * b / rise
            } else {
                0.0
            }
        };
        let by_tangential = basis.iter().map(|b| -kt * b);
        Phase::Stick {
            offset: -kt * self.moved.value(at),
            slope: by_tangential.chain(basis.iter().map(by_normal)).collect(),
        }
    }

    fn largest(&self, segments: &[Segment]) -> f64 {
        let kt = self.slider.tangential_stiffness;
        let force = |phase: &Phase, at: f64| match phase {
            Phase::Open => 0.0,
            Phase::Stick { offset, .. } => (kt * self.moved.value(at) + offset).abs(),
            Phase::Slip { .. } => self.friction * self.load.value(at).max(0.0),
        };
        let ends = segments
            .iter()
            .flat_map(|s| [s.from, 0.5 * (s.from + s.to), s.to].map(|at| force(&s.phase, at)));
        ends.fold(0.0, f64::max)
    }
}

/// Adds the coefficients of the normal load of a slider beyond its preload, and their derivatives.
pub(super) fn add_normal(
    slider: &Slider,
    nodes: &Nodes<'_>,
    normal: &[f64],
    force: &mut [f64],
    slope: &mut [f64],
) {
    let harmonics = nodes.harmonics;
    let n = harmonics.coefficients();
    let load = load(slider, nodes, normal);
    let opposite = load.opposite();
    force[0] -= slider.normal_load;
    let mut from = 0.0;
    let mut is_closed = load.is_positive_after(0.0);
    for _ in 0..MOST_CHANGES * (1 + harmonics.highest() as usize) {
        if from >= TAU {
            break;
        }
        let change = if is_closed { &load } else { &opposite };
        let to = change.first_below_zero(from).unwrap_or(TAU).min(TAU);
        if is_closed {
            let products = Products::over(harmonics, from, to);
            for c in 0..n {
                let row = products.row(c);
                force[c] += dot(row, &load.row);
                for (slope, product) in slope[c * n..][..n].iter_mut().zip(row) {
                    *slope += slider.normal_stiffness * product;
                }
            }
        }
        (from, is_closed) = (to, !is_closed);
    }
}

/// Whether a slider is without load throughout.
pub(super) fn stays_open(slider: &Slider, nodes: &Nodes<'_>, normal: &[f64]) -> bool {
    let load = load(slider, nodes, normal);
    !load.is_positive_after(0.0) && load.opposite().first_below_zero(0.0).is_none()
}

/// Normal load of a slider without the limit at zero \[N\].
fn load<'a>(slider: &Slider, nodes: &'a Nodes<'a>, normal: &[f64]) -> Series<'a> {
    let kn = slider.normal_stiffness;
    let mut row: Vec<f64> = normal.iter().map(|u| kn * u).collect();
    row[0] += slider.bilateral_load(0.0);
    Series::new(nodes, row)
}

/// Whether two phases go on alike.
fn same(a: &Phase, b: &Phase, scale: f64) -> bool {
    match (a, b) {
        (Phase::Stick { offset: a, .. }, Phase::Stick { offset: b, .. }) => {
            (a - b).abs() <= ROUNDING * scale
        }
        (Phase::Slip { sign: a }, Phase::Slip { sign: b }) => a == b,
        (Phase::Open, Phase::Open) => true,
        _ => false,
    }
}
