//! `[dynamics]`: what drives the structure and what of its response is wanted.

use std::f64::consts::TAU;

use super::Result;
use crate::scene::document::Content;
use crate::scene::reader::{ANY, POSITIVE, RATIO, Reader};
use crate::scene::{Contact, DampingBasis, Dynamics, Force, FrictionLaw, Port, Structure, keys};
use crate::units::Dimension;

/// Elastic modes of a reduced structure unless the scene says otherwise [A §3].
const MODES: usize = 30;
/// More modes than any band that is swept has: the matrices of a reduced structure are dense, and the highest modes of a mesh are
/// not those of the structure.
const MOST_MODES: usize = 1000;
/// More frequencies than a forced response can show; each is a solve of its own.
const MOST_POINTS: usize = 100_000;
/// Directions of motion of an oscillator, all of which it keeps.
const OSCILLATOR_MODES: usize = 3;
/// Harmonics unless the scene says otherwise [A §3].
const HARMONICS: [u32; 4] = [0, 1, 2, 3];
/// A higher harmonic than any response shows: a slip of the keyboard.
const LARGEST_HARMONIC: u64 = 1000;
/// That harmonic and all below it, and the constant part.
const MOST_HARMONICS: usize = LARGEST_HARMONIC as usize + 1;
/// Modal damping ratio of a bolted steel structure unless the scene says otherwise. The published case does not state its own.
const DAMPING_RATIO: f64 = 0.002;
/// Where the forced response of an oscillator is computed unless the scene says otherwise: from this share of the natural
/// frequency without the contact to that share of the one with its springs.
const FROM_FREE: f64 = 0.5;
/// The same from the frequency with springs, where there is none without.
const FROM_STUCK: f64 = 0.3;
/// See [`FROM_FREE`].
const TO_STUCK: f64 = 1.5;

const FORCE_EXAMPLE: &str =
    "force = { amplitude = \"1000 N\", at = \"far_wall\", direction = \"x\" }";
const FREQUENCY_EXAMPLE: &str = "frequency = [\"900 Hz\", \"1050 Hz\"]";

/// Points of a structure at which forces act and displacements are read, the usual one first.
fn points(structure: &Structure) -> &'static [&'static str] {
    match structure {
        Structure::Resonator { .. } => &["far_wall", "block"],
        Structure::Oscillator { .. } => &["mass"],
    }
}

pub(super) fn dynamics(
    reader: &Reader<'_>,
    structure: &Structure,
    contact: Option<&Contact>,
) -> Result<Dynamics> {
    let is_oscillator = matches!(structure, Structure::Oscillator { .. });
    let forces = forces(reader, structure)?;
    let Some(drive) = forces.iter().find(|force| force.harmonic == 1) else {
        return Err(reader.conflict(
            "dynamics.force",
            "no force of harmonic 1 drives the structure; give one",
        ));
    };
    let response = port(reader, "dynamics.response", structure, &drive.port)?;
    let harmonics = harmonics(reader, &forces)?;
    if is_oscillator && reader.has("dynamics.modes") {
        return Err(reader.conflict(
            "dynamics.modes",
            "an oscillator is not reduced to modes; leave it out",
        ));
    }
    let default = if is_oscillator {
        OSCILLATOR_MODES
    } else {
        MODES
    };
    let modes = reader.count("dynamics.modes", 1, MOST_MODES)?;
    Ok(Dynamics {
        response,
        harmonics,
        modes: modes.unwrap_or(default),
        damping_ratio: reader
            .quantity("dynamics.damping_ratio", Dimension::NONE, RATIO, "0.002")?
            .unwrap_or(if is_oscillator { 0.0 } else { DAMPING_RATIO }),
        damping_basis: reader
            .choice(
                "dynamics.damping_basis",
                &[("stuck", DampingBasis::Stuck), ("free", DampingBasis::Free)],
            )?
            .unwrap_or(DampingBasis::Stuck),
        friction_law: reader
            .choice(
                "dynamics.friction_law",
                &[("cone", FrictionLaw::Cone), ("box", FrictionLaw::Box)],
            )?
            .unwrap_or(FrictionLaw::Cone),
        frequency: frequency(reader, structure, contact, drive.port.axis)?,
        points: reader.count("dynamics.points", 2, MOST_POINTS)?,
        forces,
    })
}

/// One force, or a list of them.
fn forces(reader: &Reader<'_>, structure: &Structure) -> Result<Vec<Force>> {
    const KEY: &str = "dynamics.force";
    let Some(node) = reader.node(KEY) else {
        let example = match structure {
            Structure::Resonator { .. } => FORCE_EXAMPLE,
            Structure::Oscillator { .. } => "force = { amplitude = \"100 N\", direction = \"x\" }",
        };
        return Err(reader.missing(KEY, example));
    };
    if matches!(node.content, Content::Section(_)) {
        return Ok(vec![force(reader, KEY, structure)?]);
    }
    let Some(tables) = node.tables() else {
        let expected = format!(
            "a table such as {}, or a list of such tables",
            FORCE_EXAMPLE.trim_start_matches("force = ")
        );
        return Err(reader.wrong_type(KEY, node, expected));
    };
    tables
        .into_iter()
        .enumerate()
        .map(|(at, table)| {
            reader.check_section(KEY, &table)?;
            let name = format!("force[{at}]");
            let root = table.below(&["dynamics", &name]);
            force(
                &Reader { root: &root },
                &keys::join("dynamics", &name),
                structure,
            )
        })
        .collect()
}

