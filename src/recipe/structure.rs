//! Where a structure comes from, and its vibration.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::decision::Told;
use super::{BaseMotion, DampingBasis, Layout, Port, Reasons, Response};
use crate::dynamics::oscillator::mass_on_springs;
use crate::dynamics::reduced::{Damping, reduced_model, reference_springs};
use crate::dynamics::{
    ContactElement, DynamicsError, FrictionLaw, Harmonics, Load, SecondOrder, Settings, Spring,
    Vibration,
};
use crate::gauge::Gauge;
use crate::journal::Journal;
use crate::structure::StructureError;
use crate::structure::reduction::{ContactPorts, Reduced};
use crate::structure::resonator::{Outline, Resonator};

/// What vibrates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Structure {
    /// Where it comes from.
    pub source: StructureSource,
    /// Elastic modes that are kept of it.
    pub modes: usize,
    /// What its contact elements are.
    #[serde(default, skip_serializing_if = "ContactPorts::are_faces")]
    pub contact_ports: ContactPorts,
    /// The reasons.
    pub why: Reasons,
}

/// Where a structure comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StructureSource {
    /// The single-lap-joint resonator, bonded without a contact.
    Resonator {
        /// Its dimensions, mesh and material; the lap has the size and the elements of the joint.
        geometry: Box<Resonator>,
    },
    /// One mass on springs and dampers, and one contact element to the ground.
    Oscillator {
        /// Mass along x, y, z \[kg\].
        mass: [f64; 3],
        /// Damping along x, y, z \[N s/m\].
        damping: [f64; 3],
        /// Stiffness without the contact along x, y, z \[N/m\].
        stiffness: [f64; 3],
        /// Springs to the ground whose force is no multiple of displacement.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        springs: Vec<Spring>,
    },
}

impl From<Resonator> for StructureSource {
    fn from(geometry: Resonator) -> Self {
        StructureSource::Resonator {
            geometry: Box::new(geometry),
        }
    }
}

impl StructureSource {
    /// An oscillator of mass \[kg\], damping \[N s/m\] and stiffness \[N/m\] along x, y, z.
    pub fn oscillator(mass: [f64; 3], damping: [f64; 3], stiffness: [f64; 3]) -> Self {
        StructureSource::Oscillator {
            mass,
            damping,
            stiffness,
            springs: Vec::new(),
        }
    }

    /// An oscillator with other springs to the ground: cubic stiffness \[N/m³\], stiffness \[N/m\] and gap \[m\] of stops along
    /// x, y, z; those of no stiffness are none.
    pub fn with_springs(mut self, cubic: [f64; 3], stop: [f64; 3], gap: [f64; 3]) -> Self {
        if let StructureSource::Oscillator { springs, .. } = &mut self {
            for direction in 0..3 {
                if cubic[direction] != 0.0 {
                    springs.push(Spring::Cubic {
                        direction,
                        stiffness: cubic[direction],
                    });
                }
                if stop[direction] > 0.0 {
                    springs.push(Spring::Stop {
                        direction,
                        stiffness: stop[direction],
                        gap: gap[direction],
                    });
                }
            }
        }
        self
    }

    /// Springs whose force is no multiple of displacement.
    pub fn springs(&self) -> &[Spring] {
        match self {
            StructureSource::Resonator { .. } => &[],
            StructureSource::Oscillator { springs, .. } => springs,
        }
    }

    /// The geometry of what is meshed and reduced; none of an oscillator.
    pub fn resonator(&self) -> Option<&Resonator> {
        match self {
            StructureSource::Resonator { geometry } => Some(geometry),
            StructureSource::Oscillator { .. } => None,
        }
    }

    /// Number of its contact elements, where there is a contact.
    pub fn contact_elements(&self, ports: ContactPorts) -> usize {
        match (self, ports) {
            (StructureSource::Oscillator { .. }, _) => 1,
            (StructureSource::Resonator { geometry }, ContactPorts::Faces) => {
                geometry.contact_cells().len()
            }
            (StructureSource::Resonator { geometry }, ContactPorts::Nodes) => {
                geometry.contact_nodes().len()
            }
        }
    }

    /// Names of the points at which forces act and displacements are read, the usual one first.
    pub fn points(&self) -> &'static [&'static str] {
        match self {
            StructureSource::Resonator { .. } => &["far_wall", "block"],
            StructureSource::Oscillator { .. } => &["mass"],
        }
    }

    /// Mass \[kg\], damping \[N s/m\] and stiffness \[N/m\] along an axis, of an oscillator.
    pub fn oscillator_along(&self, axis: usize) -> Option<[f64; 3]> {
        match self {
            StructureSource::Resonator { .. } => None,
            StructureSource::Oscillator {
                mass,
                damping,
                stiffness,
                ..
            } => Some([mass[axis], damping[axis], stiffness[axis]]),
        }
    }

    /// Why it is there.
    pub fn why(&self) -> &'static str {
        match self {
            StructureSource::Resonator { .. } => {
                "computed once and shared between runs by its content"
            }
            StructureSource::Oscillator { .. } => "structure.kind = \"oscillator\"",
        }
    }
}

