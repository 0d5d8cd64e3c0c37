//! Frequency range of the resonance of a scene, and the effect of its loads there, for `plan`.

use std::path::Path;
use std::sync::Arc;

use fretwear::dynamics::{LinearResonance, LinearResonances};
use fretwear::recipe::{Inputs, Recipe};
use fretwear::report::quantity::significant_digits;
use fretwear::stages;
use fretwear::store::{Cache, RealFileSystem};
use serde_json::{Value, json};

use super::arguments::threads_or_cores;
use super::run::cache_folder;
use crate::progress::Watcher;
use crate::terminal::Results;

/// Largest number of frequencies outside the range that the message lists.
const SHOWN: usize = 6;

/// Unit of the loads of a scene.
struct Unit {
    /// Half range of the drive \[N\], if a force drives. If the drive changes, the ratio of every other load to the
    /// drive remains constant.
    drive: Option<f64>,
}

impl Unit {
    fn of(recipe: &Recipe) -> Unit {
        let forces = recipe.response.as_ref().map_or(&[][..], |r| &r.forces);
        let drive = forces.iter().find(|f| f.harmonic == 1 && f.amplitude > 0.0);
        Unit {
            drive: drive.map(|force| force.amplitude),
        }
    }

    fn level(&self, factor: f64) -> String {
        match self.drive {
            Some(drive) => format!("{} N", significant_digits(factor * drive, 3)),
            None => format!("{} times its loads", significant_digits(factor, 3)),
        }
    }
}

/// Resonances of a scene, or the reason why they are unknown. Returns `None` if the scene has no vibration.
pub fn resonances(
    inputs: &Inputs,
    path: &Path,
    quiet: bool,
) -> Option<Result<LinearResonances, String>> {
    let recipe = &inputs.recipe;
    recipe.structure.as_ref()?;
    recipe.response.as_ref()?;
    let cache = cache_folder().map(|folder| Cache::new(Arc::new(RealFileSystem), &folder));
    let watcher = Watcher::new(recipe, path, quiet);
    let threads = threads_or_cores(None);
    let result = stages::linear_resonances(inputs, cache.as_ref(), threads, &watcher);
    watcher.finish();
    Some(match result {
        Ok(Ok(result)) => Ok(result),
        Ok(Err(outside)) => {
            let outside = outside
                .iter()
                .take(SHOWN)
                .map(|f| significant_digits(*f, 4));
            let outside: Vec<String> = outside.collect();
            let nearby = match outside[..] {
                [] => "there is none outside it".to_owned(),
                _ => format!("resonances outside it are at {} Hz", outside.join(", ")),
            };
            let subject = match recipe.elements() {
                Some(_) => "stuck joint",
                None => "linear structure",
            };
            Err(format!(
                "dynamics.frequency: no resonance of the {subject} lies in this range; {nearby}"
            ))
        }
        Err(error) => Err(error.to_string()),
    })
}

