//! Source of the structure's matrices, and the settings of the structure's vibration.

use std::f64::consts::TAU;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::decision::Decisions;
use super::{BaseMotion, DampingBasis, Layout, Port, Reasons, Response};
use crate::dynamics::oscillator::mass_on_springs;
use crate::dynamics::reduced::{Damping, reduced_model, reference_springs};
use crate::dynamics::{
    BalanceSettings, ContactElement, DynamicsError, FrictionLaw, Harmonics, Load, SecondOrder,
    Spring, Vibration,
};
use crate::gauge::Gauge;
use crate::journal::Journal;
use crate::structure::contact_array::ContactArray;
use crate::structure::element::Formulation;
use crate::structure::imported::{EndsOfPreload, ImportError, ImportedStructure, UnitSystem};
use crate::structure::interface::{Interface, JointRequirements};
use crate::structure::matrices::Role;
use crate::structure::outline::Outline;
use crate::structure::reduction::{ContactPorts, ReducedStructure};
use crate::structure::resonator::Resonator;
use crate::threads::Threads;

/// A vibrating structure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Structure {
    /// Source of the structure.
    pub source: StructureSource,
    /// Number of elastic modes of the reduced structure.
    pub modes: usize,
    /// Position of the contact elements: on faces, or at nodes.
    pub contact_ports: ContactPorts,
    /// Reasons for the choices.
    pub why: Reasons,
}

/// Source of a structure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StructureSource {
    /// The single-lap-joint resonator, bonded without a contact.
    Resonator {
        /// Dimensions, mesh and material. The lap has the size and the elements of the joint.
        geometry: Box<Resonator>,
    },
    /// Stiffness and mass from another program.
    Matrices(Box<Import>),
    /// A single mass on springs and dampers, with one contact element to the ground.
    Oscillator {
        /// Mass along x, y, z \[kg\].
        mass: [f64; 3],
        /// Damping along x, y, z \[N s/m\].
        damping: [f64; 3],
        /// Stiffness without the contact along x, y, z \[N/m\].
        stiffness: [f64; 3],
        /// Nonlinear springs to the ground.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        springs: Vec<Spring>,
    },
}

/// Stiffness and mass matrices from another program, with their meaning.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Import {
    /// Absolute paths of the files. The paths are not part of a recipe.
    #[serde(skip)]
    pub files: ImportFiles,
    /// Name of the file format; `None` to detect it from the content.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
    /// Units of the files.
    pub unit: UnitSystem,
    /// Fixed degrees of freedom.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed: Option<String>,
    /// Node sets at the joint; `None` if a file lists pairs of nodes.
    #[serde(rename = "interface", default, skip_serializing_if = "Option::is_none")]
    pub sets: Option<JointSets>,
    /// Requirements on the joint.
    #[serde(flatten)]
    pub wanted: JointRequirements,
    /// Hash of the files; `None` before they are read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content: Option<String>,
    /// Points at which forces act and displacements are evaluated; empty before the files are read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<String>,
    /// Points at which a preload acts; `None` before the files are read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preload: Option<EndsOfPreload>,
    /// Formulation of the finite elements, if all of them are hexahedra.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hexahedra: Option<Formulation>,
    /// True if the files contain a damping matrix.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub has_damping: bool,
    /// True if the files contain finite elements, whose edges can be drawn.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub has_outline: bool,
    /// Stiffness of the nodes per side length of a contact element \[Pa\]; `None` before the files are read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub apparent_modulus: Option<f64>,
    /// The joint; `None` before the files are read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<Interface>,
}

/// Paths of the files of a structure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImportFiles {
    /// Paths of the matrix files. Each path has the role of the matrix in the file. The role is `None` for a file with
    /// several matrices.
    pub matrices: Vec<(Option<Role>, PathBuf)>,
    /// Positions of nodes.
    pub nodes: Option<PathBuf>,
    /// Pairs of nodes at the joint.
    pub pairs: Option<PathBuf>,
}

