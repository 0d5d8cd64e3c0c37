//! Curves that show the stiffnesses kn and kt.

use crate::contact::ContactError;
use crate::contact::normal::NormalSolution;
use crate::contact::tangential::TangentialOptions;
use crate::grid::ByAxis;
use crate::wear::cycle::{CycleSolution, March};
use crate::wear::{FrettingJoint, WearError};

/// Loads of the indentation curve below the static load, as fractions of it in descending order, and the load
/// above it.
const BELOW: [f64; 5] = [0.75, 0.5, 0.25, 0.125, 0.0];
const ABOVE: f64 = 1.25;

/// Points of a branch of the hysteresis loop.
const BRANCH: usize = 8;

/// Relative duality gap of the points between the ends of a loop. The force at a point between the ends has an error of
/// some thousandths of the largest force. The ends of the loop are as exact as the cycle.
const INNER: f64 = 1e-2;

/// Curve of load against displacement.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Normal load or tangential force \[N\].
    pub load: Vec<f64>,
    /// Approach or tangential displacement \[m\].
    pub displacement: Vec<f64>,
}

impl Curve {
    /// Appends a point.
    pub fn push(&mut self, load: f64, displacement: f64) {
        self.load.push(load);
        self.displacement.push(displacement);
    }
}

/// Computes the curve of normal load against approach near the static contact under `load`. The points of the curve are
/// in ascending order of the load. `indentation` skips loads above the capacity of the pressure cap. `indentation` also
/// skips loads that are too small to balance the moments on the joint.
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
        // Without loads, the position of the bodies is free.
        let own = joint.pressing.take_if(|_| part == 0.0);
        joint
            .pressing
            .iter_mut()
            .for_each(|pressing| pressing.load_fraction = part);
        let contact = joint.contact(wear, None, part * load, Some(start));
        joint.pressing = joint.pressing.take().or(own);
        joint
            .pressing
            .iter_mut()
            .for_each(|pressing| pressing.load_fraction = 1.0);
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
    // Start each contact from the next higher load.
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

/// Computes the tangential force over the displacement along x. The loop of a straight motion is twice its
/// first loading, mirrored at the reversals (Masing). For any other motion the instants of the cycle form the loop.
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
    // Extrapolates the shear of sticking cells along the line through the last two points. Before there are
    // two points, the shear of the cycle gives the direction.
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
        // The end is a point of the cycle, and its shear is mostly the shear that the cycle starts from.
        let (options, from) = if point == BRANCH {
            (exact, &cycle.shear)
        } else {
            (inner, &start)
        };
        let step = joint.step_with_options(options, &limit, None, [&zero, &place], Some(from))?;
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

/// Returns `shear` + `part` (`shear` − `before`), with `before` = 0 if `None`: one field per axis.
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
