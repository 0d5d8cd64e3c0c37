//! Elastic compliance of a bolt and of the parts that it clamps, by VDI 2230-1:2015, 5.1.
//!
//! ```
//! use fretwear::model_update::{BoltHead, BoltedJoint, Clamping};
//!
//! // M10 through two plates of 20 mm; 20 mm of the clamped length are shank.
//! let joint = BoltedJoint {
//!     diameter: 10e-3,
//!     core_diameter: 8.16e-3,
//!     clamp_length: 40e-3,
//!     shank_length: 20e-3,
//!     bearing_diameter: 14.6e-3,
//!     hole_diameter: 11e-3,
//!     outer_diameter: 40e-3,
//!     bolt_modulus: 205e9,
//!     plate_modulus: 205e9,
//!     head: BoltHead::Hexagon,
//!     clamping: Clamping::Through,
//! };
//! let (bolt, plates) = (joint.bolt(), joint.plates()?);
//! assert!(bolt > plates);
//! # Ok::<(), fretwear::model_update::ModelUpdateError>(())
//! ```

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::ModelUpdateError;

/// Head of a bolt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BoltHead {
    /// Hexagon head.
    Hexagon,
    /// Cylinder head with a socket.
    Cylinder,
}

/// End of a bolt opposite to its head.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clamping {
    /// Nut: the pressure cones widen from both ends.
    Through,
    /// Tapped thread in a part: the pressure cone widens from the head alone.
    Tapped,
}

/// Two parts that one bolt clamps together, with the bolt in the middle of the joint. Lengths are in m, moduli in Pa.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoltedJoint {
    /// Nominal diameter d.
    pub diameter: f64,
    /// Core diameter of the thread, d₃.
    pub core_diameter: f64,
    /// Clamped length l_K.
    pub clamp_length: f64,
    /// Length of the shank with the nominal diameter; the rest of the clamped length is thread.
    pub shank_length: f64,
    /// Outer diameter of the bearing face under the head or the nut, d_W.
    pub bearing_diameter: f64,
    /// Diameter of the hole, d_h.
    pub hole_diameter: f64,
    /// Outer diameter of the clamped parts, D_A. If the clamped parts are not round, D_A is the diameter of the largest
    /// circle about the bolt within the parts.
    pub outer_diameter: f64,
    /// Young's modulus of the bolt and the nut.
    pub bolt_modulus: f64,
    /// Young's modulus of the clamped parts and of the tapped part.
    pub plate_modulus: f64,
    /// Head of the bolt.
    pub head: BoltHead,
    /// End of the bolt.
    pub clamping: Clamping,
}

impl BoltedJoint {
    /// Computes the compliance of the bolt δ_S \[m/N\] [VDI 2230-1, 5.1.1]. The compliance is the sum over head, shank,
    /// free thread, engaged thread, and nut or tapped part.
    pub fn bolt(&self) -> f64 {
        let d = self.diameter;
        let area = |diameter: f64| PI / 4.0 * diameter * diameter;
        let (nominal, core) = (area(d), area(self.core_diameter));
        let head = match self.head {
            BoltHead::Hexagon => 0.5 * d,
            BoltHead::Cylinder => 0.4 * d,
        };
        let thread = self.clamp_length - self.shank_length + 0.5 * d;
        let length_over_area = (head + self.shank_length) / nominal + thread / core;
        let end_compliance = match self.clamping {
            Clamping::Through => 0.4 * d / (nominal * self.bolt_modulus),
            Clamping::Tapped => 0.33 * d / (nominal * self.plate_modulus),
        };
        length_over_area / self.bolt_modulus + end_compliance
    }

    /// Computes the compliance of the clamped parts δ_P \[m/N\] [VDI 2230-1, 5.1.2]. A cone widens from each end with a
    /// head or nut up to the width of the parts. A sleeve follows beyond.
    ///
    /// # Errors
    /// Returns [`ModelUpdateError::OutOfRange`] for lengths that do not fit together.
    pub fn plates(&self) -> Result<f64, ModelUpdateError> {
        self.check()?;
        let &BoltedJoint {
            clamp_length: l,
            bearing_diameter: w,
            hole_diameter: h,
            outer_diameter: a,
            ..
        } = self;
        let sleeve = |length: f64| 4.0 * length / (PI * (a * a - h * h));
        if w >= a {
            return Ok(sleeve(l) / self.plate_modulus);
        }
        // Cones from both ends meet in the middle; a single cone from the head reaches through.
        let (length, width) = (l / w, a / w);
        let (ends, slope) = match self.clamping {
            Clamping::Through => {
                let slope = 0.362 + 0.032 * (length / 2.0).ln() + 0.153 * width.ln();
                (1.0, slope)
            }
            Clamping::Tapped => (2.0, 0.348 + 0.013 * length.ln() + 0.193 * width.ln()),
        };
        // The fit of the slope is not valid for very short joints.
        if slope <= 0.0 {
            return out_of_range("clamp_length", l, "long enough for pressure cones");
        }
        let unbounded_width = w + ends * l * slope;
        let widest = a.min(unbounded_width);
        let cones = (((w + h) * (widest - h)) / ((w - h) * (widest + h))).ln();
        let cones = 2.0 * cones / (ends * PI * h * slope);
        let sleeve_part = match widest < unbounded_width {
            true => sleeve(l - (a - w) / (ends * slope)),
            false => 0.0,
        };
        Ok((cones + sleeve_part) / self.plate_modulus)
    }

