//! Messages for faults of structures and their contacts, word for word.

use super::{OSCILLATOR, ROUGH, SPRINGS, assert_faults};

/// Replaced text of the rough joint, new text, and message.
const IN_ROUGH: &[(&str, &str, &str)] = &[
    (
        r#"[structure]
kind = "resonator"
"#,
        "",
        r#"case.toml: section [structure] is missing ([dynamics] needs it: the structure that vibrates); add for example:
[structure]
kind = "resonator""#,
    ),
    (
        r#"[dynamics]
force = { amplitude = "1000 N", at = "far_wall", direction = "x" }
frequency = ["900 Hz", "1050 Hz"]
"#,
        "",
        r#"case.toml: section [dynamics] is missing ([structure] needs it: the forces that make it vibrate); add for example:
[dynamics]
force = { amplitude = "1000 N", at = "far_wall", direction = "x" }
frequency = ["900 Hz", "1050 Hz"]"#,
    ),
    (
        "[wear]",
        r#"[motion]
amplitude = "5 um"
[wear]"#,
        "case.toml, line 21: section [motion]: [dynamics] computes the motion of the joint; give one or the other",
    ),
    (
        r#"kind = "resonator""#,
        "",
        r#"case.toml: structure.kind is missing; add to [structure]: kind = "resonator""#,
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonatr""#,
        r#"case.toml, line 17: structure.kind = "resonatr": must be one of "resonator", "matrices", "mesh", "oscillator"; did you mean "resonator"?"#,
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "reduced""#,
        r#"case.toml, line 17: structure.kind = "reduced" is not available in this version: only "resonator", "matrices", "mesh" and "oscillator" are"#,
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
mass = "1 kg""#,
        r#"case.toml, line 18: structure.mass = "1 kg" does not belong to structure.kind = "resonator", whose keys are: depth, stub_length, gap_length, block_length, block_height, leaf_thickness, window_length, window_height, frame_height, wall_thickness, head_thickness, bolt_modulus_factor, half_depth_cells, block_cells, stub_cells, gap_cells, leaf_cells, window_cells, wall_cells, inner_cells, rim_cells, head_cells"#,
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
block_lenght = "70 mm""#,
        r#"case.toml, line 18: structure.block_lenght = "70 mm": there is no such key; did you mean structure.block_length?"#,
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
lap_length = "40 mm""#,
        r#"case.toml, line 18: structure.lap_length = "40 mm": there is no such key; did you mean joint.size?"#,
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
block_length = 70"#,
        r#"case.toml, line 18: structure.block_length: "70" has no unit; a length is wanted, such as "70 um" or "70 mm""#,
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
block_length = "0 mm""#,
        r#"case.toml, line 18: structure.block_length = "0 mm": must be greater than zero"#,
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
leaf_cells = 0"#,
        "case.toml, line 18: structure.leaf_cells = 0: must be an integer of 1 to 999",
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
leaf_cells = 1000"#,
        "case.toml, line 18: structure.leaf_cells = 1000: must be an integer of 1 to 999",
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
head_cells = 999
half_depth_cells = 999
window_cells = 999"#,
        "case.toml, line 16: section [structure]: the box around its mesh has 1.97e8 cells, but at most 4e6 are allowed: make joint.elements or the *_cells smaller",
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
window_height = "30 mm""#,
        r#"case.toml, line 18: structure.window_height = "30 mm": structure.window_height must be greater than joint.size along y, but they are 30 mm and 38 mm"#,
    ),
    (
        r#"kind = "resonator""#,
        r#"kind = "resonator"
frame_height = "100 mm""#,
        r#"case.toml, line 18: structure.frame_height = "100 mm": structure.frame_height must be greater than structure.window_height, but they are 100 mm and 120 mm"#,
    ),
    (
        r#""38 mm""#,
        r#""130 mm""#,
        r#"case.toml, line 2: joint.size = ["40 mm", "130 mm"]: structure.window_height must be greater than joint.size along y, but they are 120 mm and 130 mm"#,
    ),
    (
        "elements = [19, 19]",
        "elements = [19, 17]",
        "case.toml, line 4: joint.elements = [19, 17]: must be the same number along x and y for a resonator, such as [19, 19]",
    ),
    (
        "elements = [19, 19]",
        "elements = [20, 20]",
        "case.toml, line 4: joint.elements = [20, 20]: must be an odd number, at least the 9 cells of a bolt head",
    ),
    (
        "elements = [19, 19]",
        "elements = [7, 7]",
        "case.toml, line 4: joint.elements = [7, 7]: must be an odd number, at least the 9 cells of a bolt head",
    ),
    (
        "grid = [76, 57]",
        "",
        "case.toml: joint.grid is missing; add to [joint]: grid = [256, 192]",
    ),
    (
        "grid = [76, 57]",
        "grid = [76, 18]",
        "case.toml, line 3: joint.grid = [76, 18]: must be at least one cell per contact element, 19 along x and y, or elements would bear no load",
    ),
    (
        "elements = [19, 19]",
        r#"hole = { diameter = "16 mm" }"#,
        r#"case.toml, line 4: joint.hole.diameter = "16 mm": must be within 2.1053 mm of 10.6104 mm: the mesh of a resonator defines its hole, 21 contact elements; remove joint.hole"#,
    ),
    (
        r#"density = "7949 kg/m^3""#,
        "",
        r#"case.toml: material.density is missing; add to [material]: density = "7949 kg/m^3""#,
    ),
    (
        r#"density = "7949 kg/m^3""#,
        r#"density = "7949 kg/m^3"
upper = { youngs_modulus = "70 GPa" }"#,
        r#"case.toml, line 9: material.upper.youngs_modulus = "70 GPa": a resonator has one material; material.lower and material.upper must be equal"#,
    ),
    (
        "poisson_ratio = 0.3",
        "poisson_ratio = 0.5",
        "case.toml, line 7: material.poisson_ratio = 0.5: must be above -1 and below 0.5",
    ),
    (
        r#"[contact]
friction_coefficient = 0.6
normal_load = "30 kN"
"#,
        "",
        r#"case.toml: section [contact] is missing (the load on the joint); add for example:
[contact]
friction_coefficient = 0.6
normal_load = "30 kN""#,
    ),
    (
        "friction_coefficient = 0.6
",
        "",
        "case.toml: contact.friction_coefficient is missing; add to [contact]: friction_coefficient = 0.6",
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "0 kN""#,
        r#"case.toml, line 15: contact.normal_load = "0 kN": must be greater than zero"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
kn = "1e4 N/um""#,
        r#"case.toml, line 16: contact.kn = "1e4 N/um": the contact stiffness is already computed from [surface]; give one or the other"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
kt = "1e4 N/um""#,
        r#"case.toml, line 16: contact.kt = "1e4 N/um": the contact stiffness is already computed from [surface]; give one or the other"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
gap = "1 um""#,
        r#"case.toml, line 16: contact.gap = "1 um": the gap follows from the surface; it is given only together with contact.kn and contact.kt"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
stiffness = "tangential""#,
        r#"case.toml, line 16: contact.stiffness = "tangential": must be one of "sliders", "total", "roughness", "tangent"; did you mean "tangent"?"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
stiffness = "tangent"
distribution = "by_load""#,
        r#"case.toml, line 17: contact.distribution = "by_load": contact.stiffness = "tangent" gives each element its own stiffness; remove distribution, or add stiffness = "total""#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
distribution = "loaded""#,
        r#"case.toml, line 16: contact.distribution = "loaded": contact.stiffness = "sliders", its default, gives each element its own stiffness; remove distribution, or add stiffness = "total""#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
bolt_stiffness = "0 N/um""#,
        r#"case.toml, line 16: contact.bolt_stiffness = "0 N/um": must be greater than zero"#,
    ),
    (
        r#"[surface]
kind = "gaussian"
rq = "5 um"
correlation_length = ["0.5 mm", "0.4 mm"]
"#,
        "",
        r#"case.toml: section [surface] is missing (the heights of the contact; contact.kn and contact.kt may take its place); add for example:
[surface]
kind = "gaussian"
rq = "5 um"
correlation_length = ["0.5 mm", "0.5 mm"]"#,
    ),
];

