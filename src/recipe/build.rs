//! From a recipe to what computes it. Nothing is chosen here.

use std::f64::consts::TAU;

use super::{
    Cells, Contact, Cycle, DampingBasis, ElementStiffness, Elements, Motion, Port, Recipe,
    Response, Structure, StructureSource, Surface,
};
use crate::contact::HalfSpace;
use crate::contact::normal::NormalOptions;
use crate::contact::tangential::TangentialOptions;
use crate::dynamics::oscillator::mass_on_springs;
use crate::dynamics::reduced::{Damping, reduced_model, reference_springs};
use crate::dynamics::{
    ContactElement, DynamicsError, Harmonics, Load, SecondOrder, Settings, Vibration,
};
use crate::grid::Patch;
use crate::model_update::{ContactElements, ElementParameters, ModelUpdateError};
use crate::structure::reduction::Reduced;
use crate::wear::cycle::March;
use crate::wear::joint::FrettingOptions;
use crate::wear::{self, FrettingJoint};

/// A computed motion that varies the load by less than this share of it, and leaves its line by less than this share of its
/// reach, is marched between its two reversals: the error of wear is of second order in both.
pub const STRAIGHT: f64 = 0.01;

/// A motion that the cycle of a recipe cannot march.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CycleError {
    /// `reversal` or `superposition` for another motion than they can march.
    #[error(
        "`fidelity.cycle` is \"{mode}\", which needs a straight motion about zero that turns at its ends only, under constant normal load; use \"stepped\""
    )]
    NotStraight {
        /// The value of `fidelity.cycle`.
        mode: &'static str,
    },
    /// The load lifts off within the cycle.
    #[error(
        "the normal load falls to {load:.6e} N within the cycle; it must stay above zero: make `motion.normal_load_amplitude` smaller than `contact.normal_load`"
    )]
    LiftsOff {
        /// The least load \[N\].
        load: f64,
    },
}

/// Where the contact elements of a structure are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// Centres (x, y), from the middle of the joint \[m\].
    pub centres: Vec<[f64; 2]>,
    /// Area of each \[m²\]; 0 for that of an oscillator.
    pub area: f64,
    /// Half the length of the joint along x \[m\].
    pub lever: f64,
}

impl Surface {
    /// The contact elements whose cells are those of the joint, if they are.
    ///
    /// # Errors
    /// [`ModelUpdateError`] where the grid is coarser than the elements.
    pub fn contact_elements(&self) -> Result<Option<ContactElements>, ModelUpdateError> {
        let Cells::Elements { counts, absent } = &self.cells else {
            return Ok(None);
        };
        let all = (0..counts[0]).flat_map(|i| (0..counts[1]).map(move |j| [i, j]));
        let cells: Vec<[usize; 2]> = all.filter(|cell| !absent.contains(cell)).collect();
        ContactElements::new(self.grid(), *counts, &cells).map(Some)
    }

    /// The grid and the cells of it that belong to the joint.
    ///
    /// # Errors
    /// As for [`Surface::contact_elements`].
    pub fn patch(&self) -> Result<Patch, ModelUpdateError> {
        Ok(match (self.contact_elements()?, &self.cells) {
            (Some(elements), _) => elements.patch().clone(),
            (None, Cells::Hole { diameter }) => Patch::with_hole(self.grid(), *diameter),
            (None, _) => Patch::full(self.grid()),
        })
    }
}

impl Contact {
    /// The joint on the given unworn heights, under this motion.
    pub fn joint(
        &self,
        cycle: Option<&Cycle>,
        patch: Patch,
        height: Vec<f64>,
        motion: wear::Motion,
    ) -> FrettingJoint {
        FrettingJoint {
            half_space: HalfSpace::new(patch.grid, self.bodies, self.boundary),
            patch,
            height,
            pressure_cap: self.pressure_cap,
            friction_coefficient: self.friction_coefficient.unwrap_or(0.0),
            rotation: self.rotation,
            motion,
            march: cycle
                .and_then(|cycle| cycle.march)
                .unwrap_or(March::Reversal),
            options: FrettingOptions {
                normal: NormalOptions {
                    tolerance: self.normal_tolerance,
                    ..NormalOptions::default()
                },
                tangential: TangentialOptions {
                    tolerance: self.tangential_tolerance,
                    ..TangentialOptions::default()
                },
                cycle_tolerance: self.cycle_tolerance,
                extrapolate: cycle.is_some_and(|cycle| cycle.extrapolate),
            },
        }
    }
}

