//! Springs of the contact elements from the compliance of the fine contact.
//!
//! Everything global is a compliance \[m/N\]: a joint that loses its roughness becomes rigid, k = ∞, which is a compliance of 0
//! and nothing special; a joint that is open has k = 0, a compliance of ∞.

use serde::{Deserialize, Serialize};

use super::{ContactElements, ModelUpdateError, Sliders};
use crate::contact::stiffness::{self, Stiffness};
use crate::contact::{ContactError, HalfSpace, Shear};
use crate::grid::{ByAxis, Patch};

/// Smallest compliance of the springs together, in parts of the smooth patch's. A structure's finite elements need a finite
/// spring where the roughness is gone. What this adds is a thousandth of the give that the bodies have around the joint anyway,
/// far less than their discretisation changes it; much stiffer springs would cost the balance of harmonics its digits.
pub const SMALLEST_COMPLIANCE: f64 = 1e-3;

/// Compliance of the whole joint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Compliance {
    /// Of the approach, 1/kn \[m/N\].
    pub normal: f64,
    /// Of the tangential displacement, 1/kt \[m/N\].
    pub tangential: f64,
}

impl Compliance {
    /// From stiffnesses ≥ 0 \[N/m\]; ∞ is one.
    pub fn of(kn: f64, kt: f64) -> Self {
        Compliance {
            normal: 1.0 / kn,
            tangential: 1.0 / kt,
        }
    }

    /// Normal stiffness \[N/m\].
    pub fn kn(&self) -> f64 {
        1.0 / self.normal
    }

    /// Tangential stiffness \[N/m\].
    pub fn kt(&self) -> f64 {
        1.0 / self.tangential
    }

    /// Compliance of a patch in full contact: that of the half spaces under it, without roughness. It depends on the patch
    /// alone and takes two solves: to be kept. `shear` must be that of the contact from which it is to be taken away, as holding
    /// the transverse displacement makes the joint a little stiffer (by 0.1 % on a square patch).
    ///
    /// # Errors
    /// Those of [`stiffness::normal`] and [`stiffness::tangential`].
    pub fn smooth(
        half_space: &mut HalfSpace,
        patch: &Patch,
        shear: Shear,
    ) -> Result<Self, ContactError> {
        let kn = stiffness::normal(half_space, &patch.kept)?.total;
        let kt = stiffness::tangential(half_space, &patch.kept, shear)?.total;
        Ok(Compliance::of(kn, kt))
    }

    /// What is left of this compliance without that of the smooth patch in series: 1/k = 1/k_total − 1/k_smooth, and nothing
    /// less than nothing.
    pub fn without(&self, smooth: Compliance) -> Compliance {
        Compliance {
            normal: difference(self.normal, smooth.normal),
            tangential: difference(self.tangential, smooth.tangential),
        }
    }
}

/// An open joint stays open whatever is taken from it.
fn difference(total: f64, smooth: f64) -> f64 {
    if total == f64::INFINITY {
        total
    } else {
        (total - smooth).max(0.0)
    }
}

/// The linearised fine contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// On the elastic cells: capped ones carry what they carry.
    pub kn: Stiffness,
    /// At full stick, on all loaded cells.
    pub kt: Stiffness,
}

impl Linearisation {
    /// Of the contact with this `pressure` \[Pa\] and cap.
    ///
    /// # Errors
    /// Those of [`stiffness::local_normal`] and [`stiffness::local_tangential`].
    pub fn new(
        half_space: &mut HalfSpace,
        pressure: &[f64],
        cap: Option<f64>,
        shear: Shear,
    ) -> Result<Self, ContactError> {
        let elastic = stiffness::elastic_cells(pressure, cap);
        let closed: Vec<bool> = pressure.iter().map(|&p| p > 0.0).collect();
        Ok(Linearisation {
            kn: stiffness::local_normal(half_space, &elastic)?,
            kt: stiffness::local_tangential(half_space, &closed, shear)?,
        })
    }

    /// Compliance of the whole joint.
    pub fn compliance(&self) -> Compliance {
        Compliance::of(self.kn.total, self.kt.total)
    }
}

/// What the contact elements get of the joint's compliance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StiffnessKind {
    /// All of it, as published: the half spaces' own compliance too, which the structure's model has as well.
    #[default]
    Total,
    /// What the roughness adds to the smooth patch. The displacement of the fine contact is then not that of the springs:
    /// [`fine_displacement`].
    Roughness,
    /// All of it, each element with the stiffness that the fine contact has there: none where nothing is in contact (at the
    /// published load a third of the elements at Rq 10 µm, a sixth at 5 µm), which then stays so over the cycle.
    Tangent,
    /// None: each element is a bank of sliders, [`super::sliders`].
    Sliders,
}

/// How a stiffness of the whole joint is divided among the elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// By area.
    #[default]
    Uniform,
    /// By area, among the elements that bear load.
    Loaded,
    /// By normal load N₀: an element without load has no stiffness, whatever its gap.
    ByLoad,
}

/// A [`StiffnessKind`] with what it is made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Springs<'a> {
    /// [`StiffnessKind::Total`].
    Total {
        /// Of the fine contact.
        total: Compliance,
        /// How it is divided.
        distribution: Distribution,
    },
    /// [`StiffnessKind::Roughness`].
    Roughness {
        /// Of the fine contact.
        total: Compliance,
        /// Of the smooth patch.
        smooth: Compliance,
        /// How it is divided.
        distribution: Distribution,
    },
    /// [`StiffnessKind::Tangent`].
    Tangent(&'a Linearisation),
}

