//! `title`, `[joint]` and `[material]`

use super::Default::{Absent, Required, Rule};
use super::keys;
use super::value::{Counts, List, POISSON, POSITIVE, Quantity, XY};
use super::word::{FilePath, Text};
use crate::units::Dimension;

/// More cells a side would need fields of several GiB each once they are padded for convolution.
const LARGEST_GRID: u64 = 16_384;

/// More contact elements a side than any structure is meshed with: a slip of the keyboard.
const LARGEST_ELEMENTS: u64 = 999;

/// It belongs to a file, and not to the scene that a file and its base are.
pub mod file {
    use super::*;

    keys! {
        /// The scene file that this one begins from: it has only the keys that differ. Not with --set.
        BASE: FilePath = "base", Absent, FilePath("other.toml");
    }
}

keys! {
    section "": "The scene as a whole.";
    section "joint": "Size, grid and contact elements of the joint. An oscillator has none.";
    section "joint.hole": "A round hole in the middle of the joint: its cells carry nothing.";
    section "material": "The elastic bodies. An oscillator has none.";
    section "material.lower": "The body below the joint, where it differs from the other one.";
    section "material.upper": "The body above the joint, where it differs from the other one.";

    /// What the scene is called in reports.
    TITLE: Text = "title", Absent, Text("Lap joint, Rq 5 um");
    /// Side lengths of the joint along x and y. Of a resonator: length of the lap, and height of its arms.
    SIZE: List<2> = "joint.size", Required, List(XY, Quantity(Dimension::LENGTH, POSITIVE, r#"["40 mm", "30 mm"]"#), None);
    /// Cells of the rough contact along x and y. A resonator needs at least one for each contact element.
    GRID: Counts = "joint.grid", Rule("must be given where there is a [surface]"), Counts(LARGEST_GRID, "[256, 192]");
    /// Contact elements of the structure along x and y. Of a resonator an odd number, at least 9, as many along x as along y.
    ELEMENTS: Counts = "joint.elements", Rule("[19, 19] for a resonator, else none"), Counts(LARGEST_ELEMENTS, "[19, 19]");
    /// Diameter of the hole. That of a resonator is made of contact elements, and may only be confirmed here.
    HOLE_DIAMETER: Quantity = "joint.hole.diameter", Required, Quantity(Dimension::LENGTH, POSITIVE, "11 mm");
    /// Young's modulus of both bodies.
    YOUNGS_MODULUS: Quantity = "material.youngs_modulus", Rule("must be given, or for both bodies"), MODULUS;
    /// Poisson's ratio of both bodies.
    POISSON_RATIO: Quantity = "material.poisson_ratio", Rule("must be given, or for both bodies"), RATIO;
    /// Density of both bodies.
    DENSITY: Quantity = "material.density", Rule("must be given for a resonator, else none"), MASS;
    /// Young's modulus of the lower body.
    LOWER_YOUNGS_MODULUS: Quantity = "material.lower.youngs_modulus", Rule("material.youngs_modulus"), MODULUS;
    /// Poisson's ratio of the lower body.
    LOWER_POISSON_RATIO: Quantity = "material.lower.poisson_ratio", Rule("material.poisson_ratio"), RATIO;
    /// Density of the lower body.
    LOWER_DENSITY: Quantity = "material.lower.density", Rule("material.density"), MASS;
    /// Young's modulus of the upper body.
    UPPER_YOUNGS_MODULUS: Quantity = "material.upper.youngs_modulus", Rule("material.youngs_modulus"), MODULUS;
    /// Poisson's ratio of the upper body.
    UPPER_POISSON_RATIO: Quantity = "material.upper.poisson_ratio", Rule("material.poisson_ratio"), RATIO;
    /// Density of the upper body.
    UPPER_DENSITY: Quantity = "material.upper.density", Rule("material.density"), MASS;
}

const MODULUS: Quantity = Quantity(Dimension::PRESSURE, POSITIVE, "198.4 GPa");
const RATIO: Quantity = Quantity(Dimension::NONE, POISSON, "0.3");
const MASS: Quantity = Quantity(Dimension::DENSITY, POSITIVE, "7949 kg/m^3");
