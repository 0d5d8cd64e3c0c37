//! Inputs of the figures of a scene.

use super::face::Face;
use crate::material::Elastic;
use crate::recipe::{Inputs, Recipe, Response, Structure};
use crate::structure::resonator::Resonator;
use crate::surface::prepare::PreparedSurface;
use crate::wear::{Channel, Motion};

/// Index of the normal among the directions of an oscillator.
pub const NORMAL: usize = 2;

/// Scene with the data that several figures need.
pub struct Setup<'a> {
    pub recipe: &'a Recipe,
    pub motion: &'a Motion,
    pub map: Option<&'a PreparedSurface>,
    /// Load in the scene \[N\]. The motion of a rough joint may have another load.
    pub given_load: Option<f64>,
    /// Elastic constants of both bodies, if the two bodies have the same material.
    pub both: Option<Elastic>,
    /// Elastic constants of the lower and the upper body, if the two bodies have different materials.
    pub lower: Option<Elastic>,
    pub upper: Option<Elastic>,
    pub face: Option<Face<'a>>,
    pub response: Option<&'a Response>,
    pub resonator: Option<&'a Resonator>,
    pub oscillator: Option<Oscillator>,
}

impl<'a> Setup<'a> {
    pub fn of(inputs: &'a Inputs, given_load: Option<f64>) -> Self {
        let (recipe, motion) = (&inputs.recipe, &inputs.motion);
        let map = inputs.measured.as_deref();
        let structure = recipe.structure.as_ref();
        let resonator = structure.and_then(|structure| structure.source.resonator());
        let response = recipe.response.as_ref();
        let pair = recipe.contact().map(|contact| contact.bodies);
        let alike = pair.filter(|pair| pair.lower == pair.upper);
        let unlike = pair.filter(|pair| pair.lower != pair.upper);
        let of_resonator = resonator.filter(|_| pair.is_none());
        Setup {
            recipe,
            motion,
            map,
            given_load,
            both: alike
                .map(|pair| pair.lower)
                .or(of_resonator.map(|resonator| resonator.material.elastic)),
            lower: unlike.map(|pair| pair.lower),
            upper: unlike.map(|pair| pair.upper),
            face: Face::new(recipe, map),
            response,
            resonator,
            oscillator: structure
                .zip(response)
                .and_then(|(structure, response)| Oscillator::of(recipe, structure, response)),
        }
    }

    /// Friction coefficient of the joint, and its friction limit \[N\].
    pub fn friction(&self) -> Option<[f64; 2]> {
        if let Some(contact) = self.recipe.contact() {
            let mu = contact.friction_coefficient?;
            return Some([mu, mu * contact.conditions.normal_load]);
        }
        let elements = self.recipe.elements()?;
        let mu = elements.friction_coefficient;
        let [_, _, normal_load] = elements.stiffness.given()?;
        Some([mu, mu * normal_load])
    }

    /// Contact stiffness along the normal and in the plane \[N/m\], if both are given.
    pub fn springs(&self) -> Option<[f64; 2]> {
        let [kn, kt, _] = self.recipe.elements()?.stiffness.given()?;
        (kn > 0.0 && kt > 0.0).then_some([kn, kt])
    }

    /// Half range of the largest displacement \[m\], if it is given.
    pub fn displacement_half_range(&self) -> Option<f64> {
        let halves = self.motion.drive.iter().filter_map(half_range);
        Some(halves.fold(0.0, f64::max)).filter(|half| *half > 0.0)
    }

    /// Half range of the displacement of a corner \[m\], if a rotation is given.
    pub fn corner_half_range(&self) -> Option<f64> {
        let [x, y] = self.face?.surface.size;
        let angle = self.motion.rotation.as_ref().and_then(half_range)?;
        (angle > 0.0).then_some(angle * (0.5 * x.hypot(y)))
    }
}

/// Half range of a given displacement \[m\] or rotation \[rad\].
fn half_range(channel: &Channel) -> Option<f64> {
    match channel {
        Channel::Displacement(values) => {
            let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            Some(0.5 * (most - least))
        }
        Channel::Force(_) => None,
    }
}

/// Oscillator along the axis in which it is driven.
#[derive(Clone, Copy)]
pub struct Oscillator {
    pub mass: f64,
    damping: f64,
    /// Stiffness of the springs of the oscillator \[N/m\].
    pub stiffness: f64,
    /// Stiffness of the contact of the oscillator while the contact sticks \[N/m\].
    pub contact: f64,
}

impl Oscillator {
    fn of(recipe: &Recipe, structure: &Structure, response: &Response) -> Option<Self> {
        let drive = response.forces.iter().find(|force| force.harmonic == 1);
        let ground = response.base.map(|base| base.axis);
        let axis = drive.map(|force| force.port.axis).or(ground)?;
        let [mass, damping, stiffness] = structure.source.oscillator_along(axis)?;
        let contact_stiffness = recipe
            .elements()
            .and_then(|elements| elements.stiffness.given());
        let contact =
            contact_stiffness.map_or(0.0, |[kn, kt, _]| if axis == NORMAL { kn } else { kt });
        Some(Oscillator {
            mass,
            damping,
            stiffness,
            contact,
        })
    }

    pub fn dashpot_ratio(&self) -> f64 {
        0.5 * self.damping / (self.mass * (self.stiffness + self.contact)).sqrt()
    }
}
