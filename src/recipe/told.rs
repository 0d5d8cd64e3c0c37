//! A recipe in words: what will exist, what will not, and why.

use serde::Serialize;

use super::build::STRAIGHT;
use super::{
    Contact, Coupling, Cycle, ElementStiffness, Motion, Recipe, StructureSource, Surface, Wear,
};
use crate::contact::Shear;
use crate::contact::normal::Rotation;
use crate::dynamics::FrictionLaw;
use crate::model_update::{Criterion, StiffnessKind};
use crate::wear::cycle::March;
use crate::wear::joint::Scheme;

/// One decision: what, whether it will exist, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// What it is about.
    pub what: String,
    /// What was decided.
    pub choice: String,
    /// Why.
    pub why: String,
}

/// The decisions of a recipe, in the order of the stages that they are about.
pub fn told(recipe: &Recipe) -> Vec<Decision> {
    let mut told = Told(Vec::new());
    if let (Some(surface), Some(contact)) = (recipe.surface(), recipe.contact()) {
        told.contact(surface, contact);
        told.cycle(contact, recipe.cycle());
        told.wear(recipe.wear.as_ref());
    }
    told.vibration(recipe);
    told.0
}

struct Told(Vec<Decision>);

impl Told {
    fn add(&mut self, what: &str, choice: impl Into<String>, why: &str) {
        self.0.push(Decision {
            what: what.to_owned(),
            choice: choice.into(),
            why: why.to_owned(),
        });
    }

    fn contact(&mut self, surface: &Surface, contact: &Contact) {
        let why = &contact.why;
        let [x, y] = contact.plane;
        self.add("transforms", format!("real, {x} x {y}"), why.of("boundary"));
        let cells = format!("{} of {}", surface.kept, surface.grid().len());
        self.add("cells", cells, surface.why.of("cells"));
        let cap = contact.pressure_cap.map(|cap| format!("at {cap:e} Pa"));
        let cap = cap.unwrap_or_else(|| "none".to_owned());
        self.add("pressure cap", cap, why.of("pressure_cap"));
        let coupling = match contact.coupling {
            Coupling::None => "none".to_owned(),
            Coupling::Frictionless => "in kt alone".to_owned(),
            Coupling::Indented { load_steps } => {
                format!("pressure and shear together, in {load_steps} load steps")
            }
        };
        let kernels = "kernels normal-tangential (zx, zy)";
        self.add(kernels, coupling, why.of("coupling"));
        let shear = match (contact.shear, contact.transverse_free) {
            (Shear::AlongX, _) => "along x; kernel xx",
            (Shear::InPlane, false) => "along x and y; kernels xx, yy, xy",
            (Shear::InPlane, true) => "along x and y, without force along y; kernels xx, yy, xy",
        };
        self.add("shear", shear, why.of("shear"));
        let rotation = match contact.rotation {
            Rotation::Given(_) => "held; the moments of the pressure are reported".to_owned(),
            Rotation::Free { moment: [0.0, 0.0] } => {
                "found such that the pressure has no moments, and reported".to_owned()
            }
            Rotation::Free { moment: [x, y] } => format!(
                "found such that the pressure has moments of {x:e} and {y:e} N m, and reported"
            ),
        };
        self.add("rotations about x and y", rotation, why.of("rotation"));
        if contact.friction_coefficient == Some(0.0) {
            self.add("friction", "none", why.of("friction_coefficient"));
        }
    }

    fn cycle(&mut self, contact: &Contact, cycle: Option<&Cycle>) {
        const WHAT: &str = "fretting cycle";
        let Some(cycle) = cycle else {
            return self.add(WHAT, "none", contact.why.of("cycle"));
        };
        if let Motion::Harmonic { axes, rotation, .. } = &cycle.motion {
            if axes
                .iter()
                .any(|axis| axis.is_force && axis.amplitude != 0.0)
            {
                self.add(
                    "force in the plane",
                    "given; the displacement is found and reported",
                    "motion.force",
                );
            }
            match rotation.map(|rotation| rotation.is_force) {
                Some(false) => self.add(
                    "rotation about z",
                    "given; its moment is reported",
                    "motion.rotation",
                ),
                Some(true) => self.add(
                    "rotation about z",
                    "found from the moment given, and reported",
                    "motion.moment",
                ),
                None => {}
            }
        }
        let samples = match &cycle.motion {
            Motion::History { samples, .. } => *samples,
            _ => cycle
                .harmonic_motion(contact.normal_load)
                .map_or(cycle.steps, |motion| motion.samples()),
        };
        let extrapolated = if cycle.extrapolate {
            "; with half of them too, for its error and, where the motion turns, to extrapolate"
        } else {
            ""
        };
        let stepped =
            || format!("stepped: {samples} exact solves a cycle, until it closes{extrapolated}");
        let choice = match (cycle.march, cycle.asked) {
            (Some(March::Reversal), _) => "reversal: one exact solve a cycle".to_owned(),
            (Some(March::Superposition), _) => {
                "superposition: two pressures in place of a tangential solve, an approximation"
                    .to_owned()
            }
            (Some(March::Stepped), _) | (None, Some(March::Stepped)) => stepped(),
            (None, Some(march)) => format!(
                "{}, if the motion that dynamic_response finds allows it",
                march.word()
            ),
            (None, None) => "after dynamic_response: reversal or stepped".to_owned(),
        };
        self.add(WHAT, choice, cycle.why.of("march"));
    }

