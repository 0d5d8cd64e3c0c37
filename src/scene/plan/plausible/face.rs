//! The rough face: its heights, and what presses on it.

use std::f64::consts::{PI, SQRT_2, TAU};

use super::{Bounded, PLAIN, short};
use crate::recipe::{Contact, Recipe, Surface, YIELDS};
use crate::surface::prepare::Prepared;

/// Mean pressure over the contact modulus: a joint strained by more than a hundredth is no joint under a bolt, and with less than the
/// lower bound the bodies hardly touch.
const STRAIN: [f64; 2] = [1e-10, 1e-2];
/// Below that the load is rather that of a weight than of a bolt: 0.1 MPa on steel.
const OF_BOLTS: f64 = 1e-6;
/// Fewer points of a map along a side of the joint are no roughness.
const POINTS: f64 = 4.0;
/// Spacing of a map's points along x over that along y, where only the joint's sides say what it is.
const ASPECT: [f64; 2] = [0.5, 2.0];
/// Root mean square slope of heights: half spaces take slopes as small, and machined faces have some 0.01 to 0.2.
const SLOPE: f64 = 0.5;
/// Below that a face is polished as a mirror.
const MIRROR: f64 = 1e-4;
/// Mean pressure over what the slope and the contact modulus withstand: from 1 on most of a face touches, and from the bound on all of
/// it, so that the roughness alters nothing.
const CLOSED: [f64; 2] = [2.0, 5.0];
/// Cells that touch: of fewer the contact is not resolved, however light a load is meant to be.
const TOUCHING: f64 = 5.0;
/// Cells along the contact radius of a sphere, likewise.
const CELLS_OF_RADIUS: f64 = 3.0;
/// Approach over the side of the joint: the strain that it makes in the bodies.
const APPROACH: f64 = 1e-2;
/// How far the highest cells of a measured face stand above all but a thousandth of them, over the Rq of these; a Gaussian face has
/// some 1.5, and a spike of an instrument any number.
const SPIKE: f64 = 10.0;
/// The cells that may be such a spike.
const HIGHEST: f64 = 1e-3;
/// Least Rq \[m\]: an atom.
const ATOM: f64 = 1e-10;
/// Fewer cells along a correlation length do not resolve an asperity; fewer correlation lengths along a side are no statistics.
const CELLS: f64 = 2.0;
const ASPERITIES: f64 = 3.0;
/// Sides of a joint \[m\].
const SIDE: [f64; 2] = [1e-6, 2.0];
/// Stiffness of a bolt over that of bodies as wide as the joint.
const BOLT: [f64; 2] = [1e-6, 10.0];
/// A bolt has at least so much, and a spring that holds its load may have less.
const SPRING: f64 = 1e-3;

/// What is known of a rough face before it is drawn.
pub struct Face<'a> {
    pub surface: &'a Surface,
    pub contact: &'a Contact,
    /// \[m\]; none of a face whose form alone is known.
    pub rq: Option<f64>,
    /// Root mean square slope along the steeper axis.
    slope: Option<f64>,
    /// How far the highest cell of a measured face stands above the others, over their Rq.
    spike: Option<f64>,
}

impl<'a> Face<'a> {
    pub fn of(recipe: &'a Recipe, measured: Option<&Prepared>) -> Option<Self> {
        let (surface, contact) = (recipe.surface()?, recipe.contact()?);
        let heights = &surface.heights;
        let rq = measured.map_or_else(|| heights.rq(), |found| Some(rq_of(&found.heights)));
        // The least of the two axes is the steepest.
        let length = heights
            .correlation_length()
            .map(|lengths| lengths[0].min(lengths[1]))
            .or(heights.rolloff_wavelength().map(|rolloff| rolloff / TAU));
        let drawn = rq.zip(length).map(|(rq, length)| SQRT_2 * rq / length);
        Some(Face {
            surface,
            contact,
            rq,
            slope: measured.map(slope_of).or(drawn),
            spike: measured.and_then(|found| {
                let kept = found.patch.gather(&found.heights);
                spike_of(&kept)
            }),
        })
    }

    /// Area that the load presses on \[m²\].
    pub fn area(&self) -> f64 {
        self.surface.kept as f64 * self.surface.grid().cell_area()
    }

