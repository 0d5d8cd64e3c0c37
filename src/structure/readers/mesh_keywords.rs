//! Which keywords of an input deck leave the structure as it is, and which make another one of it.

use super::deck::{keyword, option};
use super::error::ReadProblem;

/// Keywords that are read.
const READ: [&str; 14] = [
    "*BOUNDARY",
    "*DAMPING",
    "*DENSITY",
    "*ELASTIC",
    "*ELEMENT",
    "*ELSET",
    "*EQUATION",
    "*HEADING",
    "*MATERIAL",
    "*NODE",
    "*NSET",
    "*SOLID SECTION",
    "*SURFACE",
    "*TIE",
];
/// Keywords that say nothing of a linear structure at rest: steps and loads, output, other physics, properties of contacts and of what is
/// beyond the elastic limit.
const HARMLESS: [&str; 76] = [
    "*AMPLITUDE",
    "*BUCKLE",
    "*CFLUX",
    "*CLOAD",
    "*CONDUCTIVITY",
    "*CONTACT CONTROLS",
    "*CONTACT FILE",
    "*CONTACT OUTPUT",
    "*CONTACT PRINT",
    "*CONTROLS",
    "*CYCLIC HARDENING",
    "*DAMPING CONTROLS",
    "*DFLUX",
    "*DLOAD",
    "*DSLOAD",
    "*DYNAMIC",
    "*EL FILE",
    "*EL PRINT",
    "*ELEMENT MATRIX OUTPUT",
    "*ELEMENT OUTPUT",
    "*END STEP",
    "*ENERGY FILE",
    "*ENERGY OUTPUT",
    "*ENERGY PRINT",
    "*EXPANSION",
    "*FILE FORMAT",
    "*FILE OUTPUT",
    "*FILM",
    "*FILTER",
    "*FREQUENCY",
    "*FRICTION",
    "*GREEN",
    "*HEAT TRANSFER",
    "*INCREMENTATION OUTPUT",
    "*INELASTIC HEAT FRACTION",
    "*LATENT HEAT",
    "*MATRIX GENERATE",
    "*MATRIX OUTPUT",
    "*MODAL DYNAMIC",
    "*MODAL FILE",
    "*MODAL OUTPUT",
    "*MODAL PRINT",
    "*MONITOR",
    "*NODAL THICKNESS",
    "*NODE FILE",
    "*NODE OUTPUT",
    "*NODE PRINT",
    "*NO ANALYSIS",
    "*OUTPUT",
    "*PHYSICAL CONSTANTS",
    "*PLASTIC",
    "*PREPRINT",
    "*PRINT",
    "*RADIATE",
    "*RANDOM RESPONSE",
    "*RATE DEPENDENT",
    "*RESPONSE SPECTRUM",
    "*RESTART",
    "*RETAINED NODAL DOFS",
    "*SECTION CONTROLS",
    "*SECTION FILE",
    "*SECTION PRINT",
    "*SELECT EIGENMODES",
    "*SOLVER CONTROLS",
    "*SPECIFIC HEAT",
    "*STATIC",
    "*STEADY STATE DYNAMICS",
    "*STEP",
    "*SUBSTRUCTURE GENERATE",
    "*SUBSTRUCTURE MATRIX OUTPUT",
    "*SURFACE BEHAVIOR",
    "*SURFACE INTERACTION",
    "*TEMPERATURE",
    "*TIME POINTS",
    "*USER OUTPUT VARIABLES",
    "*VIEWFACTOR",
];
/// Keywords of decks that are not flat.
const NOT_FLAT: [&str; 3] = ["*INCLUDE", "*INSTANCE", "*PART"];
/// Options of keywords that are read, and what they would change: nodes and elements elsewhere, or other stiffness.
const OPTIONS: [(&str, &str, &str); 4] = [
    ("*NODE", "INPUT", "write the nodes into the deck"),
    ("*ELEMENT", "INPUT", "write the elements into the deck"),
    (
        "*NODE",
        "SYSTEM",
        "write the nodes in rectangular coordinates",
    ),
    (
        "*BOUNDARY",
        "FIXED",
        "say what is held in the data of the model, at zero",
    ),
];

/// Where in a deck a keyword stands.
#[derive(Default)]
pub(super) struct Steps {
    /// Steps begun so far.
    pub(super) count: usize,
    is_new: bool,
}

impl Steps {
    /// Looks at a line with a keyword. True where it says that nothing is held any more of what was said before the step.
    ///
    /// # Errors
    /// [`ReadProblem::Unsupported`] for a keyword or an option that would make another structure of it, or may.
    pub(super) fn pass(&mut self, line: &str, at: usize) -> Result<bool, ReadProblem> {
        let word = keyword(line);
        let refused = |advice: &str| {
            Err(ReadProblem::Unsupported {
                found: format!("{word} of line {at}"),
                advice: advice.to_owned(),
            })
        };
        let word = word.as_str();
        if NOT_FLAT.contains(&word) {
            return refused(match word {
                "*INCLUDE" => "its file is not found from here: give the deck as a file",
                _ => {
                    "only flat decks are read: fretwear-import writes one from a deck with parts and instances"
                }
            });
        }
        if !READ.contains(&word) && !HARMLESS.contains(&word) {
            return refused(
                "a mesh of solids alone is assembled here, and this keyword changes the model: leave the keyword out, or let your program write the matrices and use structure.kind = \"matrices\"",
            );
        }
        let given =
            |name: &str| option(line, name).filter(|value| !value.eq_ignore_ascii_case("NO"));
        if let Some((_, name, advice)) =
            (OPTIONS.iter()).find(|(of, name, _)| *of == word && given(name).is_some())
        {
            return refused(&format!("{name} is not followed here: {advice}"));
        }
        match word {
            "*STEP" => {
                (self.count, self.is_new) = (self.count + 1, false);
                if given("NLGEOM").is_some() {
                    return refused(
                        "NLGEOM makes the stiffness that of a loaded structure, and the unloaded one is assembled here: leave it out, or let your program write the matrices",
                    );
                }
            }
            "*BOUNDARY" if self.count > 1 => {
                return refused(
                    "what a second step holds may be another structure: keep one step, or say what is held before it",
                );
            }
            "*BOUNDARY" => {
                let is_new = option(line, "OP").is_some_and(|op| op.eq_ignore_ascii_case("NEW"));
                // The lines of one step take away once what was before them.
                let takes_away = is_new && !self.is_new;
                self.is_new |= is_new;
                return Ok(takes_away);
            }
            _ => {}
        }
        Ok(false)
    }
}
