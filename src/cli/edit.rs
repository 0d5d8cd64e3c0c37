//! Changes of a commented scene in its text: each value is replaced where it stands, and comments stay.

use std::io::{self, BufRead};

use crate::terminal::say;

/// Keys that differ from joint to joint, in the order in which one would be asked for them, and what they are.
const ASKED: [(&str, &str); 11] = [
    ("joint.size", "sides of the joint along x and y"),
    ("joint.hole", "the hole, as { diameter = \"9 mm\" }"),
    ("joint.grid", "cells along x and y"),
    ("material.youngs_modulus", "Young's modulus"),
    ("surface.rq", "root mean square roughness"),
    ("surface.correlation_length", "correlation length"),
    ("contact.normal_load", "load of the bolt"),
    ("contact.friction_coefficient", "coefficient of friction"),
    ("motion.amplitude", "half range of the motion along x and y"),
    ("wear.coefficient", "worn volume per dissipated energy"),
    ("wear.cycles", "cycles"),
];

/// Where the value of a key stands in the text of a scene, which has a key a line.
fn place_of(text: &str, key: &str) -> Option<std::ops::Range<usize>> {
    let (wanted, name) = key.rsplit_once('.').unwrap_or(("", key));
    let (mut section, mut at) = ("", 0);
    for line in text.split_inclusive('\n') {
        let begin = at;
        at += line.len();
        if let Some(rest) = line.strip_prefix('[') {
            section = rest.split(']').next().unwrap_or_default();
        }
        let Some((left, right)) = line.split_once('=') else {
            continue;
        };
        if section == wanted && left.trim() == name {
            // No text of a shipped scene has a `#` in it.
            let value = right.split('#').next().unwrap_or(right);
            let skipped = left.len() + 1 + value.len() - value.trim_start().len();
            return Some(begin + skipped..begin + skipped + value.trim().len());
        }
    }
    None
}

/// The text with another value of a key, as TOML; none where the key stands on no line of its own.
pub fn with(text: &str, key: &str, value: &str) -> Option<String> {
    let place = place_of(text, key)?;
    let value = match value.parse::<toml::Value>() {
        Ok(_) => value.to_owned(),
        Err(_) => toml::Value::from(value).to_string(),
    };
    let mut text = text.to_owned();
    text.replace_range(place, &value);
    Some(text)
}

/// Asks a person for what differs from joint to joint: `--set` of what is not as the scene has it. Where an answer has a `fault`, given
/// those before it, it is asked for again.
pub fn asked(text: &str, fault: impl Fn(&[String]) -> Option<String>) -> Vec<String> {
    asked_of(text, io::stdin().lock().lines(), fault)
}

fn asked_of(
    text: &str,
    mut answers: impl Iterator<Item = io::Result<String>>,
    fault: impl Fn(&[String]) -> Option<String>,
) -> Vec<String> {
    say("An empty answer keeps the value in brackets.");
    let mut sets = Vec::new();
    for (key, about) in ASKED {
        let Some(place) = place_of(text, key) else {
            continue;
        };
        loop {
            say(&format!("{about}, {key} [{}]?", &text[place.clone()]));
            let Some(Ok(answer)) = answers.next() else {
                say("No more answers: the other values stay as they are.");
                return sets;
            };
            if answer.trim().is_empty() {
                break;
            }
            sets.push(format!("{key}={}", answer.trim()));
            match fault(&sets) {
                None => break,
                Some(fault) => say(&fault),
            }
            sets.pop();
        }
    }
    sets
}

#[cfg(test)]
mod tests {
    use super::asked_of;

    #[test]
    fn an_answer_with_a_fault_is_asked_for_again_and_an_empty_one_keeps_the_value() {
        let text = "[surface]\nrq = \"5 um\"\n[contact]\nnormal_load = \"30 kN\"\n";
        let answers = ["", "30 km", "20 kN"].map(|answer| Ok(answer.to_owned()));
        let fault = |sets: &[String]| sets.last()?.contains("km").then(|| "a length".to_owned());
        let sets = asked_of(text, answers.into_iter(), fault);
        assert_eq!(sets, ["contact.normal_load=20 kN"]);
        // Who goes away has answered what he has.
        let none = asked_of(text, std::iter::empty(), |_| None);
        assert!(none.is_empty());
    }
}