    fn wear(&mut self, wear: Option<&Wear>) {
        let Some(wear) = wear else {
            return self.add("wear", "none", "no [wear]: a single pass");
        };
        let depth = wear.depth_step.unwrap_or(f64::NAN);
        let (choice, why) = match wear.scheme {
            Scheme::Implicit => (
                format!(
                    "implicit, second order, error {} of the volume of each step",
                    wear.tolerance
                ),
                "wear.scheme = \"implicit\": stable at any step",
            ),
            Scheme::SemiImplicit => (
                format!(
                    "implicit in the pressure, first order, {depth:e} m a step at the rate of its beginning"
                ),
                "wear.scheme = \"semi_implicit\": the slip of a step's beginning, without an error to set the step",
            ),
            Scheme::Explicit => (
                format!("explicit, {depth:e} m a step"),
                "wear.scheme = \"explicit\": the published step [A eq. 2.7-2.8]",
            ),
        };
        self.add("wear", choice, why);
    }

    fn vibration(&mut self, recipe: &Recipe) {
        let (Some(structure), Some(response)) = (&recipe.structure, &recipe.response) else {
            return self.add(
                "structure, dynamic response, model update",
                "none",
                "no [structure] and [dynamics]",
            );
        };
        let source = match &structure.source {
            StructureSource::Resonator { .. } => format!(
                "resonator: {} elastic modes, and the static residual of all others",
                structure.modes
            ),
            StructureSource::Oscillator { .. } => "one mass, three degrees of freedom".to_owned(),
        };
        self.add("structure", source, structure.why.of("source"));
        let elements = recipe.elements();
        match elements {
            None => self.add("contact elements", "none", response.why.of("elements")),
            Some(elements) => {
                let law = match elements.friction_law {
                    FrictionLaw::Cone => "|T| <= mu N",
                    FrictionLaw::Box => "|Tx| and |Ty| <= mu N each",
                };
                let choice = format!("{}, three-dimensional, {law}", elements.count);
                self.add("contact elements", choice, elements.why.of("friction_law"));
                self.add(
                    "unknowns of the harmonic balance",
                    "after the linear response: those of contact elements that slip or open",
                    "the others follow their springs, which is checked over the whole cycle",
                );
            }
        }
        let orders = &response.harmonics;
        let harmonics = match response.harmonic_tolerance {
            Some(tolerance) => format!(
                "after dynamic_response: from {orders:?} up to 31, until those left out change amplitude and dissipation by less than {tolerance}"
            ),
            None => format!("{orders:?}"),
        };
        self.add("harmonics", harmonics, response.why.of("harmonics"));
        if response.damping_ratio > 0.0 {
            let ratio = format!("ratio {} in every mode", response.damping_ratio);
            self.add("damping", ratio, response.why.of("damping_basis"));
        }
        let points = match response.points {
            Some(points) => format!("at {points} frequencies"),
            None => "as continuation places its points".to_owned(),
        };
        self.add("forced response", points, response.why.of("points"));
        let Some(elements) = elements else {
            return;
        };
        let stiffness = match elements.stiffness {
            ElementStiffness::Given { .. } => "given",
            ElementStiffness::Contact { stiffness, .. } => match stiffness {
                StiffnessKind::Total => "that of the whole rough patch",
                StiffnessKind::Roughness => {
                    "that of the rough patch without the smooth one's compliance"
                }
                StiffnessKind::Tangent => "each element its own tangent",
            },
        };
        self.add("contact stiffness", stiffness, elements.why.of("stiffness"));
        if matches!(elements.stiffness, ElementStiffness::Given { .. }) {
            return;
        }
        let update = match elements.update {
            _ if recipe.wear.is_none() => "none".to_owned(),
            Criterion::Never => "never".to_owned(),
            Criterion::StiffnessChange(change) => {
                format!(
                    "after static_contact: where kn or kt has changed by {change} since the last"
                )
            }
            Criterion::Iterations(every) => format!("every {every} wear iterations"),
            Criterion::WearVolume(volume) => format!("after wear: at every {volume:e} m^3"),
        };
        self.add("model update", update, elements.why.of("update"));
    }
}

/// Why a motion that is computed is marched as it is.
pub(crate) fn why_computed(asked: Option<March>) -> String {
    match asked {
        Some(March::Stepped) => "fidelity.cycle or the preset asks for it".to_owned(),
        Some(_) => format!(
            "fidelity.cycle asks for it; the joint's load may vary by {STRAIGHT} of it and its motion leave its line by {STRAIGHT} of its reach"
        ),
        None => format!(
            "reversal where the joint's load varies by less than {STRAIGHT} of it and its motion leaves its line by less than {STRAIGHT} of its reach; else stepped"
        ),
    }
}
