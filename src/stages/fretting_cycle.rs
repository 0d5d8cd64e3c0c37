//! The steady fretting cycle of an iteration.

use super::RunError;
use super::computed_motion::{
    ComputedMotion, DrivingMotion, ElementFigures, ElementMotion, let_move,
};
use super::contact_state::{AtRest, Fields, tangential_compliance};
use super::cycle_check::{LEFT, stepped_part};
use super::declaration::{Declaration, joined};
use super::error_bars::ALL;
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

/// Shear, slip and dissipation over the steady cycle, [A §2e, eq. 2.6], from the shear of the static contact on.
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
    let at_rest = AtRest::of(reads, solvers)?;
    let AtRest { wear, contact, .. } = &at_rest;
    let start = at_rest.start();
    let moved = ElementMotion::of(reads)?;
    let by_structure = moved.is_some();
    let compliance = tangential_compliance(&reads.table()?);
    let load = contact.load;
    let DrivingMotion { left_out, computed } =
        let_move(reads, solvers, load, moved.as_ref(), compliance)?;
    let elements = match &computed {
        Some(computed) => Some(elements_of(reads, computed, compliance)?),
        None => None,
    };
    // The loop is that of force over displacement along x, if anything drives the joint there.
    let drive = match &moved {
        Some(_) => None,
        None => reads.motion().drive.first(),
    };
    let curve_due = reads.curves_due && drive.is_none_or(|x| x.moves());
    let every = samples_an_instant(reads, solvers.joint(reads)?.march);
    let chosen = reads.recipe.output.cycle_fields.clone();
    let wanted = |instant: usize| {
        let is_written = || instant.is_multiple_of(every);
        chosen
            .as_ref()
            .is_some_and(|fields| is_written() && fields.has_sample(instant / every))
    };
    // The cycle at the end of a wear step has no fields.
    let known = solvers.end.take().filter(|_| chosen.is_none());
    let ((solution, of_instants, curve), fft_pairs) = solvers.work(reads, None, |joint| {
        let is_same = |end: &EndCycle| {
            end.motion == joint.motion
                && end.wear == *wear
                && end.pressure == contact.pressure
                && Some(&end.start).filter(|start| !start.is_empty()) == start
        };
        let (solution, of_instants) = match known.filter(is_same) {
            Some(known) => {
                joint.half_space.count_pairs(known.fft_pairs);
                (known.cycle, Vec::new())
            }
            None => joint.cycle_with_fields(wear, contact, start, &wanted)?,
        };
        let curve = curve_due
            .then(|| curves::hysteresis(joint, contact, &solution))
            .transpose()?;
        Ok((solution, of_instants, curve))
    })?;
    let march = solvers.joint(reads)?.march;
    let check = match &moved {
        Some(moved) if reads.recipe.wear.is_some() => {
            Some(Check::of(reads, solvers, &at_rest.wear, moved, march)?)
        }
        _ => None,
    };
    let energy = solution.dissipation;
    let update = match &elements {
        Some(elements) => Some(at_update(
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
        outputs.put(&typed::Hysteresis { load, displacement })?;
    }
    let written: Vec<&Instant> = solution.instants.iter().step_by(every).collect();
    outputs.put(&instants(&written, by_structure))?;
    if let Some(chosen) = &chosen {
        let fields = cycle_field(&patch, chosen, &of_instants, &written, every);
        if fields.sample.is_empty() {
            outputs.notice(
                "output.cycle_fields: none of the chosen cells is in contact in this cycle; the table cycle_field has no rows",
            );
        }
        outputs.put(&fields)?;
    }
    drop(of_instants);
    let periodic = is_periodic(reads);
    let band = SlipBand::of(&patch, periodic, &contact.pressure, &solution.energy);
    if reads.wear_iteration == 0 {
        tell_band(band, &mut outputs);
    }
    let of_solves = match check.as_ref().and_then(|check| check.error) {
        // What it is held against has the whole of it.
        Some(known) if march == March::Reversal => solution.error + known,
        _ => solution.relative_error() + left_out,
    };
    let of_solves = of_solves.min(1.0);
    outputs.put(&typed::FrettingCycle {
        dissipated_energy: solution.dissipation,
        iterations: solution.steps as i64,
        error_tangential: solution.error,
        error_cycle: of_solves.max(band.relative_error()),
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
    outputs.put(&typed::ContactField {
        slip_path: Some(patch.gather(&solution.slip_path)),
        dissipation: Some(patch.gather(&solution.energy)),
        ..fields.table(&patch)
    })?;
    Ok(outputs)
}

/// What is known of cycles between two ends: found anew at parts of the run, and at its end.
struct Check {
    /// Energy of a stepped cycle over that between two ends as it is; 1 before any is found.
    stepped_part: f64,
    /// Worn volume at the last check \[m³\].
    volume: f64,
    /// Relative error of the energy of the cycle, which the response in force has a part of it in; none before any is found.
    error: Option<f64>,
}

impl Check {
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        wear: &[f64],
        moved: &ElementMotion,
        march: March,
    ) -> Result<Check, RunError> {
        let before = reads.optional_before::<typed::FrettingCycle>()?;
        let before = before.unwrap_or_default();
        let known = before.error_between_ends.is_some_and(|error| error > 0.0);
        let in_force = moved.stepped_part();
        let is_due = reads.cycle_check_due && march == March::Reversal && moved.has_laws();
        let found = match is_due {
            true => stepped_part(reads, solvers.threads().count(), wear, moved)?,
            false => None,
        };
        let (part, volume) = match found {
            Some(found) => (in_force * found, solvers.joint(reads)?.volume(wear)),
            None => (
                before.stepped_part.unwrap_or(1.0),
                before.check_volume.unwrap_or(0.0),
            ),
        };
        Ok(Check {
            stepped_part: part,
            volume,
            error: (known || found.is_some()).then(|| (in_force / part - 1.0).abs() + LEFT),
        })
    }
}

/// What the contact elements do under the motion of this iteration: what they do in the response in force, by what its motion has gone on to.
fn elements_of(
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

/// What the last update has changed the energy of a cycle by on the same surface, and what it leaves between both scales, each in parts of it:
/// `energy` is that of the cycle of this iteration, `of_elements` that of its contact elements.
fn at_update(
    reads: &StageInputs,
    solvers: &mut Solvers,
    at_rest: &AtRest,
    energy: f64,
    of_elements: f64,
) -> Result<[f64; 2], RunError> {
    let update: typed::ModelUpdate = reads.table()?;
    let before = reads.optional_before::<typed::FrettingCycle>()?;
    if !update.updated {
        let before = before.unwrap_or_default();
        return Ok([before.update_jump, before.update_gap].map(|value| value.unwrap_or(0.0)));
    }
    let over = |value: f64, of: f64| if of > 0.0 { value / of - 1.0 } else { 0.0 };
    let gap = over(energy, of_elements);
    let Some(moved) = ElementMotion::before(reads)?.filter(|_| reads.recipe.wear.is_some()) else {
        return Ok([0.0, gap]);
    };
    let compliance = tangential_compliance(&reads.table()?);
    let load = at_rest.contact.load;
    let predicted = match let_move(reads, solvers, load, Some(&moved), compliance) {
        Ok(_) => {
            let solved = solvers.work(reads, None, |joint| {
                Ok(joint.cycle(&at_rest.wear, &at_rest.contact, at_rest.start())?)
            })?;
            solved.0.dissipation
        }
        // The motion before would open the joint as it is now.
        Err(RunError::Cycle(_)) => return Ok([ALL, gap]),
        Err(error) => return Err(error),
    };
    Ok([over(energy, predicted), gap])
}

/// Says so where the grid does not resolve what slips.
fn tell_band(band: SlipBand, outputs: &mut Outputs) {
    let error = band.relative_error();
    if band.cells == 0.0 {
        outputs.notice(
            "joint.grid: no cell slips in the cycle; the joint sticks, or what slips is thinner than the grid shows: use more cells if it should slip",
        );
    } else if error > 0.0 {
        outputs.notice(format!(
            "joint.grid: the slipping rims of the contact spots are {:.2} cells wide on average, and the energy of a cycle may be off by {:.0} %, which error_cycle has; \
             use more cells, for rims of 1.5",
            band.cells,
            100.0 * error
        ));
    }
}

/// Samples of the motion from one instant that is written to the next: those between them at which a history is marched too, to
/// extrapolate it, are not. So the cycle of a run with a history is a history with the same result.
fn samples_an_instant(reads: &StageInputs, march: March) -> usize {
    let cycle = reads.recipe.cycle().filter(|_| march == March::Stepped);
    cycle.map_or(1, Cycle::samples_an_instant)
}

/// The fields of the chosen cells that are in contact at one of the instants, those of one instant after those of another. `written` are all
/// instants of the table of the cycle, each `every` of the march.
fn cycle_field(
    patch: &Patch,
    chosen: &CycleFields,
    fields: &[InstantFields],
    written: &[&Instant],
    every: usize,
) -> typed::CycleField {
    let is_pressed = |cell: &usize| fields.iter().any(|of| of.pressure[*cell] > 0.0);
    let is_chosen = |cell: &usize| patch.kept[*cell] && chosen.has_cell(patch.grid.cell(*cell));
    let cells: Vec<usize> = (0..patch.grid.len())
        .filter(|cell| is_chosen(cell) && is_pressed(cell))
        .collect();
    let of_cells = |value: &dyn Fn(&InstantFields, usize) -> f64| -> Vec<f64> {
        let rows = fields
            .iter()
            .flat_map(|of| cells.iter().map(move |cell| (of, *cell)));
        rows.map(|(of, cell)| value(of, cell)).collect()
    };
    let index = |axis: fn((usize, usize)) -> usize| -> Vec<i32> {
        let once = cells.iter().map(|cell| axis(patch.grid.cell(*cell)) as i32);
        fields.iter().flat_map(|_| once.clone()).collect()
    };
    let sample = |of: &InstantFields| of.instant / every;
    let samples = fields
        .iter()
        .flat_map(|of| cells.iter().map(move |_| sample(of) as i32));
    let first = fields.first();
    let in_plane = first.is_some_and(|of| of.shear.len() > 1);
    let has_gap = first.is_some_and(|of| of.gap.is_some());
    typed::CycleField {
        sample: samples.collect(),
        time: of_cells(&|of, _| written[sample(of)].time),
        i: index(|cell| cell.0),
        j: index(|cell| cell.1),
        gap: has_gap.then(|| of_cells(&|of, cell| of.gap.as_ref().map_or(0.0, |gap| gap[cell]))),
        pressure: of_cells(&|of, cell| of.pressure[cell]),
        shear_x: of_cells(&|of, cell| of.shear[0][cell]),
        shear_y: in_plane.then(|| of_cells(&|of, cell| of.shear[1][cell])),
        slip_x: of_cells(&|of, cell| of.slip[0][cell]),
        slip_y: in_plane.then(|| of_cells(&|of, cell| of.slip[1][cell])),
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
