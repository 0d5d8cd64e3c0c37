//! Edits the text of a commented scene: each value is replaced in place, and comments stay.

use std::io::{self, BufRead};

use fretwear::units::{self, Dimension};

use crate::terminal::say;

/// Keys that differ from joint to joint, in the order of the questions, with their descriptions.
const QUESTIONS: [(&str, &str); 11] = [
    (
        "joint.size",
        "sides of the joint along x and y, as 40 x 30 mm",
    ),
    (
        "joint.hole",
        "the hole, as { diameter = \"9 mm\" }, or none",
    ),
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

/// Finds the value of a key in the text of a scene, which has one key per line.
fn value_range(text: &str, key: &str) -> Option<std::ops::Range<usize>> {
    let (wanted_section, name) = key.rsplit_once('.').unwrap_or(("", key));
    let (mut section, mut offset) = ("", 0);
    for line in text.split_inclusive('\n') {
        let line_start = offset;
        offset += line.len();
        if let Some(rest) = line.strip_prefix('[') {
            section = rest.split(']').next().unwrap_or_default();
        }
        let Some((left, right)) = line.split_once('=') else {
            continue;
        };
        if section == wanted_section && left.trim() == name {
            // No string of a shipped scene contains `#`.
            let value = right.split('#').next().unwrap_or(right);
            let value_start = left.len() + 1 + value.len() - value.trim_start().len();
            return Some(line_start + value_start..line_start + value_start + value.trim().len());
        }
    }
    None
}

/// Converts an answer to the value of a scene: sides as `40 x 30 mm`, and no hole. An empty result means that the line
/// of the key is removed.
pub fn normalize_answer(key: &str, value: &str) -> String {
    let value = value.trim();
    let bare = value.trim_matches(['"', '\'']);
    match key {
        "joint.hole" if NO.contains(&bare.to_lowercase().as_str()) => String::new(),
        "joint.size" => {
            let sides: Vec<&str> = bare.split(['x', 'X', '\u{d7}']).map(str::trim).collect();
            let unit = |side: &str| {
                side.trim_start_matches(|c: char| !c.is_alphabetic())
                    .to_owned()
            };
            match sides[..] {
                [x, y] if !bare.starts_with('[') => {
                    let unit_of_y = unit(y);
                    let x = match unit(x).is_empty() {
                        true => format!("{x} {unit_of_y}"),
                        false => x.to_owned(),
                    };
                    format!("[\"{x}\", \"{y}\"]")
                }
                _ => value.to_owned(),
            }
        }
        _ => value.to_owned(),
    }
}

/// Answers for a joint without a hole.
const NO: [&str; 5] = ["no", "none", "no hole", "0", "-"];

/// Removes the line of a key from the text.
pub fn remove_key(text: &str, key: &str) -> String {
    let Some(place) = value_range(text, key) else {
        return text.to_owned();
    };
    let begin = text[..place.start].rfind('\n').map_or(0, |at| at + 1);
    let end = text[place.end..]
        .find('\n')
        .map_or(text.len(), |at| place.end + at + 1);
    format!("{}{}", &text[..begin], &text[end..])
}

/// Returns the cells along x and y that resolve a correlation length as finely as the `shipped` scene. Returns `None`
/// if a scene lacks the lengths.
pub fn fitting_grid(shipped: &str, text: &str) -> Option<[u64; 2]> {
    let lengths = |text: &str, key: &str| -> Option<[f64; 2]> {
        let value = text
            .get(value_range(text, key)?)?
            .parse::<toml::Value>()
            .ok()?;
        let values = match &value {
            toml::Value::Array(values) => values.clone(),
            value => vec![value.clone(); 2],
        };
        let length = |at: usize| units::parse(values.get(at)?.as_str()?, Dimension::LENGTH).ok();
        Some([length(0)?, length(1)?])
    };
    let cells = shipped
        .get(value_range(shipped, "joint.grid")?)?
        .parse::<toml::Value>()
        .ok()?;
    let ratios = |text: &str| -> Option<[f64; 2]> {
        let sides = lengths(text, "joint.size")?;
        let correlation = lengths(text, "surface.correlation_length")?;
        Some([0, 1].map(|axis| sides[axis] / correlation[axis]))
    };
    let (ratios_of_text, ratios_of_shipped) = (ratios(text)?, ratios(shipped)?);
    let cells_along = |axis: usize| {
        let cells = cells.get(axis)?.as_integer()? as f64;
        let resolved_cells = cells * ratios_of_text[axis] / ratios_of_shipped[axis];
        Some(2 * (0.5 * resolved_cells).round().clamp(FEWEST, MOST) as u64)
    };
    Some([cells_along(0)?, cells_along(1)?])
}

/// Bounds of the chosen number of cells along a side, divided by 2.
const FEWEST: f64 = 16.0;
const MOST: f64 = 256.0;

/// Removes the leading comment, which describes the shipped scene.
pub fn remove_heading(text: &str) -> &str {
    let lines = text
        .split_inclusive('\n')
        .take_while(|line| line.starts_with('#') || line.trim().is_empty());
    &text[lines.map(str::len).sum()..]
}

/// Replaces the value of a key, as TOML. Returns `None` if the key has no line of its own.
pub fn replace_value(text: &str, key: &str, value: &str) -> Option<String> {
    let place = value_range(text, key)?;
    let value = match value.parse::<toml::Value>() {
        Ok(_) => value.to_owned(),
        Err(_) => toml::Value::from(value).to_string(),
    };
    let mut text = text.to_owned();
    text.replace_range(place, &value);
    Some(text)
}

/// Asks for the values that differ from joint to joint. Returns the changed values as arguments of `--set`. If `fault`
/// reports an error for the answers so far, the question is repeated.
pub fn ask_for_values(text: &str, fault: impl Fn(&[String]) -> Option<String>) -> Vec<String> {
    ask_from(text, io::stdin().lock().lines(), fault)
}

fn ask_from(
    text: &str,
    mut answers: impl Iterator<Item = io::Result<String>>,
    fault: impl Fn(&[String]) -> Option<String>,
) -> Vec<String> {
    say("An empty answer keeps the value in brackets.");
    let mut sets = Vec::new();
    for (key, about) in QUESTIONS {
        let Some(place) = value_range(text, key) else {
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
            sets.push(format!("{key}={}", normalize_answer(key, &answer)));
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
    use super::{ask_from, fitting_grid, normalize_answer, remove_heading, remove_key};

    #[test]
    fn sides_and_no_hole_are_read_as_they_are_said() {
        let size = |text| normalize_answer("joint.size", text);
        assert_eq!(size("40 x 30 mm"), "[\"40 mm\", \"30 mm\"]");
        assert_eq!(size("40x30mm"), "[\"40 mm\", \"30mm\"]");
        assert_eq!(size("1.2 cm × 8 mm"), "[\"1.2 cm\", \"8 mm\"]");
        assert_eq!(size("[\"4 mm\", \"3 mm\"]"), "[\"4 mm\", \"3 mm\"]");
        assert_eq!(normalize_answer("joint.hole", "No hole"), "");
        assert_eq!(
            normalize_answer("joint.hole", "{ diameter = \"9 mm\" }"),
            "{ diameter = \"9 mm\" }"
        );
        let text = "# About.\n\n[joint]\nsize = [\"4 mm\", \"4 mm\"]\nhole = 1 # h\ngrid = [64, 64]\n[surface]\ncorrelation_length = \"1 mm\"\n";
        assert_eq!(
            remove_key(text, "joint.hole"),
            text.replace("hole = 1 # h\n", "")
        );
        assert!(remove_heading(text).starts_with("[joint]"));
        let wide = text.replace("[\"4 mm\", \"4 mm\"]", "[\"8 mm\", \"3 mm\"]");
        assert_eq!(fitting_grid(text, &wide), Some([128, 48]));
    }

    #[test]
    fn an_answer_with_a_fault_is_asked_for_again_and_an_empty_one_keeps_the_value() {
        let text = "[surface]\nrq = \"5 um\"\n[contact]\nnormal_load = \"30 kN\"\n";
        let answers = ["", "30 km", "20 kN"].map(|answer| Ok(answer.to_owned()));
        let fault = |sets: &[String]| sets.last()?.contains("km").then(|| "a length".to_owned());
        let sets = ask_from(text, answers.into_iter(), fault);
        assert_eq!(sets, ["contact.normal_load=20 kN"]);
        // End of input keeps the answers so far.
        let none = ask_from(text, std::iter::empty(), |_| None);
        assert!(none.is_empty());
    }
}
