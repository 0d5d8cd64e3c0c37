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
    /// How many there are.
    pub count: usize,
    /// Coulomb's coefficient of friction.
    pub friction_coefficient: f64,
    /// Friction in the plane.
    pub friction_law: FrictionLaw,
    /// What they get as load and stiffness.
    pub stiffness: ElementStiffness,
    /// Each by a table, whose sums are given then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<ElementTable>,
    /// When they are renewed.
    pub update: Updates,
    /// The reasons.
    pub why: Reasons,
}

/// When contact elements are renewed, and what they do in between.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Updates {
    /// What makes an update due.
    pub criterion: UpdateCriterion,
    /// Whether their motion goes on to change from one update to the next as it has since the one before.
    pub extrapolates: bool,
}

/// What contact elements get as load and stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementStiffness {
    /// Totals over the joint, shared by area.
    Given {
        /// Normal stiffness \[N/m\].
        kn: f64,
        /// Tangential stiffness \[N/m\].
        kt: f64,
        /// Gap without load \[m\]; zero under load.
        gap: f64,
        /// Static load \[N\].
        normal_load: f64,
    },
    /// That of the rough contact.
    Contact {
        /// Which stiffness of it.
        stiffness: StiffnessKind,
        /// How a stiffness of the whole joint is shared.
        distribution: Distribution,
    },
}

impl ElementStiffness {
    /// Stiffness along the normal and in the plane \[N/m\] and static load \[N\], where they are given.
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

    /// True if each element has a stiffness of its own.
    pub fn is_tangent(&self) -> bool {
        self.is_kind(StiffnessKind::Tangent)
    }

    /// True if each element is a bank of sliders.
    pub fn is_sliders(&self) -> bool {
        self.is_kind(StiffnessKind::Sliders)
    }

    fn is_kind(&self, kind: StiffnessKind) -> bool {
        matches!(self, ElementStiffness::Contact { stiffness, .. } if *stiffness == kind)
    }
}

/// Where the contact elements of a structure are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// Centres (x, y), from the middle of the joint \[m\].
    pub centres: Vec<[f64; 2]>,
    /// Area of each \[m²\]; 0 for that of an oscillator.
    pub areas: Vec<f64>,
    /// Half the length of the joint along x \[m\].
    pub lever: f64,
}

impl Elements {
    /// The contact elements with these parameters.
    pub fn with(&self, layout: &Layout, parameters: &ElementParameters) -> Vec<ContactElement> {
        let of = |e: usize, sliders: Vec<Slider>| ContactElement {
            springs: Vec::new(),
            // A table of more elements than the structure has is refused where all are counted.
            area: layout.areas.get(e).copied().unwrap_or(0.0),
            friction_coefficient: self.friction_of(e),
            law: self.friction_law,
            sliders,
        };
        let Some(banks) = &parameters.sliders else {
            let one = |e: usize| Slider {
                normal_load: parameters.normal_load[e],
                gap: parameters.gap[e],
                tangential_stiffness: parameters.kt[e],
                normal_stiffness: parameters.kn[e],
            };
            let elements = 0..parameters.normal_load.len();
            return elements.map(|e| of(e, vec![one(e)])).collect();
        };
        let mut elements: Vec<ContactElement> = (0..parameters.normal_load.len())
            .map(|e| of(e, Vec::new()))
            .collect();
        for (s, &e) in banks.element.iter().enumerate() {
            if e >= elements.len() {
                // A slider of no element makes one too many, which is refused where all are counted.
                elements.push(of(elements.len(), Vec::new()));
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
        let own = self.table.as_ref();
        let own = own.and_then(|table| table.friction_coefficient.get(element));
        own.copied().unwrap_or(self.friction_coefficient)
    }

    /// True if each element is a bank of sliders.
    pub fn has_banks(&self) -> bool {
        self.table.is_some() || self.stiffness.is_sliders()
    }

    /// Parameters of elements that damping in modes of the stuck joint is counted with, where they are given.
    pub fn given_for_damping(&self) -> Option<ElementParameters> {
        match &self.table {
            Some(table) => Some(table.damping_parameters()),
            None => self.given(),
        }
    }

    /// Parameters of elements whose stiffness is given: by their table, else load and stiffness by area.
    pub fn given(&self) -> Option<ElementParameters> {
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

    /// Says what the contact elements are.
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

    /// Says what they get as stiffness, and when they are renewed.
    pub(super) fn tell_stiffness(&self, wears: bool, decisions: &mut Decisions) {
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