/// Replaced text of the resonator with given stiffness, new text, and message.
const IN_SPRINGS: &[(&str, &str, &str)] = &[
    (
        r#"kt = "1e4 N/um"
"#,
        "",
        r#"case.toml: contact.kt is missing; add to [contact]: kt = "1e4 N/um""#,
    ),
    (
        r#"kn = "1.2e4 N/um"
"#,
        "",
        r#"case.toml: contact.kn is missing; add to [contact]: kn = "1.2e4 N/um""#,
    ),
    (
        r#"kn = "1.2e4 N/um"
kt = "1e4 N/um"
"#,
        "",
        r#"case.toml: section [surface] is missing (the heights of the contact; contact.kn and contact.kt may take its place); add for example:
[surface]
kind = "gaussian"
rq = "5 um"
correlation_length = ["0.5 mm", "0.5 mm"]"#,
    ),
    (
        r#"kn = "1.2e4 N/um""#,
        r#"kn = "-1 N/um""#,
        r#"case.toml, line 8: contact.kn = "-1 N/um": must be zero or greater"#,
    ),
    (
        r#"kn = "1.2e4 N/um""#,
        r#"kn = "1.2e4 N/um^2""#,
        r#"case.toml, line 8: contact.kn: "1.2e4 N/um^2" is a pressure; a stiffness is wanted, such as "1e4 N/um""#,
    ),
    (
        r#"kn = "1.2e4 N/um"
kt = "1e4 N/um"
friction_coefficient = 0.6
normal_load = "30 kN""#,
        r#"kn = "0 N/um"
kt = "1e4 N/um"
friction_coefficient = 0.6
normal_load = "0 N""#,
        r#"case.toml, line 8: contact.kn = "0 N/um": without a normal stiffness the contact bears no load unless contact.kt and contact.normal_load are greater than zero; give them, or remove [contact]"#,
    ),
    (
        "friction_coefficient = 0.6
",
        "",
        "case.toml: contact.friction_coefficient is missing; add to [contact]: friction_coefficient = 0.6",
    ),
    (
        "friction_coefficient = 0.6",
        "friction_coefficient = -0.6",
        "case.toml, line 10: contact.friction_coefficient = -0.6: must be zero or greater",
    ),
    (
        r#"normal_load = "30 kN""#,
        "",
        r#"case.toml: contact.normal_load is missing; add to [contact]: normal_load = "30 kN"   (or gap = "20 um")"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
gap = "1 um""#,
        r#"case.toml, line 12: contact.gap = "1 um": a contact that is open at rest bears no contact.normal_load; give one or the other"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"gap = "-1 um""#,
        r#"case.toml, line 11: contact.gap = "-1 um": must be zero or greater"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
pressure_cap = "600 MPa""#,
        r#"case.toml, line 12: contact.pressure_cap = "600 MPa": it applies to the contact of a rough surface, but contact.kn and contact.kt are given instead; remove it"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
bolt_stiffness = "1 N/um""#,
        r#"case.toml, line 12: contact.bolt_stiffness = "1 N/um": it applies to the contact of a rough surface, but contact.kn and contact.kt are given instead; remove it"#,
    ),
    (
        r#"normal_load = "30 kN""#,
        r#"normal_load = "30 kN"
stiffness = "total""#,
        r#"case.toml, line 12: contact.stiffness = "total": it applies to the contact of a rough surface, but contact.kn and contact.kt are given instead; remove it"#,
    ),
    (
        "[structure]",
        r#"[wear]
coefficient = "2e3 um^3/J"
cycles = 5
[structure]"#,
        r#"case.toml, line 8: contact.kn = "1.2e4 N/um": a contact of given stiffness has no surface that could wear; give [surface] instead, or remove [wear]"#,
    ),
    (
        "[structure]",
        "[output]
response_at = [0, 5]
[structure]",
        "case.toml, line 13: output.response_at = [0, 5]: without [wear] there are no cycles; remove it or give []",
    ),
    (
        "[structure]",
        "[update]
iterations = 5
[structure]",
        "case.toml, line 12: section [update]: without [wear] the contact never changes; remove it",
    ),
    (
        r#"[contact]
kn = "1.2e4 N/um"
kt = "1e4 N/um"
friction_coefficient = 0.6
normal_load = "30 kN"
"#,
        r#"[wear]
coefficient = "2e3 um^3/J"
cycles = 5
"#,
        r#"case.toml: section [contact] is missing ([wear] needs it: a bonded joint does not wear); add for example:
[contact]
friction_coefficient = 0.6
normal_load = "30 kN""#,
    ),
];

