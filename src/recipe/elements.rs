//! The contact elements of a structure.

use serde::{Deserialize, Serialize};

use super::Reasons;
use super::decision::Decisions;
use super::element_table::ElementTable;
use crate::dynamics::{ContactElement, FrictionLaw, Slider};
use crate::model_update::{Distribution, ElementParameters, StiffnessKind, UpdateCriterion};

/// The contact elements of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Elements {
    /// Number of contact elements.
    pub count: usize,
    /// Coulomb's coefficient of friction.
    pub friction_coefficient: f64,
    /// Friction in the plane.
    pub friction_law: FrictionLaw,
    /// Source of load and stiffness.
    pub stiffness: ElementStiffness,
    /// Table of the parameters of each element. With a table, the sums over the table are the prescribed totals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<ElementTable>,
    /// Updates of the elements.
    pub update: Updates,
    /// Reasons for the choices.
    pub why: Reasons,
}

/// Criterion for updates of the contact elements, and their motion between updates.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Updates {
    /// Criterion for an update.
    pub criterion: UpdateCriterion,
    /// True if the motion is extrapolated between updates, from its last change.
    pub extrapolates: bool,
}

/// Source of the load and stiffness of contact elements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementStiffness {
    /// Prescribed totals over the joint, shared by area.
    Given {
        /// Normal stiffness \[N/m\].
        kn: f64,
        /// Tangential stiffness \[N/m\].
        kt: f64,
        /// Gap without load \[m\]; zero for a loaded joint.
        gap: f64,
        /// Static load \[N\].
        normal_load: f64,
    },
    /// Stiffness of the rough contact.
    Contact {
        /// Kind of the stiffness.
        stiffness: StiffnessKind,
        /// Distribution of a stiffness of the whole joint over the elements.
        distribution: Distribution,
    },
}

impl ElementStiffness {
    /// Returns the normal and the tangential stiffness \[N/m\] and the static load \[N\], if they are prescribed.
    pub fn given(&self) -> Option<[f64; 3]> {
        match *self {
            ElementStiffness::Given {
                kn,
                kt,
                normal_load,
                ..
            } => Some([kn, kt, normal_load]),
            ElementStiffness::Contact { .. } => None,
        }
    }

    /// Returns true if each element has its own stiffness.
    pub fn is_tangent(&self) -> bool {
        self.is_kind(StiffnessKind::Tangent)
    }

    /// Returns true if each element is a bank of sliders.
    pub fn is_sliders(&self) -> bool {
        self.is_kind(StiffnessKind::Sliders)
    }

    fn is_kind(&self, kind: StiffnessKind) -> bool {
        matches!(self, ElementStiffness::Contact { stiffness, .. } if *stiffness == kind)
    }
}

/// Positions and areas of the contact elements of a structure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// Centres (x, y), relative to the middle of the joint \[m\].
    pub centres: Vec<[f64; 2]>,
    /// Area of each element \[m²\]; 0 for an oscillator.
    pub areas: Vec<f64>,
    /// Half the length of the joint along x \[m\].
    pub lever: f64,
}

impl Elements {
    /// Creates contact elements with the given `parameters`.
    pub fn with(&self, layout: &Layout, parameters: &ElementParameters) -> Vec<ContactElement> {
        let element = |e: usize, sliders: Vec<Slider>| ContactElement {
            springs: Vec::new(),
            // A table may have more elements than the structure. The check of the number of elements rejects it
            // later.
            area: layout.areas.get(e).copied().unwrap_or(0.0),
            friction_coefficient: self.friction_of(e),
            law: self.friction_law,
            sliders,
        };
        let Some(banks) = &parameters.sliders else {
            let slider = |e: usize| Slider {
                normal_load: parameters.normal_load[e],
                gap: parameters.gap[e],
                tangential_stiffness: parameters.kt[e],
                normal_stiffness: parameters.kn[e],
            };
            let elements = 0..parameters.normal_load.len();
            return elements.map(|e| element(e, vec![slider(e)])).collect();
        };
        let mut elements: Vec<ContactElement> = (0..parameters.normal_load.len())
            .map(|e| element(e, Vec::new()))
            .collect();
        for (s, &e) in banks.element.iter().enumerate() {
            if e >= elements.len() {
                // A slider without an element adds one element, so that the check of the number of elements rejects
                // the table.
                elements.push(element(elements.len(), Vec::new()));
                break;
            }
            elements[e].sliders.push(Slider {
                normal_load: banks.normal_load[s],
                gap: banks.gap[s],
                tangential_stiffness: banks.kt[s],
                normal_stiffness: banks.kn[s],
            });
        }
        elements
    }

