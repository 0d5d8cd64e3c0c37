//! Properties of a rough face that are known before its heights are computed.

use std::f64::consts::{SQRT_2, TAU};

use crate::recipe::{Contact, Recipe, Surface};
use crate::surface::prepare::PreparedSurface;

/// Fraction of the highest cells of a measured face that may be an instrument spike.
const HIGHEST: f64 = 1e-3;
/// Assumed Rq of a face whose heights are only a form \[m\].
const OF_FORM: f64 = 1e-6;

/// Rough face of the joint, and the contact of the rough face.
#[derive(Clone, Copy)]
pub struct Face<'a> {
    pub surface: &'a Surface,
    pub contact: &'a Contact,
    /// Rq \[m\]; `None` for a face of which only the form is known.
    pub rq: Option<f64>,
    /// Root mean square slope along the steeper axis, if not zero.
    pub slope: Option<f64>,
    /// Height of the highest cell of a measured face above the others, relative to their Rq.
    pub spike: Option<f64>,
}

impl<'a> Face<'a> {
    pub fn new(recipe: &'a Recipe, measured: Option<&PreparedSurface>) -> Option<Self> {
        let (surface, contact) = (recipe.surface()?, recipe.contact()?);
        let heights = &surface.heights;
        let rq = measured.map_or_else(|| heights.rq(), |surface| Some(rq_of(&surface.heights)));
        // The shorter length of the two axes gives the steeper slope.
        let length = heights
            .correlation_length()
            .map(|lengths| lengths[0].min(lengths[1]))
            .or(heights.rolloff_wavelength().map(|rolloff| rolloff / TAU));
        let drawn = rq.zip(length).map(|(rq, length)| SQRT_2 * rq / length);
        Some(Face {
            surface,
            contact,
            rq,
            slope: measured
                .map(slope_of)
                .or(drawn)
                .filter(|slope| *slope > 0.0),
            spike: measured.and_then(|surface| {
                let kept = surface.patch.joint_values(&surface.heights);
                spike_of(&kept)
            }),
        })
    }

    /// Area under load \[m²\].
    pub fn area(&self) -> f64 {
        self.surface.kept as f64 * self.surface.grid().cell_area()
    }

    /// Shorter side of the joint \[m\].
    pub fn side(&self) -> f64 {
        self.surface.size[0].min(self.surface.size[1])
    }

    /// Shorter side of a cell \[m\].
    pub fn cell(&self) -> f64 {
        let grid = self.surface.grid();
        grid.dx.min(grid.dy)
    }

    /// Contact modulus of the bodies \[Pa\].
    pub fn modulus(&self) -> f64 {
        self.contact.bodies.effective_modulus()
    }

    /// Friction limit \[N\].
    pub fn limit(&self) -> Option<f64> {
        Some(self.contact.friction_coefficient? * self.contact.conditions.normal_load)
    }

    /// Rq, or an assumed one for a face without \[m\].
    pub fn roughness(&self) -> f64 {
        self.rq.filter(|rq| *rq > 0.0).unwrap_or(OF_FORM)
    }

    /// Mean pressure \[Pa\]; `None` if the approach is given.
    pub fn mean_pressure(&self) -> Option<f64> {
        let under_load = self.contact.conditions.approach.is_none();
        under_load.then(|| self.contact.conditions.normal_load / self.area())
    }

    /// Contact radius of a sphere, after Hertz \[m\].
    pub fn contact_radius(&self) -> Option<f64> {
        let radius = self.surface.heights.sphere_radius()?;
        Some((0.75 * self.contact.conditions.normal_load * radius / self.modulus()).cbrt())
    }

    /// Width of the pressed area \[m\].
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

/// Returns the difference between the highest cell and the 99.9 % quantile of the heights, divided by an Rq. The Rq is
/// the Rq of the cells up to the quantile.
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
fn slope_of(measured: &PreparedSurface) -> f64 {
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
