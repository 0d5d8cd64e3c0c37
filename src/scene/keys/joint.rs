//! `title`, `[joint]` and `[material]`

use super::Default::{Absent, Required, Rule};
use super::keys;
use super::value::{Counts, List, POISSON, POSITIVE, Quantity, XY};
use super::word::{FilePath, Text};
use crate::units::Dimension;

/// Largest number of cells per side. Larger grids would need fields of several GiB each, with padding for convolution.
const LARGEST_GRID: u64 = 16_384;

/// Largest number of contact elements per side. A larger number is probably a typing error.
const LARGEST_ELEMENTS: u64 = 999;

/// Keys of a single scene file. The scene that results from a file and its bases does not contain the keys.
pub mod file {
    use super::*;

    keys! {
        /// Path of the base. The base is another scene file. The scene takes the keys that the scene file omits from
        /// the base. A scene file with a base contains only the keys that differ from the base. The option --set cannot
        /// set the base.
        BASE: FilePath = "base", Absent, FilePath("other.toml");
    }
}

keys! {
    section "": "The scene as a whole.";
    section "joint": "Size, grid and contact elements of the joint. A scene with an oscillator has no [joint].";
    section "joint.hole": "A round hole in the middle of the joint, whose cells carry no load.";
    section "material": "Material of the elastic bodies. A scene with an oscillator has no [material].";
    section "material.lower": "Material of the body below the joint, if the materials of both bodies differ.";
    section "material.upper": "Material of the body above the joint, if the materials of both bodies differ.";

    /// Title of the scene in reports.
    TITLE: Text = "title", Absent, Text("Lap joint, Rq 5 um");
    /// Side lengths of the joint along x and y. For a resonator, the first side length is the length of the lap. The
    /// second side length is the height of the arms.
    SIZE: List<2> = "joint.size", Required, List(XY, Quantity(Dimension::LENGTH, POSITIVE, r#"["40 mm", "30 mm"]"#), None);
    /// Number of cells of the rough contact along x and y. A resonator needs at least one cell per contact element.
    GRID: Counts = "joint.grid", Rule("must be given with a [surface]"), Counts(LARGEST_GRID, "[256, 192]");
    /// Number of contact elements of the structure along x and y. A resonator needs an odd number of contact elements,
    /// at least 9, the same along x and y.
    ELEMENTS: Counts = "joint.elements", Rule("[19, 19] for a resonator, else none"), Counts(LARGEST_ELEMENTS, "[19, 19]");
    /// Diameter of the hole in the joint. For a resonator, the contact elements determine the hole, and a given
    /// diameter must agree with that hole.
    HOLE_DIAMETER: Quantity = "joint.hole.diameter", Required, Quantity(Dimension::LENGTH, POSITIVE, "11 mm");
    /// Young's modulus of both bodies.
    YOUNGS_MODULUS: Quantity = "material.youngs_modulus", Rule("must be given, or separately for both bodies"), MODULUS;
    /// Poisson's ratio of both bodies.
    POISSON_RATIO: Quantity = "material.poisson_ratio", Rule("must be given, or separately for both bodies"), RATIO;
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
