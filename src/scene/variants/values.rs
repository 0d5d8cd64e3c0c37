//! Values at which each knob of a scene is tried.

use super::{Choice, Knob};
use crate::recipe::{ElementStiffness, MotionSource, Recipe, Response};
use crate::scene::Scene;
use crate::scene::keys::contact::STIFFNESS;
use crate::wear::cycle::March;

/// Tried tolerances of the worn volume.
const TOLERANCES: [f64; 3] = [0.05, 0.01, 0.002];

/// Depths of wear steps without error control, for a scene without a depth: the published depth, and ten times the
/// published depth.
const DEPTH_STEPS: [&str; 2] = ["0.1 um", "1 um"];

/// Fewest cells per side. Coarser grids resolve no roughness.
const FEWEST_CELLS: usize = 12;

/// Most cells per side. Finer grids are impractical.
const MOST_CELLS: usize = 1024;

/// Finest tried grid relative to the grid of the scene, unless a finer one is requested.
const FINEST: usize = 2;

/// Values of a knob, each with its size, and with the `--set` options if they are more than the value.
#[derive(Default)]
pub(super) struct Values {
    pub base: Option<(String, f64)>,
    pub tried: Vec<(String, f64, Vec<String>)>,
}

pub(super) fn values(
    knob: Knob,
    written: &Scene,
    scene: &Scene,
    recipe: &Recipe,
    choice: &Choice,
) -> Result<Values, &'static str> {
    const RIGID: &str = "there is no rough surface";
    const STILL: &str = "nothing moves the joint";
    let fidelity = &scene.fidelity;
    let response = scene.recipe.response.as_ref();
    let extended = response.and_then(|response| response.harmonic_tolerance);
    let rough = scene.surface.is_some();
    let moved = response.is_some() || scene.motion.is_some();
    // With a computed motion, the run decides how the cycle is marched.
    let march = recipe.cycle().and_then(|cycle| cycle.march);
    let load_steps = recipe
        .contact()
        .and_then(|contact| contact.coupling.load_steps());
    let stepped = march == Some(March::Stepped) || response.is_some();
    match knob.name {
        "normal_tolerance" if rough => Ok(decades(fidelity.tolerances.normal)),
        "tangential_tolerance" | "cycle_tolerance" | "cycle" | "steps_per_cycle" if !rough => {
            Err(RIGID)
        }
        "tangential_tolerance" if moved || load_steps.is_some() => {
            Ok(decades(fidelity.tolerances.tangential))
        }
        "tangential_tolerance" | "cycle_tolerance" | "cycle" | "steps_per_cycle" if !moved => {
            Err(STILL)
        }
        "cycle_tolerance" | "steps_per_cycle" if !stepped => {
            Err("the cycle is one exact solve between its reversals, not stepped")
        }
        "cycle_tolerance" => Ok(decades(fidelity.tolerances.cycle)),
        "steps_per_cycle" if has_rows_enough(recipe, fidelity.steps_per_cycle) => {
            Err("motion.history has more rows than a cycle has steps")
        }
        "steps_per_cycle" => Ok(counts(
            fidelity.steps_per_cycle,
            [1.0 / 4.0, 1.0 / 2.0, 2.0],
            even,
        )),
        "cycle" => Ok(cycles(march)),
        "load_steps" => match load_steps {
            Some(steps) => Ok(counts(steps, [1.0 / 4.0, 1.0 / 2.0, 2.0], whole)),
            None => Err("the bodies are not pressed together in load steps"),
        },
        "tolerance" | "wear_tolerance" | "scheme" if scene.recipe.wear.is_none() => {
            Err("there is no [wear]")
        }
        "tolerance" => Ok(parts(1.0, TOLERANCES).without_base()),
        "wear_tolerance" => {
            let tolerance = scene
                .recipe
                .wear
                .as_ref()
                .map_or(1.0, |wear| wear.tolerance);
            Ok(parts(tolerance, [10.0, 3.0, 0.3, 0.1]))
        }
        "scheme" => Ok(schemes(scene, written)),
        "aft_samples" | "harmonics" | "harmonic_tolerance" if response.is_none() => {
            Err("there is no [dynamics]")
        }
        "aft_samples" | "harmonics" | "harmonic_tolerance" if scene.contact.is_none() => {
            Err("without a contact the vibration is linear")
        }
        "aft_samples" => {
            let samples = response.map_or(1, |response| response.samples);
            Ok(counts(samples, [1.0 / 4.0, 1.0 / 2.0, 2.0], even))
        }
        "harmonic_tolerance" => match extended {
            Some(tolerance) => Ok(parts(tolerance, [10.0, 3.0, 0.3])),
            None => Err("dynamics.harmonics lists the harmonics"),
        },
        "harmonics" if extended.is_some() => {
            Err("fidelity.harmonic_tolerance adds harmonics as far as needed")
        }
        "harmonics" => Ok(response.map(harmonics).unwrap_or_default()),
        "modes" | "elements" | "stiffness"
            if scene.structure().is_none_or(|s| s.is_oscillator()) =>
        {
            Err("there is no [structure] of finite elements")
        }
        "elements" if scene.structure().is_some_and(|s| s.import().is_some()) => {
            Err("the files of the structure define the contact elements")
        }
        "modes" => {
            let structure = scene.recipe.structure.as_ref();
            let modes = structure.map_or(1, |structure| structure.modes);
            Ok(counts(modes, [1.0 / 3.0, 2.0 / 3.0, 3.0 / 2.0], whole))
        }
        "elements" => Ok(elements(scene)),
        "stiffness" if rough => Ok(stiffnesses(scene)),
        "grid" if rough => Ok(grids(scene, choice.largest_grid)),
        _ => Err(RIGID),
    }
}

