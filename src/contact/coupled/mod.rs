//! Contact with friction of bodies that differ elastically (Dundurs β ≠ 0). Pressure then causes tangential
//! displacement, and shear causes normal displacement.
//!
//! In a step, the bodies move normally and tangentially. Let p₀ and q₀ be the tractions before the step. Find the
//! pressure p and the shear q that satisfy the normal conditions (see [`super::normal`]) for the gap
//!
//! g = K_zz p + K_zt q + D p − h − (the rigid normal motion)
//!
//! and Coulomb's law (see [`super::tangential`]) with |q| ≤ µp for the slip
//!
//! s = (the rigid tangential motion) − K_tt (q − q₀) − K_tz (p − p₀), K_tz = K_ztᵀ.
//!
//! The rigid motions are controlled as in the modules of normal and tangential contact.
//!
//! With a given shear, the normal problem is convex. With a given pressure, the tangential problem is convex. The
//! solver alternates between the two problems (Panagiotopoulos 1975). The normal problem has the heights h − K_zt q.
//! The tangential problem has the offset −K_tz (p − p₀). The solver iterates on the normal displacement K_zt q. The
//! next iterate is mixed from the last few iterates, so that the changes of the iterates cancel best (Anderson 1965).
//! Without mixing, the change of the tractions in a round is about βµ times the change in the round before. If all
//! cells stick, the change is β² times the change in the round before.
//!
//! The certificate of the result includes both problems: the gap with the latest shear, and the duality gap of friction
//! with the latest pressure. The gap and the duality gap do not depend on the mixing of the iterates. For large βµ
//! there may be several solutions or no solution. For large βµ the iteration may fail with
//! [`ContactError::NotConverged`].
//!
//! The history of the pressure matters. If a point closes during a step, the solver treats the point as in contact
//! during the whole step. The friction limit of the point is the limit at the end of the step. Because the history
//! matters, [`indent`] raises loads in steps. The finite number of steps causes an error of first order.
//!
//! [`super::stiffness::coupled`] computes the stiffness of the whole K.

mod mixing;

use super::error::{ContactError, check_field, check_length};
use super::half_space::{HalfSpace, Shear};
use super::normal::{self, Control, NormalOptions, NormalProblem, NormalSolution};
use super::tangential::{self, Drive, TangentialOptions, TangentialProblem, TangentialSolution};
use crate::grid::ByAxis;
use mixing::Mixing;

/// Tolerance of the first normal solve. A tighter tolerance is useless, because the shear of the first round changes
/// the solution by more.
const FIRST_TOLERANCE: f64 = 1e-3;

/// Tolerance of a normal solve, as a fraction of the joint error of the round before.
const INNER_REDUCTION: f64 = 0.05;

/// Fraction of the joint error that a round may leave. If a round leaves more, the friction solve was not accurate
/// enough.
const SLOW_REDUCTION: f64 = 0.2;

/// Factor that reduces the tolerance of the duality gap after a round with an inaccurate friction solve.
const TOLERANCE_REDUCTION: f64 = 0.01;

/// Smallest tolerance of the duality gap: the rounding of its sums.
const LEAST_GAP: f64 = 1e-10;

/// Fraction of the friction limit from which a shear counts as at the limit.
const AT_LIMIT: f64 = 1.0 - 1e-9;

/// Largest number of Newton steps towards a tightened gap. The solver converges in a few Newton steps or not at all.
const TIGHTENED_MAX_STEPS: usize = 20;

/// Tractions on the contact plane.
#[derive(Debug, Clone, Copy)]
pub struct Tractions<'a> {
    /// Pressure \[Pa\].
    pub pressure: &'a [f64],
    /// Shear, one field per axis \[Pa\].
    pub shear: &'a ByAxis<Vec<f64>>,
}

/// One step of the coupled contact.
#[derive(Debug, Clone, Copy)]
pub struct CoupledProblem<'a> {
    /// Normal problem at the end of the step.
    pub normal: NormalProblem<'a>,
    /// Coulomb's friction coefficient µ ≥ 0.
    pub friction_coefficient: f64,
    /// Tractions p₀ and q₀ before the step; `None` for bodies that did not touch.
    pub previous: Option<Tractions<'a>>,
    /// Motion of the upper body against the lower body during the step, one entry per axis (x, or x and y).
    pub drive: &'a ByAxis<Drive>,
    /// Rotation of the upper body against the lower about z through the grid's centre; `None` for no rotation. Needs
    /// both axes.
    pub rotation: Option<Drive>,
}

/// Stopping criteria of a coupled step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoupledOptions {
    /// Options of the normal solves. The tolerance applies to the normal conditions of both bodies together. The
    /// bound on iterations applies to each normal solve.
    pub normal: NormalOptions,
    /// Options of the tangential solves, and so of the joint tangential conditions.
    pub tangential: TangentialOptions,
    /// Bound on rounds. Each round has a normal and a tangential solve.
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

/// Converged step.
#[derive(Debug, Clone, PartialEq)]
pub struct CoupledSolution {
    /// Pressure, gap and approach. Gap and error belong to the joint conditions; the counts are sums over the rounds.
    pub normal: NormalSolution,
    /// Shear and slip. The counts are sums over the rounds.
    pub tangential: TangentialSolution,
}

impl CoupledSolution {
    /// Returns the tractions, with which the next step begins.
    pub fn tractions(&self) -> Tractions<'_> {
        Tractions {
            pressure: &self.normal.pressure,
            shear: &self.tangential.shear,
        }
    }
}