    fn friction_of(&self, element: usize) -> f64 {
        let coefficient = self.table.as_ref();
        let coefficient = coefficient.and_then(|table| table.friction_coefficient.get(element));
        coefficient.copied().unwrap_or(self.friction_coefficient)
    }

    /// Returns true if each element is a bank of sliders.
    pub fn has_banks(&self) -> bool {
        self.table.is_some() || self.stiffness.is_sliders()
    }

    /// Returns the prescribed parameters of the elements for the modal damping of the stuck joint, if there are any.
    pub fn damping_parameters(&self) -> Option<ElementParameters> {
        match &self.table {
            Some(table) => Some(table.damping_parameters()),
            None => self.prescribed_parameters(),
        }
    }

    /// Returns the parameters of elements with prescribed stiffness: from their table, otherwise load and stiffness
    /// shared by area.
    pub fn prescribed_parameters(&self) -> Option<ElementParameters> {
        if let Some(table) = &self.table {
            return Some(table.parameters());
        }
        let ElementStiffness::Given {
            kn,
            kt,
            gap,
            normal_load,
        } = self.stiffness
        else {
            return None;
        };
        let part = |total: f64| vec![total / self.count as f64; self.count];
        Some(ElementParameters {
            normal_load: part(normal_load),
            gap: vec![gap; self.count],
            kn: part(kn),
            kt: part(kt),
            sliders: None,
        })
    }

    /// Explains the contact elements.
    pub(super) fn explain(&self, decisions: &mut Decisions) {
        let law = self.friction_law.formula();
        let choice = format!("{}, three-dimensional, {law}", self.count);
        decisions.add("contact elements", choice, self.why.of("friction_law"));
        decisions.add(
            "unknowns of the harmonic balance",
            "after the linear response: those of contact elements that slip or open",
            "the others follow their springs, which is checked over the whole cycle",
        );
    }

    /// Explains the stiffness and the updates of the elements.
    pub(super) fn explain_stiffness(&self, wears: bool, decisions: &mut Decisions) {
        let stiffness = match self.stiffness {
            ElementStiffness::Given { .. } if self.table.is_some() => "by contact.elements",
            ElementStiffness::Given { .. } => "given",
            ElementStiffness::Contact { stiffness, .. } => match stiffness {
                StiffnessKind::Total => "that of the whole rough patch",
                StiffnessKind::Roughness => {
                    "that of the rough patch without the smooth one's compliance"
                }
                StiffnessKind::Tangent => "each element its own tangent",
                StiffnessKind::Sliders => {
                    "each element its own curve of force over displacement, a bank of sliders"
                }
            },
        };
        decisions.add("contact stiffness", stiffness, self.why.of("stiffness"));
        if matches!(self.stiffness, ElementStiffness::Given { .. }) {
            return;
        }
        let update = match wears {
            false => "none".to_owned(),
            true if self.update.extrapolates => {
                format!(
                    "{}; the motion is extrapolated in between",
                    self.update.criterion.describe()
                )
            }
            true => self.update.criterion.describe(),
        };
        decisions.add("model update", update, self.why.of("update"));
    }
}