/// Node sets that face each other at the joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointSets {
    /// Node set of the upper body.
    pub upper: String,
    /// Node set of the lower body.
    pub lower: String,
}

impl From<Import> for StructureSource {
    fn from(import: Import) -> Self {
        StructureSource::Matrices(Box::new(import))
    }
}

impl From<Resonator> for StructureSource {
    fn from(geometry: Resonator) -> Self {
        StructureSource::Resonator {
            geometry: Box::new(geometry),
        }
    }
}

impl StructureSource {
    /// Creates an oscillator. Each argument lists the values along x, y, z: mass \[kg\], damping \[N s/m\] and
    /// stiffness \[N/m\].
    pub fn oscillator(mass: [f64; 3], damping: [f64; 3], stiffness: [f64; 3]) -> Self {
        StructureSource::Oscillator {
            mass,
            damping,
            stiffness,
            springs: Vec::new(),
        }
    }

    /// Adds nonlinear springs between the oscillator and the ground. `cubic` is the cubic stiffness along x, y, z
    /// \[N/m³\]. `stop` and `gap` are the stiffness \[N/m\] and the gap \[m\] of the stops along x, y, z. A stiffness
    /// of zero adds no spring.
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

    /// Returns the nonlinear springs.
    pub fn springs(&self) -> &[Spring] {
        match self {
            StructureSource::Oscillator { springs, .. } => springs,
            _ => &[],
        }
    }

    /// Returns the geometry of a resonator; `None` for other structures.
    pub fn resonator(&self) -> Option<&Resonator> {
        match self {
            StructureSource::Resonator { geometry } => Some(geometry),
            _ => None,
        }
    }

    /// Returns the import from another program; `None` for other structures.
    pub fn import(&self) -> Option<&Import> {
        match self {
            StructureSource::Matrices(import) => Some(import),
            _ => None,
        }
    }

    /// Returns the import from another program, mutably, to complete it from its files; `None` for other structures.
    pub fn import_mut(&mut self) -> Option<&mut Import> {
        match self {
            StructureSource::Matrices(import) => Some(import),
            _ => None,
        }
    }

    /// Returns true for an oscillator.
    pub fn is_oscillator(&self) -> bool {
        matches!(self, StructureSource::Oscillator { .. })
    }

    /// Returns the array of contact elements; `None` for an oscillator, and before the files are read.
    pub fn contact_array(&self) -> Option<ContactArray> {
        match self {
            StructureSource::Resonator { geometry } => Some(geometry.contact_array()),
            StructureSource::Matrices(import) => {
                import.joint.as_ref().map(|joint| joint.array.clone())
            }
            StructureSource::Oscillator { .. } => None,
        }
    }

    /// Returns the thickness of the layers of finite elements, starting at the joint \[m\]; empty if it is not known.
    pub fn layers(&self) -> Vec<f64> {
        match self {
            StructureSource::Resonator { geometry } => geometry.layers(),
            StructureSource::Matrices(import) => {
                let joint = import.joint.as_ref();
                joint.map_or_else(Vec::new, |joint| joint.layers.clone())
            }
            StructureSource::Oscillator { .. } => Vec::new(),
        }
    }

    /// Returns the finite element formulation of the mesh. If the matrices do not state the formulation, the function
    /// returns the formulation without locking.
    pub fn formulation(&self) -> Formulation {
        let import = self.import();
        import
            .and_then(|import| import.hexahedra)
            .unwrap_or_default()
    }

    /// Returns the number of contact elements, if there is a contact.
    pub fn contact_elements(&self, ports: ContactPorts) -> usize {
        if self.is_oscillator() {
            return 1;
        }
        self.contact_array().map_or(0, |array| match ports {
            ContactPorts::Faces => array.cells().len(),
            ContactPorts::Nodes => array.nodes().len(),
        })
    }