/// Solves one step. `start` is an initial guess of the tractions and affects speed only. If `start` is `None`, the
/// solver begins with `previous`.
///
/// Uncoupled bodies take one normal and one tangential solve, exactly as in [`super::normal`] and
/// [`super::tangential`].
pub fn solve(
    half_space: &mut HalfSpace,
    problem: &CoupledProblem,
    start: Option<Tractions>,
    options: CoupledOptions,
) -> Result<CoupledSolution, ContactError> {
    check(problem, start)?;
    if half_space.pair().is_coupled() {
        // The solvers check the length of the half space, but the coupling is applied before they run.
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

/// Presses the bodies together without a tangential motion, from no contact through the given loads in turn \[N\]. Any
/// slip arises because the bodies differ. `problem.control` is ignored. `on_solution` receives the solution of each
/// load.
pub fn indent(
    half_space: &mut HalfSpace,
    problem: &NormalProblem,
    friction_coefficient: f64,
    shear: Shear,
    loads: &[f64],
    options: CoupledOptions,
    mut on_solution: impl FnMut(&CoupledSolution),
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
        on_solution(&solution);
        last = Some(solution);
    }
    last.ok_or(ContactError::OutOfRange {
        name: "number of load steps",
        value: 0.0,
        expected: "at least 1",
    })
}

/// Checks the input that the normal and the tangential solver do not check.
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
                expected: "the number of axes of the drive",
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

/// Alternates normal and tangential solves until the joint error is within the tolerance.
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
    // The normal problem assumes a normal displacement. The resulting shear causes another normal displacement. The
    // solver iterates until the two displacements agree.
    let mut assumed_displacement = vec![0.0; cells];
    let mut caused_displacement = vec![0.0; cells];
    if let Some(shear) = &shear {
        half_space.normal_of_shear(shear, &mut assumed_displacement);
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
            *h = problem.normal.height[c] - assumed_displacement[c];
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
        let mut tangential = solve_friction(half_space, &step, shear.as_ref(), least_gap, options)?;

        half_space.normal_of_shear(&tangential.shear, &mut caused_displacement);
        for (c, (a, b)) in change
            .iter_mut()
            .zip(caused_displacement.iter().zip(&assumed_displacement))
        {
            *c = a - b;
        }
        let before = error;
        error = joint_error(half_space, problem, &mut normal, &change);
        if error > SLOW_REDUCTION * before {
            least_gap = (TOLERANCE_REDUCTION * least_gap).max(LEAST_GAP);
        }
        let spent = [normal.iterations, tangential.steps, tangential.iterations];
        for (count, spent) in counts.iter_mut().zip(spent) {
            *count += spent;
        }
        if error <= tolerance {
            [normal.iterations, tangential.steps, tangential.iterations] = counts;
            return Ok(CoupledSolution { normal, tangential });
        }
        mixing.advance(&mut assumed_displacement, &change, |c| {
            normal.pressure[c] > 0.0
        });
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

/// Scales shear at the friction limit along with the limit. If the shear did not change with the limit, slipping cells
/// would begin the next solve as sticking cells.
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

/// Solves the tangential problem of a round to the tolerance in `options`, and further if `tolerance` is smaller. The
/// duality gap is of second order in the shear. Shears of equal duality gap scatter by the root of the gap. With a
/// constant tolerance, the rounds might never converge.
fn solve_friction(
    half_space: &mut HalfSpace,
    step: &TangentialProblem,
    start: Option<&ByAxis<Vec<f64>>>,
    tolerance: f64,
    options: CoupledOptions,
) -> Result<TangentialSolution, ContactError> {
    let options = options.tangential;
    let first = match tangential::solve(half_space, step, start, options) {
        // The shear of the last round saves steps. If the solve from the last shear fails, a solve from the default
        // start may still converge.
        Err(ContactError::NotConverged { .. }) if start.is_some() => {
            tangential::solve(half_space, step, None, options)?
        }
        result => result?,
    };
    if first.error <= tolerance {
        return Ok(first);
    }
    let tighter = TangentialOptions {
        tolerance,
        max_steps: options.max_steps.min(TIGHTENED_MAX_STEPS),
        ..options
    };
    // Failing to reach the smaller tolerance is not an error: the first solution meets the requested one.
    Ok(
        match tangential::solve(half_space, step, Some(&first.shear), tighter) {
            Ok(second) => TangentialSolution {
                steps: first.steps + second.steps,
                iterations: first.iterations + second.iterations,
                ..second
            },
            Err(_) => first,
        },
    )
}

/// Adds the change of normal displacement to the gap. Sets [`NormalSolution::error`] to the largest violation of the
/// normal conditions at the unchanged rigid motion, and returns it.
fn joint_error(
    half_space: &HalfSpace,
    problem: &CoupledProblem,
    normal: &mut NormalSolution,
    change: &[f64],
) -> f64 {
    let cap = problem.normal.pressure_cap.unwrap_or(f64::INFINITY);
    let (mut worst, mut peak, mut moved) = (0.0f64, 0.0f64, false);
    for (c, p) in normal.pressure.iter().enumerate() {
        if !problem.normal.patch.is_in_joint[c] {
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
    // Without a load, the highest point determines the approach, and that point has moved.
    normal.error = match (peak > 0.0, moved) {
        (true, _) => worst / (half_space.self_compliance() * peak),
        (false, true) => f64::INFINITY,
        (false, false) => 0.0,
    };
    normal.error
}
