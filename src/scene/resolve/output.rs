//! `[output]`

use serde_json::json;

use super::Result;
use crate::recipe::{CycleFields, ResonanceOf};
use crate::scene::keys::{cycles::MOST_CYCLES, output::*};
use crate::scene::reader::Reader;
use crate::scene::{Keep, Output, Wear};

pub(super) fn output(reader: &Reader<'_>, wear: Option<&Wear>, vibrates: bool) -> Result<Output> {
    let keep = if reader.has(&KEEP_EVERY) || reader.has(&KEEP_LAST) || reader.has(&KEEP_UPDATES) {
        Keep::Some {
            every: reader.optional(&KEEP_EVERY, None)?,
            last: reader.value(&KEEP_LAST)?,
            updates: reader.value(&KEEP_UPDATES)?,
        }
    } else {
        reader.peek(&KEEP)?;
        reader.record.note(KEEP.name, "all".into());
        Keep::All
    };
    Ok(Output {
        keep,
        cycle_fields: cycle_fields(reader)?,
        stiffness: reader.value(&STIFFNESS)?,
        response_at: response_at(reader, wear, vibrates)?,
        curves_every: reader.value(&CURVES_EVERY)?,
        resonance: resonance(reader, vibrates)?,
        durability: reader.value(&DURABILITY)?,
    })
}

fn cycle_fields(reader: &Reader<'_>) -> Result<Option<CycleFields>> {
    let is_table = [&CYCLE_FIELDS_I, &CYCLE_FIELDS_J]
        .iter()
        .any(|key| reader.has(*key))
        || reader.has(&CYCLE_FIELDS_SAMPLES)
        || reader.has(&CYCLE_FIELDS_EVERY);
    if !is_table && !reader.value(&CYCLE_FIELDS)? {
        return Ok(None);
    }
    let mut samples = reader.peek(&CYCLE_FIELDS_SAMPLES)?;
    if let Some(samples) = &mut samples {
        samples.sort_unstable();
    }
    if samples.as_ref().is_some_and(Vec::is_empty) {
        let expected = CYCLE_FIELDS_SAMPLES.value.1;
        return Err(reader.out_of_range(&CYCLE_FIELDS_SAMPLES, expected));
    }
    let fields = CycleFields {
        samples,
        cells: [reader.peek(&CYCLE_FIELDS_I)?, reader.peek(&CYCLE_FIELDS_J)?],
        every: reader.peek(&CYCLE_FIELDS_EVERY)?.unwrap_or(1),
    };
    reader.record.note(CYCLE_FIELDS.name, json!(fields));
    let moves = reader.has("motion") || reader.has("dynamics");
    if !(reader.has("surface") && moves) {
        return Err(reader.conflict(
            &CYCLE_FIELDS,
            "only a scene with [surface] and [motion] or [dynamics] has a fretting cycle; remove it",
        ));
    }
    Ok(Some(fields))
}

fn resonance(reader: &Reader<'_>, vibrates: bool) -> Result<ResonanceOf> {
    let resonance = reader.value(&RESONANCE)?;
    if resonance == ResonanceOf::All && !vibrates {
        return Err(reader.conflict(
            &RESONANCE,
            "without [dynamics] there is no resonance; remove it",
        ));
    }
    Ok(resonance)
}

fn response_at(reader: &Reader<'_>, wear: Option<&Wear>, vibrates: bool) -> Result<Vec<u64>> {
    let expected = RESPONSE_AT.value.1;
    let cycles = reader.value(&RESPONSE_AT)?;
    let Some(&last) = cycles.last() else {
        return Ok(cycles);
    };
    if last > MOST_CYCLES {
        let expected = format!("a list of numbers of cycles up to {MOST_CYCLES}");
        return Err(reader.out_of_range(&RESPONSE_AT, expected));
    }
    if !cycles.is_sorted() {
        return Err(reader.out_of_range(&RESPONSE_AT, expected));
    }
    if !vibrates {
        return Err(reader.conflict(
            &RESPONSE_AT,
            "without [dynamics] there is no response; remove it or give []",
        ));
    }
    match wear {
        None if last > 0 => Err(reader.conflict(
            &RESPONSE_AT,
            "without [wear] there are no cycles; remove it or give []",
        )),
        Some(Wear {
            cycles: Some(end), ..
        }) if last > *end => Err(reader.out_of_range(
            &RESPONSE_AT,
            format!("a list of numbers of cycles up to wear.cycles = {end}"),
        )),
        _ => Ok(cycles),
    }
}