/// Replaced text of the oscillator, new text, and message.
const IN_OSCILLATOR: &[(&str, &str, &str)] = &[
    (
        "[structure]",
        r#"[joint]
size = ["40 mm", "38 mm"]
[structure]"#,
        "case.toml, line 1: section [joint]: an oscillator has one contact element and no joint; remove it",
    ),
    (
        "[structure]",
        r#"[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[structure]"#,
        "case.toml, line 1: section [material]: an oscillator has a mass and a stiffness instead, in [structure]; remove it",
    ),
    (
        "[structure]",
        r#"[surface]
kind = "flat"
[structure]"#,
        "case.toml, line 1: section [surface]: an oscillator has no joint that could be rough; give contact.kn and contact.kt",
    ),
    (
        "[structure]",
        r#"[wear]
coefficient = "2e3 um^3/J"
cycles = 5
[structure]"#,
        "case.toml, line 1: section [wear]: an oscillator has no surface that could wear; remove [wear]",
    ),
    (
        r#"mass = "1 kg""#,
        "",
        r#"case.toml: structure.mass is missing; add to [structure]: mass = "1 kg""#,
    ),
    (
        r#"mass = "1 kg""#,
        r#"mass = "1""#,
        r#"case.toml, line 3: structure.mass: "1" has no unit; a mass is wanted, such as "1 g" or "1 kg""#,
    ),
    (
        r#"mass = "1 kg""#,
        r#"mass = ["1 kg", "1 kg"]"#,
        r#"case.toml, line 3: structure.mass = ["1 kg", "1 kg"]: must be one value, or a list of three for x, y and z, such as "1 kg""#,
    ),
    (
        r#"mass = "1 kg""#,
        r#"mass = ["1 kg", "1 kg", "0 kg"]"#,
        r#"case.toml, line 3: structure.mass = ["1 kg", "1 kg", "0 kg"]: must be greater than zero"#,
    ),
    (
        r#"mass = "1 kg""#,
        r#"mass = "1 kg"
damping = "5 N/m""#,
        r#"case.toml, line 4: structure.damping: "5 N/m" is a stiffness; a damping (force per velocity) is wanted, such as "5 N s/m""#,
    ),
    (
        r#"mass = "1 kg""#,
        r#"mass = "1 kg"
damping = "-5 N s/m""#,
        r#"case.toml, line 4: structure.damping = "-5 N s/m": must be zero or greater"#,
    ),
    (
        r#"mass = "1 kg""#,
        r#"mass = "1 kg"
depth = "5 mm""#,
        r#"case.toml, line 4: structure.depth = "5 mm" does not belong to structure.kind = "oscillator", whose keys are: mass, damping, stiffness, cubic_stiffness, stop_stiffness, stop_gap"#,
    ),
    (
        r#"stiffness = "4 N/um""#,
        "",
        r#"case.toml: structure.stiffness is missing; add to [structure]: stiffness = "10 N/um""#,
    ),
    (
        r#"stiffness = "4 N/um""#,
        r#"stiffness = "-4 N/um""#,
        r#"case.toml, line 4: structure.stiffness = "-4 N/um": must be zero or greater"#,
    ),
    (
        r#"kn = "8 N/um"
kt = "6 N/um"
"#,
        "",
        r#"case.toml: contact.kn is missing; add to [contact]: kn = "12 N/um""#,
    ),
    (
        r#"force = { amplitude = "100 N" }"#,
        r#"force = { amplitude = "100 N", at = "far_wall" }"#,
        r#"case.toml, line 11: dynamics.force.at = "far_wall": must be one of "mass""#,
    ),
    (
        r#"force = { amplitude = "100 N" }"#,
        r#"force = { amplitude = "100 N" }
modes = 3"#,
        "case.toml, line 12: dynamics.modes = 3: an oscillator is not reduced to modes; remove it",
    ),
    (
        r#"stiffness = "4 N/um"
[contact]
kn = "8 N/um"
kt = "6 N/um"
friction_coefficient = 0.3
normal_load = "1 kN"
"#,
        r#"stiffness = "0 N/m"
"#,
        r#"case.toml: dynamics.frequency is missing; add to [dynamics]: frequency = ["900 Hz", "1050 Hz"]"#,
    ),
];

#[test]
fn faults_of_structures() {
    assert_faults(ROUGH, IN_ROUGH);
    assert_faults(SPRINGS, IN_SPRINGS);
    assert_faults(OSCILLATOR, IN_OSCILLATOR);
}