    fn check(&self) -> Result<(), ModelUpdateError> {
        let positive = [
            ("diameter", self.diameter),
            ("core_diameter", self.core_diameter),
            ("clamp_length", self.clamp_length),
            ("bearing_diameter", self.bearing_diameter),
            ("hole", self.hole_diameter),
            ("outer_diameter", self.outer_diameter),
            ("modulus", self.bolt_modulus),
        ];
        for (key, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return out_of_range(key, value, "positive and finite");
            }
        }
        if !(0.0..=self.clamp_length).contains(&self.shank_length) {
            return out_of_range("shank_length", self.shank_length, "0 to clamp_length");
        }
        let slenderness = self.clamp_length / self.diameter;
        if !(0.05..=100.0).contains(&slenderness) {
            let expected = "0.05 to 100 diameters of the bolt (is the unit mm, cm or m?)";
            return out_of_range("clamp_length", self.clamp_length, expected);
        }
        if self.core_diameter < 0.5 * self.diameter {
            let expected = "at least half of the diameter";
            return out_of_range("core_diameter", self.core_diameter, expected);
        }
        if self.bearing_diameter > 6.0 * self.diameter {
            let expected = "at most six diameters of the bolt (is the unit mm, cm or m?)";
            return out_of_range("bearing_diameter", self.bearing_diameter, expected);
        }
        if self.outer_diameter > 1000.0 * self.diameter {
            let expected = "at most a thousand diameters of the bolt (is the unit mm, cm or m?)";
            return out_of_range("outer_diameter", self.outer_diameter, expected);
        }
        if !(0.02..=50.0).contains(&(self.bolt_modulus / self.plate_modulus)) {
            let expected =
                "0.02 to 50 times the modulus of the clamped parts (is the unit GPa or MPa?)";
            return out_of_range("modulus", self.bolt_modulus, expected);
        }
        if self.core_diameter >= self.diameter {
            return out_of_range(
                "core_diameter",
                self.core_diameter,
                "less than the diameter",
            );
        }
        if self.hole_diameter < self.diameter {
            return out_of_range("hole", self.hole_diameter, "at least as wide as the bolt");
        }
        if self.bearing_diameter <= self.hole_diameter {
            let expected = "wider than the hole";
            return out_of_range("bearing_diameter", self.bearing_diameter, expected);
        }
        if self.outer_diameter <= self.hole_diameter {
            let expected = "wider than the hole";
            return out_of_range("outer_diameter", self.outer_diameter, expected);
        }
        Ok(())
    }
}

/// Pitches of coarse metric threads \[mm\] by nominal diameter \[mm\] (ISO 261).
const COARSE: [(f64, f64); 24] = [
    (3.0, 0.5),
    (4.0, 0.7),
    (5.0, 0.8),
    (6.0, 1.0),
    (8.0, 1.25),
    (10.0, 1.5),
    (12.0, 1.75),
    (14.0, 2.0),
    (16.0, 2.0),
    (18.0, 2.5),
    (20.0, 2.5),
    (22.0, 2.5),
    (24.0, 3.0),
    (27.0, 3.0),
    (30.0, 3.5),
    (33.0, 3.5),
    (36.0, 4.0),
    (39.0, 4.0),
    (42.0, 4.5),
    (48.0, 5.0),
    (52.0, 5.0),
    (56.0, 5.5),
    (60.0, 5.5),
    (64.0, 6.0),
];

/// Returns nominal and core diameter \[m\] of a metric thread: `M10` or, with its pitch in mm, `M10x1.25`. The core
/// diameter is d₃ = d − 1.22687 P (ISO 724). Returns `None` for any other text.
pub fn metric_thread(size: &str) -> Option<[f64; 2]> {
    let numbers = size.trim().strip_prefix(['M', 'm'])?;
    let numbers = numbers.replace(['X', '\u{d7}'], "x");
    let (diameter, pitch) = match numbers.split_once('x') {
        Some((diameter, pitch)) => {
            let diameter: f64 = diameter.trim().parse().ok()?;
            (diameter, pitch.trim().parse().ok()?)
        }
        None => {
            let diameter: f64 = numbers.trim().parse().ok()?;
            let coarse = COARSE.iter().find(|(d, _)| *d == diameter)?;
            (diameter, coarse.1)
        }
    };
    let core = diameter - 1.226_87 * pitch;
    (pitch > 0.0 && core > 0.0 && diameter.is_finite()).then_some([1e-3 * diameter, 1e-3 * core])
}

fn out_of_range<T>(
    key: &'static str,
    value: f64,
    expected: &'static str,
) -> Result<T, ModelUpdateError> {
    Err(ModelUpdateError::OutOfRange {
        name: key,
        value,
        expected,
    })
}
