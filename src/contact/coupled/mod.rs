//! Contact with friction of bodies that differ elastically (Dundurs β ≠ 0): pressure displaces the surfaces along each other,
//! and shear displaces them across.
//!
//! A step moves the bodies along each other and across. With p₀ and q₀ the tractions before it, find pressure p
//! and shear q that obey the normal conditions (see [`super::normal`]) for the gap
//!
//! g = K_zz p + K_zt q + D p − h − (the rigid motion across)
//!
//! and Coulomb's law (see [`super::tangential`]) with |q| ≤ µp for the slip
//!
//! s = (the rigid motion along) − K_tt (q − q₀) − K_tz (p − p₀), K_tz = K_ztᵀ.
//!
//! Whatever controls the rigid motions in the two modules, does so here.
//!
//! Either condition is that of a convex problem at a given solution of the other. They are solved in turn (Panagiotopoulos
//! 1975): the normal problem on heights h − K_zt q, the tangential one with the offset −K_tz (p − p₀). What is
//! iterated is the normal displacement K_zt q; its next value is mixed from the last few so that their changes cancel best
//! (Anderson 1965). A round changes the tractions by about βµ times what the last one did, or by β² where all sticks.
//!
//! The result is certified on the joint conditions: the gap with the latest shear, the duality gap of friction with the latest
//! pressure. Neither depends on the mixing. For large βµ there may be several solutions, or none; then the iteration may stop with
//! [`ContactError::NotConverged`].
//!
//! A pressure history matters: a point that closes in a step is taken to have been in contact, and under its friction limit at
//! the step's end, during all of it. Loads rise in steps, see [`indent`]; their number is an error of first order.
//!
//! Stiffness of the whole K is [`super::stiffness::coupled`].

mod mixing;

use super::error::{ContactError, check_field, check_length};
use super::half_space::{HalfSpace, Shear};
use super::normal::{self, Control, NormalOptions, NormalProblem, NormalSolution};
use super::tangential::{self, Drive, TangentialOptions, TangentialProblem, TangentialSolution};
use crate::grid::ByAxis;
use mixing::Mixing;

/// Tolerance of the first normal solve: what the first round's shear will change is larger.
const FIRST_TOLERANCE: f64 = 1e-3;

/// Error that a normal solve may leave, as a part of the joint error of the round before.
const INNER_REDUCTION: f64 = 0.05;

/// A round that leaves more than this part of the joint error tells that friction was not solved well enough.
const SETTLING: f64 = 0.2;

/// The next duality gap asked for then, as a part of the last one.
const TIGHTER: f64 = 0.01;

/// A duality gap at the rounding of its sums.
const LEAST_GAP: f64 = 1e-10;

/// A shear of this part of its limit is at it.
const AT_LIMIT: f64 = 1.0 - 1e-9;

/// Newton steps towards a smaller gap than asked for; it converges in a few or not at all.
const FURTHER_STEPS: usize = 20;

/// Tractions on the contact plane.
#[derive(Debug, Clone, Copy)]
pub struct Tractions<'a> {
    /// Pressure \[Pa\].
    pub pressure: &'a [f64],
    /// Shear, one field an axis \[Pa\].
    pub shear: &'a ByAxis<Vec<f64>>,
}

/// One step.
#[derive(Debug, Clone, Copy)]
pub struct CoupledProblem<'a> {
    /// What is pressed on what, at the end of the step.
    pub normal: NormalProblem<'a>,
    /// Coulomb's µ ≥ 0.
    pub friction_coefficient: f64,
    /// Tractions p₀ and q₀ before the step; `None` are bodies that did not touch.
    pub previous: Option<Tractions<'a>>,
    /// Motion of the upper body against the lower in this step, one entry an axis (x, or x and y).
    pub drive: &'a ByAxis<Drive>,
    /// Rotation of the upper body against the lower about z through the grid's centre; `None` is none. Needs both axes.
    pub rotation: Option<Drive>,
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoupledOptions {
    /// The tolerance is that of the joint normal conditions; the iterations are those of one normal solve.
    pub normal: NormalOptions,
    /// Of each tangential solve, and so of the joint tangential conditions.
    pub tangential: TangentialOptions,
    /// Bound on the rounds of a normal and a tangential solve.
    pub max_rounds: usize,
}