/// Prints the resonances of a scene.
pub fn write(out: &mut Results, recipe: &Recipe, resonances: &Result<LinearResonances, String>) {
    let resonances = match resonances {
        Ok(resonances) => resonances,
        Err(why) => {
            writeln!(out, "\nresonance: not known: {why}");
            return;
        }
    };
    let unit = Unit::of(recipe);
    let per = match unit.drive {
        Some(_) => "per newton of the drive",
        None => "under the loads of the scene",
    };
    let has_contact = resonances.free.is_some();
    let subject = match has_contact {
        true => "unworn joint, linear",
        false => "linear structure",
    };
    writeln!(out, "\nresonance of the {subject}, {per}");
    let scale = unit.drive.map_or(1.0, |drive| 1.0 / drive);
    let mut line = |name: &str, text: String| writeln!(out, "    {name:<13} {text}");
    for (name, resonance) in named_resonances(resonances) {
        if resonance.frequency == 0.0 {
            let text = format!("mode {}, 0 Hz: a body is loose", resonance.mode);
            line(name, text);
            continue;
        }
        let mut text = format!(
            "mode {}, {} Hz, damping {} %",
            resonance.mode,
            significant_digits(resonance.frequency, 5),
            significant_digits(100.0 * resonance.damping_ratio, 3)
        );
        if let Some(response) = resonance.response {
            let displacement = significant_digits(1e6 * scale * response.displacement, 3);
            text += &format!("; the response is {displacement} µm");
            if has_contact {
                let force = significant_digits(scale * response.force, 3);
                let moment = significant_digits(1e3 * scale * response.moment, 3);
                text += &format!(", the joint transmits {force} N and {moment} N mm");
            }
        }
        line(name, text);
    }
    if resonances.in_range.len() > 1 {
        let all = resonances
            .in_range
            .iter()
            .map(|f| significant_digits(*f, 4));
        let all = all.collect::<Vec<String>>().join(", ");
        line("in the range", format!("{all} Hz; the strongest is used"));
    }
    if let Some(free) = &resonances.free {
        let from = significant_digits(free.frequency, 5);
        let mut text = match &resonances.tied {
            Some(tied) => format!("{from} to {} Hz", significant_digits(tied.frequency, 5)),
            None => format!("from {from} Hz, because the joint fixes the structure to the ground"),
        };
        text += ", while no element opens or closes";
        let range = recipe.response.as_ref().and_then(|r| r.frequency);
        if let (Some([least, most]), Some(tied)) = (range, &resonances.tied) {
            text += match least <= free.frequency && tied.frequency <= most {
                true => "; dynamics.frequency contains it",
                false => "; dynamics.frequency contains a part of it",
            };
        }
        line("band", text);
    }
    if let Some(limits) = &resonances.limits {
        let text = match limits.sticks {
            0.0 => "under no load".to_owned(),
            factor => format!(
                "up to {} no element slips as a whole or opens",
                unit.level(factor)
            ),
        };
        line("sticks", text);
        let possible_events = [
            ("a contact element may slip from", limits.may_slip),
            ("the whole joint from", limits.joint_may_slip),
            ("an element may open from", limits.may_open),
        ];
        let possible_events: Vec<String> = possible_events
            .into_iter()
            .filter(|(_, factor)| factor.is_finite())
            .map(|(what, factor)| format!("{what} {}", unit.level(factor)))
            .collect();
        if !possible_events.is_empty() {
            line("may", possible_events.join(", "));
        }
    }
}

fn named_resonances(
    resonances: &LinearResonances,
) -> impl Iterator<Item = (&'static str, &LinearResonance)> {
    let stuck = match resonances.free {
        Some(_) => "stuck",
        None => "linear",
    };
    let all = [
        ("free", resonances.free.as_ref()),
        (stuck, Some(&resonances.stuck)),
        ("tied", resonances.tied.as_ref()),
    ];
    all.into_iter()
        .filter_map(|(name, resonance)| Some((name, resonance?)))
}

/// Returns the resonances as JSON, in SI units, under the loads of the scene. A limit is a factor of the loads of the
/// scene. A limit of null means that the loads have no limit.
pub fn json(resonances: &Result<LinearResonances, String>) -> Value {
    match resonances {
        Ok(resonances) => {
            let mut printed = json!({});
            for (name, resonance) in named_resonances(resonances) {
                printed[name] = json!({
                    "mode": resonance.mode,
                    "frequency": resonance.frequency,
                    "damping_ratio": resonance.damping_ratio,
                    "response": resonance.response.map(|r| json!({
                        "displacement": r.displacement,
                        "force": r.force,
                        "moment": r.moment,
                        "load_lost": r.load_lost,
                    })),
                });
            }
            printed["in_range"] = json!(resonances.in_range);
            if let Some(limits) = resonances.limits {
                let finite = |factor: f64| factor.is_finite().then_some(factor);
                printed["limits"] = json!({
                    "sticks": finite(limits.sticks),
                    "may_slip": finite(limits.may_slip),
                    "may_open": finite(limits.may_open),
                    "joint_may_slip": finite(limits.joint_may_slip),
                });
            }
            printed
        }
        Err(why) => json!({ "not_known": why }),
    }
}
