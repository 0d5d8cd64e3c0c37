//! Export of the contact elements of a committed iteration, and of their structure, for other programs.

use super::RunError;
use super::backbone::at_iteration;
use super::contact_state::harmonics_of;
use super::contact_state::parameters_of;
use super::dynamic_response::{contact_elements, dynamics_error};
use super::observer::Observer;
use super::recompute::require_own;
use super::solvers::{Solvers, element_layout, given_parameters};
use super::stage_inputs::StageInputs;
use crate::dynamics::{ContactElement, DynamicsError, Slider};
use crate::linalg::Matrix;
use crate::recipe::Inputs;
use crate::recipe::element_table::ElementTable;
use crate::store::RunReader;
use crate::structure::reduction::ContactPorts;
use crate::structure::superelement::model_matrices;
use crate::tables::typed;

/// Exported vibrating joint, in SI units. The first rows are the ports x, y, n of each contact element; n is positive
/// where the joint opens. The next rows are the ports of the loads and of the response. The last rows are the modes and
/// pseudo-modes of the structure.
pub struct ExportedContact {
    /// Current contact elements.
    pub table: ElementTable,
    /// Area of each element \[m²\]; 0 for an oscillator.
    pub areas: Vec<f64>,
    /// The bodies or faces that the elements connect.
    pub ports: ContactPorts,
    /// Matrices of stiffness, mass, viscous damping and hysteretic damping. The matrices include all contributions of
    /// the scene.
    pub matrices: [Matrix; 4],
    /// Points and axes of the ports after the contact ports.
    pub points: Vec<(String, usize)>,
    /// Loads: row, harmonic, cosine and sine coefficient \[N\].
    pub loads: Vec<(usize, u32, f64, f64)>,
    /// Row of the response.
    pub response: usize,
    /// Harmonics of the response, and number of samples per cycle at which elements are evaluated.
    pub orders: Vec<u32>,
    pub samples: usize,
    /// Frequency of the current response \[Hz\].
    pub driven_at: f64,
    /// Range of the search for the response \[Hz\].
    pub range: [f64; 2],
    /// Displacement coefficients of the current response \[m\], for the directions x, y, n of each element.
    /// [`ExportedContact::orders`] gives the order of the harmonics.
    pub displacement: Vec<f64>,
    /// The contact elements.
    pub elements: Vec<ContactElement>,
}

/// Reads a committed iteration of a run for export.
///
/// # Errors
/// [`RunError::OfAnotherScene`], and errors of reading the run.
///
/// # Panics
/// If the recipe lacks structure, response or contact.
pub fn exported_contact(
    reader: &RunReader,
    inputs: &Inputs,
    wear_iteration: u64,
    observer: &dyn Observer,
) -> Result<ExportedContact, RunError> {
    require_own(reader, wear_iteration)?;
    at_iteration(reader, inputs, wear_iteration, 1, observer, export)
}

fn export(reads: &StageInputs, solvers: &mut Solvers) -> Result<ExportedContact, RunError> {
    let vibration = solvers.vibration(reads)?;
    let row: typed::DynamicResponse = reads.table()?;
    let response: typed::Response = reads.table()?;
    let parameters = match reads.optional_table::<typed::ContactElement>()? {
        Some(rows) => parameters_of(&rows, reads.optional_table()?),
        None => given_parameters(reads),
    };
    let elements = contact_elements(reads, &parameters, row.stepped_part.unwrap_or(1.0));
    let layout = element_layout(reads);
    let springs = damping_springs(reads)?;
    let table = ElementTable::of(&elements, &layout, springs);
    let (harmonics, displacement) = harmonics_of(&response)?;
    let model = &vibration.model;
    let matrices = model_matrices(
        [
            &model.stiffness,
            &model.mass,
            &model.damping,
            &model.hysteretic,
        ],
        &model.basis,
        model.residual.as_ref(),
        model.contact_dofs,
    )
    .map_err(|source| {
        let what = "residual flexibility";
        dynamics_error(reads, DynamicsError::Matrix { what, source })
    })?;
    let points = reads.recipe.points();
    let contact = 3 * elements.len();
    let width = harmonics.coefficients();
    Ok(ExportedContact {
        areas: layout.areas.clone(),
        ports: reads
            .recipe
            .structure
            .as_ref()
            .map_or(ContactPorts::Faces, |structure| structure.contact_ports),
        matrices,
        points: points
            .iter()
            .map(|port| (port.at.clone(), port.axis))
            .collect(),
        loads: vibration
            .loads
            .iter()
            .map(|load| {
                // The sign follows the rows: positive where the joint opens.
                let opens = load.port < model.contact_dofs && load.port % 3 == 2;
                let sign = if opens { -1.0 } else { 1.0 };
                (
                    load.port,
                    load.harmonic,
                    sign * load.cosine,
                    sign * load.sine,
                )
            })
            .collect(),
        response: vibration.response_port,
        orders: harmonics.orders().to_vec(),
        samples: vibration.settings.samples,
        driven_at: row.resonance_frequency.unwrap_or(row.peak_frequency),
        range: {
            let (from, to) = vibration.range;
            [from, to].map(|omega| omega / std::f64::consts::TAU)
        },
        displacement: displacement[..contact * width].to_vec(),
        table,
        elements,
    })
}

