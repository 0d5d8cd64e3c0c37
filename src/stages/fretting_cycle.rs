//! The steady fretting cycle of an iteration.

use super::RunError;
use super::computed_motion::{
    ComputedMotion, DrivingMotion, ElementFigures, ElementMotion, set_motion,
};
use super::contact_state::{Fields, StaticState, tangential_compliance};
use super::cycle_check::{REMAINING_ERROR, stepped_part};
use super::declaration::{Declaration, joined};
use super::error_bars::UNKNOWN;
use super::reduced;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use super::summary::is_periodic;
use crate::dynamics::cycle::half_range;
use crate::grid::Patch;
use crate::model_update::CycleFigures;
use crate::recipe::{Cycle, CycleFields, Part};
use crate::tables::{TableName, typed};
use crate::wear::curves::{self, Curve};
use crate::wear::cycle::{Instant, March};
use crate::wear::fields::InstantFields;
use crate::wear::implicit::EndCycle;
use crate::wear::slip_band::SlipBand;

/// Shear, slip and dissipation over the steady cycle, [A §2e, eq. 2.6]. The cycle starts from the shear of the static
/// contact.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::FrettingCycle,
    when: When::Always,
    recipe: &[
        Part::Structure,
        Part::Surface,
        Part::Contact,
        Part::Cycle,
        Part::Elements,
        Part::Curves,
        Part::CycleFields,
        Part::WearLaw,
        Part::End,
    ],
    reads: &joined::<16>(&[
        &reduced::TABLES,
        &[
            TableName::Surface,
            TableName::Reference,
            TableName::WearField,
            TableName::StaticContact,
            TableName::ContactField,
            TableName::ContactElement,
            TableName::ContactSlider,
            TableName::Response,
            TableName::DynamicResponse,
            TableName::JointCycle,
            TableName::ModelUpdate,
        ],
    ]),
    before: &[
        TableName::ContactElement,
        TableName::ContactSlider,
        TableName::Response,
        TableName::DynamicResponse,
        TableName::ModelUpdate,
        TableName::FrettingCycle,
    ],
    writes: &[
        TableName::FrettingCycle,
        TableName::ContactField,
        TableName::Cycle,
        TableName::Hysteresis,
        TableName::CycleField,
    ],
    is_due: |_| true,
    shared: false,
    compute,
};

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let patch = solvers.joint(reads)?.patch.clone();
    let at_rest = StaticState::of(reads, solvers)?;
    let StaticState { wear, contact, .. } = &at_rest;
    let start = at_rest.start();
    let element_motion = ElementMotion::of(reads)?;
    let by_structure = element_motion.is_some();
    let compliance = tangential_compliance(&reads.table()?);
    let load = contact.load;
    let DrivingMotion { left_out, computed } =
        set_motion(reads, solvers, load, element_motion.as_ref(), compliance)?;
    let elements = match &computed {
        Some(computed) => Some(element_figures(reads, computed, compliance)?),
        None => None,
    };
    // The loop plots force over displacement along x, if the joint is driven along x.
    let drive = match &element_motion {
        Some(_) => None,
        None => reads.motion().drive.first(),
    };
    let curve_due = reads.curves_due && drive.is_none_or(|x| x.moves());
    let every = samples_per_instant(reads, solvers.joint(reads)?.march);
    let selection = reads.recipe.output.cycle_fields.clone();
    let needs_fields = |instant: usize| {
        let is_written = || instant.is_multiple_of(every);
        selection
            .as_ref()
            .is_some_and(|fields| is_written() && fields.has_sample(instant / every))
    };
    // The stored cycle at the end of a wear step has no fields.
    let end_cycle = solvers.end.take().filter(|_| selection.is_none());
    let ((solution, instant_fields, curve), fft_pairs) = solvers.timed(reads, None, |joint| {
        let is_same = |end: &EndCycle| {
            end.motion == joint.motion
                && end.wear == *wear
                && end.pressure == contact.pressure
                && Some(&end.start).filter(|start| !start.is_empty()) == start
        };
        let (solution, instant_fields) = match end_cycle.filter(is_same) {
            Some(end_cycle) => {
                joint.half_space.count_pairs(end_cycle.fft_pairs);
                (end_cycle.cycle, Vec::new())
            }
            None => joint.cycle_with_fields(wear, contact, start, &needs_fields)?,
        };
        let curve = curve_due
            .then(|| curves::hysteresis(joint, contact, &solution))
            .transpose()?;
        Ok((solution, instant_fields, curve))
    })?;
    let march = solvers.joint(reads)?.march;
    let check = match &element_motion {
        Some(element_motion) if reads.recipe.wear.is_some() => Some(Check::of(
            reads,
            solvers,
            &at_rest.wear,
            element_motion,
            march,
        )?),
        _ => None,
    };
    let energy = solution.dissipation;
    let update = match &elements {
        Some(elements) => Some(update_errors(
            reads,
            solvers,
            &at_rest,
            energy,
            elements.cycle.energy,
        )?),
        None => None,
    };
    let mut outputs = Outputs::default();
    if let Some(Curve { load, displacement }) = curve {
        outputs.add_table(&typed::Hysteresis { load, displacement })?;
    }
    let written_instants: Vec<&Instant> = solution.instants.iter().step_by(every).collect();
    outputs.add_table(&instants(&written_instants, by_structure))?;
    if let Some(selection) = &selection {
        let fields = cycle_field(&patch, selection, &instant_fields, &written_instants, every);
        if fields.sample.is_empty() {
            outputs.notice(
                "output.cycle_fields: none of the chosen cells is in contact in this cycle; the table cycle_field has no rows",
            );
        }
        outputs.add_table(&fields)?;
    }
    drop(instant_fields);
    let periodic = is_periodic(reads);
    let band = SlipBand::measure(&patch, periodic, &contact.pressure, &solution.energy);
    if reads.wear_iteration == 0 {
        warn_band(band, &mut outputs);
    }
    let solve_error = match check.as_ref().and_then(|check| check.error) {
        // The comparison with a stepped cycle includes all other errors.
        Some(check_error) if march == March::Reversal => solution.error + check_error,
        _ => solution.relative_error() + left_out,
    };
    let solve_error = solve_error.min(1.0);
    outputs.add_table(&typed::FrettingCycle {
        dissipated_energy: solution.dissipation,
        iterations: solution.steps as i64,
        error_tangential: solution.error,
        error_cycle: solve_error.max(band.relative_error()),
        slip_band: band.cells,
        fft_pairs,
        stepped_part: check.as_ref().map(|check| check.stepped_part),
        check_volume: check.as_ref().map(|check| check.volume),
        error_between_ends: check.map(|check| check.error.unwrap_or(0.0)),
        update_jump: update.map(|update| update[0]),
        update_gap: update.map(|update| update[1]),
        elements_energy: elements.map(|elements| elements.cycle.energy),
        elements_force: elements.map(|elements| elements.cycle.force),
        elements_total_force: elements.map(|elements| elements.total_force),
        elements_displacement: elements.map(|elements| elements.displacement),
    })?;
    let fields = Fields {
        gap: at_rest.contact.gap,
        pressure: at_rest.contact.pressure,
        shear: solution.shear,
    };
    outputs.add_table(&typed::ContactField {
        slip_path: Some(patch.joint_values(&solution.slip_path)),
        dissipation: Some(patch.joint_values(&solution.energy)),
        ..fields.table(&patch)
    })?;
    Ok(outputs)
}

