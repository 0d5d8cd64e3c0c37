//! `[output]`

use super::Result;
use crate::scene::reader::{MOST_CYCLES, MOST_ITERATIONS, Reader};
use crate::scene::{Dynamics, Keep, Output, Wear, keys};

/// Iterations between two indentation and hysteresis curves.
const CURVES_EVERY: u64 = 10;

/// Each is a forced response of its own, which takes seconds at least: more of them are no choice of the user's.
const MOST_RESPONSES: usize = 10_000;

pub(super) fn output(
    reader: &Reader<'_>,
    wear: Option<&Wear>,
    dynamics: Option<&Dynamics>,
) -> Result<Output> {
    let is_table = ["every", "last", "updates"]
        .iter()
        .any(|name| reader.has(&keys::join("output.keep", name)));
    let keep = if is_table {
        Keep::Some {
            every: reader.integer("output.keep.every", 1, MOST_ITERATIONS)?,
            last: reader
                .integer("output.keep.last", 1, MOST_ITERATIONS)?
                .unwrap_or(1),
            updates: reader.boolean("output.keep.updates")?.unwrap_or(true),
        }
    } else if reader
        .node("output.keep")
        .is_none_or(|node| node.shown() == "\"all\"")
    {
        Keep::All
    } else {
        return Err(reader.out_of_range(
            "output.keep",
            "\"all\" or a table such as { every = 50, last = 3, updates = true }",
        ));
    };
    Ok(Output {
        keep,
        cycle_fields: reader.boolean("output.cycle_fields")?.unwrap_or(false),
        response_at: response_at(reader, wear, dynamics)?,
        curves_every: reader
            .integer("output.curves_every", 0, MOST_ITERATIONS)?
            .unwrap_or(CURVES_EVERY),
    })
}

fn response_at(
    reader: &Reader<'_>,
    wear: Option<&Wear>,
    dynamics: Option<&Dynamics>,
) -> Result<Vec<u64>> {
    const KEY: &str = "output.response_at";
    let expected = "a list of numbers of cycles in ascending order, such as [0, 1e6, 1e7]";
    let Some(cycles) = reader.integers(KEY, MOST_RESPONSES, expected)? else {
        return Ok(Vec::new());
    };
    let Some(&last) = cycles.last() else {
        return Ok(cycles);
    };
    if last > MOST_CYCLES {
        let expected = format!("a list of numbers of cycles up to {MOST_CYCLES}");
        return Err(reader.out_of_range(KEY, expected));
    }
    if !cycles.is_sorted() {
        return Err(reader.out_of_range(KEY, expected));
    }
    if dynamics.is_none() {
        return Err(reader.conflict(
            KEY,
            "without [dynamics] there is no response; leave it out or give []",
        ));
    }
    match wear {
        None if last > 0 => Err(reader.conflict(
            KEY,
            "without [wear] there are no cycles; leave it out or give []",
        )),
        Some(Wear {
            cycles: Some(end), ..
        }) if last > *end => Err(reader.out_of_range(
            KEY,
            format!("a list of numbers of cycles up to wear.cycles = {end}"),
        )),
        _ => Ok(cycles),
    }
}
