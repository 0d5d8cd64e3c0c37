//! What the stages of one run share.

use std::time::Instant;

use serde_json::Value;

use super::error::NumericsError;
use super::{Observer, RunError, Stage, dynamic_response};
use crate::contact::Shear;
use crate::contact::normal::{NormalSolution, Rotation};
use crate::grid::Patch;
use crate::model_update::Bolt;
use crate::recipe::{Coupling, Inputs, Recipe};
use crate::store::{Draft, Kept, RunStore, StageKey};
use crate::tables::{TableName, TypedTable, typed};
use crate::wear::{FrettingJoint, WearError};

/// Who watches, which iteration is in progress, and what its stages have cost so far.
pub struct Clock<'a> {
    pub observer: &'a dyn Observer,
    pub wear_iteration: u64,
    pub timing: Vec<Timing>,
}

/// The rough joint of a run, its inputs, and the iteration in progress.
pub struct Context<'a> {
    pub inputs: &'a Inputs,
    pub joint: FrettingJoint,
    pub surface_key: StageKey,
    pub clock: Clock<'a>,
    /// Static load that the joint bears \[N\]: the number itself, as the mean of a motion under it is rounded, and a run that is
    /// continued has to go on with the very same.
    pub load: f64,
    /// Approach of the unworn joint under its load; there if the load falls with wear.
    pub unworn_approach: Option<f64>,
    /// True if the iteration in progress reaches the end of the scene.
    pub is_last: bool,
}

/// What a stage, or a part of it that is told apart, cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    pub stage: Stage,
    pub part: Option<&'static str>,
    pub seconds: f64,
    pub fft_pairs: f64,
}

/// Keys of the stages of one iteration; the wear step of the unworn state has none.
pub struct Keys {
    pub wear: Option<StageKey>,
    pub static_contact: StageKey,
    /// Keys of model update and dynamic response; none without a structure.
    pub vibration: Option<VibrationKeys>,
    pub fretting_cycle: StageKey,
}

/// Keys of the stages of a vibrating structure.
pub struct VibrationKeys {
    pub model_update: StageKey,
    pub dynamic_response: StageKey,
}

impl VibrationKeys {
    /// From the keys of the structure and of what its contact elements are made from.
    pub fn of(inputs: &Inputs, structure: &StageKey, contact: &[&StageKey]) -> VibrationKeys {
        let mut upstream = vec![structure];
        upstream.extend(contact);
        let model_update = StageKey::new(
            Stage::ModelUpdate.name(),
            &[TableName::ModelUpdate, TableName::ContactElement],
            &parts(&inputs.recipe, &["contact", "elements"]),
            &upstream,
        );
        let dynamic_response = StageKey::new(
            Stage::DynamicResponse.name(),
            &dynamic_response::TABLES,
            &parts(
                &inputs.recipe,
                &["response", "elements", "output.response_at"],
            ),
            &[&model_update],
        );
        VibrationKeys {
            model_update,
            dynamic_response,
        }
    }
}

impl Keys {
    /// Keys follow from what the stages read, before anything is computed.
    pub fn of(
        inputs: &Inputs,
        store: &RunStore,
        surface: &StageKey,
        structure: Option<&StageKey>,
        wear_iteration: u64,
    ) -> Result<Keys, RunError> {
        let parent = match wear_iteration {
            0 => None,
            k => Some(StageKey::of_commit(store.reader().commit_of(k - 1)?)),
        };
        let wear = match &parent {
            None => None,
            Some(parent) => {
                let reads = ["contact", "cycle", "elements", "wear", "output.response_at"];
                let parameters = parts(&inputs.recipe, &reads);
                let tables = [
                    TableName::WearField,
                    TableName::WearStep,
                    TableName::ContactField,
                ];
                Some(StageKey::new(
                    Stage::Wear.name(),
                    &tables,
                    &parameters,
                    &[surface, parent],
                ))
            }
        };
        let mut upstream = vec![surface];
        upstream.extend(&wear);
        let parameters = parts(&inputs.recipe, &["contact", "output.curves_every"]);
        let tables = [
            TableName::ContactField,
            TableName::StaticContact,
            TableName::Indentation,
            TableName::Summary,
        ];
        let static_contact =
            StageKey::new(Stage::StaticContact.name(), &tables, &parameters, &upstream);
        let vibration = structure.map(|structure| {
            let mut contact = vec![&static_contact];
            contact.extend(&parent);
            VibrationKeys::of(inputs, structure, &contact)
        });
        let mut upstream = vec![&static_contact];
        upstream.extend(vibration.as_ref().map(|keys| &keys.dynamic_response));
        let parameters = parts(&inputs.recipe, &["contact", "cycle", "output.curves_every"]);
        let tables = [
            TableName::ContactField,
            TableName::Cycle,
            TableName::Hysteresis,
            TableName::Summary,
        ];
        let fretting_cycle =
            StageKey::new(Stage::FrettingCycle.name(), &tables, &parameters, &upstream);
        Ok(Keys {
            wear,
            static_contact,
            vibration,
            fretting_cycle,
        })
    }
}