impl Default for CoupledOptions {
    fn default() -> Self {
        CoupledOptions {
            normal: NormalOptions::default(),
            tangential: TangentialOptions::default(),
            max_rounds: 60,
        }
    }
}

/// A converged step.
#[derive(Debug, Clone, PartialEq)]
pub struct CoupledSolution {
    /// Pressure, gap and approach. Gap and error are those of the joint conditions; the counts are sums over the rounds.
    pub normal: NormalSolution,
    /// Shear and slip. The counts are sums over the rounds.
    pub tangential: TangentialSolution,
}

impl CoupledSolution {
    /// The tractions, to begin the next step from.
    pub fn tractions(&self) -> Tractions<'_> {
        Tractions {
            pressure: &self.normal.pressure,
            shear: &self.tangential.shear,
        }
    }
}

/// Solves one step. `start` are tractions to begin from, used for speed alone; without them the step begins from `previous`.
///
/// Bodies that are not coupled take one normal and one tangential solve, exactly those of the modules beside.
pub fn solve(
    half_space: &mut HalfSpace,
    problem: &CoupledProblem,
    start: Option<Tractions>,
    options: CoupledOptions,
) -> Result<CoupledSolution, ContactError> {
    check(problem, start)?;
    if half_space.pair().is_coupled() {
        // The half space's length is checked by the solvers, but the coupling is applied before them.
        check_length(
            "half space",
            half_space.grid().len(),
            problem.normal.patch.grid.len(),
        )?;
        alternate(half_space, problem, start, options)
    } else {
        uncoupled(half_space, problem, start, options)
    }
}

/// Presses the bodies together without a tangential motion: from no contact through the given loads in turn \[N\]. What
/// slips does so because the bodies differ. `problem.control` is not read; `seen` gets the solution of every load.
pub fn indent(
    half_space: &mut HalfSpace,
    problem: &NormalProblem,
    friction_coefficient: f64,
    shear: Shear,
    loads: &[f64],
    options: CoupledOptions,
    mut seen: impl FnMut(&CoupledSolution),
) -> Result<CoupledSolution, ContactError> {
    let drive = match shear {
        Shear::AlongX => vec![Drive::Displacement(0.0)],
        Shear::InPlane => vec![Drive::Displacement(0.0); 2],
    };
    let mut last: Option<CoupledSolution> = None;
    for &load in loads {
        let step = CoupledProblem {
            normal: NormalProblem {
                control: Control::Load(load),
                ..*problem
            },
            friction_coefficient,
            previous: last.as_ref().map(CoupledSolution::tractions),
            drive: &drive,
            rotation: None,
        };
        let solution = solve(half_space, &step, None, options)?;
        seen(&solution);
        last = Some(solution);
    }
    last.ok_or(ContactError::OutOfRange {
        name: "number of load steps",
        value: 0.0,
        expected: "at least 1",
    })
}

/// What the normal and the tangential solver do not check themselves.
fn check(problem: &CoupledProblem, start: Option<Tractions>) -> Result<(), ContactError> {
    let friction = problem.friction_coefficient;
    if !(friction.is_finite() && friction >= 0.0) {
        return Err(ContactError::OutOfRange {
            name: "friction coefficient",
            value: friction,
            expected: "finite and ≥ 0",
        });
    }
    let axes = problem.drive.len();
    if !(1..=2).contains(&axes) {
        return Err(ContactError::OutOfRange {
            name: "number of axes",
            value: axes as f64,
            expected: "1 or 2",
        });
    }
    let grid = problem.normal.patch.grid;
    check_length("height", problem.normal.height.len(), grid.len())?;
    for (tractions, [pressure, shear]) in [
        (
            problem.previous,
            ["pressure before the step", "shear before the step"],
        ),
        (start, ["starting pressure", "starting shear"]),
    ] {
        let Some(tractions) = tractions else { continue };
        if tractions.shear.len() != axes {
            return Err(ContactError::OutOfRange {
                name: "number of axes of a shear",
                value: tractions.shear.len() as f64,
                expected: "that of the drive",
            });
        }
        let fields = std::iter::once((pressure, tractions.pressure))
            .chain(tractions.shear.iter().map(|q| (shear, &q[..])));
        for (field, values) in fields {
            check_field(field, values, grid, |_| true)?;
        }
    }
    Ok(())
}