impl Cycle {
    /// The motion that the numbers of the recipe give; that of a file, and one that is computed, are none.
    pub fn harmonic_motion(&self, normal_load: f64) -> Option<wear::Motion> {
        let Motion::Harmonic {
            axes,
            rotation,
            normal_load_amplitude,
        } = &self.motion
        else {
            return None;
        };
        Some(wear::Motion::driven(
            axes,
            *rotation,
            normal_load,
            *normal_load_amplitude,
            self.steps,
        ))
    }

    /// The motion that is marched for a computed one, and how: between its reversals where it is straight and steady enough, else at
    /// `steps` of its samples.
    ///
    /// `fine` has many samples, a multiple of `steps`.
    ///
    /// # Errors
    /// [`CycleError::NotStraight`] where `reversal` is asked for and not possible, [`CycleError::LiftsOff`].
    pub fn of_computed(&self, fine: &wear::Motion) -> Result<(wear::Motion, March), CycleError> {
        let loads = fine.normal_load.iter().copied();
        let least = loads.fold(f64::INFINITY, f64::min);
        if least <= 0.0 {
            return Err(CycleError::LiftsOff { load: least });
        }
        let stepped = || {
            let every = fine.samples() / self.steps;
            (fine.every(every.max(1)).about_its_middle(), March::Stepped)
        };
        if self.asked == Some(March::Stepped) {
            return Ok(stepped());
        }
        match (fine.reversals(STRAIGHT), self.asked) {
            (Some(motion), Some(March::Superposition)) => Ok((motion, March::Superposition)),
            (Some(motion), _) => Ok((motion, March::Reversal)),
            (None, Some(march)) => Err(CycleError::NotStraight { mode: march.word() }),
            (None, None) => Ok(stepped()),
        }
    }
}

impl March {
    /// The word for it in a scene.
    pub fn word(self) -> &'static str {
        match self {
            March::Superposition => "superposition",
            March::Reversal => "reversal",
            March::Stepped => "stepped",
        }
    }
}

impl Elements {
    /// The contact elements with these parameters.
    pub fn with(&self, layout: &Layout, parameters: &ElementParameters) -> Vec<ContactElement> {
        (0..parameters.normal_load.len())
            .map(|e| ContactElement {
                area: layout.area,
                friction_coefficient: self.friction_coefficient,
                normal_load: parameters.normal_load[e],
                gap: parameters.gap[e],
                tangential_stiffness: parameters.kt[e],
                normal_stiffness: parameters.kn[e],
                law: self.friction_law,
            })
            .collect()
    }

    /// Parameters of elements whose stiffness is given: load and stiffness by area.
    pub fn given(&self) -> Option<ElementParameters> {
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
        })
    }
}

impl Structure {
    /// Where the contact elements are.
    pub fn layout(&self) -> Layout {
        match &self.source {
            StructureSource::Oscillator { .. } => Layout {
                centres: vec![[0.0; 2]],
                area: 0.0,
                lever: 0.0,
            },
            StructureSource::Resonator { geometry } => Layout {
                centres: geometry.contact_centres(),
                area: geometry.contact_area(),
                lever: 0.5 * geometry.lap_length,
            },
        }
    }

    /// Contact elements along x and y, were there no hole, and the side lengths that they cover \[m\]; none where there is one alone.
    pub fn lattice(&self) -> Option<([usize; 2], [f64; 2])> {
        match &self.source {
            StructureSource::Oscillator { .. } => None,
            StructureSource::Resonator { geometry } => Some((
                [geometry.lap_cells; 2],
                [geometry.lap_length, geometry.arm_height],
            )),
        }
    }