    /// Returns the names of the points for forces and responses. The first point is the default. The list is empty for
    /// an imported structure, because the files of the structure define the points.
    pub fn points(&self) -> &'static [&'static str] {
        match self {
            StructureSource::Matrices(_) => &[],
            StructureSource::Resonator { .. } => &["far_wall", "block"],
            StructureSource::Oscillator { .. } => &["mass"],
        }
    }

    /// Returns mass \[kg\], damping \[N s/m\] and stiffness \[N/m\] of an oscillator along an axis.
    pub fn oscillator_along(&self, axis: usize) -> Option<[f64; 3]> {
        match self {
            StructureSource::Oscillator {
                mass,
                damping,
                stiffness,
                ..
            } => Some([mass[axis], damping[axis], stiffness[axis]]),
            _ => None,
        }
    }

    /// Returns a text with the reason for the kind of the structure.
    pub fn why(&self) -> &'static str {
        match self {
            StructureSource::Resonator { .. } | StructureSource::Matrices(_) => {
                "computed once and shared between runs by its content"
            }
            StructureSource::Oscillator { .. } => "structure.kind = \"oscillator\"",
        }
    }
}

impl Structure {
    /// Returns true for a structure that is reduced to modes before it vibrates.
    pub fn is_reduced(&self) -> bool {
        !self.source.is_oscillator()
    }

    /// Reduces the structure. Returns the reduced structure and the outline of the structure, or `None` for a structure
    /// that needs no reduction. `imported` contains the matrices of a structure that comes from files.
    ///
    /// # Errors
    /// Returns [`ImportError`] if the mesher rejects the geometry, if the matrices do not describe a structure, or if
    /// the eigenvalue solver does not find the modes.
    ///
    /// # Panics
    /// Panics if the structure comes from files and `imported` is missing.
    pub fn reduce(
        &self,
        imported: Option<&ImportedStructure>,
    ) -> Result<Option<(ReducedStructure, Option<Outline>)>, ImportError> {
        let (modes, ports) = (self.modes, self.contact_ports);
        Ok(match &self.source {
            StructureSource::Oscillator { .. } => None,
            StructureSource::Resonator { geometry } => {
                let (reduced, outline) = geometry.reduce(modes, ports)?;
                Some((reduced, Some(outline)))
            }
            StructureSource::Matrices(_) => {
                let imported = imported.expect("the files of a run are read before it begins");
                Some(imported.reduce(modes, ports)?)
            }
        })
    }

    /// Returns the peak memory of [`Structure::reduce`] \[B\]; `None` if no reduction is needed or possible.
    pub fn memory_to_reduce(&self, imported: Option<&ImportedStructure>) -> Option<f64> {
        match &self.source {
            StructureSource::Oscillator { .. } => None,
            StructureSource::Resonator { geometry } => geometry.memory_to_reduce(self.modes).ok(),
            StructureSource::Matrices(_) => {
                let bytes = imported?.memory_to_reduce(self.modes, self.contact_ports);
                bytes.ok()
            }
        }
    }

    /// Adds the springs of an oscillator to the contact element of the oscillator. If the joint has no contact element,
    /// the function creates an element that has only the springs of the oscillator.
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

    /// Explains the structure.
    pub(super) fn explain(&self, decisions: &mut Decisions) {
        let source = match &self.source {
            StructureSource::Resonator { .. } => format!(
                "resonator: {} elastic modes, and the residual of all others",
                self.modes
            ),
            StructureSource::Matrices(import) => {
                let joint = import
                    .joint
                    .as_ref()
                    .map_or_else(String::new, |joint| joint.describe());
                format!(
                    "matrices: {} elastic modes, and the residual of all others{joint}",
                    self.modes
                )
            }
            StructureSource::Oscillator { .. } => "one mass, three degrees of freedom".to_owned(),
        };
        decisions.add("structure", source, self.why.of("source"));
        for spring in self.source.springs() {
            let axis = ["x", "y", "z"][spring.direction()];
            let law = match spring {
                Spring::Cubic { stiffness, .. } => format!("cubic along {axis}: {stiffness} N/m³"),
                Spring::Stop { stiffness, gap, .. } => {
                    format!("stop along {axis}: {stiffness} N/m beyond {gap} m")
                }
            };
            decisions.add("spring", law, "sampled, because its force is nonlinear");
        }
    }