impl Springs<'_> {
    /// Compliance of all springs together, exactly; the update criterion watches it.
    pub fn compliance(&self) -> Compliance {
        match *self {
            Springs::Total { total, .. } => total,
            Springs::Roughness { total, smooth, .. } => total.without(smooth),
            Springs::Tangent(linearisation) => linearisation.compliance(),
        }
    }

    /// kn and kt of each element \[N/m\], which sum to those of the joint, where [`SMALLEST_COMPLIANCE`] allows it. kt of an
    /// element is one number for both directions: the joint's along x. `normal_load` is that of each element \[N\].
    ///
    /// # Errors
    /// [`ModelUpdateError::Rigid`] if there is no finite spring.
    pub fn distribute(
        &self,
        elements: &ContactElements,
        normal_load: &[f64],
    ) -> Result<[Vec<f64>; 2], ModelUpdateError> {
        let mut joint = self.compliance();
        if let Springs::Roughness { smooth, .. } = self {
            joint.normal = joint.normal.max(SMALLEST_COMPLIANCE * smooth.normal);
            joint.tangential = joint
                .tangential
                .max(SMALLEST_COMPLIANCE * smooth.tangential);
        }
        let (kn, kt) = (joint.kn(), joint.kt());
        for (name, k) in [("kn", kn), ("kt", kt)] {
            if k.is_infinite() {
                return Err(ModelUpdateError::Rigid { name });
            }
        }
        match *self {
            Springs::Total { distribution, .. } | Springs::Roughness { distribution, .. } => {
                let parts = distribution.parts(elements, normal_load);
                Ok([kn, kt].map(|k| parts.iter().map(|part| k * part).collect()))
            }
            Springs::Tangent(linearisation) => {
                let fields = [&linearisation.kn, &linearisation.kt];
                Ok(fields.map(|k| never_negative(elements.integrals(&k.density[0]))))
            }
        }
    }
}

impl Distribution {
    /// Part of each element; they sum to one, unless nothing is loaded.
    fn parts(self, elements: &ContactElements, normal_load: &[f64]) -> Vec<f64> {
        let weights = match self {
            Distribution::Uniform => elements.areas().to_vec(),
            Distribution::Loaded => {
                let pairs = elements.areas().iter().zip(normal_load);
                let loaded = |(area, load): (&f64, &f64)| if *load > 0.0 { *area } else { 0.0 };
                pairs.map(loaded).collect()
            }
            Distribution::ByLoad => normal_load.to_vec(),
        };
        let whole: f64 = weights.iter().sum();
        weights
            .iter()
            .map(|w| if whole > 0.0 { w / whole } else { 0.0 })
            .collect()
    }
}

/// Under a common displacement a cell in the shade of its neighbours may be drawn the other way; should that be all that an
/// element has, it has no stiffness, and the others keep the sum.
fn never_negative(mut k: Vec<f64>) -> Vec<f64> {
    if k.iter().all(|&k| k >= 0.0) {
        return k;
    }
    let whole: f64 = k.iter().sum();
    k.iter_mut().for_each(|k| *k = k.max(0.0));
    let positive: f64 = k.iter().sum();
    k.iter_mut().for_each(|k| *k *= whole / positive);
    k
}

/// Parameters of the contact elements, in their order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ElementParameters {
    /// Normal static load N₀ \[N\].
    pub normal_load: Vec<f64>,
    /// Normal static gap g₀ ≥ 0 \[m\]; 0 where there is load.
    pub gap: Vec<f64>,
    /// Normal stiffness kn \[N/m\].
    pub kn: Vec<f64>,
    /// Tangential stiffness kt \[N/m\].
    pub kt: Vec<f64>,
    /// The sliders that elements are made of, where each is a bank; their loads and stiffnesses are those of the elements, parted.
    pub sliders: Option<Sliders>,
}

impl ElementParameters {
    /// From the static fine contact: `pressure` \[Pa\] and `gap` \[m\] on each fine cell [A §2e].
    ///
    /// # Errors
    /// [`ModelUpdateError::Rigid`] if there is no finite spring.
    ///
    /// # Panics
    /// If a field has not one value for each cell of the grid.
    pub fn new(
        elements: &ContactElements,
        pressure: &[f64],
        gap: &[f64],
        springs: Springs<'_>,
    ) -> Result<Self, ModelUpdateError> {
        let normal_load = elements.loads(pressure);
        let [kn, kt] = springs.distribute(elements, &normal_load)?;
        Ok(ElementParameters {
            gap: elements.static_gaps(gap, &normal_load),
            normal_load,
            kn,
            kt,
            sliders: None,
        })
    }
}

/// Displacement to prescribe to the fine contact when the springs have the roughness alone: δ(t) = δ_spring(t) + c_bulk T(t).
///
/// `spring` is the displacement of the springs \[m\] and `force` the tangential force T of the joint \[N\], each a list of samples
/// for every axis; `bulk` is [`Compliance::tangential`] of the smooth patch \[m/N\], that along x for both axes. What the half
/// spaces give under T is in the structure's model, not in its springs, but the fine contact includes it.
pub fn fine_displacement(
    spring: &ByAxis<Vec<f64>>,
    force: &ByAxis<Vec<f64>>,
    bulk: f64,
) -> ByAxis<Vec<f64>> {
    spring
        .iter()
        .zip(force)
        .map(|(spring, force)| {
            spring
                .iter()
                .zip(force)
                .map(|(u, t)| u + bulk * t)
                .collect()
        })
        .collect()
}