fn force(reader: &Reader<'_>, section: &str, structure: &Structure) -> Result<Force> {
    let key = |name| keys::join(section, name);
    let first = Port {
        at: points(structure)[0].to_owned(),
        axis: 0,
    };
    let port = port(reader, section, structure, &first)?;
    let harmonic = reader
        .integer(&key("harmonic"), 0, LARGEST_HARMONIC)?
        .map_or(1, |order| order as u32);
    let amplitude = reader
        .quantity(&key("amplitude"), Dimension::FORCE, ANY, "\"1000 N\"")?
        .ok_or_else(|| reader.missing(&key("amplitude"), "amplitude = \"1000 N\""))?;
    if amplitude == 0.0 {
        return Err(reader.out_of_range(
            &key("amplitude"),
            "other than zero: a force of nothing drives nothing; leave it out",
        ));
    }
    if amplitude < 0.0 && harmonic > 0 {
        return Err(reader.out_of_range(
            &key("amplitude"),
            "greater than zero; an opposite force has phase = \"180 deg\"",
        ));
    }
    let phase = reader
        .quantity(&key("phase"), Dimension::ANGLE, ANY, "\"90 deg\"")?
        .unwrap_or(0.0);
    if harmonic == 0 && phase != 0.0 {
        return Err(reader.conflict(
            &key("phase"),
            "harmonic = 0 is a constant force, which has no phase; leave it out",
        ));
    }
    Ok(Force {
        amplitude,
        port,
        phase,
        harmonic,
    })
}

/// `at` and `direction` of a force or of the response.
fn port(reader: &Reader<'_>, section: &str, structure: &Structure, default: &Port) -> Result<Port> {
    let known: Vec<(&str, &str)> = points(structure)
        .iter()
        .map(|name| (*name, *name))
        .collect();
    let at = reader
        .choice(&keys::join(section, "at"), &known)?
        .map_or_else(|| default.at.clone(), str::to_owned);
    let axis = reader
        .choice(
            &keys::join(section, "direction"),
            &[("x", 0), ("y", 1), ("z", 2)],
        )?
        .unwrap_or(default.axis);
    Ok(Port { at, axis })
}

/// In ascending order.
fn harmonics(reader: &Reader<'_>, forces: &[Force]) -> Result<Vec<u32>> {
    const KEY: &str = "dynamics.harmonics";
    let expected = format!(
        "a list of different integers of 0 to {LARGEST_HARMONIC}, 0 and 1 among them, such as [0, 1, 2, 3]"
    );
    let mut orders = match reader.integers(KEY, MOST_HARMONICS, &expected)? {
        None => {
            let driven = forces.iter().map(|force| force.harmonic);
            let mut orders: Vec<u32> = HARMONICS.into_iter().chain(driven).collect();
            orders.sort_unstable();
            orders.dedup();
            orders
        }
        Some(orders) => orders
            .into_iter()
            .map(|order| {
                u32::try_from(order)
                    .ok()
                    .filter(|_| order <= LARGEST_HARMONIC)
                    .ok_or_else(|| reader.out_of_range(KEY, expected.as_str()))
            })
            .collect::<Result<Vec<u32>>>()?,
    };
    orders.sort_unstable();
    if !orders.starts_with(&[0, 1]) {
        return Err(reader.out_of_range(KEY, expected));
    }
    if let Some(force) = forces.iter().find(|f| !orders.contains(&f.harmonic)) {
        return Err(reader.conflict(
            "dynamics.force",
            format!(
                "harmonic {} is not in dynamics.harmonics = {orders:?}; add it there",
                force.harmonic
            ),
        ));
    }
    Ok(orders)
}

fn frequency(
    reader: &Reader<'_>,
    structure: &Structure,
    contact: Option<&Contact>,
    axis: usize,
) -> Result<[f64; 2]> {
    const KEY: &str = "dynamics.frequency";
    let expected =
        "a list of the lowest and the highest frequency, such as [\"900 Hz\", \"1050 Hz\"]";
    let given = reader.list(KEY, Dimension::FREQUENCY, POSITIVE, None, expected)?;
    if let Some([low, high]) = given {
        return if low < high {
            Ok([low, high])
        } else {
            let expected =
                "a list with the lower frequency first, such as [\"900 Hz\", \"1050 Hz\"]";
            Err(reader.out_of_range(KEY, expected))
        };
    }
    let missing = || reader.missing(KEY, FREQUENCY_EXAMPLE);
    let Structure::Oscillator {
        mass, stiffness, ..
    } = structure
    else {
        return Err(missing());
    };
    let spring = contact
        .and_then(|contact| contact.given)
        .map_or(0.0, |given| if axis == 2 { given.kn } else { given.kt });
    let natural = |stiffness: f64| (stiffness / mass[axis]).sqrt() / TAU;
    let [free, stuck] = [natural(stiffness[axis]), natural(stiffness[axis] + spring)];
    let low = if free > 0.0 {
        FROM_FREE * free
    } else {
        FROM_STUCK * stuck
    };
    if low > 0.0 {
        Ok([low, TO_STUCK * stuck])
    } else {
        Err(missing())
    }
}