/// Returns the springs that define the modal damping of the stuck joint.
fn damping_springs(reads: &StageInputs) -> Result<Vec<[f64; 2]>, RunError> {
    if let Some(rows) = reads.optional_table::<typed::ReferenceElement>()? {
        return Ok(rows
            .kn
            .iter()
            .zip(&rows.kt)
            .map(|(kn, kt)| [*kn, *kt])
            .collect());
    }
    let elements = reads.recipe.elements();
    let parameters = elements.and_then(crate::recipe::Elements::damping_parameters);
    let parameters = parameters.unwrap_or_default();
    Ok(parameters
        .kn
        .iter()
        .zip(&parameters.kt)
        .map(|(kn, kt)| [*kn, *kt])
        .collect())
}

/// Number of samples per cycle at which displacements are evaluated.
const INSTANTS: usize = 256;

impl ExportedContact {
    /// Returns the displacement x, y, n of an element over a cycle of the current response \[m\]. The displacement n is
    /// positive where the bodies approach.
    pub fn over_cycle(&self, element: usize) -> Vec<[f64; 3]> {
        let width = self.displacement.len() / (3 * self.elements.len());
        let rows = &self.displacement[3 * element * width..][..3 * width];
        samples_of(&self.orders, rows)
    }
}

/// `with_one_slider` computes the stiffness of a single slider by `HALVINGS` bisection steps. `LARGEST_STIFFNESS_RATIO`
/// bounds the ratio of the stiffness of the single slider to the stiffness of the bank.
const HALVINGS: usize = 60;
const LARGEST_STIFFNESS_RATIO: f64 = 1e6;

impl ExportedContact {
    /// Returns the same elements with a single slider each. The single slider has the strength and the normal stiffness
    /// of the sliders that bear load at rest. With the chosen tangential stiffness, the single slider and the bank
    /// dissipate the same energy over the current response. The single slider does not preserve the initial stiffness
    /// of the bank. If no stiffness gives the energy of the bank, the single slider has the total stiffness of the
    /// bank.
    pub fn with_one_slider(&self) -> ElementTable {
        let elements = self.elements.iter().enumerate();
        let rows = elements.map(|(e, element)| {
            let bears = element
                .sliders
                .iter()
                .any(|slider| slider.normal_load > 0.0);
            let active_sliders = || {
                let sliders = element.sliders.iter();
                sliders.filter(move |slider| !bears || slider.normal_load > 0.0)
            };
            let load: f64 = active_sliders().map(|slider| slider.normal_load).sum();
            let kn: f64 = active_sliders().map(|slider| slider.normal_stiffness).sum();
            let kt: f64 = active_sliders()
                .map(|slider| slider.tangential_stiffness)
                .sum();
            let gap = active_sliders()
                .map(|slider| slider.gap)
                .fold(f64::INFINITY, f64::min);
            let displacement = self.over_cycle(e);
            let with_stiffness = |tangential_stiffness: f64| ContactElement {
                sliders: vec![Slider {
                    normal_load: load,
                    gap,
                    tangential_stiffness,
                    normal_stiffness: kn,
                }],
                ..element.clone()
            };
            let energy = |kt: f64| with_stiffness(kt).cycle(&displacement).dissipated_energy;
            let bank_energy = element.cycle(&displacement).dissipated_energy;
            let (mut low, mut high) = (kt / LARGEST_STIFFNESS_RATIO, kt * LARGEST_STIFFNESS_RATIO);
            if bank_energy <= 0.0 || energy(high) < bank_energy || energy(low) > bank_energy {
                return [load, gap, kn, kt];
            }
            for _ in 0..HALVINGS {
                let middle = (low * high).sqrt();
                match energy(middle) < bank_energy {
                    true => low = middle,
                    false => high = middle,
                }
            }
            [load, gap, kn, high]
        });
        ElementTable {
            sliders: rows.collect(),
            element: (0..self.elements.len()).collect(),
            ..self.table.clone()
        }
    }
}

fn samples_of(orders: &[u32], rows: &[f64]) -> Vec<[f64; 3]> {
    let width = rows.len() / 3;
    let at = |row: &[f64], time: f64| -> f64 {
        // The mean has one coefficient. Each other order has a cosine and a sine coefficient.
        let terms = orders.iter().skip(1).enumerate().map(|(k, order)| {
            let angle = f64::from(*order) * time;
            row[1 + 2 * k] * angle.cos() + row[2 + 2 * k] * angle.sin()
        });
        row[0] + terms.sum::<f64>()
    };
    let instants = (0..INSTANTS).map(|k| std::f64::consts::TAU * k as f64 / INSTANTS as f64);
    instants
        .map(|time| [0, 1, 2].map(|axis| at(&rows[axis * width..][..width], time)))
        .collect()
}
