//! `[output]`

use super::Default::{Is, Rule};
use super::cycles::MOST_ITERATIONS;
use super::keys;
use super::value::{Integer, IntegerRange, Integers, integer};
use super::word::{Boolean, BooleanOrTable, Choice, WordOrTable};
use crate::recipe::{Durability, ResonanceOf};

/// Each is a forced response of its own, which takes seconds at least: more of them are no choice of the user's.
const MOST_RESPONSES: usize = 10_000;

/// A history has no more.
const MOST_SAMPLES: usize = 1_000_000;

keys! {
    section "output": "What a run keeps.";

    /// Which iterations are kept, to restart from and to read: all, or those that the keys below name.
    KEEP: WordOrTable = "output.keep", Is("all"), WordOrTable("all", "{ every = 50, last = 3, updates = true }");
    /// Every so many iterations are kept.
    KEEP_EVERY: Integer = "output.keep.every", Rule("only those below"), integer(1, MOST_ITERATIONS, "50");
    /// The last so many iterations are kept.
    KEEP_LAST: Integer = "output.keep.last", Is("1"), integer(1, MOST_ITERATIONS, "3");
    /// Whether the iterations that updated the contact elements are kept.
    KEEP_UPDATES: Boolean = "output.keep.updates", Is("true"), Boolean;
    /// Whether pressure, shear and slip over the steady cycle are written, as table cycle_field. True is all that the keys below choose from.
    CYCLE_FIELDS: BooleanOrTable = "output.cycle_fields", Is("false"), BooleanOrTable("{ samples = [0, 16, 32], j = [20, 20], every = 10 }");
    /// The samples, by their rows in the table cycle: 0 is t = 0. A cycle by reversal has three or four, one that is stepped has one for each
    /// step and t = T.
    CYCLE_FIELDS_SAMPLES: Integers = "output.cycle_fields.samples", Rule("all"), Integers(MOST_SAMPLES, "a list of different numbers of samples, such as [0, 16, 32]");
    /// The first and the last cell along x.
    CYCLE_FIELDS_I: IntegerRange = "output.cycle_fields.i", Rule("all"), IntegerRange("[0, 63]");
    /// The first and the last cell along y.
    CYCLE_FIELDS_J: IntegerRange = "output.cycle_fields.j", Rule("all"), IntegerRange("[20, 20]");
    /// They are written every so many iterations, and of the last.
    CYCLE_FIELDS_EVERY: Integer = "output.cycle_fields.every", Is("1"), integer(1, MOST_ITERATIONS, "10");
    /// Indentation and hysteresis curves are written every so many iterations; 0: never.
    CURVES_EVERY: Integer = "output.curves_every", Is("10"), integer(0, MOST_ITERATIONS, "5");
    /// Whether kn and kt of the joint are computed at every iteration; contact elements want them in any case.
    STIFFNESS: Boolean = "output.stiffness", Is("true"), Boolean;
    /// Cycles at which a forced response of the worn joint is computed. It is not fed back; the first and the last are always there.
    RESPONSE_AT: Integers = "output.response_at", Is("[]"),
        Integers(MOST_RESPONSES, "a list of numbers of cycles in ascending order, such as [0, 1e6, 1e7]");
    /// Which states of wear have a resonance of their own, with the contact elements of their own surface. It is not fed back.
    RESONANCE: Choice<ResonanceOf> = "output.resonance", Is("updates"), Choice(&[
        ("updates", ResonanceOf::Updates, "those of updates, of response_at, and the last"),
        ("all", ResonanceOf::All, "all wear iterations, each with a response that feeds nothing back"),
    ]);
    /// When what is written is on the disk for good, so that a loss of power leaves it. A run that is killed goes on in either case.
    DURABILITY: Choice<Durability> = "output.durability", Is("commit"), Choice(&[
        ("commit", Durability::Commit, "at every commit"),
        ("end", Durability::End, "where the run ends or is stopped, for many short runs: a loss of power may leave one that must be removed and begun anew"),
    ]);
}
