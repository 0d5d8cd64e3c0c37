//! How long a run will take, before it has shown it: what the shipped scenes take, scaled by the size of this one, and by what its first
//! stages take.

use std::collections::BTreeMap;

use fretwear::model_update::Criterion;
use fretwear::recipe::Recipe;
use fretwear::stages::Stage;

/// Seconds of the reduction of a structure of so many unknowns, as the published case has them on the machine of the README.
const STRUCTURE: (f64, f64) = (7.0, 68_730.0);
/// The time of a reduction grows by this power of the unknowns: that of a sparse factor in three dimensions.
const OF_UNKNOWNS: f64 = 2.0;
/// Seconds of its first vibration, with so many contact elements; it grows as they do.
const VIBRATION: (f64, f64) = (4.8, 388.0);
/// A forced response of the unworn joint over that vibration.
const RESPONSE: f64 = 2.6;
/// Points of such a response, where continuation places them.
const POINTS: f64 = 60.0;
/// Forced response, and vibration, of the worn joint over that of the unworn one: more of its elements slide.
pub const WORN: f64 = 2.3;
/// The vibration at an update of the contact elements grows to that by this power of the part of the run behind it: measured.
const OF_PART: f64 = 0.2;
/// From one update to the next the part of the run behind it grows so many times: the stiffness goes with the logarithm of the wear.
const APART: f64 = 4.0;
/// Part of the run behind the first step, before which nothing is updated.
const FIRST: f64 = 0.0025;
/// Steps of the wear where their error decides.
pub const STEPS: f64 = 14.0;
/// Seconds of a step a cell: of a joint that vibrates, and of another.
const STEP: [f64; 2] = [8.0e-6, 3.0e-6];
/// The unworn contact takes as long as so many steps.
const UNWORN: f64 = 1.0;

/// By how much a first stage may say that the machine is slower or faster.
const MOST: f64 = 2.0;

/// What the stages of a run take, before they have shown it \[s\].
#[derive(Debug, Clone, Default)]
pub struct Prior {
    /// Those of the unworn joint, which come before the first step.
    stages: BTreeMap<Stage, f64>,
    /// A step of the wear, without a vibration.
    pub step: f64,
    /// Whether contact elements are updated.
    updates: bool,
}

impl Prior {
    /// Of a recipe with a structure of so many unknowns, if it has one. None where steps are not chosen by their error: how many there
    /// are, nothing tells.
    pub fn of(recipe: &Recipe, unknowns: Option<usize>) -> Option<Prior> {
        let wear = recipe.wear.as_ref()?;
        if wear.scheme.needs_depth_step() {
            return None;
        }
        let cells = recipe.surface()?.grid().len() as f64;
        let vibrates = recipe.structure.is_some();
        let step = cells * if vibrates { STEP[0] } else { STEP[1] };
        let mut stages = BTreeMap::from([(Stage::StaticContact, UNWORN * step)]);
        if let Some(unknowns) = unknowns {
            let (seconds, of) = STRUCTURE;
            let size = (unknowns as f64 / of).powf(OF_UNKNOWNS);
            stages.insert(Stage::Structure, seconds * size);
        }
        if let Some(structure) = &recipe.structure {
            let (seconds, of) = VIBRATION;
            let elements = structure.source.contact_elements(structure.contact_ports);
            let first = seconds * elements as f64 / of;
            stages.insert(Stage::DynamicResponse, first);
            let given = recipe.response.as_ref().and_then(|r| r.points);
            let points = given.map_or(1.0, |points| points as f64 / POINTS);
            stages.insert(Stage::ForcedResponse, RESPONSE * points * first);
        }
        Some(Prior {
            stages,
            step,
            updates: updates(recipe),
        })
    }

    /// A stage of the unworn joint took so long.
    pub fn took(&mut self, stage: Stage, seconds: f64) {
        let Some(expected) = self.stages.insert(stage, seconds).filter(|e| *e > 0.0) else {
            return;
        };
        // What follows is of another kind than a reduction or a contact: it says more of the machine than of what follows.
        let ratio = seconds / expected;
        let ratio_of_machine = ratio.clamp(1.0 / MOST, MOST);
        let vibrates = self.stages.contains_key(&Stage::DynamicResponse);
        match stage {
            Stage::Structure => self.scale(ratio_of_machine),
            Stage::StaticContact if !vibrates => self.scale(ratio_of_machine),
            // What makes a vibration long need not make a response long.
            Stage::DynamicResponse => self.scale_of(&[Stage::ForcedResponse], ratio.sqrt()),
            _ => (),
        }
    }

    fn scale(&mut self, ratio: f64) {
        let after: Vec<Stage> = self.stages.keys().copied().collect();
        let after: Vec<Stage> = after
            .into_iter()
            .filter(|s| *s > Stage::Structure)
            .collect();
        self.scale_of(&after, ratio);
        self.step *= ratio;
    }

    fn scale_of(&mut self, stages: &[Stage], ratio: f64) {
        for stage in stages {
            if let Some(seconds) = self.stages.get_mut(stage) {
                *seconds *= ratio;
            }
        }
    }

    /// Of a stage of the unworn joint.
    pub fn stage(&self, stage: Stage) -> f64 {
        self.stages.get(&stage).copied().unwrap_or(0.0)
    }

    /// What comes after such a stage, to the end of the run.
    pub fn after(&self, stage: Stage) -> f64 {
        let others = self.stages.iter().filter(|(other, _)| **other > stage);
        others.map(|(_, seconds)| seconds).sum::<f64>() + self.worn()
    }

    /// The whole run.
    pub fn whole(&self) -> f64 {
        self.stages.values().sum::<f64>() + self.worn()
    }

    /// Steps with the vibrations at updates, and the forced response of the worn joint.
    pub fn worn(&self) -> f64 {
        let first = self.stage(Stage::DynamicResponse);
        let updates = match self.updates {
            true => first * updates_between(0.0, 1.0),
            false => 0.0,
        };
        STEPS * self.step + updates + WORN * self.stage(Stage::ForcedResponse)
    }
}

/// Whether a run of a recipe updates its contact elements.
pub fn updates(recipe: &Recipe) -> bool {
    let criterion = recipe.elements().map(|elements| elements.update);
    recipe.wear.is_some() && criterion.is_some_and(|criterion| criterion != Criterion::Never)
}

/// The vibration at an update with such a part of the run behind it, over the first one.
pub fn update(part: f64) -> f64 {
    WORN * part.clamp(FIRST, 1.0).powf(OF_PART)
}

/// The vibrations at all updates between two parts of the run, over the first one: as if they were spread evenly in the logarithm.
pub fn updates_between(from: f64, to: f64) -> f64 {
    (update(to) - update(from)).max(0.0) / (OF_PART * APART.ln())
}

/// The vibrations at the updates to come, over the first one, with such a part of the run behind it and behind the last update. One that
/// is due and does not come does so a while later.
pub fn updates_to_come(part: f64, last: f64) -> f64 {
    let between = APART.sqrt();
    updates_between((between * last).max(part / between), 1.0)
}
