//! What is known of a rough face before it is drawn.

use std::f64::consts::{SQRT_2, TAU};

use crate::recipe::{Contact, Recipe, Surface};
use crate::surface::prepare::PreparedSurface;

/// The highest cells of a measured face, which may be a spike of an instrument.
const HIGHEST: f64 = 1e-3;
/// Rq of a face whose heights are a form \[m\].
const OF_FORM: f64 = 1e-6;

/// A rough face and its contact.
#[derive(Clone, Copy)]
pub struct Face<'a> {
    pub surface: &'a Surface,
    pub contact: &'a Contact,
    /// \[m\]; none of a face whose form alone is known.
    pub rq: Option<f64>,
    /// Root mean square slope along the steeper axis, if it is not zero.
    pub slope: Option<f64>,
    /// How far the highest cell of a measured face stands above the others, over their Rq.
    pub spike: Option<f64>,
}

impl<'a> Face<'a> {
    pub fn of(recipe: &'a Recipe, measured: Option<&PreparedSurface>) -> Option<Self> {
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
            slope: measured
                .map(slope_of)
                .or(drawn)
                .filter(|slope| *slope > 0.0),
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

    /// The shorter side \[m\].
    pub fn side(&self) -> f64 {
        self.surface.size[0].min(self.surface.size[1])
    }

    /// The shorter side of a cell \[m\].
    pub fn cell(&self) -> f64 {
        let grid = self.surface.grid();
        grid.dx.min(grid.dy)
    }

    /// Contact modulus of the bodies \[Pa\].
    pub fn modulus(&self) -> f64 {
        self.contact.bodies.effective_modulus()
    }

    /// What friction holds \[N\].
    pub fn limit(&self) -> Option<f64> {
        Some(self.contact.friction_coefficient? * self.contact.conditions.normal_load)
    }

    /// Rq, also of a face that has none \[m\].
    pub fn roughness(&self) -> f64 {
        self.rq.filter(|rq| *rq > 0.0).unwrap_or(OF_FORM)
    }

    /// Mean pressure under its load \[Pa\].
    pub fn mean_pressure(&self) -> Option<f64> {
        let under_load = self.contact.conditions.approach.is_none();
        under_load.then(|| self.contact.conditions.normal_load / self.area())
    }

    /// Radius of the contact of a sphere, after Hertz \[m\].
    pub fn contact_radius(&self) -> Option<f64> {
        let radius = self.surface.heights.sphere_radius()?;
        Some((0.75 * self.contact.conditions.normal_load * radius / self.modulus()).cbrt())
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
