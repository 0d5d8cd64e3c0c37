//! Springs of the contact elements from the compliance of the fine contact.
//!
//! Joint values are compliances \[m/N\]. A joint without roughness is rigid, with the stiffness k = ∞ and a compliance
//! of zero. An open joint has k = 0 and a compliance of ∞.

use serde::{Deserialize, Serialize};

use super::{ContactElements, ModelUpdateError, Sliders};
use crate::contact::stiffness::{self, Stiffness};
use crate::contact::{ContactError, HalfSpace, Shear};
use crate::grid::{ByAxis, Patch};

/// Smallest compliance of all springs together, relative to the compliance of the smooth patch. A structure of finite
/// elements needs finite springs even where the roughness is gone. The smallest compliance adds a thousandth of the
/// compliance that the bodies have around the joint anyway. The added compliance is far less than the discretisation
/// error of the bodies. Much stiffer springs would cost the harmonic balance accuracy.
pub const SMALLEST_COMPLIANCE: f64 = 1e-3;

/// Compliance of the whole joint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Compliance {
    /// Compliance of the approach, 1/kn \[m/N\].
    pub normal: f64,
    /// Compliance of the tangential displacement, 1/kt \[m/N\].
    pub tangential: f64,
}

impl Compliance {
    /// Converts stiffnesses ≥ 0 \[N/m\], which may be ∞.
    pub fn from_stiffness(kn: f64, kt: f64) -> Self {
        Compliance {
            normal: 1.0 / kn,
            tangential: 1.0 / kt,
        }
    }

    /// Returns the normal stiffness \[N/m\].
    pub fn kn(&self) -> f64 {
        1.0 / self.normal
    }

    /// Returns the tangential stiffness \[N/m\].
    pub fn kt(&self) -> f64 {
        1.0 / self.tangential
    }

    /// Computes the compliance of a patch in full contact: the compliance of the half spaces under the patch, without
    /// roughness. The compliance of the smooth patch depends on the patch alone and takes two solves, so callers should
    /// store it. `shear` must equal the shear setting of the rough contact, because callers subtract the compliance of
    /// the smooth patch from the rough one. A fixed transverse displacement makes a square patch stiffer by 0.1 %.
    ///
    /// # Errors
    /// Returns the errors of [`stiffness::normal`] and [`stiffness::tangential`].
    pub fn smooth(
        half_space: &mut HalfSpace,
        patch: &Patch,
        shear: Shear,
    ) -> Result<Self, ContactError> {
        let kn = stiffness::normal(half_space, &patch.is_in_joint)?.total;
        let kt = stiffness::tangential(half_space, &patch.is_in_joint, shear)?.total;
        Ok(Compliance::from_stiffness(kn, kt))
    }

    /// Subtracts the compliance of the smooth patch in series: 1/k = 1/k_total − 1/k_smooth, and at least 0.
    pub fn subtract_series(&self, smooth: Compliance) -> Compliance {
        Compliance {
            normal: difference(self.normal, smooth.normal),
            tangential: difference(self.tangential, smooth.tangential),
        }
    }
}

/// Subtracts a compliance. An open joint stays open.
fn difference(total: f64, smooth: f64) -> f64 {
    if total == f64::INFINITY {
        total
    } else {
        (total - smooth).max(0.0)
    }
}

/// Linearised fine contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// Normal stiffness on the elastic cells; capped cells carry a constant pressure.
    pub kn: Stiffness,
    /// Tangential stiffness at full stick, on all loaded cells.
    pub kt: Stiffness,
}

impl Linearisation {
    /// Linearises the contact at the given `pressure` and pressure cap \[Pa\].
    ///
    /// # Errors
    /// Returns the errors of [`stiffness::local_normal`] and [`stiffness::local_tangential`].
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

    /// Returns the compliance of the whole joint.
    pub fn compliance(&self) -> Compliance {
        Compliance::from_stiffness(self.kn.total, self.kt.total)
    }
}

/// Part of the joint's compliance that the contact elements represent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StiffnessKind {
    /// The whole compliance of the joint, as published. This option counts the compliance of the half spaces twice. The
    /// springs and the model of the structure both contain this compliance.
    #[default]
    Total,
    /// The part that the roughness adds to the smooth patch. If the springs represent the roughness alone, the
    /// displacement of the fine contact exceeds the displacement of the springs: see [`fine_displacement`].
    Roughness,
    /// The whole compliance of the joint, where each element has the local stiffness of the fine contact. The stiffness
    /// is zero for elements without contact, and stays zero over the cycle. At the published load, a third of the
    /// elements have no contact for Rq 10 µm. For Rq 5 µm, a sixth of the elements have no contact.
    Tangent,
    /// No springs: each element is a bank of sliders, see [`super::sliders`].
    Sliders,
}

