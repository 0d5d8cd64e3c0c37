//! The contact of a vibrating joint without its vibration.

use super::Rehearsing;
use super::coarser;
use crate::contact::Shear;
use crate::recipe::{Cycle, Inputs, MotionSource};
use crate::wear::cycle::March;
use crate::wear::{Harmonic, HarmonicMotion};

impl Rehearsing<'_> {
    /// The rough contact under a straight motion, as long as its stiffness bears up to sliding; none where it cannot be solved.
    pub(super) fn contact_alone(&mut self, inputs: &Inputs) -> Option<Inputs> {
        let mut alone = inputs.clone();
        let recipe = &mut alone.recipe;
        recipe.structure = None;
        recipe.response = None;
        recipe.output.response_at = Vec::new();
        let joint = recipe.joints.first_mut()?;
        joint.elements = None;
        let cycle = joint.cycle.take();
        let contact = joint.contact.as_ref()?;
        let load = contact.normal_load;
        let friction = contact.friction_coefficient.unwrap_or(0.0);
        let along_y = (contact.shear == Shear::InPlane).then_some(Harmonic {
            amplitude: 0.0,
            phase: 0.0,
            is_force: contact.transverse_free,
        });
        let wear = recipe.wear.take();
        let curves = std::mem::take(&mut recipe.output.curves_every);
        let coarse = coarser::counts(recipe, coarser::coarsest(inputs));
        let pressed = coarser::on_grid(&alone, coarse)?;
        let pressed = self.run(&pressed, f64::INFINITY);
        self.rehearsed.pop();
        let kt = pressed?.iterations.first()?.kt?;
        let mut axes = vec![Harmonic {
            amplitude: friction * load / kt,
            phase: 0.0,
            is_force: false,
        }];
        axes.extend(along_y);
        let mut cycle: Cycle = cycle?;
        let motion = HarmonicMotion {
            axes,
            rotation: None,
            normal_load_amplitude: 0.0,
        };
        alone.motion = motion.sampled(load, cycle.steps);
        cycle.march = Some(March::Reversal);
        cycle.motion = MotionSource::Harmonic(motion);
        let recipe = &mut alone.recipe;
        recipe.joints.first_mut()?.cycle = Some(cycle);
        recipe.wear = wear;
        recipe.output.curves_every = curves;
        Some(alone)
    }
}
