//! Keywords of an input deck, classified by their effect on the structure.

use super::deck::{keyword, option};
use super::error::ReadProblem;

/// Keywords that are supported.
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
/// Keywords that do not change the stiffness or the mass of a linear structure. The keywords define steps, loads,
/// output, other physics, contact properties and plasticity.
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
/// Unsupported options of supported keywords, with advice. The unsupported options would add nodes or elements, or
/// change the stiffness.
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
        "define the supports in the model data, with zero displacement",
    ),
];

/// State of the steps while a deck is read.
#[derive(Default)]
pub(super) struct Steps {
    /// Number of steps begun so far.
    pub(super) count: usize,
    is_new: bool,
}

impl Steps {
    /// Checks a keyword line. Returns true if the line removes all supports that were defined before the step.
    ///
    /// # Errors
    /// [`ReadProblem::Unsupported`] for a keyword or an option that changes the structure, or may change it.
    pub(super) fn check_keyword(&mut self, line: &str, at: usize) -> Result<bool, ReadProblem> {
        let word = keyword(line);
        let reject = |advice: &str| {
            Err(ReadProblem::Unsupported {
                found: format!("{word} of line {at}"),
                advice: advice.to_owned(),
            })
        };
        let word = word.as_str();
        if NOT_FLAT.contains(&word) {
            return reject(match word {
                "*INCLUDE" => "an included file cannot be found from here: give the deck as a file",
                _ => {
                    "only flat decks are read: fretwear-import writes one from a deck with parts and instances"
                }
            });
        }
        if !READ.contains(&word) && !HARMLESS.contains(&word) {
            return reject(
                "only a mesh of solids is assembled here, and this keyword changes the model: remove the keyword, or let your program write the matrices and use structure.kind = \"matrices\"",
            );
        }
        let option_value =
            |name: &str| option(line, name).filter(|value| !value.eq_ignore_ascii_case("NO"));
        if let Some((_, name, advice)) =
            (OPTIONS.iter()).find(|(of, name, _)| *of == word && option_value(name).is_some())
        {
            return reject(&format!("the option {name} is not supported: {advice}"));
        }
        match word {
            "*STEP" => {
                (self.count, self.is_new) = (self.count + 1, false);
                if option_value("NLGEOM").is_some() {
                    return reject(
                        "NLGEOM requests the stiffness of the loaded structure, but the unloaded structure is assembled here: remove NLGEOM, or let your program write the matrices",
                    );
                }
            }
            "*BOUNDARY" if self.count > 1 => {
                return reject(
                    "a second step may define another structure by its supports: keep one step, or define the supports before it",
                );
            }
            "*BOUNDARY" => {
                let is_new = option(line, "OP").is_some_and(|op| op.eq_ignore_ascii_case("NEW"));
                // The first line with OP=NEW in a step removes the earlier supports. Further lines of the step only
                // add supports.
                let removes_supports = is_new && !self.is_new;
                self.is_new |= is_new;
                return Ok(removes_supports);
            }
            _ => {}
        }
        Ok(false)
    }
}