/// Distribution of the stiffness of the whole joint among the elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// By area.
    #[default]
    Uniform,
    /// By area, among the loaded elements only.
    Loaded,
    /// By normal load N₀. An element without load has no stiffness, whatever its gap.
    ByLoad,
}

/// [`StiffnessKind`] with its data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Springs<'a> {
    /// [`StiffnessKind::Total`].
    Total {
        /// Compliance of the fine contact.
        total: Compliance,
        /// Distribution among the elements.
        distribution: Distribution,
    },
    /// [`StiffnessKind::Roughness`].
    Roughness {
        /// Compliance of the fine contact.
        total: Compliance,
        /// Compliance of the smooth patch.
        smooth: Compliance,
        /// Distribution among the elements.
        distribution: Distribution,
    },
    /// [`StiffnessKind::Tangent`].
    Tangent(&'a Linearisation),
}

impl Springs<'_> {
    /// Returns the exact compliance of all springs together, which the update criterion monitors.
    pub fn compliance(&self) -> Compliance {
        match *self {
            Springs::Total { total, .. } => total,
            Springs::Roughness { total, smooth, .. } => total.subtract_series(smooth),
            Springs::Tangent(linearisation) => linearisation.compliance(),
        }
    }

    /// Returns kn and kt of each element \[N/m\], from the `normal_load` of each element \[N\]. The stiffnesses of the
    /// elements sum to the stiffness of the joint, unless [`SMALLEST_COMPLIANCE`] limits the stiffness. The kt of an
    /// element is computed along x and applies to both directions.
    ///
    /// # Errors
    /// Returns [`ModelUpdateError::Rigid`] if there is no finite spring.
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
                let shares = distribution.parts(elements, normal_load);
                Ok([kn, kt].map(|k| shares.iter().map(|share| k * share).collect()))
            }
            Springs::Tangent(linearisation) => {
                let fields = [&linearisation.kn, &linearisation.kt];
                Ok(fields.map(|k| never_negative(elements.integrals(&k.density[0]))))
            }
        }
    }
}

impl Distribution {
    /// Returns the share of each element. The shares sum to one, unless nothing is loaded.
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
        let sum: f64 = weights.iter().sum();
        weights
            .iter()
            .map(|w| if sum > 0.0 { w / sum } else { 0.0 })
            .collect()
    }
}

/// Sets negative stiffnesses to zero and keeps the sum. Under a common displacement, the force on a cell between loaded
/// neighbours may oppose the displacement. If all cells of an element have an opposing force, the stiffness of the
/// element would be negative.
fn never_negative(mut k: Vec<f64>) -> Vec<f64> {
    if k.iter().all(|&k| k >= 0.0) {
        return k;
    }
    let sum: f64 = k.iter().sum();
    k.iter_mut().for_each(|k| *k = k.max(0.0));
    let positive: f64 = k.iter().sum();
    k.iter_mut().for_each(|k| *k *= sum / positive);
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
    /// Sliders, if each element is a bank of them. The sliders of an element share the load and the stiffness of the
    /// element.
    pub sliders: Option<Sliders>,
}

impl ElementParameters {
    /// Computes the parameters from the static fine contact: `pressure` \[Pa\] and `gap` \[m\] on each fine cell [A
    /// §2e].
    ///
    /// # Errors
    /// Returns [`ModelUpdateError::Rigid`] if there is no finite spring.
    ///
    /// # Panics
    /// Panics if a field does not have one value per cell of the grid.
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

/// Returns the prescribed displacement of the fine contact, δ(t) = δ_spring(t) + c_bulk T(t). The equation holds if the
/// springs represent the roughness alone.
///
/// `spring` contains the displacement δ_spring of the springs \[m\], and `force` contains the tangential force T of the
/// joint \[N\]. Both have one list of samples per axis. `bulk` is the [`Compliance::tangential`] of the smooth patch
/// \[m/N\]. The value of `bulk` along x applies to both axes. The model of the structure contains the displacement of
/// the half spaces under T, and the springs do not. The displacement of the fine contact includes the displacement of
/// the half spaces.
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