/// Comparison of reversal cycles with a stepped cycle. A reversal cycle is marched between the two ends of the motion
/// only. The stage repeats the comparison at fixed parts of the run, and at the end of the run.
struct Check {
    /// Energy of a stepped cycle, divided by the energy of an uncorrected reversal cycle; 1 before the first
    /// comparison.
    stepped_part: f64,
    /// Worn volume at the last comparison \[m³\].
    volume: f64,
    /// Relative error of the energy per cycle in the current response, after the correction. `None` before the first
    /// comparison with a stepped cycle.
    error: Option<f64>,
}

impl Check {
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        wear: &[f64],
        element_motion: &ElementMotion,
        march: March,
    ) -> Result<Check, RunError> {
        let before = reads.optional_previous_table::<typed::FrettingCycle>()?;
        let before = before.unwrap_or_default();
        let has_error = before.error_between_ends.is_some_and(|error| error > 0.0);
        let in_force = element_motion.stepped_part();
        let is_due = reads.cycle_check_due && march == March::Reversal && element_motion.has_laws();
        let correction = match is_due {
            true => stepped_part(reads, solvers.threads().count(), wear, element_motion)?,
            false => None,
        };
        let (energy_part, volume) = match correction {
            Some(correction) => (in_force * correction, solvers.joint(reads)?.volume(wear)),
            None => (
                before.stepped_part.unwrap_or(1.0),
                before.check_volume.unwrap_or(0.0),
            ),
        };
        Ok(Check {
            stepped_part: energy_part,
            volume,
            error: (has_error || correction.is_some())
                .then(|| (in_force / energy_part - 1.0).abs() + REMAINING_ERROR),
        })
    }
}

