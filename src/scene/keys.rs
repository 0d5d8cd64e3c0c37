//! The keys of a scene: which exist, which are paths, which belong to which kind of a section, and which are still to come.

/// Every key. A table that is itself listed may also be written as a plain value.
pub(super) const KEYS: &[&str] = &[
    "title",
    "joint.size",
    "joint.grid",
    "joint.elements",
    "joint.hole.diameter",
    "material.youngs_modulus",
    "material.poisson_ratio",
    "material.density",
    "material.lower.youngs_modulus",
    "material.lower.poisson_ratio",
    "material.lower.density",
    "material.upper.youngs_modulus",
    "material.upper.poisson_ratio",
    "material.upper.density",
    "surface.kind",
    "surface.rq",
    "surface.correlation_length",
    "surface.hurst",
    "surface.rolloff_wavelength",
    "surface.cutoff_wavelength",
    "surface.seed",
    "surface.radius",
    "surface.path",
    "surface.unit",
    "surface.detrend",
    "surface.fill",
    "surface.spacing",
    "contact.friction_coefficient",
    "contact.normal_load",
    "contact.approach",
    "contact.kn",
    "contact.kt",
    "contact.gap",
    "contact.pressure_cap",
    "contact.boundary",
    "contact.transverse",
    "contact.rotation",
    "contact.moment",
    "contact.stiffness",
    "contact.distribution",
    "contact.bolt_stiffness",
    "structure.kind",
    "structure.depth",
    "structure.stub_length",
    "structure.gap_length",
    "structure.block_length",
    "structure.block_height",
    "structure.leaf_thickness",
    "structure.window_length",
    "structure.window_height",
    "structure.frame_height",
    "structure.wall_thickness",
    "structure.head_thickness",
    "structure.bolt_modulus_factor",
    "structure.half_depth_cells",
    "structure.block_cells",
    "structure.stub_cells",
    "structure.gap_cells",
    "structure.leaf_cells",
    "structure.window_cells",
    "structure.wall_cells",
    "structure.inner_cells",
    "structure.rim_cells",
    "structure.head_cells",
    "structure.mass",
    "structure.damping",
    "structure.stiffness",
    "dynamics.force",
    "dynamics.force.amplitude",
    "dynamics.force.at",
    "dynamics.force.direction",
    "dynamics.force.phase",
    "dynamics.force.harmonic",
    "dynamics.response.at",
    "dynamics.response.direction",
    "dynamics.harmonics",
    "dynamics.modes",
    "dynamics.damping_ratio",
    "dynamics.damping_basis",
    "dynamics.friction_law",
    "dynamics.frequency",
    "dynamics.points",
    "motion.amplitude",
    "motion.force",
    "motion.rotation",
    "motion.moment",
    "motion.phase",
    "motion.normal_load_amplitude",
    "motion.history",
    "wear.coefficient",
    "wear.cycles",
    "wear.volume",
    "wear.scheme",
    "wear.depth_step",
    "wear.tolerance",
    "update",
    "update.stiffness_change",
    "update.iterations",
    "update.wear_volume",
    "fidelity.preset",
    "fidelity.tolerance",
    "fidelity.cycle",
    "fidelity.steps_per_cycle",
    "fidelity.normal_tolerance",
    "fidelity.tangential_tolerance",
    "fidelity.cycle_tolerance",
    "fidelity.cycle_extrapolation",
    "fidelity.load_steps",
    "fidelity.wear_tolerance",
    "fidelity.aft_samples",
    "fidelity.harmonic_tolerance",
    "output.keep",
    "output.keep.every",
    "output.keep.last",
    "output.keep.updates",
    "output.cycle_fields",
    "output.curves_every",
    "output.response_at",
];

/// Keys whose value is the path of a file.
pub(super) const PATHS: &[[&str; 2]] = &[["surface", "path"], ["motion", "history"]];

/// Kinds of a section and the keys that each has beside `kind`.
pub(super) type Kinds = &'static [(&'static str, &'static [&'static str])];

/// The sections that have a `kind`.
pub(super) const KINDS: &[(&str, Kinds)] =
    &[("surface", SURFACE_KINDS), ("structure", STRUCTURE_KINDS)];

const SURFACE_KINDS: Kinds = &[
    ("gaussian", &["rq", "correlation_length", "seed"]),
    ("exponential", &["rq", "correlation_length", "seed"]),
    (
        "self_affine",
        &[
            "rq",
            "hurst",
            "rolloff_wavelength",
            "cutoff_wavelength",
            "seed",
        ],
    ),
    ("flat", &[]),
    ("sphere", &["radius"]),
    ("file", &["path", "unit", "detrend", "fill", "spacing"]),
];