fn limit(problem: &CoupledProblem, pressure: &[f64]) -> Vec<f64> {
    pressure
        .iter()
        .map(|p| problem.friction_coefficient * p)
        .collect()
}

fn uncoupled(
    half_space: &mut HalfSpace,
    problem: &CoupledProblem,
    start: Option<Tractions>,
    options: CoupledOptions,
) -> Result<CoupledSolution, ContactError> {
    let begin = start.or(problem.previous);
    let normal = normal::solve(
        half_space,
        &problem.normal,
        begin.map(|t| t.pressure),
        options.normal,
    )?;
    let step = TangentialProblem {
        patch: problem.normal.patch,
        limit: &limit(problem, &normal.pressure),
        previous: problem.previous.map(|t| t.shear),
        drive: problem.drive,
        rotation: problem.rotation,
        offset: None,
    };
    let tangential = tangential::solve(
        half_space,
        &step,
        start.map(|t| t.shear),
        options.tangential,
    )?;
    Ok(CoupledSolution { normal, tangential })
}

/// Normal and tangential solves in turn until the joint conditions hold.
fn alternate(
    half_space: &mut HalfSpace,
    problem: &CoupledProblem,
    start: Option<Tractions>,
    options: CoupledOptions,
) -> Result<CoupledSolution, ContactError> {
    let cells = problem.normal.patch.grid.len();
    let tolerance = options.normal.tolerance;
    let begin = start.or(problem.previous);
    let mut pressure = begin.map(|t| t.pressure.to_vec());
    let mut shear = begin.map(|t| t.shear.clone());
    // The normal displacement that the normal problem is solved with, and the one that its shear brings about.
    let mut assumed = vec![0.0; cells];
    let mut caused = vec![0.0; cells];
    if let Some(shear) = &shear {
        half_space.normal_of_shear(shear, &mut assumed);
    }
    let mut height = vec![0.0; cells];
    let mut change = vec![0.0; cells];
    let mut offset = vec![vec![0.0; cells]; problem.drive.len()];
    let mut mixing = Mixing::default();
    let mut counts = [0; 3];
    let mut error = f64::INFINITY;
    let mut least_gap = options.tangential.tolerance;
    for _ in 0..options.max_rounds {
        for (c, h) in height.iter_mut().enumerate() {
            *h = problem.normal.height[c] - assumed[c];
        }
        let inner = NormalOptions {
            tolerance: (INNER_REDUCTION * error).clamp(0.5 * tolerance, FIRST_TOLERANCE),
            ..options.normal
        };
        let step = NormalProblem {
            height: &height,
            ..problem.normal
        };
        let mut normal = normal::solve(half_space, &step, pressure.as_deref(), inner)?;

        change.copy_from_slice(&normal.pressure);
        if let Some(previous) = problem.previous {
            for (c, p) in change.iter_mut().zip(previous.pressure) {
                *c -= p;
            }
        }
        half_space.shear_of_normal(&change, &mut offset);
        for field in &mut offset {
            field.iter_mut().for_each(|w| *w = -*w);
        }
        let step = TangentialProblem {
            patch: problem.normal.patch,
            limit: &limit(problem, &normal.pressure),
            previous: problem.previous.map(|t| t.shear),
            drive: problem.drive,
            rotation: problem.rotation,
            offset: Some(&offset),
        };
        if let (Some(shear), Some(pressure)) = (&mut shear, &pressure) {
            stay_at_limit(
                shear,
                problem.friction_coefficient,
                pressure,
                &normal.pressure,
            );
        }
        let mut tangential = friction(half_space, &step, shear.as_ref(), least_gap, options)?;

        half_space.normal_of_shear(&tangential.shear, &mut caused);
        for (c, (a, b)) in change.iter_mut().zip(caused.iter().zip(&assumed)) {
            *c = a - b;
        }
        let before = error;
        error = joint_error(half_space, problem, &mut normal, &change);
        if error > SETTLING * before {
            least_gap = (TIGHTER * least_gap).max(LEAST_GAP);
        }
        let spent = [normal.iterations, tangential.steps, tangential.iterations];
        for (count, spent) in counts.iter_mut().zip(spent) {
            *count += spent;
        }
        if error <= tolerance {
            [normal.iterations, tangential.steps, tangential.iterations] = counts;
            return Ok(CoupledSolution { normal, tangential });
        }
        mixing.next(&mut assumed, &change, |c| normal.pressure[c] > 0.0);
        pressure = Some(normal.pressure);
        shear = Some(tangential.shear);
    }
    Err(ContactError::NotConverged {
        problem: "coupled",
        iterations: options.max_rounds,
        error,
        tolerance,
    })
}

