//! `[output]`

use super::Default::{Is, Rule};
use super::cycles::MOST_ITERATIONS;
use super::keys;
use super::value::{Integer, IntegerRange, Integers, integer};
use super::word::{Boolean, BooleanOrTable, Choice, WordOrTable};
use crate::recipe::{Durability, ResonanceOf};

/// Largest number of response cycles. Each response cycle needs a separate forced response, which takes seconds at
/// least.
const MOST_RESPONSES: usize = 10_000;

/// Largest number of listed samples of a cycle. A motion history has at most `MOST_SAMPLES` rows.
const MOST_SAMPLES: usize = 1_000_000;

keys! {
    section "output": "The results that a run stores.";

    /// Iterations that a run keeps, to restart from and to read: all, or a selection by the keys of output.keep.
    KEEP: WordOrTable = "output.keep", Is("all"), WordOrTable("all", "{ every = 50, last = 3, updates = true }");
    /// Interval of kept iterations: n keeps every n-th iteration.
    KEEP_EVERY: Integer = "output.keep.every", Rule("none: only the iterations selected below"), integer(1, MOST_ITERATIONS, "50");
    /// Number of last iterations that are kept.
    KEEP_LAST: Integer = "output.keep.last", Is("1"), integer(1, MOST_ITERATIONS, "3");
    /// `output.keep.updates = true` keeps the iterations that updated the contact elements.
    KEEP_UPDATES: Boolean = "output.keep.updates", Is("true"), Boolean;
    /// Pressure, shear and slip over the steady cycle, written as table cycle_field. With output.cycle_fields = true,
    /// the table contains all samples and cells. A table of keys selects samples and cells.
    CYCLE_FIELDS: BooleanOrTable = "output.cycle_fields", Is("false"), BooleanOrTable("{ samples = [0, 16, 32], j = [20, 20], every = 10 }");
    /// Samples of the cycle to write, by their rows in the table cycle: 0 is t = 0. A cycle marched by reversal has
    /// three or four samples. A stepped cycle has one sample per step and one for t = T.
    CYCLE_FIELDS_SAMPLES: Integers = "output.cycle_fields.samples", Rule("all"), Integers(MOST_SAMPLES, "a list of different numbers of samples, such as [0, 16, 32]");
    /// First and last cell along x in the table cycle_field.
    CYCLE_FIELDS_I: IntegerRange = "output.cycle_fields.i", Rule("all"), IntegerRange("[0, 63]");
    /// First and last cell along y in the table cycle_field.
    CYCLE_FIELDS_J: IntegerRange = "output.cycle_fields.j", Rule("all"), IntegerRange("[20, 20]");
    /// Number of iterations between two writes of the table cycle_field. The last iteration of a run always writes the
    /// table cycle_field.
    CYCLE_FIELDS_EVERY: Integer = "output.cycle_fields.every", Is("1"), integer(1, MOST_ITERATIONS, "10");
    /// Interval of indentation and hysteresis curves, in iterations; 0 means never.
    CURVES_EVERY: Integer = "output.curves_every", Is("10"), integer(0, MOST_ITERATIONS, "5");
    /// `output.stiffness = true` computes kn and kt of the joint at every iteration. Contact elements require kn and kt
    /// in any case.
    STIFFNESS: Boolean = "output.stiffness", Is("true"), Boolean;
    /// Cycles at which a forced response of the worn joint is computed. The forced response at a cycle of
    /// output.response_at does not affect the wear. The first and the last cycle are always included.
    RESPONSE_AT: Integers = "output.response_at", Is("[]"),
        Integers(MOST_RESPONSES, "a list of numbers of cycles in ascending order, such as [0, 1e6, 1e7]");
    /// States of wear for which the resonance is computed, with contact elements for the worn surface. Computing the
    /// resonance does not affect the wear.
    RESONANCE: Choice<ResonanceOf> = "output.resonance", Is("updates"), Choice(&[
        ("updates", ResonanceOf::Updates, "states of updates and of response_at, and the last state"),
        ("all", ResonanceOf::All, "all wear iterations, each with a response that does not affect the wear"),
    ]);
    /// Time at which the program syncs written data to the disk. Synced data survives a loss of power. A killed run can
    /// continue with "commit" and with "end".
    DURABILITY: Choice<Durability> = "output.durability", Is("commit"), Choice(&[
        ("commit", Durability::Commit, "at every commit"),
        ("end", Durability::End, "when the run ends or is stopped, for many short runs: after a loss of power a run may have to be removed and started again"),
    ]);
}
