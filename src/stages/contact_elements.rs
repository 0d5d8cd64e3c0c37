//! Parameters of the contact elements of a structure from the fine contact: loads, gaps and springs.

use super::RunError;
use super::contact_state::{Fields, compliance_of, contact_of};
use super::solvers::{Solvers, smooth_compliance};
use super::stage_inputs::StageInputs;
use crate::contact::{ContactError, Shear};
use crate::dynamics::ElementState;
use crate::model_update::{
    Compliance, Distribution, ElementParameters, Laws, Linearisation, Springs,
};
use crate::recipe::Layout;
use crate::recipe::{ElementStiffness, Recipe};
use crate::tables::typed;
use crate::wear::FrettingJoint;

/// Linearises the fine contact.
pub fn linearise(
    recipe: &Recipe,
    joint: &mut FrettingJoint,
    pressure: &[f64],
) -> Result<Linearisation, ContactError> {
    let cap = joint.pressure_cap;
    let shear = recipe.contact().map_or(Shear::AlongX, |c| c.shear);
    Linearisation::new(&mut joint.half_space, pressure, cap, shear)
}

/// Returns the springs of the contact elements from the compliance of the fine contact.
pub fn springs<'a>(
    recipe: &Recipe,
    linearisation: &'a Linearisation,
    smooth: Option<Compliance>,
) -> Springs<'a> {
    match begins_with_tangents(recipe) {
        true => Springs::Tangent(linearisation),
        false => shared_springs(recipe, linearisation.compliance(), smooth),
    }
}

/// Returns true if the elements start from tangent springs. Elements with tangent stiffness and elements with several
/// sliders start from tangent springs.
fn begins_with_tangents(recipe: &Recipe) -> bool {
    let elements = recipe.elements();
    elements
        .is_some_and(|elements| elements.stiffness.is_tangent() || elements.stiffness.is_sliders())
}

/// Returns springs that share a compliance of the whole joint, without the compliance of the smooth patch if it is
/// given.
fn shared_springs(
    recipe: &Recipe,
    total: Compliance,
    smooth: Option<Compliance>,
) -> Springs<'static> {
    let distribution = match recipe.elements().map(|elements| elements.stiffness) {
        Some(ElementStiffness::Contact { distribution, .. }) => distribution,
        _ => Distribution::default(),
    };
    match smooth {
        Some(smooth) => Springs::Roughness {
            total,
            smooth,
            distribution,
        },
        None => Springs::Total {
            total,
            distribution,
        },
    }
}

/// Returns the parameters of the contact elements from the static contact of an iteration. If each element has an
/// individual friction law, the second value is the part of the contact that the laws omit.
pub fn parameters(
    reads: &StageInputs,
    solvers: &mut Solvers,
    contact: &typed::StaticContact,
    fields: &typed::ContactField,
) -> Result<(ElementParameters, Option<f64>), RunError> {
    let recipe = &reads.recipe;
    let elements = solvers.elements(reads)?;
    let smooth = smooth_compliance(reads)?;
    let Fields { gap, pressure, .. } = Fields::of(elements.patch(), fields);
    let stiffness = recipe.elements().map(|elements| elements.stiffness);
    if stiffness.is_some_and(|stiffness| stiffness.is_sliders()) {
        let shear = contact_of(recipe).shear;
        let (laws, _) = solvers.timed(reads, None, |joint| {
            let (mu, cap) = (joint.friction_coefficient, joint.pressure_cap);
            let state = [&pressure[..], &gap[..]];
            Ok(Laws::new(
                &mut joint.half_space,
                &elements,
                state,
                mu,
                cap,
                shear,
            )?)
        })?;
        return Ok((laws.parameters, Some(laws.backbone_error)));
    }
    if begins_with_tangents(recipe) {
        let (linearisation, _) = solvers.timed(reads, None, |joint| {
            Ok(linearise(recipe, joint, &pressure)?)
        })?;
        let springs = springs(recipe, &linearisation, smooth);
        let parameters = ElementParameters::new(&elements, &pressure, &gap, springs)?;
        return Ok((parameters, None));
    }
    // kn and kt of the whole joint are known already, so they are shared without a linearisation.
    let total = compliance_of(contact)?;
    let springs = shared_springs(recipe, total, smooth);
    let parameters = ElementParameters::new(&elements, &pressure, &gap, springs)?;
    Ok((parameters, None))
}

/// Returns the table of sliders; `None` for elements without sliders of their own.
pub fn slider_table(parameters: &ElementParameters) -> Option<typed::ContactSlider> {
    let sliders = parameters.sliders.as_ref()?;
    Some(typed::ContactSlider {
        element: sliders.element.iter().map(|&e| e as i32).collect(),
        normal_load: sliders.normal_load.clone(),
        gap: sliders.gap.clone(),
        kn: sliders.kn.clone(),
        kt: sliders.kt.clone(),
    })
}

/// Returns the table of contact elements, with the worst state of each element over the cycle if it is known.
pub fn element_table(
    layout: &Layout,
    parameters: &ElementParameters,
    states: Option<&[ElementState]>,
) -> typed::ContactElement {
    let count = parameters.normal_load.len();
    let name = |state: &ElementState| {
        match state {
            ElementState::Stick => "stick",
            ElementState::Partial => "partial",
            ElementState::Slip => "slip",
            ElementState::Open => "open",
        }
        .to_owned()
    };
    typed::ContactElement {
        element: (0..count as i32).collect(),
        x: layout.centres.iter().map(|c| c[0]).collect(),
        y: layout.centres.iter().map(|c| c[1]).collect(),
        area: layout.areas.clone(),
        normal_load: parameters.normal_load.clone(),
        gap: parameters.gap.clone(),
        kn: parameters.kn.clone(),
        kt: parameters.kt.clone(),
        state: states.map(|states| states.iter().map(name).collect()),
    }
}
