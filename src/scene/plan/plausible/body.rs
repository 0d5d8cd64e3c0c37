//! The bodies: their materials, and the structure's dimensions.

use super::{Bounded, PLAIN, short};
use crate::material::Elastic;
use crate::recipe::Recipe;
use crate::structure::resonator::Resonator;

/// Young's moduli \[Pa\] of gels and of diamond.
const MODULUS: [f64; 2] = [1e4, 1.3e12];
/// Least size of a Poisson's ratio that is meant not to be zero; cork has zero.
const POISSON: f64 = 0.01;
/// Densities \[kg/m³\] of foam and of osmium.
const DENSITY: [f64; 2] = [20.0, 2.3e4];
/// Longitudinal wave speeds √(E/ρ) \[m/s\] of rubber and of diamond.
const WAVE_SPEED: [f64; 2] = [20.0, 2e4];
/// Stiffness of a node of a mesh, held alone, over modulus and distance of nodes: 0.3 to 3 of boxes, more of flat ones, less where the rest of a
/// structure was condensed. The nearest wrong unit is a factor of a thousand.
const OF_NODES: [f64; 2] = [0.04, 40.0];
/// Dimensions of a structure over the side of its joint: of a gap, and of a long arm.
const DIMENSION: [f64; 2] = [6e-3, 100.0];

/// What the bodies are made of.
pub fn materials(recipe: &Recipe) -> Vec<Bounded> {
    let mut found = Vec::new();
    let resonator = recipe.structure.as_ref().and_then(|s| s.source.resonator());
    match (recipe.contact().map(|contact| contact.bodies), resonator) {
        (Some(pair), _) if pair.lower == pair.upper => found.extend(elastic(
            pair.lower,
            ["material.youngs_modulus", "material.poisson_ratio"],
        )),
        (Some(pair), _) => {
            found.extend(elastic(
                pair.lower,
                [
                    "material.lower.youngs_modulus",
                    "material.lower.poisson_ratio",
                ],
            ));
            found.extend(elastic(
                pair.upper,
                [
                    "material.upper.youngs_modulus",
                    "material.upper.poisson_ratio",
                ],
            ));
        }
        (None, Some(resonator)) => found.extend(elastic(
            resonator.material.elastic,
            ["material.youngs_modulus", "material.poisson_ratio"],
        )),
        (None, None) => (),
    }
    found.extend(resonator.into_iter().flat_map(inertia));
    found.extend(of_files(recipe));
    found
}

/// Stiffness of the nodes at the joint of a structure from files, over what Young's modulus makes of it.
fn of_files(recipe: &Recipe) -> Option<Bounded> {
    let import = recipe.structure.as_ref()?.source.import()?;
    let modulus = recipe.contact()?.least_modulus();
    let ratio = import.apparent_modulus? / modulus;
    Some(Bounded {
        what: "stiffness of nodes at the joint over Young's modulus and their distance",
        value: ratio,
        words: short(ratio),
        bounds: OF_NODES,
        key: "structure.unit, material.youngs_modulus",
        hint: "t with mm and s, kg with m and s?",
        ..PLAIN
    })
}

fn elastic(body: Elastic, [modulus, poisson]: [&'static str; 2]) -> [Bounded; 2] {
    let ratio = body.poisson_ratio;
    [
        Bounded {
            what: "Young's modulus",
            value: body.youngs_modulus,
            words: format!("{} GPa", short(body.youngs_modulus * 1e-9)),
            bounds: MODULUS,
            unit: ("GPa", 1e9),
            key: modulus,
            hint: "GPa, MPa or Pa?",
            ..PLAIN
        },
        Bounded {
            what: "size of Poisson's ratio",
            value: ratio.abs(),
            words: format!("{}", ratio.abs()),
            bounds: [if ratio == 0.0 { 0.0 } else { POISSON }, 1.0],
            key: poisson,
            hint: "metals have some 0.3, and 0 is none",
            ..PLAIN
        },
    ]
}

fn inertia(resonator: &Resonator) -> [Bounded; 2] {
    let material = resonator.material;
    let speed = (material.elastic.youngs_modulus / material.density).sqrt();
    [
        Bounded {
            what: "density",
            value: material.density,
            words: format!("{} kg/m³", short(material.density)),
            bounds: DENSITY,
            unit: ("kg/m³", 1.0),
            key: "material.density",
            hint: "kg/m^3 or g/cm^3?",
            ..PLAIN
        },
        Bounded {
            what: "speed of sound",
            value: speed,
            words: format!("{} m/s", short(speed)),
            bounds: WAVE_SPEED,
            unit: ("m/s", 1.0),
            key: "material.youngs_modulus, material.density",
            hint: "it is the root of E over density",
            ..PLAIN
        },
    ]
}

/// The thinnest and the longest of the structure, against its joint.
pub fn dimensions(recipe: &Recipe) -> Vec<Bounded> {
    let resonator = recipe.structure.as_ref().and_then(|s| s.source.resonator());
    let Some(resonator) = resonator else {
        return Vec::new();
    };
    let side = (resonator.lap_length * resonator.arm_height).sqrt();
    let each = of_keys(resonator);
    let figure = |what, (key, length): (&'static str, f64)| Bounded {
        what,
        value: length / side,
        words: format!(
            "{} ({} mm over {} mm)",
            short(length / side),
            short(length * 1e3),
            short(side * 1e3)
        ),
        bounds: DIMENSION,
        key,
        hint: "mm, um or m? or joint.size, with which it is compared",
        ..PLAIN
    };
    let by_length = |a: &&(&str, f64), b: &&(&str, f64)| a.1.total_cmp(&b.1);
    let ends = [each.iter().min_by(by_length), each.iter().max_by(by_length)];
    let names = [
        "thinnest dimension of the structure over the side of the joint",
        "longest dimension of the structure over the side of the joint",
    ];
    let ends = names.into_iter().zip(ends.into_iter().flatten());
    ends.map(|(what, end)| figure(what, *end)).collect()
}

/// Lengths of a resonator \[m\] by their keys.
fn of_keys(resonator: &Resonator) -> [(&'static str, f64); 11] {
    [
        ("structure.depth", resonator.depth),
        ("structure.stub_length", resonator.stub_length),
        ("structure.gap_length", resonator.gap_length),
        ("structure.block_length", resonator.block_length),
        ("structure.block_height", resonator.block_height),
        ("structure.leaf_thickness", resonator.leaf_thickness),
        ("structure.window_length", resonator.window_length),
        ("structure.window_height", resonator.window_height),
        ("structure.frame_height", resonator.frame_height),
        ("structure.wall_thickness", resonator.wall_thickness),
        ("structure.head_thickness", resonator.head_thickness),
    ]
}
