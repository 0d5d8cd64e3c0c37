//! Transform pairs of the solves that a run is made of.
//!
//! Conjugate gradients with a preconditioner: their number grows slowly, as powers of the cells in contact, and with the digits
//! asked for. Exponents and factors are a fit in logarithms to the solves of some 200 runs of random scenes (see
//! [`super::before`]); what is left over scatters by 10 % (normal contact and stiffness) to 20 % (shear).

use super::before::Before;
use crate::scene::Fidelity;

/// Pairs = factor · areaᵃ · cellsᵇ · (cells across an asperity)ᶜ · (tolerance/usual)ᵈ, times these where they apply.
struct Law {
    factor: f64,
    area: f64,
    cells: f64,
    across: f64,
    tolerance: f64,
    periodic: f64,
    capped: f64,
    /// Of a contact in one piece: a sphere's, or that of flats.
    smooth: f64,
    /// Without the transverse axis.
    along_x: f64,
    /// Powers of the reach of the motion, of what of it is below 1.2 and above.
    reach: [f64; 2],
}

/// From a uniform pressure.
const COLD: Law = Law {
    factor: 12.4,
    area: 0.144,
    cells: 0.092,
    across: 0.018,
    tolerance: -0.028,
    periodic: 1.55,
    capped: 0.91,
    smooth: 0.75,
    along_x: 1.0,
    reach: [0.0; 2],
};
/// All six loads of the indentation curve.
const INDENTATION: Law = Law {
    factor: 44.0,
    area: 0.15,
    cells: 0.081,
    across: 0.012,
    tolerance: -0.051,
    periodic: 1.48,
    capped: 1.14,
    smooth: 0.9,
    along_x: 1.0,
    reach: [0.0; 2],
};
/// kn and kt.
const STIFFNESS: Law = Law {
    factor: 16.4,
    area: 0.187,
    cells: 0.111,
    across: -0.043,
    tolerance: 0.0,
    periodic: 1.46,
    capped: 1.0,
    smooth: 0.58,
    along_x: 0.61,
    reach: [0.0; 2],
};
/// A cycle between reversals, from the shear of the cycle before.
const CYCLE: Law = Law {
    factor: 23.0,
    area: 0.067,
    cells: 0.043,
    across: 0.23,
    tolerance: -0.064,
    periodic: 1.49,
    capped: 0.91,
    smooth: 0.6,
    along_x: 0.3,
    reach: [0.0, -0.546],
};
/// The same with the eight solves of the hysteresis curve.
const CYCLE_AND_CURVE: Law = Law {
    factor: 212.0,
    area: 0.133,
    cells: 0.017,
    across: 0.094,
    tolerance: -0.079,
    periodic: 1.48,
    capped: 0.95,
    smooth: 0.7,
    along_x: 0.379,
    reach: [-0.105, -0.507],
};
/// An implicit step: three normal contacts, and a cycle between reversals in its middle.
const STEP: Law = Law {
    factor: 28.0,
    area: 0.16,
    cells: 0.116,
    across: 0.15,
    tolerance: -0.048,
    periodic: 1.54,
    capped: 1.0,
    smooth: 0.56,
    along_x: 0.707,
    reach: [0.122, -0.088],
};

/// A normal contact from a similar one, over one from a uniform pressure.
const WARM: f64 = 0.65;
/// The static contact after a step that predicts it: a check.
const CHECK: f64 = 1.2;
/// Tries of a step for one that is taken.
const TRIES: f64 = 1.05;
/// A sample of a stepped cycle, until the cycle closes, over a cycle between reversals.
const SAMPLE: f64 = 2.1;
/// The same where half of the samples are marched too, with which the cycle closes.
const SAMPLE_AND_HALF: f64 = 3.1;
/// A superposed cycle: two normal contacts and a check of the shear.
const SUPERPOSED: f64 = 2.2;
/// Part of the stiffness solves that is kn's, over the axes of all.
const TURNING: f64 = 3.5;
/// A load step of bodies that differ elastically, over a cold contact.
const COUPLED: f64 = 4.0;
/// Loads that are tried until the bolt and the contact agree.
const BOLT: f64 = 3.0;

const USUAL_NORMAL: f64 = 1e-6;
const USUAL_TANGENTIAL: f64 = 1e-4;