    /// Mean pressure under its load \[Pa\].
    fn mean_pressure(&self) -> Option<f64> {
        let under_load = self.contact.approach.is_none();
        under_load.then(|| self.contact.normal_load / self.area())
    }

    /// Radius of the contact of a sphere, after Hertz \[m\].
    pub fn contact_radius(&self) -> Option<f64> {
        let radius = self.surface.heights.sphere_radius()?;
        let modulus = self.contact.bodies.effective_modulus();
        Some((0.75 * self.contact.normal_load * radius / modulus).cbrt())
    }

    /// Width of what is pressed together \[m\].
    pub fn width(&self) -> f64 {
        let [x, y] = self.surface.size;
        let joint = (x * y).sqrt();
        self.contact_radius().map_or(joint, |a| joint.min(2.0 * a))
    }
}

fn rq_of(heights: &[f64]) -> f64 {
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    let square: f64 = heights.iter().map(|h| (h - mean).powi(2)).sum();
    (square / heights.len() as f64).sqrt()
}

/// How far the highest cell stands above all but a thousandth of the others, over the Rq of those.
fn spike_of(heights: &[f64]) -> Option<f64> {
    let mut sorted = heights.to_vec();
    sorted.sort_by(f64::total_cmp);
    let highest = sorted.last().copied()?;
    let rest = ((1.0 - HIGHEST) * sorted.len() as f64).floor() as usize;
    let rest = &sorted[..rest.min(sorted.len() - 1)];
    let (rq, top) = (rq_of(rest), rest.last().copied()?);
    (rq > 0.0).then(|| (highest - top) / rq)
}

/// Root mean square slope along the steeper axis.
fn slope_of(measured: &Prepared) -> f64 {
    let grid = measured.patch.grid;
    let mut sums = [(0.0, 0u32); 2];
    for cell in 0..grid.len() {
        let (i, j) = grid.cell(cell);
        let next = [(i + 1, j, grid.dx), (i, j + 1, grid.dy)];
        for (sum, (i, j, side)) in sums.iter_mut().zip(next) {
            if i < grid.nx && j < grid.ny {
                let rise = measured.heights[grid.index(i, j)] - measured.heights[cell];
                sum.0 += (rise / side).powi(2);
                sum.1 += 1;
            }
        }
    }
    sums.map(|(sum, count)| (sum / f64::from(count.max(1))).sqrt())
        .into_iter()
        .fold(0.0, f64::max)
}

/// Too few points of a map on the joint, and cells of a shape that is not likely; nothing of a map that fits.
pub fn map(map: &Prepared) -> Vec<Bounded> {
    // Sums of spacings are not exact.
    let rounded = |value: f64| (value * 1e6).round() / 1e6;
    let [x, y] = map.points.map(rounded);
    let mut found = vec![Bounded {
        what: "number of points of the map along a side of the joint",
        value: x.min(y),
        words: format!("{} × {}", short(x), short(y)),
        bounds: [POINTS, f64::INFINITY],
        key: "surface.spacing, joint.size",
        hint: "so few points have no roughness; um or mm?",
        ..PLAIN
    }];
    if let Some(aspect) = map.assumed_aspect.map(rounded) {
        found.push(Bounded {
            what: "spacing of the map's points along x over that along y",
            value: aspect,
            words: short(aspect),
            bounds: ASPECT,
            key: "surface.spacing, joint.size",
            hint: "the map states no spacing and is taken to cover the joint; are x and y exchanged? give surface.spacing",
            ..PLAIN
        });
    }
    found.retain(|figure| figure.beyond(figure.bounds).is_some());
    found
}

