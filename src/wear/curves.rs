//! The curves behind kn and kt.

use crate::contact::ContactError;
use crate::contact::normal::NormalSolution;
use crate::contact::tangential::TangentialOptions;
use crate::grid::ByAxis;
use crate::wear::cycle::{CycleSolution, March};
use crate::wear::{FrettingJoint, WearError};

/// Loads of the indentation curve below the static load, in parts of it, from there down, and the one above.
const BELOW: [f64; 5] = [0.75, 0.5, 0.25, 0.125, 0.0];
const ABOVE: f64 = 1.25;

/// Points of a branch of the hysteresis loop.
const BRANCH: usize = 8;

/// Relative duality gap of the points between the ends of a loop: their force is in error by some thousandths of the largest. The
/// ends are as exact as the cycle.
const INNER: f64 = 1e-2;

/// Load against displacement, point by point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Normal load or tangential force \[N\].
    pub load: Vec<f64>,
    /// Approach or tangential displacement \[m\].
    pub displacement: Vec<f64>,
}

impl Curve {
    /// Adds a point at the end.
    pub fn push(&mut self, load: f64, displacement: f64) {
        self.load.push(load);
        self.displacement.push(displacement);
    }
}

/// Normal load over approach about the static contact under `load`. Loads that a pressure cap does not carry are left out, and
/// those too small to have the moments that the joint bears. From no load on, the load rises.
///
/// # Errors
/// [`WearError::Contact`].
pub fn indentation(
    joint: &mut FrettingJoint,
    wear: &[f64],
    load: f64,
    at_load: &NormalSolution,
) -> Result<Curve, WearError> {
    let capacity = joint
        .pressure_cap
        .map_or(f64::INFINITY, |cap| cap * joint.patch.area());
    let mut at = |part: f64, start: &[f64]| {
        if part * load > capacity {
            return Ok(None);
        }
        // Bodies without loads touch wherever they are.
        let own = joint.pressing.take_if(|_| part == 0.0);
        joint.pressing.iter_mut().for_each(|of| of.part = part);
        let contact = joint.contact(wear, None, part * load, Some(start));
        joint.pressing = joint.pressing.take().or(own);
        joint.pressing.iter_mut().for_each(|of| of.part = 1.0);
        match contact {
            Ok(contact) => {
                let is_free = joint.pressing.is_none();
                let load = if is_free { part * load } else { contact.load };
                Ok(Some((load, contact)))
            }
            Err(WearError::Contact(ContactError::MomentNotCarried { .. })) => Ok(None),
            Err(error) => Err(error),
        }
    };
    let mut points = vec![(load, at_load.approach)];
    // Each from the one above: the nearest there is.
    let mut pressure = at_load.pressure.clone();
    for part in BELOW {
        if let Some((load, contact)) = at(part, &pressure)? {
            points.push((load, contact.approach));
            pressure = contact.pressure;
        }
    }
    points.reverse();
    let above = at(ABOVE, &at_load.pressure)?;
    points.extend(above.map(|(load, contact)| (load, contact.approach)));
    let mut curve = Curve::default();
    for (load, approach) in points {
        curve.push(load, approach);
    }
    Ok(curve)
}

/// Tangential force along x over displacement along x. The loop of a straight motion is twice its first loading, turned
/// about the reversals (Masing); otherwise the instants of the cycle are the loop.
///
/// # Errors
/// [`WearError::Contact`].
pub fn hysteresis(
    joint: &mut FrettingJoint,
    contact: &NormalSolution,
    cycle: &CycleSolution,
) -> Result<Curve, WearError> {
    let mut curve = Curve::default();
    let Some(motion) = joint
        .motion
        .straight()
        .filter(|_| joint.march != March::Stepped)
    else {
        for instant in &cycle.instants {
            curve.push(instant.force[0], instant.displacement[0]);
        }
        return Ok(curve);
    };
    let limit = joint.limit(&contact.pressure);
    let mut first = Vec::with_capacity(BRANCH + 1);
    first.push((0.0, 0.0));
    // From the shear of the last point, what sticks goes on along the line through the last two; before there are two, towards the
    // end of the motion.
    let mut start: ByAxis<Vec<f64>> = beyond(&cycle.shear, None, 1.0 / BRANCH as f64 - 1.0);
    let mut last: Option<ByAxis<Vec<f64>>> = None;
    let zero = vec![0.0; motion.end.len()];
    let exact = joint.options.tangential;
    let inner = TangentialOptions {
        tolerance: exact.tolerance.max(INNER),
        ..exact
    };
    for point in 1..=BRANCH {
        let part = point as f64 / BRANCH as f64;
        let place: Vec<f64> = motion.end.iter().map(|d| part * d).collect();
        // The end is a point of the cycle, and its shear most often what that starts from.
        let (options, from) = if point == BRANCH {
            (exact, &cycle.shear)
        } else {
            (inner, &start)
        };
        let step = joint.step_within(options, &limit, None, [&zero, &place], Some(from))?;
        first.push((step.force[0], step.displacement[0]));
        start = beyond(&step.shear, last.as_ref(), 1.0);
        last = Some(step.shear);
    }
    let (top_force, top) = first[BRANCH];
    for sign in [1.0, -1.0] {
        for (force, displacement) in &first {
            curve.push(
                sign * (top_force - 2.0 * force),
                sign * (top - 2.0 * displacement),
            );
        }
    }
    Ok(curve)
}

/// `shear` + `part` (`shear` − `before`), with zero where there is nothing before: one field an axis.
fn beyond(
    shear: &ByAxis<Vec<f64>>,
    before: Option<&ByAxis<Vec<f64>>>,
    part: f64,
) -> ByAxis<Vec<f64>> {
    let fields = shear.iter().enumerate();
    let field = |(axis, shear): (usize, &Vec<f64>)| {
        let before = |c: usize| before.map_or(0.0, |before| before[axis][c]);
        let cells = shear.iter().enumerate();
        cells.map(|(c, q)| q + part * (q - before(c))).collect()
    };
    fields.map(field).collect()
}
