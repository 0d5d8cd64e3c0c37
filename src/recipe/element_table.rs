//! Contact elements in a table, for exchange between runs and with other programs.

use serde::{Deserialize, Serialize};

use super::elements::Layout;
use crate::dynamics::ContactElement;
use crate::model_update::{ElementParameters, Sliders};

/// Columns of the element table in SI units. The table has one row per slider. The columns `element` to `mu` describe
/// the element, numbered from 0. The columns `damping_kn` and `damping_kt` are the springs for the modal damping of the
/// stuck joint. The other columns describe the slider.
pub const COLUMNS: [&str; 11] = [
    "element",
    "x",
    "y",
    "area",
    "mu",
    "damping_kn",
    "damping_kt",
    "normal_load",
    "gap",
    "kn",
    "kt",
];

/// Contact elements from a table. Each element is a bank of sliders.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ElementTable {
    /// Hash of the file.
    pub content: String,
    /// Centres, relative to the middle of the joint \[m\].
    pub centres: Vec<[f64; 2]>,
    /// Coefficients of friction.
    pub friction_coefficient: Vec<f64>,
    /// Normal and tangential spring of each element for the modal damping of the stuck joint \[N/m\].
    pub damping_springs: Vec<[f64; 2]>,
    /// Element of each slider, in ascending order.
    pub element: Vec<usize>,
    /// The sliders: static load \[N\], gap \[m\], normal and tangential stiffness \[N/m\].
    pub sliders: Vec<[f64; 4]>,
}

impl ElementTable {
    /// Returns the number of elements.
    pub fn count(&self) -> usize {
        self.centres.len()
    }

    /// Creates the table of contact elements.
    pub fn of(
        elements: &[ContactElement],
        layout: &Layout,
        damping_springs: Vec<[f64; 2]>,
    ) -> Self {
        let banks = elements.iter().enumerate();
        let sliders = banks.flat_map(|(e, element)| element.sliders.iter().map(move |s| (e, s)));
        let (element, sliders) = sliders
            .map(|(e, s)| {
                (
                    e,
                    [
                        s.normal_load,
                        s.gap,
                        s.normal_stiffness,
                        s.tangential_stiffness,
                    ],
                )
            })
            .unzip();
        ElementTable {
            content: String::new(),
            centres: layout.centres.clone(),
            friction_coefficient: elements.iter().map(|e| e.friction_coefficient).collect(),
            damping_springs,
            element,
            sliders,
        }
    }

    /// Returns the sum of a column of the sliders over all elements. The columns are load, gap, kn and kt.
    pub fn total(&self, column: usize) -> f64 {
        self.sliders.iter().map(|slider| slider[column]).sum()
    }

    /// Returns the mean coefficient of friction, weighted by load. Without load, returns the mean over the elements.
    pub fn mean_friction(&self) -> f64 {
        let (mut strength, mut load) = (0.0, 0.0);
        for (&e, slider) in self.element.iter().zip(&self.sliders) {
            strength += self.friction_coefficient[e] * slider[0];
            load += slider[0];
        }
        match load > 0.0 {
            true => strength / load,
            false => self.friction_coefficient.iter().sum::<f64>() / self.count().max(1) as f64,
        }
    }

    /// Returns the parameters of the elements and their sliders.
    pub fn parameters(&self) -> ElementParameters {
        let summed = |column: usize| {
            let mut sums = vec![0.0; self.count()];
            for (&e, slider) in self.element.iter().zip(&self.sliders) {
                sums[e] += slider[column];
            }
            sums
        };
        let column = |column: usize| self.sliders.iter().map(|slider| slider[column]).collect();
        let mut gap = vec![f64::INFINITY; self.count()];
        for (&e, slider) in self.element.iter().zip(&self.sliders) {
            gap[e] = gap[e].min(slider[1]);
        }
        ElementParameters {
            normal_load: summed(0),
            gap,
            kn: summed(2),
            kt: summed(3),
            sliders: Some(Sliders {
                element: self.element.clone(),
                normal_load: column(0),
                gap: column(1),
                kn: column(2),
                kt: column(3),
            }),
        }
    }

    /// Returns the parameters of the springs for the modal damping of the stuck joint.
    pub fn damping_parameters(&self) -> ElementParameters {
        ElementParameters {
            kn: self
                .damping_springs
                .iter()
                .map(|springs| springs[0])
                .collect(),
            kt: self
                .damping_springs
                .iter()
                .map(|springs| springs[1])
                .collect(),
            sliders: None,
            ..self.parameters()
        }
    }
}