impl Values {
    fn one(&mut self, value: impl Into<String>, size: f64) {
        self.tried.push((value.into(), size, Vec::new()));
    }

    /// For values that are neither finer nor coarser than `balanced`.
    fn without_base(self) -> Values {
        Values { base: None, ..self }
    }
}

/// Formats a number as in a scene: `1e-4`.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    format!("{rounded:e}")
}

fn parts(base: f64, factors: impl IntoIterator<Item = f64>) -> Values {
    let mut values = Values {
        base: Some((number(base), 1.0 / base)),
        ..Values::default()
    };
    for factor in factors {
        values.one(number(base * factor), 1.0 / (base * factor));
    }
    values
}

fn decades(base: f64) -> Values {
    parts(base, [100.0, 10.0, 0.1, 0.01])
}

fn whole(value: f64) -> usize {
    value.round() as usize
}

fn even(value: f64) -> usize {
    2 * whole(value / 2.0)
}

fn counts<const N: usize>(base: usize, factors: [f64; N], round: fn(f64) -> usize) -> Values {
    let mut values = Values {
        base: Some((base.to_string(), base as f64)),
        ..Values::default()
    };
    let mut tried: Vec<usize> = factors.map(|factor| round(base as f64 * factor)).to_vec();
    tried.dedup();
    for count in tried
        .into_iter()
        .filter(|count| *count > 0 && *count != base)
    {
        values.one(count.to_string(), count as f64);
    }
    values
}

fn cycles(base: Option<March>) -> Values {
    let mut values = Values::default();
    let known = [
        ("reversal", March::Reversal),
        ("superposition", March::Superposition),
        ("stepped", March::Stepped),
    ];
    for (word, march) in known {
        if base != Some(march) {
            values.one(word, 0.0);
        }
    }
    values
}

pub(super) fn own_depth(written: &Scene) -> Option<f64> {
    written
        .recipe
        .wear
        .as_ref()
        .and_then(|wear| wear.depth_step)
        .filter(|_| {
            // The default of the preset `paper` is not given by the scene.
            written
                .document()
                .get("wear")
                .is_some_and(|wear| wear.get("depth_step").is_some())
        })
}

pub(super) fn depth(metres: f64) -> String {
    format!("wear.depth_step={} um", number(metres * 1e6))
}