/// What is known of the heights.
pub fn heights(face: &Face, is_measured: bool) -> Vec<Bounded> {
    let (grid, size) = (face.surface.grid(), face.surface.size);
    let (shortest, longest) = (size[0].min(size[1]), size[0].max(size[1]));
    let mut found = vec![Bounded {
        what: "side of the joint",
        value: if longest > SIDE[1] { longest } else { shortest },
        words: format!("{} × {} mm", short(size[0] * 1e3), short(size[1] * 1e3)),
        bounds: SIDE,
        unit: ("mm", 1e-3),
        key: "joint.size",
        hint: "mm, um or m?",
        ..PLAIN
    }];
    if let Some(diameter) = face.surface.cells.hole_diameter() {
        let cell = grid.dx.min(grid.dy);
        found.push(Bounded {
            what: "diameter of the hole over a cell",
            value: diameter / cell,
            words: format!(
                "{} ({} mm over {} mm)",
                short(diameter / cell),
                short(diameter * 1e3),
                short(cell * 1e3)
            ),
            bounds: [1.0, f64::INFINITY],
            key: "joint.hole.diameter",
            hint: "it takes no cell; mm or um?",
            ..PLAIN
        });
    }
    if let Some(rq) = face.rq {
        found.push(Bounded {
            what: "Rq",
            value: rq,
            words: format!("{} µm", short(rq * 1e6)),
            // A face that is flat by its file says nothing of a unit.
            bounds: [if rq == 0.0 { 0.0 } else { ATOM }, shortest],
            unit: ("µm", 1e-6),
            key: if is_measured {
                "surface.unit"
            } else {
                "surface.rq"
            },
            hint: "um, nm or mm?",
            ..PLAIN
        });
    }
    if let Some(slope) = face.slope.filter(|slope| *slope > 0.0) {
        found.push(Bounded {
            what: "slope of the heights (root mean square)",
            value: slope,
            words: short(slope),
            bounds: [0.0, SLOPE],
            key: if is_measured {
                "surface.unit, surface.spacing"
            } else {
                "surface.rq, surface.correlation_length"
            },
            hint: "heights are small against lengths: um and mm exchanged?",
            usual: Some(([MIRROR, SLOPE], "a face as flat as a mirror; um or nm?")),
            ..PLAIN
        });
    }
    if let Some(spike) = face.spike {
        found.push(Bounded {
            what: "highest cell above the others over their Rq",
            value: spike,
            words: short(spike),
            bounds: [f64::NEG_INFINITY, SPIKE],
            key: "surface.path",
            hint: "a spike of the instrument, or dust? it would carry the load alone; take it out of the map",
            ..PLAIN
        });
    }
    if let Some(lengths) = face.surface.heights.correlation_length() {
        let cells = (lengths[0] / grid.dx).min(lengths[1] / grid.dy);
        let many = (size[0] / lengths[0]).min(size[1] / lengths[1]);
        found.push(Bounded {
            what: "cells of a correlation length",
            value: cells,
            words: short(cells),
            bounds: [CELLS, f64::INFINITY],
            key: "surface.correlation_length, joint.grid",
            hint: "an asperity is not resolved; a finer grid, or um in place of mm?",
            ..PLAIN
        });
        found.push(Bounded {
            what: "correlation lengths along a side",
            value: many,
            words: short(many),
            bounds: [ASPERITIES, f64::INFINITY],
            key: "surface.correlation_length",
            hint: "the face has no more than a few asperities; m in place of mm?",
            ..PLAIN
        });
    }
    found
}

/// What presses the faces together.
pub fn pressures(face: &Face) -> Vec<Bounded> {
    let contact = face.contact;
    let modulus = contact.bodies.effective_modulus();
    let mut found = Vec::new();
    if let Some(mean) = face.mean_pressure() {
        found.push(Bounded {
            what: "mean pressure over the contact modulus",
            value: mean / modulus,
            words: format!("{:.2e} ({} MPa)", mean / modulus, short(mean * 1e-6)),
            bounds: STRAIN,
            key: "contact.normal_load, joint.size, material.youngs_modulus",
            hint: "kN or N, mm or m, GPa or MPa?",
            usual: Some((
                [OF_BOLTS, STRAIN[1]],
                "less than any bolt gives; kN or N, GPa or MPa?",
            )),
            ..PLAIN
        });
        found.extend(touching(face, mean / modulus));
        found.extend(hertz(face));
    }
    if let Some(approach) = contact.approach {
        let [x, y] = face.surface.size;
        let strain = approach / x.min(y);
        found.push(Bounded {
            what: "approach over the shorter side of the joint",
            value: strain,
            words: format!("{} ({} µm)", short(strain), short(approach * 1e6)),
            bounds: [f64::NEG_INFINITY, APPROACH],
            key: "contact.approach, joint.size",
            hint: "um or mm?",
            ..PLAIN
        });
    }
    if let Some(cap) = contact.pressure_cap {
        found.push(Bounded {
            what: "cap of the pressure over the contact modulus",
            value: cap / modulus,
            words: format!("{:.2e} ({} MPa)", cap / modulus, short(cap * 1e-6)),
            bounds: [STRAIN[0], 0.5],
            key: "contact.pressure_cap",
            hint: "MPa or GPa? no pressure comes near it",
            ..PLAIN
        });
    }
    if let Some(bolt) = contact.bolt_stiffness {
        let bodies = modulus * face.width();
        found.push(Bounded {
            what: "stiffness of the bolt over that of bodies as wide as the joint",
            value: bolt / bodies,
            words: format!(
                "{} ({} N/µm over some {} N/µm)",
                short(bolt / bodies),
                short(bolt * 1e-6),
                short(bodies * 1e-6)
            ),
            bounds: BOLT,
            key: "contact.bolt_stiffness",
            hint: "N/um, N/nm or N/m?",
            usual: Some((
                [SPRING, BOLT[1]],
                "rather a spring than a bolt; N/um or N/mm?",
            )),
            ..PLAIN
        });
    }
    found
}