impl Clock<'_> {
    /// Runs the numerics of a stage without transforms, with its time noted.
    pub fn timed<T>(
        &mut self,
        stage: Stage,
        work: impl FnOnce() -> Result<T, RunError>,
    ) -> Result<T, RunError> {
        self.observer.stage(stage, self.wear_iteration);
        let begin = Instant::now();
        let result = work()?;
        self.timing.push(Timing {
            stage,
            part: None,
            seconds: begin.elapsed().as_secs_f64(),
            fft_pairs: 0.0,
        });
        Ok(result)
    }

    /// Runs the numerics of a stage on a joint, with its time and transform pairs noted.
    pub fn timed_pairs<T>(
        &mut self,
        stage: Stage,
        joint: &mut FrettingJoint,
        work: impl FnOnce(&mut FrettingJoint) -> Result<T, RunError>,
    ) -> Result<T, RunError> {
        joint.half_space.take_pairs();
        let result = self.timed(stage, || work(joint))?;
        if let Some(timing) = self.timing.last_mut() {
            timing.fft_pairs = joint.half_space.take_pairs();
        }
        Ok(result)
    }

    /// The timing table of the iteration.
    pub fn table(&mut self) -> typed::Timing {
        let mut table = typed::Timing::default();
        for timing in std::mem::take(&mut self.timing) {
            table.stage.push(match timing.part {
                Some(part) => format!("{}.{part}", timing.stage.name()),
                None => timing.stage.name().to_owned(),
            });
            table.seconds.push(timing.seconds);
            table.fft_pairs.push(timing.fft_pairs);
        }
        table
    }
}

impl Context<'_> {
    /// Runs the numerics of a stage, with its time and transform pairs noted.
    pub fn timed<T>(
        &mut self,
        stage: Stage,
        work: impl FnOnce(&mut FrettingJoint) -> Result<T, NumericsError>,
    ) -> Result<(T, f64), RunError> {
        self.clock.observer.stage(stage, self.clock.wear_iteration);
        self.timed_part(stage, None, work)
    }

    /// The same for a part of a stage under way: its time and pairs are a row of their own beside the stage's.
    pub fn timed_part<T>(
        &mut self,
        stage: Stage,
        part: Option<&'static str>,
        work: impl FnOnce(&mut FrettingJoint) -> Result<T, NumericsError>,
    ) -> Result<(T, f64), RunError> {
        let begin = Instant::now();
        self.joint.half_space.take_pairs();
        let wear_iteration = self.clock.wear_iteration;
        let result = work(&mut self.joint).map_err(|source| match source {
            NumericsError::ModelUpdate(source) => RunError::ModelUpdate(source),
            NumericsError::Wear(WearError::Contact(source)) => RunError::Contact {
                stage,
                wear_iteration,
                source,
            },
            NumericsError::Wear(source) => RunError::Wear {
                stage,
                wear_iteration,
                source,
            },
        })?;
        let fft_pairs = self.joint.half_space.take_pairs();
        self.clock.timing.push(Timing {
            stage,
            part,
            seconds: begin.elapsed().as_secs_f64(),
            fft_pairs,
        });
        Ok((result, fft_pairs))
    }

    /// Rotations of the bodies in a contact, where they are free.
    pub fn rotation(&self, contact: &NormalSolution) -> Option<[f64; 2]> {
        matches!(self.joint.rotation, Rotation::Free { .. }).then_some(contact.rotation)
    }

    /// Tangential tractions, and what they have to do with the pressure.
    pub fn shear_and_coupling(&self) -> (Shear, Coupling) {
        let contact = self.inputs.recipe.contact();
        contact.map_or((Shear::AlongX, Coupling::None), |contact| {
            (contact.shear, contact.coupling)
        })
    }

    /// What clamps the joint, if its load falls with wear.
    pub fn bolt(&self) -> Option<Bolt> {
        let contact = self.inputs.recipe.contact()?;
        Some(Bolt {
            stiffness: contact.bolt_stiffness?,
            load: contact.normal_load,
            approach: self.unworn_approach?,
        })
    }

    /// From now on the joint moves under this static load. A motion that a structure gives it has to follow.
    pub fn bear(&mut self, load: f64) {
        self.load = load;
        if self.unworn_approach.is_some() {
            // Always from the motion of the scene: shifted again and again it would hang on how often that was.
            self.joint.motion = self.inputs.motion.clone().with_mean_load(load);
        }
    }

    /// Notes whether the iteration in progress, with these cycles and this volume behind it, is the last.
    pub fn reach(&mut self, cycles: u64, volume: f64) {
        let wear = self.inputs.recipe.wear.as_ref();
        self.is_last = wear.is_none_or(|wear| wear.is_reached(cycles, volume));
    }

    /// True if the curves behind the stiffnesses belong to this iteration: every so many, and the last.
    pub fn curves_due(&self) -> bool {
        let every = self.inputs.recipe.output.curves_every;
        every > 0 && (self.is_last || self.clock.wear_iteration.is_multiple_of(every))
    }

    /// The same for the loop of force over displacement along x, if anything drives the joint there.
    pub fn hysteresis_due(&self) -> bool {
        let drive = self.inputs.motion.drive.first();
        self.curves_due() && drive.is_none_or(|x| x.moves())
    }

    /// The values of the kept cells, spread over the grid.
    pub fn field(&self, values: &[f64]) -> Vec<f64> {
        spread(&self.joint.patch, values)
    }
}