impl Law {
    fn at(&self, before: &Before, area: f64, in_plane: bool, relative_tolerance: f64) -> f64 {
        let when = |applies: bool, factor: f64| if applies { factor } else { 1.0 };
        let reach = before.reach.max(0.05);
        self.factor
            * area.powf(self.area)
            * before.cells.powf(self.cells)
            * before.across.powf(self.across)
            * relative_tolerance.powf(self.tolerance)
            * when(before.periodic, self.periodic)
            * when(before.capped > 0.0, self.capped)
            * when(before.one_piece(), self.smooth)
            * when(!in_plane, self.along_x)
            * reach.min(1.2).powf(self.reach[0])
            * reach.max(1.2).powf(self.reach[1])
    }
}

/// How a cycle is marched, as far as it costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Marched {
    /// Not at all.
    Not,
    Reversal,
    Superposition,
    /// At so many samples, whose load varies or not.
    Stepped {
        samples: f64,
        varies: bool,
    },
}

/// The solves of a scene.
pub(super) struct Solves<'a> {
    pub before: &'a Before,
    pub fidelity: &'a Fidelity,
    pub in_plane: bool,
    pub marched: Marched,
    /// Whether the bodies turn until their moments are given ones.
    pub turning: bool,
    /// Whether the load is looked for that a bolt has left.
    pub bolt: bool,
    /// Load steps of bodies that differ elastically; none of others.
    pub load_steps: Option<usize>,
}

impl Solves<'_> {
    fn normal(&self, law: &Law, area: f64) -> f64 {
        let tolerance = self.fidelity.normal_tolerance / USUAL_NORMAL;
        law.at(self.before, area, true, tolerance)
    }

    fn tangential(&self, law: &Law, area: f64) -> f64 {
        let tolerance = self.fidelity.tangential_tolerance / USUAL_TANGENTIAL;
        law.at(self.before, area, self.in_plane, tolerance)
    }

    /// The static contact of the unworn joint, and of a worn one after a step that predicts it or not.
    pub fn first(&self) -> f64 {
        let cold = self.normal(&COLD, self.before.area);
        match self.load_steps {
            Some(steps) => COUPLED * cold * steps as f64,
            None => cold * if self.bolt { 1.0 + WARM } else { 1.0 },
        }
    }

    pub fn next(&self, area: f64, predicted: bool) -> f64 {
        let warm = WARM * self.normal(&COLD, area);
        match (self.bolt, predicted) {
            (true, _) => BOLT * (warm + 0.33 * self.stiffness(area)),
            (false, true) => CHECK,
            (false, false) => warm,
        }
    }

    pub fn stiffness(&self, area: f64) -> f64 {
        let both = STIFFNESS.at(self.before, area, self.in_plane, 1.0);
        let axes = if self.in_plane { 3.0 } else { 2.0 };
        let turning = if self.turning {
            1.0 + TURNING / axes
        } else {
            1.0
        };
        both * turning
    }

    pub fn indentation(&self, area: f64) -> f64 {
        if self.load_steps.is_some() {
            return 0.0;
        }
        self.normal(&INDENTATION, area)
    }

    /// A cycle with the curve of force over displacement or without.
    pub fn cycle(&self, area: f64, curve: bool) -> f64 {
        match self.marched {
            Marched::Not => 0.0,
            Marched::Reversal if curve => self.tangential(&CYCLE_AND_CURVE, area),
            Marched::Reversal => self.tangential(&CYCLE, area),
            Marched::Superposition => {
                let own = SUPERPOSED * WARM * self.normal(&COLD, area);
                own + if curve {
                    self.tangential(&CYCLE_AND_CURVE, area)
                } else {
                    0.0
                }
            }
            Marched::Stepped { samples, varies } => {
                let marched = if self.fidelity.cycle_extrapolation {
                    SAMPLE_AND_HALF
                } else {
                    SAMPLE
                };
                let sample = marched * self.tangential(&CYCLE, area)
                    + if varies {
                        WARM * self.normal(&COLD, area)
                    } else {
                        0.0
                    };
                samples * sample
            }
        }
    }

    /// An implicit wear step with the tries that were too long.
    pub fn step(&self, area: f64) -> f64 {
        let plain = self.tangential(&STEP, area);
        let reversal = self.tangential(&CYCLE, area);
        TRIES * (plain - reversal + self.cycle(area, false)).max(0.5 * plain)
    }

    /// A step that is implicit in the pressure alone: one normal contact.
    pub fn single_step(&self, area: f64) -> f64 {
        let normals = self.tangential(&STEP, area) - self.tangential(&CYCLE, area);
        normals / 3.0
    }
}