const STRUCTURE_KINDS: Kinds = &[
    (
        "resonator",
        &[
            "depth",
            "stub_length",
            "gap_length",
            "block_length",
            "block_height",
            "leaf_thickness",
            "window_length",
            "window_height",
            "frame_height",
            "wall_thickness",
            "head_thickness",
            "bolt_modulus_factor",
            "half_depth_cells",
            "block_cells",
            "stub_cells",
            "gap_cells",
            "leaf_cells",
            "window_cells",
            "wall_cells",
            "inner_cells",
            "rim_cells",
            "head_cells",
        ],
    ),
    ("oscillator", &["mass", "damping", "stiffness"]),
];

/// The kinds of a section; none for a section without `kind`.
pub(super) fn kinds(section: &str) -> Kinds {
    KINDS
        .iter()
        .find(|entry| entry.0 == section)
        .map_or(&[], |entry| entry.1)
}

/// The keys of one kind of a section.
pub(super) fn keys_of_kind(section: &str, kind: &str) -> Option<&'static [&'static str]> {
    kinds(section)
        .iter()
        .find(|entry| entry.0 == kind)
        .map(|entry| entry.1)
}

/// Keys of one section of which a scene gives one: setting one drops the others.
pub(super) const ALTERNATIVES: &[(&str, &[&[&str]])] = &[
    (
        "motion",
        &[
            &["history"],
            &[
                "amplitude",
                "phase",
                "normal_load_amplitude",
                "force",
                "rotation",
                "moment",
            ],
        ],
    ),
    ("contact", &[&["normal_load"], &["approach"]]),
    ("motion", &[&["force"], &["amplitude"], &["history"]]),
    ("motion", &[&["rotation"], &["moment"], &["history"]]),
    (
        "update",
        &[&["stiffness_change"], &["iterations"], &["wear_volume"]],
    ),
];

/// A section, a key of it, and the word that makes another key of it meaningless: setting the word drops the other key.
pub(super) const DROPPED_BY: &[(&str, &str, &str, &str)] = &[
    ("contact", "stiffness", "tangent", "distribution"),
    ("contact", "rotation", "fixed", "moment"),
];

/// Tables that may also be given as a list of tables.
pub(super) const LISTS: &[&str] = &["dynamics.force"];

/// Names that a resonator's drawing has, and the keys that give them.
const ELSEWHERE: &[(&str, &str)] = &[
    ("structure.lap_length", "joint.size"),
    ("structure.arm_height", "joint.size"),
    ("structure.lap_cells", "joint.elements"),
    ("structure.material", "material"),
];

/// Words less alike than this are not suggested: at 0.6 `frq` still finds `rq` and `bolt` finds nothing.
const LIKENESS: f64 = 0.6;

/// The word most like `word`, if any is like it at all.
pub(super) fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    let length = word.chars().count();
    known
        .into_iter()
        // Two words are at least as unlike as their lengths: a long one is not compared letter by letter.
        .filter(|candidate| {
            let other = candidate.chars().count();
            length.min(other) as f64 >= LIKENESS * length.max(other) as f64
        })
        .map(|candidate| {
            let likeness = strsim::normalized_damerau_levenshtein(&word, &candidate.to_lowercase());
            (likeness, candidate)
        })
        .filter(|(likeness, _)| *likeness >= LIKENESS)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// What stands directly under a section (`""`: at the top), in the order of [`KEYS`].
pub(super) fn children(section: &str) -> Vec<&'static str> {
    let mut names: Vec<&str> = Vec::new();
    for key in KEYS {
        let below = if section.is_empty() {
            Some(*key)
        } else {
            key.strip_prefix(section)
                .and_then(|rest| rest.strip_prefix('.'))
        };
        let Some(name) = below.and_then(|rest| rest.split('.').next()) else {
            continue;
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The known key that an unknown one was probably meant to be: in its own section, else of the same name elsewhere, else alike elsewhere.
pub(super) fn nearest_key(key: &str) -> Option<String> {
    if let Some((_, given)) = ELSEWHERE.iter().find(|entry| entry.0 == key) {
        return Some((*given).to_owned());
    }
    let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
    if let Some(sibling) = nearest(name, children(section)) {
        return Some(join(section, sibling));
    }
    // A table such as joint.hole has a few keys of its own: one of that name elsewhere is not what was meant.
    if section.contains('.') {
        return None;
    }
    let last = |key: &'static str| key.rsplit('.').next().unwrap_or(key);
    if let Some(same) = KEYS.iter().find(|known| last(known) == name) {
        return Some((*same).to_owned());
    }
    let alike = nearest(name, KEYS.iter().map(|known| last(known)))?;
    KEYS.iter()
        .find(|known| last(known) == alike)
        .map(|known| (*known).to_owned())
}

/// A dotted key from its section and its name.
pub(super) fn join(section: &str, name: &str) -> String {
    if section.is_empty() {
        name.to_owned()
    } else {
        format!("{section}.{name}")
    }
}