fn schemes(scene: &Scene, written: &Scene) -> Values {
    let mut values = Values::default();
    if scene
        .recipe
        .wear
        .as_ref()
        .is_some_and(|wear| wear.scheme.is_explicit())
    {
        return values;
    }
    let depths = match own_depth(written) {
        Some(own) => vec![depth(own), depth(10.0 * own)],
        None => DEPTH_STEPS
            .map(|step| format!("wear.depth_step={step}"))
            .to_vec(),
    };
    for scheme in ["semi_implicit", "explicit"] {
        for step in &depths {
            let size = step.trim_start_matches("wear.depth_step=");
            let sets = vec![format!("wear.scheme={scheme}"), step.clone()];
            values.tried.push((format!("{scheme}, {size}"), 0.0, sets));
        }
    }
    values
}

/// Tries fewer and more harmonics. If the scene has only odd harmonics beside 0, so have the variants.
fn harmonics(response: &Response) -> Values {
    let orders = &response.harmonics;
    let highest = orders.last().copied().unwrap_or(1);
    let step = if orders.iter().any(|order| *order > 0 && order % 2 == 0) || highest == 1 {
        1
    } else {
        2
    };
    let mut values = Values {
        base: Some((format!("{orders:?}"), f64::from(highest))),
        ..Values::default()
    };
    let tops = [
        highest.checked_sub(2 * step),
        highest.checked_sub(step),
        Some(highest + 2 * step),
        Some(highest + 4 * step),
    ];
    for top in tops.into_iter().flatten().filter(|top| *top >= 1) {
        let list: Vec<u32> = [0]
            .into_iter()
            .chain((1..=top).step_by(step as usize))
            .collect();
        values.one(format!("{list:?}"), f64::from(top));
    }
    values
}

/// Tries slightly fewer and more elements. The hole of a resonator covers a fixed number of elements, so a very
/// different number of elements would change the hole.
fn elements(scene: &Scene) -> Values {
    let Some([nx, ny]) = scene.joint.as_ref().and_then(|joint| joint.elements) else {
        return Values::default();
    };
    let shown = |n: usize| format!("[{n}, {n}]");
    let mut values = Values {
        base: Some((shown(nx), (nx * ny) as f64)),
        ..Values::default()
    };
    for n in [
        nx.checked_sub(4),
        nx.checked_sub(2),
        Some(nx + 2),
        Some(nx + 4),
    ] {
        if let Some(n) = n.filter(|n| *n > 0) {
            values.one(shown(n), (n * n) as f64);
        }
    }
    values
}

fn stiffnesses(scene: &Scene) -> Values {
    let mut values = Values::default();
    let own = scene.contact.as_ref().map(|contact| contact.elements);
    let Some(ElementStiffness::Contact { stiffness, .. }) = own else {
        return values;
    };
    for (word, kind, _) in STIFFNESS.value.0 {
        if stiffness != *kind {
            values.one(*word, 0.0);
        }
    }
    values
}

/// Halves and doubles the grid of the scene, so that its cells keep their shape.
fn grids(scene: &Scene, largest: Option<usize>) -> Values {
    let Some(base) = scene.joint.as_ref().and_then(|joint| joint.grid) else {
        return Values::default();
    };
    let longer = base[0].max(base[1]);
    let largest = largest.unwrap_or(FINEST * longer).min(MOST_CELLS);
    let shown = |grid: [usize; 2]| format!("[{}, {}]", grid[0], grid[1]);
    let size = |grid: [usize; 2]| (grid[0] * grid[1]) as f64;
    let mut values = Values {
        base: Some((shown(base), size(base))),
        ..Values::default()
    };
    for halvings in [2, 1] {
        let grid = base.map(|n| n >> halvings);
        if grid[0].min(grid[1]) >= FEWEST_CELLS {
            values.one(shown(grid), size(grid));
        }
    }
    let mut grid = base.map(|n| 2 * n);
    while grid[0].max(grid[1]) <= largest {
        values.one(shown(grid), size(grid));
        grid = grid.map(|n| 2 * n);
    }
    values
}

/// True if a cycle is stepped at the rows of a history for any number of steps up to twice `steps`. A history with
/// fewer rows is refined by halving up to that number.
fn has_rows_enough(recipe: &Recipe, steps: usize) -> bool {
    let motion = recipe.cycle().map(|cycle| &cycle.motion);
    matches!(motion, Some(MotionSource::History { samples, .. }) if *samples >= 2 * steps)
}