    /// Returns the layout of the contact elements.
    pub fn layout(&self) -> Layout {
        match &self.source {
            StructureSource::Oscillator { .. } => Layout {
                centres: vec![[0.0; 2]],
                areas: vec![0.0],
                lever: 0.0,
            },
            _ => {
                let array = self.source.contact_array().unwrap_or_default();
                let places = match self.contact_ports {
                    ContactPorts::Faces => array.faces(),
                    ContactPorts::Nodes => array.nodes(),
                };
                let (centres, areas) = places.into_iter().unzip();
                Layout {
                    centres,
                    areas,
                    lever: 0.5 * array.size[0],
                }
            }
        }
    }

    /// Returns the ports of the loads and of the response, each port once, in a fixed order. The list does not include
    /// the contact ports. An oscillator with a contact has no other ports, because the mass of the oscillator is the
    /// contact port.
    pub fn points(&self, response: &Response, has_contact: bool) -> Vec<Port> {
        match &self.source {
            StructureSource::Oscillator { .. } if has_contact => Vec::new(),
            StructureSource::Oscillator { .. } => (0..3)
                .map(|axis| Port {
                    at: response.at.at.clone(),
                    axis,
                })
                .collect(),
            _ => {
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

    /// Returns the model of the vibration without contact elements. `reduced` is the reduced structure, or `None` for
    /// an oscillator. Modal damping of the stuck joint uses the `unworn` contact elements.
    ///
    /// # Errors
    /// Returns [`DynamicsError`] for invalid parameters of the vibration.
    ///
    /// # Panics
    /// Panics if the structure needs a reduction and `reduced` is missing.
    pub fn vibration(
        &self,
        response: &Response,
        has_contact: bool,
        reduced: Option<&ReducedStructure>,
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
                let oscillator = mass_on_springs(*mass, *damping, *stiffness, 3 * unworn.len())?;
                (
                    with_damping_ratio(oscillator, response.damping_ratio, springs)?,
                    None,
                )
            }
            _ => {
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
                let model = reduced_model(reduced, &numbers, damping)?;
                if let Some([_, to]) = response.frequency {
                    model.require_modes_up_to(TAU * to, "dynamics.frequency")?;
                }
                if let Some(at) = response.at_frequency {
                    model.require_modes_up_to(TAU * at, "dynamics.at")?;
                }
                (model, Some(reduced.ports.contact_ports()))
            }
        };
        let model = match response.rayleigh {
            Some(rayleigh) => {
                let no_springs = vec![0.0; model.contact_dofs];
                model.with_rayleigh_damping(rayleigh, springs.unwrap_or(&no_springs))?
            }
            None => model,
        };
        let model = model.with_loss_factor(response.loss_factor);
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
        let [from, to] = response
            .frequency
            .or(response.frequencies_in_force())
            .expect("a scene has a range or a frequency");
        Ok(Vibration {
            loads,
            inertial_loads,
            response_port: number(&response.at),
            harmonics: Harmonics::new(&response.harmonics)?,
            settings: BalanceSettings {
                samples: response.samples,
                ..BalanceSettings::default()
            },
            at_omega: response.at_frequency.map(|at| at * TAU),
            range: (from * TAU, to * TAU),
            points: response.points,
            gauge: Gauge::default(),
            journal: Journal::default(),
            threads: Threads::default(),
            model,
        })
    }
}

/// Adds modal damping with the damping ratio `ratio` to the dampers of an oscillator.
fn with_damping_ratio(
    mut model: SecondOrder,
    ratio: f64,
    springs: Option<&[f64]>,
) -> Result<SecondOrder, DynamicsError> {
    if ratio > 0.0 {
        let dampers = model.damping.clone();
        let no_springs = vec![0.0; model.contact_dofs];
        model = model.with_damping_ratio(ratio, springs.unwrap_or(&no_springs))?;
        for axis in 0..3 {
            let sum = model.damping.at(axis, axis) + dampers.at(axis, axis);
            model.damping.set(axis, axis, sum);
        }
    }
    Ok(model)
}