/// Returns the force, displacement and energy of the contact elements under the motion of the current iteration. The
/// figures are the values of the current response, scaled by the extrapolated change of the motion.
fn element_figures(
    reads: &StageInputs,
    computed: &ComputedMotion,
    compliance: Option<f64>,
) -> Result<ElementFigures, RunError> {
    let joint: typed::JointCycle = reads.table()?;
    let response: typed::DynamicResponse = reads.table()?;
    let range = |values: &[f64]| half_range(values.iter().copied());
    let part = computed.figures_at(compliance)?;
    Ok(ElementFigures {
        displacement: range(&joint.displacement_x) * part.displacement,
        total_force: range(&joint.force_x).hypot(range(&joint.force_y)) * part.total_force,
        cycle: CycleFigures {
            force: range(&joint.force_along) * part.cycle.force,
            energy: response.friction_energy * part.cycle.energy,
        },
    })
}

/// Returns the jump of the energy per cycle at the last update, on the same surface. Also returns the remaining gap
/// between the energies of fine contact and contact elements. The jump and the gap are relative changes of the energy
/// per cycle. `energy` is the energy per cycle of the fine contact in the current iteration. `element_energy` is the
/// energy per cycle of the contact elements in the current iteration.
fn update_errors(
    reads: &StageInputs,
    solvers: &mut Solvers,
    at_rest: &StaticState,
    energy: f64,
    element_energy: f64,
) -> Result<[f64; 2], RunError> {
    let update: typed::ModelUpdate = reads.table()?;
    let before = reads.optional_previous_table::<typed::FrettingCycle>()?;
    if !update.updated {
        let before = before.unwrap_or_default();
        return Ok([before.update_jump, before.update_gap].map(|value| value.unwrap_or(0.0)));
    }
    let relative_change = |value: f64, reference: f64| {
        if reference > 0.0 {
            value / reference - 1.0
        } else {
            0.0
        }
    };
    let gap = relative_change(energy, element_energy);
    let Some(motion_before) = ElementMotion::before(reads)?.filter(|_| reads.recipe.wear.is_some())
    else {
        return Ok([0.0, gap]);
    };
    let compliance = tangential_compliance(&reads.table()?);
    let load = at_rest.contact.load;
    let predicted = match set_motion(reads, solvers, load, Some(&motion_before), compliance) {
        Ok(_) => {
            let result = solvers.timed(reads, None, |joint| {
                Ok(joint.cycle(&at_rest.wear, &at_rest.contact, at_rest.start())?)
            })?;
            result.0.dissipation
        }
        // The previous motion would open the joint in its present state.
        Err(RunError::Cycle(_)) => return Ok([UNKNOWN, gap]),
        Err(error) => return Err(error),
    };
    Ok([relative_change(energy, predicted), gap])
}

/// Warns if the grid does not resolve the slipping regions.
fn warn_band(band: SlipBand, outputs: &mut Outputs) {
    let error = band.relative_error();
    if band.cells == 0.0 {
        outputs.notice(
            "joint.grid: no cell slips in the cycle. Either the joint sticks, or the slipping region is thinner than a cell: use more cells if the joint should slip",
        );
    } else if error > 0.0 {
        outputs.notice(format!(
            "joint.grid: the slipping rims of the contact spots are {:.2} cells wide on average. The energy of a cycle may be wrong by {:.0} %, which error_cycle includes; \
             use more cells, for rims at least 1.5 cells wide",
            band.cells,
            100.0 * error
        ));
    }
}