/// Parts of a recipe by name, as `contact` or `output.curves_every`: what a stage reads goes into its key. Reasons do not
/// influence a result.
pub fn parts(recipe: &Recipe, names: &[&str]) -> Value {
    let whole = serde_json::to_value(recipe).expect("a recipe is numbers, words and UTF-8 paths");
    let of_joint = ["surface", "contact", "cycle", "elements"];
    let part = |name: &str| {
        let mut value = match of_joint.contains(&name) {
            true => &whole["joints"][0],
            false => &whole,
        };
        for name in name.split('.') {
            value = &value[name];
        }
        let mut value = value.clone();
        strip(&mut value);
        value
    };
    let parts = names.iter().map(|name| ((*name).to_owned(), part(name)));
    parts.collect::<serde_json::Map<_, _>>().into()
}

/// Takes away what does not influence a result.
fn strip(value: &mut Value) {
    match value {
        Value::Object(object) => {
            object.remove("why");
            object.values_mut().for_each(strip);
        }
        Value::Array(items) => items.iter_mut().for_each(strip),
        _ => (),
    }
}

/// A table of the draft, if an earlier start computed it from the same inputs.
pub fn kept<T: TypedTable>(draft: &mut Draft, key: &StageKey) -> Result<Option<T>, RunError> {
    Ok(match draft.get(T::TABLE, key)? {
        Kept::Valid(table) => Some(T::of(&table)?),
        Kept::Stale(_) => None,
    })
}

/// True if an earlier start computed a table of the draft from the same inputs.
pub fn is_kept(draft: &mut Draft, table: TableName, key: &StageKey) -> Result<bool, RunError> {
    Ok(matches!(draft.get(table, key)?, Kept::Valid(_)))
}

/// Writes a table to the draft.
pub fn put<T: TypedTable>(draft: &mut Draft, key: &StageKey, values: &T) -> Result<(), RunError> {
    Ok(draft.put(T::TABLE, key, &values.to_table()?)?)
}

/// The values of a field on the kept cells, in their order.
pub fn gather(patch: &Patch, field: &[f64]) -> Vec<f64> {
    field
        .iter()
        .zip(&patch.kept)
        .filter(|(_, kept)| **kept)
        .map(|(v, _)| *v)
        .collect()
}

/// The field with the given values on the kept cells and 0 elsewhere.
pub fn spread(patch: &Patch, values: &[f64]) -> Vec<f64> {
    let mut values = values.iter();
    patch
        .kept
        .iter()
        .map(|kept| {
            if *kept {
                values.next().copied().unwrap_or(0.0)
            } else {
                0.0
            }
        })
        .collect()
}

/// The i and j columns of the kept cells.
pub fn kept_cells(patch: &Patch) -> (Vec<i32>, Vec<i32>) {
    (0..patch.grid.len())
        .filter(|&c| patch.kept[c])
        .map(|c| patch.grid.cell(c))
        .map(|(i, j)| (i as i32, j as i32))
        .unzip()
}