/// How much of a rough face touches: a part 2 p / (E* h') of it, as long as that is small.
fn touching(face: &Face, strain: f64) -> Vec<Bounded> {
    let Some(slope) = face.slope.filter(|slope| *slope > 0.0) else {
        return Vec::new();
    };
    let closed = strain / slope;
    let capped = face.contact.pressure_cap.map_or(0.0, |cap| {
        face.contact.normal_load / (cap * face.surface.grid().cell_area())
    });
    let kept = face.surface.kept as f64;
    let cells = (2.0 * closed * kept).min(kept).max(capped);
    vec![
        Bounded {
            what: "number of cells that touch",
            value: cells,
            words: format!("some {} of {kept}", short(cells)),
            bounds: [TOUCHING, f64::INFINITY],
            key: "contact.normal_load, joint.grid",
            hint: "N or kN? a contact of so few cells is not resolved",
            ..PLAIN
        },
        Bounded {
            what: "mean pressure over contact modulus and slope",
            value: closed,
            words: short(closed),
            bounds: [0.0, CLOSED[1]],
            key: "surface.rq, contact.normal_load",
            hint: "the load presses the faces flat, and the roughness alters nothing: um or nm, N or kN?",
            usual: Some((
                [0.0, CLOSED[0]],
                "most of the face touches; um or nm, N or kN?",
            )),
            ..PLAIN
        },
    ]
}

/// The contact of a sphere.
fn hertz(face: &Face) -> Vec<Bounded> {
    let Some(radius) = face.contact_radius() else {
        return Vec::new();
    };
    let (grid, size) = (face.surface.grid(), face.surface.size);
    let modulus = face.contact.bodies.effective_modulus();
    let peak = 1.5 * face.contact.normal_load / (PI * radius * radius);
    let side = size[0].min(size[1]);
    let cells = radius / grid.dx.max(grid.dy);
    vec![
        Bounded {
            what: "peak pressure of Hertz over the contact modulus",
            value: peak / modulus,
            words: format!("{} ({} GPa)", short(peak / modulus), short(peak * 1e-9)),
            bounds: [0.0, 2.0 * YIELDS],
            key: "contact.normal_load, surface.radius, material.youngs_modulus",
            hint: "kN or N, mm or m, GPa or MPa?",
            ..PLAIN
        },
        Bounded {
            what: "diameter of Hertz's contact over the shorter side of the joint",
            value: 2.0 * radius / side,
            words: format!(
                "{} ({} mm over {} mm)",
                short(2.0 * radius / side),
                short(2e3 * radius),
                short(side * 1e3)
            ),
            bounds: [0.0, 1.0],
            key: "surface.radius, joint.size",
            hint: "the contact reaches beyond the joint; mm or m?",
            ..PLAIN
        },
        Bounded {
            what: "cells of the radius of Hertz's contact",
            value: cells,
            words: short(cells),
            bounds: [CELLS_OF_RADIUS, f64::INFINITY],
            key: "contact.normal_load, surface.radius, joint.size, joint.grid",
            hint: "the contact is not resolved; N or mN, mm or um?",
            ..PLAIN
        },
    ]
}