/// Returns the number of samples from one written instant to the next. For extrapolation, the march of a prescribed
/// history adds intermediate samples between the written instants. The march does not write the intermediate samples,
/// so a march of the written history gives the same result.
fn samples_per_instant(reads: &StageInputs, march: March) -> usize {
    let cycle = reads.recipe.cycle().filter(|_| march == March::Stepped);
    cycle.map_or(1, Cycle::samples_per_instant)
}

/// Returns the fields of the selected cells that touch at any instant, one instant after the other. `written` contains
/// all instants of the table `cycle`. Two consecutive instants of `written` are `every` samples of the march apart.
fn cycle_field(
    patch: &Patch,
    selection: &CycleFields,
    fields: &[InstantFields],
    written: &[&Instant],
    every: usize,
) -> typed::CycleField {
    let is_pressed = |cell: &usize| fields.iter().any(|instant| instant.pressure[*cell] > 0.0);
    let is_chosen =
        |cell: &usize| patch.is_in_joint[*cell] && selection.has_cell(patch.grid.cell(*cell));
    let cells: Vec<usize> = (0..patch.grid.len())
        .filter(|cell| is_chosen(cell) && is_pressed(cell))
        .collect();
    let column = |value: &dyn Fn(&InstantFields, usize) -> f64| -> Vec<f64> {
        let rows = fields
            .iter()
            .flat_map(|instant| cells.iter().map(move |cell| (instant, *cell)));
        rows.map(|(instant, cell)| value(instant, cell)).collect()
    };
    let index = |axis: fn((usize, usize)) -> usize| -> Vec<i32> {
        let once = cells.iter().map(|cell| axis(patch.grid.cell(*cell)) as i32);
        fields.iter().flat_map(|_| once.clone()).collect()
    };
    let sample = |instant: &InstantFields| instant.instant / every;
    let samples = fields
        .iter()
        .flat_map(|instant| cells.iter().map(move |_| sample(instant) as i32));
    let first = fields.first();
    let in_plane = first.is_some_and(|instant| instant.shear.len() > 1);
    let has_gap = first.is_some_and(|instant| instant.gap.is_some());
    typed::CycleField {
        sample: samples.collect(),
        time: column(&|instant, _| written[sample(instant)].time),
        i: index(|cell| cell.0),
        j: index(|cell| cell.1),
        gap: has_gap
            .then(|| column(&|instant, cell| instant.gap.as_ref().map_or(0.0, |gap| gap[cell]))),
        pressure: column(&|instant, cell| instant.pressure[cell]),
        shear_x: column(&|instant, cell| instant.shear[0][cell]),
        shear_y: in_plane.then(|| column(&|instant, cell| instant.shear[1][cell])),
        slip_x: column(&|instant, cell| instant.slip[0][cell]),
        slip_y: in_plane.then(|| column(&|instant, cell| instant.slip[1][cell])),
    }
}

fn instants(instants: &[&Instant], by_structure: bool) -> typed::Cycle {
    let series = |value: &dyn Fn(&Instant) -> f64| -> Vec<f64> {
        instants.iter().map(|i| value(i)).collect()
    };
    let in_plane = instants
        .first()
        .is_some_and(|instant| instant.displacement.len() > 1);
    let torsion = |k: usize| -> Option<Vec<f64>> {
        instants
            .iter()
            .map(|instant| instant.torsion.map(|pair| pair[k]))
            .collect()
    };
    typed::Cycle {
        time: series(&|i| i.time),
        displacement_x: series(&|i| i.displacement[0]),
        displacement_y: in_plane.then(|| series(&|i| i.displacement[1])),
        normal_load: series(&|i| i.normal_load),
        force_x: series(&|i| i.force[0]),
        force_y: in_plane.then(|| series(&|i| i.force[1])),
        rotation_z: torsion(0),
        moment_z: torsion(1),
        force_along: by_structure.then(|| series(&|i| i.force_along)),
    }
}