impl Structure {
    /// True of a structure that is reduced to modes before it vibrates.
    pub fn is_reduced(&self) -> bool {
        self.source.resonator().is_some()
    }

    /// The reduced structure and its outline; none of one that needs no reduction.
    ///
    /// # Errors
    /// [`StructureError`] for a geometry that cannot be meshed, and for modes that are not found.
    pub fn reduce(&self) -> Result<Option<(Reduced, Outline)>, StructureError> {
        let resonator = self.source.resonator();
        resonator
            .map(|r| r.reduce(self.modes, self.contact_ports))
            .transpose()
    }

    /// Adds the springs of an oscillator to its contact element, or makes one of them alone where it has no contact.
    pub fn add_springs(&self, elements: &mut Vec<ContactElement>) {
        let springs = self.source.springs();
        if springs.is_empty() {
            return;
        }
        if elements.is_empty() {
            elements.push(ContactElement {
                area: 0.0,
                friction_coefficient: 0.0,
                law: FrictionLaw::default(),
                sliders: Vec::new(),
                springs: Vec::new(),
            });
        }
        elements[0].springs = springs.to_vec();
    }

    /// Says what the structure is.
    pub(super) fn tell(&self, told: &mut Told) {
        let source = match &self.source {
            StructureSource::Resonator { .. } => format!(
                "resonator: {} elastic modes, and the residual of all others",
                self.modes
            ),
            StructureSource::Oscillator { .. } => "one mass, three degrees of freedom".to_owned(),
        };
        told.add("structure", source, self.why.of("source"));
        for spring in self.source.springs() {
            let axis = ["x", "y", "z"][spring.direction()];
            let told_as = match spring {
                Spring::Cubic { stiffness, .. } => format!("cubic along {axis}: {stiffness} N/m³"),
                Spring::Stop { stiffness, gap, .. } => {
                    format!("stop along {axis}: {stiffness} N/m beyond {gap} m")
                }
            };
            told.add(
                "spring",
                told_as,
                "sampled, as its force is no multiple of displacement",
            );
        }
    }

    /// Where the contact elements are.
    pub fn layout(&self) -> Layout {
        match &self.source {
            StructureSource::Oscillator { .. } => Layout {
                centres: vec![[0.0; 2]],
                areas: vec![0.0],
                lever: 0.0,
            },
            StructureSource::Resonator { geometry } => {
                let (centres, areas) = match self.contact_ports {
                    ContactPorts::Faces => {
                        let centres = geometry.contact_centres();
                        let areas = vec![geometry.contact_area(); centres.len()];
                        (centres, areas)
                    }
                    ContactPorts::Nodes => geometry.contact_nodes().into_iter().unzip(),
                };
                Layout {
                    centres,
                    areas,
                    lever: 0.5 * geometry.lap_length,
                }
            }
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
                ..
            } => {
                let own = mass_on_springs(*mass, *damping, *stiffness, 3 * unworn.len())?;
                (
                    with_damping_ratio(own, response.damping_ratio, springs)?,
                    None,
                )
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
        let model = match response.rayleigh {
            Some(rayleigh) => {
                let none = vec![0.0; model.contact_dofs];
                model.with_rayleigh_damping(rayleigh, springs.unwrap_or(&none))?
            }
            None => model,
        };
        let number = |port: &Port| first.map_or(port.axis, |first| first + place(port));
        let mut loads: Vec<Load> = response
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
            .collect();
        let mut inertial_loads = Vec::new();
        if let (Some(base), StructureSource::Oscillator { mass, .. }) =
            (response.base, &self.source)
        {
            let load = base.load(mass[base.axis]);
            match base.motion {
                BaseMotion::Acceleration(_) => loads.push(load),
                BaseMotion::Displacement(_) => inertial_loads.push(load),
            }
        }
        Ok(Vibration {
            loads,
            inertial_loads,
            response_port: number(&response.at),
            harmonics: Harmonics::new(&response.harmonics)?,
            settings: Settings {
                samples: response.samples,
                by_events: response.events,
                ..Settings::default()
            },
            range: (response.frequency[0] * TAU, response.frequency[1] * TAU),
            points: response.points,
            gauge: Gauge::default(),
            journal: Journal::default(),
            model,
        })
    }
}

/// An oscillator with a damping ratio beside its dampers.
fn with_damping_ratio(
    mut model: SecondOrder,
    ratio: f64,
    springs: Option<&[f64]>,
) -> Result<SecondOrder, DynamicsError> {
    if ratio > 0.0 {
        let own = model.damping.clone();
        let none = vec![0.0; model.contact_dofs];
        model = model.with_damping_ratio(ratio, springs.unwrap_or(&none))?;
        for axis in 0..3 {
            let sum = model.damping.at(axis, axis) + own.at(axis, axis);
            model.damping.set(axis, axis, sum);
        }
    }
    Ok(model)
}
