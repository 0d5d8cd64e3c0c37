//! `[surface]`

use super::Default::{Absent, Is, Required, Rule};
use super::keys;
use super::value::{
    ANY, FOR_BOTH, HURST, Integer, LARGEST_INTEGER, List, POSITIVE, Quantity, XY, integer,
};
use super::word::{Boolean, Choice, FilePath, Unit};
use crate::recipe::Mirror;
use crate::scene::{Detrend, Fill};
use crate::units::Dimension;

keys! {
    section "surface": "The heights of one composite rough surface against a flat, positive towards the other body.";
    section "surface.correct": "Unit and spacing that replace a wrong unit or spacing in the file of the surface. The program warns of each replacement.";
    section "surface.second": "The second of two measured faces. The heights of each face count outwards from its own body. The composite surface is the sum of the heights of both faces, after the trend of each face is subtracted.";

    /// Source of the heights.
    KIND: Choice<&'static str> = "surface.kind", Required, Choice(&[
        ("gaussian", "gaussian", "random heights, autocorrelation exp(-(x^2/clx^2 + y^2/cly^2))"),
        ("exponential", "exponential", "random heights, autocorrelation exp(-sqrt(x^2/clx^2 + y^2/cly^2))"),
        ("self_affine", "self_affine", "random heights, self-affine power spectrum"),
        ("flat", "flat", "perfectly flat"),
        ("sphere", "sphere", "a sphere, its apex at height 0 in the middle of the joint"),
        ("file", "file", "a measured topography"),
    ]);
    /// Root mean square height. The program scales the heights of the surface such that the root mean square height
    /// equals surface.rq.
    RQ: Quantity = "surface.rq", Required, length("5 um"), of ["gaussian", "exponential", "self_affine"];
    /// Lengths along x and y at which the autocorrelation has fallen to 1/e.
    CORRELATION_LENGTH: List<2> = "surface.correlation_length", Required,
        List(XY, length(r#"["0.5 mm", "0.5 mm"]"#), Some(FOR_BOTH)), of ["gaussian", "exponential"];
    /// Hurst exponent H: the power spectrum falls as the wave number to the power of -2 - 2H.
    HURST_EXPONENT: Quantity = "surface.hurst", Required, Quantity(Dimension::NONE, HURST, "0.8"), of ["self_affine"];
    /// Wavelength above which the power spectrum is flat.
    ROLLOFF_WAVELENGTH: Quantity = "surface.rolloff_wavelength", Rule("the longer side of the joint"), length("10 mm"), of ["self_affine"];
    /// Wavelength below which there is no roughness. The cutoff wavelength must be shorter than
    /// surface.rolloff_wavelength.
    CUTOFF_WAVELENGTH: Quantity = "surface.cutoff_wavelength", Rule("none: roughness down to the grid"), length("0.1 mm"), of ["self_affine"];
    /// Seed of the random heights: the same seed gives the same surface.
    SEED: Integer = "surface.seed", Is("1"), integer(0, LARGEST_INTEGER, "2"), of ["gaussian", "exponential", "self_affine"];
    /// Radius of the sphere.
    RADIUS: Quantity = "surface.radius", Required, length("25 mm"), of ["sphere"];
    /// File of the measured topography in the format X3P, SDF, SUR, AL3D, NPY, CSV, XYZ or Parquet. Axis 0 of an NPY
    /// array is x.
    PATH: FilePath = "surface.path", Required, FilePath("heights.npy"), of ["file"];
    /// Unit of the heights, for a file that does not state the unit.
    UNIT: Unit = "surface.unit", Rule("that of the file"), Unit(Dimension::LENGTH, "um"), of ["file"];
    /// Trend that is subtracted from the heights.
    DETREND: Choice<Detrend> = "surface.detrend", Is("plane"), Choice(&[
        ("none", Detrend::None, "nothing: the heights stay as they are, with their mean"),
        ("mean", Detrend::Mean, "the mean"),
        ("plane", Detrend::Plane, "the mean plane"),
        ("quadratic", Detrend::Quadratic, "plane and curvature"),
    ]), of ["file"];
    /// Treatment of points that were not measured.
    FILL: Choice<Fill> = "surface.fill", Is("interpolate"), Choice(&[
        ("mask", Fill::Mask, "cells of which less than half was measured are excluded from the joint: they carry no load"),
        ("interpolate", Fill::Interpolate, "the smoothest surface through the surrounding points"),
    ]), of ["file"];
    /// Spacing of the points along x and y, in place of the spacing in the file.
    SPACING: List<2> = "surface.spacing", Rule("that of the file, else the map covers the joint"),
        List(XY, length(r#"["2 um", "2 um"]"#), None), of ["file"];
    /// `surface.transpose = true` exchanges x and y of the map.
    TRANSPOSE: Boolean = "surface.transpose", Is("false"), Boolean, of ["file"];
    /// Unit of the heights, in place of the unit in the file.
    CORRECT_UNIT: Unit = "surface.correct.unit", Rule("that of the file"), Unit(Dimension::LENGTH, "um"), of ["file"];
    /// Spacing of the points along x and y, in place of the spacing in the file.
    CORRECT_SPACING: List<2> = "surface.correct.spacing", Rule("those of the file"),
        List(XY, length(r#"["2 um", "2 um"]"#), None), of ["file"];
    /// File of the measured topography of the second face.
    SECOND_PATH: FilePath = "surface.second.path", Absent, FilePath("upper.x3p"), of ["file"];
    /// Unit of the heights of the second face, for a file that does not state it.
    SECOND_UNIT: Unit = "surface.second.unit", Rule("that of the file"), Unit(Dimension::LENGTH, "um"), of ["file"];
    /// Spacing of the points of the second face along x and y, in place of the spacing in its file.
    SECOND_SPACING: List<2> = "surface.second.spacing", Rule("that of the file, else the map covers the joint"),
        List(XY, length(r#"["2 um", "2 um"]"#), None), of ["file"];
    /// `surface.second.transpose = true` exchanges x and y of the second map, before the map is mirrored.
    SECOND_TRANSPOSE: Boolean = "surface.second.transpose", Is("false"), Boolean, of ["file"];
    /// Mirroring of the second map, so that the second map faces the first map.
    SECOND_MIRROR: Choice<Mirror> = "surface.second.mirror", Is("none"), Choice(&[
        ("none", Mirror::None, "not mirrored: its points face the points at the same place of the first map"),
        ("x", Mirror::X, "along x, h(Lx - x, y), as a part that is turned over about its y axis"),
        ("y", Mirror::Y, "along y, h(x, Ly - y), as a part that is turned over about its x axis"),
    ]), of ["file"];
    /// Displacement of the second map along x and y of the joint, after mirroring.
    SECOND_SHIFT: List<2> = "surface.second.shift", Rule("none: the middles of both maps face each other"),
        List(XY, Quantity(Dimension::LENGTH, ANY, r#"["20 um", "0 um"]"#), None), of ["file"];
}

const fn length(example: &'static str) -> Quantity {
    Quantity(Dimension::LENGTH, POSITIVE, example)
}