/// Moves shear that is at its limit along with the limit: left below it, slipping cells would begin as sticking ones.
fn stay_at_limit(shear: &mut ByAxis<Vec<f64>>, friction: f64, old: &[f64], new: &[f64]) {
    for c in 0..old.len() {
        let size = shear.iter().map(|q| q[c] * q[c]).sum::<f64>().sqrt();
        if old[c] > 0.0 && size >= AT_LIMIT * friction * old[c] {
            for field in shear.iter_mut() {
                field[c] *= new[c] / old[c];
            }
        }
    }
}

/// The tangential solve of a round: to its tolerance, then on to a smaller one if the rounds ask for it. A duality gap is of
/// second order in the shear, so that shears of one gap still scatter by its root, and the rounds might never settle.
fn friction(
    half_space: &mut HalfSpace,
    step: &TangentialProblem,
    start: Option<&ByAxis<Vec<f64>>>,
    tolerance: f64,
    options: CoupledOptions,
) -> Result<TangentialSolution, ContactError> {
    let options = options.tangential;
    let first = match tangential::solve(half_space, step, start, options) {
        // The last round's shear saves steps, but is no better a start than the step's own.
        Err(ContactError::NotConverged { .. }) if start.is_some() => {
            tangential::solve(half_space, step, None, options)?
        }
        found => found?,
    };
    if first.error <= tolerance {
        return Ok(first);
    }
    let further = TangentialOptions {
        tolerance,
        max_steps: options.max_steps.min(FURTHER_STEPS),
        ..options
    };
    // Not to get there is no failure: what was asked for is there.
    Ok(
        match tangential::solve(half_space, step, Some(&first.shear), further) {
            Ok(second) => TangentialSolution {
                steps: first.steps + second.steps,
                iterations: first.iterations + second.iterations,
                ..second
            },
            Err(_) => first,
        },
    )
}

/// Adds the change of normal displacement to the gap and returns the largest violation of the normal conditions at the
/// unchanged rigid motion, in the measure of [`NormalSolution::error`], which it sets too.
fn joint_error(
    half_space: &HalfSpace,
    problem: &CoupledProblem,
    normal: &mut NormalSolution,
    change: &[f64],
) -> f64 {
    let cap = problem.normal.pressure_cap.unwrap_or(f64::INFINITY);
    let (mut worst, mut peak, mut moved) = (0.0f64, 0.0f64, false);
    for (c, p) in normal.pressure.iter().enumerate() {
        if !problem.normal.patch.kept[c] {
            continue;
        }
        normal.gap[c] += change[c];
        let gap = normal.gap[c];
        worst = worst.max(match *p {
            0.0 => -gap,
            p if p >= cap => gap,
            _ => gap.abs(),
        });
        peak = peak.max(*p);
        moved |= change[c] != 0.0;
    }
    // Without a load the approach is that of the highest point, which has moved.
    normal.error = match (peak > 0.0, moved) {
        (true, _) => worst / (half_space.self_compliance() * peak),
        (false, true) => f64::INFINITY,
        (false, false) => 0.0,
    };
    normal.error
}