    /// The ports of the vibration that are no contact ports, in their order: those of the loads and of the response, each once.
    /// The mass of an oscillator is its contact, unless it has none.
    pub fn points(&self, response: &Response, has_contact: bool) -> Vec<Port> {
        match &self.source {
            StructureSource::Oscillator { .. } if has_contact => Vec::new(),
            StructureSource::Oscillator { .. } => (0..3)
                .map(|axis| Port {
                    at: response.at.at.clone(),
                    axis,
                })
                .collect(),
            StructureSource::Resonator { .. } => {
                let mut points: Vec<Port> = Vec::new();
                let loads = response.forces.iter().map(|force| &force.port);
                for port in loads.chain([&response.at]) {
                    if !points.contains(port) {
                        points.push(port.clone());
                    }
                }
                points
            }
        }
    }

    /// The vibration, but for its contact elements. `reduced` is the structure, none for an oscillator; damping in modes of the stuck
    /// joint is that of the `unworn` contact elements.
    ///
    /// # Errors
    /// [`DynamicsError`] for numbers that the dynamics refuses.
    ///
    /// # Panics
    /// On a resonator that is not reduced.
    pub fn vibration(
        &self,
        response: &Response,
        has_contact: bool,
        reduced: Option<&Reduced>,
        unworn: &[ContactElement],
    ) -> Result<Vibration, DynamicsError> {
        let springs = reference_springs(unworn);
        let springs = (response.damping_basis == DampingBasis::Stuck).then_some(&springs[..]);
        let points = self.points(response, has_contact);
        let place = |port: &Port| points.iter().position(|p| p == port).unwrap_or(0);
        let (model, first): (SecondOrder, Option<usize>) = match &self.source {
            StructureSource::Oscillator {
                mass,
                damping,
                stiffness,
            } => {
                let own = mass_on_springs(*mass, *damping, *stiffness, 3 * unworn.len())?;
                (damped(own, response, springs)?, None)
            }
            StructureSource::Resonator { .. } => {
                let reduced = reduced.expect("the structure is reduced before it vibrates");
                let numbers: Option<Vec<usize>> = points
                    .iter()
                    .map(|port| reduced.ports.of_point(&port.at, port.axis))
                    .collect();
                let numbers = numbers.expect("a recipe has the points of its structure");
                let damping = Damping {
                    ratio: response.damping_ratio,
                    springs,
                };
                (
                    reduced_model(reduced, &numbers, damping)?,
                    Some(reduced.ports.contact_ports()),
                )
            }
        };
        let number = |port: &Port| first.map_or(port.axis, |first| first + place(port));
        Ok(Vibration {
            loads: response
                .forces
                .iter()
                .map(|force| Load {
                    port: number(&force.port),
                    harmonic: force.harmonic,
                    cosine: force.amplitude * force.phase.cos(),
                    sine: if force.harmonic == 0 {
                        0.0
                    } else {
                        -force.amplitude * force.phase.sin()
                    },
                })
                .collect(),
            response_port: number(&response.at),
            harmonics: Harmonics::new(&response.harmonics)?,
            settings: Settings {
                samples: response.samples,
                ..Settings::default()
            },
            range: (response.frequency[0] * TAU, response.frequency[1] * TAU),
            model,
        })
    }
}

/// An oscillator with a damping ratio beside its dampers.
fn damped(
    mut model: SecondOrder,
    response: &Response,
    springs: Option<&[f64]>,
) -> Result<SecondOrder, DynamicsError> {
    if response.damping_ratio > 0.0 {
        let own = model.damping.clone();
        let none = vec![0.0; model.contact_dofs];
        model = model.with_damping_ratio(response.damping_ratio, springs.unwrap_or(&none))?;
        for axis in 0..3 {
            let sum = model.damping.at(axis, axis) + own.at(axis, axis);
            model.damping.set(axis, axis, sum);
        }
    }
    Ok(model)
}

impl Recipe {
    /// The ports of the vibration that are no contact ports; of none without vibration.
    pub fn points(&self) -> Vec<Port> {
        match (&self.structure, &self.response) {
            (Some(structure), Some(response)) => {
                structure.points(response, self.elements().is_some())
            }
            _ => Vec::new(),
        }
    }
}
