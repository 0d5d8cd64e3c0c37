//! What an engineer would look at before a run: a few figures of a scene by rules of thumb, and where one is out of all bounds.
//!
//! A mistaken unit is wrong by a thousand or more. Bounds are so wide that a joint of any metal, ceramic or polymer passes; they judge
//! nothing. Rules of thumb are of the order of what they estimate, not better. What is only rare has a remark, since it may be meant.

mod body;
mod face;
mod rubbing;
mod vibration;

use crate::recipe::{Check, Recipe};
use crate::surface::prepare::Prepared;
use crate::wear::{Channel, Motion};
use face::Face;

/// A figure and its bounds; `hint` says which unit to look at where it is out of them.
struct Bounded {
    what: &'static str,
    value: f64,
    words: String,
    bounds: [f64; 2],
    /// Name and size of the unit in which bounds are told.
    unit: (&'static str, f64),
    key: &'static str,
    hint: &'static str,
    /// What is usual, and what it means to be beyond it.
    usual: Option<([f64; 2], &'static str)>,
}

/// A figure without unit and without anything to remark, for what is not said of one.
const PLAIN: Bounded = Bounded {
    what: "",
    value: 0.0,
    words: String::new(),
    bounds: [f64::NEG_INFINITY, f64::INFINITY],
    unit: ("", 1.0),
    key: "",
    hint: "",
    usual: None,
};

impl Bounded {
    fn check(self) -> Check {
        let (key, hint, what, words) = (self.key, self.hint, self.what, &self.words);
        let warning = self
            .beyond(self.bounds)
            .map(|beyond| format!("{key}: the {what} is {words}, and should be {beyond}: {hint}"));
        let remark = self.usual.and_then(|(usual, meaning)| {
            let beyond = self.beyond(usual).filter(|_| warning.is_none())?;
            Some(format!(
                "{key}: the {what} is {words}, and mostly {beyond}: {meaning}"
            ))
        });
        Check {
            what,
            warning,
            remark,
            value: self.words,
        }
    }

    /// What the figure should be, where it is not.
    fn beyond(&self, [least, most]: [f64; 2]) -> Option<String> {
        let (symbol, size) = self.unit;
        let bound = |value: f64| format!("{} {symbol}", short(value / size));
        let told = match self.value {
            v if v < least => format!("at least {}", bound(least)),
            v if v > most => format!("at most {}", bound(most)),
            _ => return None,
        };
        Some(told.trim_end().to_owned())
    }
}

/// The figures of a scene, in the order in which a person would ask for them.
pub(super) fn checks(recipe: &Recipe, motion: &Motion, measured: Option<&Prepared>) -> Vec<Check> {
    let face = Face::of(recipe, measured);
    let mut found = Vec::new();
    found.extend(body::materials(recipe));
    found.extend(body::dimensions(recipe));
    found.extend(measured.into_iter().flat_map(face::map));
    if let Some(face) = &face {
        found.extend(face::heights(face, measured.is_some()));
        found.extend(face::pressures(face));
    }
    found.extend(rubbing::friction(recipe));
    let wears = recipe.wear.is_some();
    found.extend(
        face.iter()
            .flat_map(|face| rubbing::moved(face, motion, wears)),
    );
    found.extend(vibration::vibration(recipe));
    found.extend(rubbing::wear(recipe, face.as_ref(), motion));
    found.into_iter().map(Bounded::check).collect()
}

/// Coefficient of friction of the joint, and its friction limit \[N\].
fn limit(recipe: &Recipe) -> Option<(f64, f64)> {
    if let Some(contact) = recipe.contact() {
        let mu = contact.friction_coefficient?;
        return Some((mu, mu * contact.normal_load));
    }
    let elements = recipe.elements()?;
    let mu = elements.friction_coefficient;
    let [_, _, normal_load] = elements.stiffness.given()?;
    Some((mu, mu * normal_load))
}

/// Half range of the largest displacement \[m\], where that is given.
fn half_range(motion: &Motion) -> Option<f64> {
    let halves = motion.drive.iter().filter_map(half);
    Some(halves.fold(0.0, f64::max)).filter(|half| *half > 0.0)
}

/// Half range of a displacement \[m\] or rotation \[rad\] that is given.
fn half(channel: &Channel) -> Option<f64> {
    match channel {
        Channel::Displacement(values) => {
            let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            Some(0.5 * (most - least))
        }
        Channel::Force(_) => None,
    }
}

/// Four significant digits.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    match rounded.abs() {
        size if size == 0.0 || (1e-3..1e6).contains(&size) => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}
