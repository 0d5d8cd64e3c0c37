//! Messages for faults of the vibration and of the later stages, word for word.

use super::{ROUGH, assert_faults, message_of};

/// Replaced text of the rough joint, new text, and message.
const OF_DYNAMICS: &[(&str, &str, &str)] = &[
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        "",
        r#"case.toml: dynamics.force is missing; add to [dynamics]: force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = "1000 N""#,
        r#"case.toml, line 19: dynamics.force = "1000 N": must be a table such as { amplitude = "1000 N", at = "far_wall", direction = "x" }, or a list of such tables"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        "force = []",
        r#"case.toml, line 19: dynamics.force = []: must be a table such as { amplitude = "1000 N", at = "far_wall", direction = "x" }, or a list of such tables"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { at = "far_wall" }"#,
        r#"case.toml: dynamics.force.amplitude is missing; add to [dynamics.force]: amplitude = "1000 N""#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "0 N" }"#,
        r#"case.toml, line 19: dynamics.force.amplitude = "0 N": must be other than zero; remove a force of zero"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "-5 N" }"#,
        r#"case.toml, line 19: dynamics.force.amplitude = "-5 N": must be greater than zero; use phase = "180 deg" for an opposite force"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "1000 N/um" }"#,
        r#"case.toml, line 19: dynamics.force.amplitude: "1000 N/um" is a stiffness; a force is wanted, such as "30 N" or "30 kN""#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "1000 N", at = "farwall" }"#,
        r#"case.toml, line 19: dynamics.force.at = "farwall": must be one of "far_wall", "block"; did you mean "far_wall"?"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "1000 N", at = "mass" }"#,
        r#"case.toml, line 19: dynamics.force.at = "mass": must be one of "far_wall", "block""#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "1000 N", direction = "X" }"#,
        r#"case.toml, line 19: dynamics.force.direction = "X": must be one of "x", "y", "z"; did you mean "x"?"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "1000 N", phase = 90 }"#,
        r#"case.toml, line 19: dynamics.force.phase: "90" has no unit; an angle is wanted, such as "90 deg" or "90 rad""#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "1000 N", harmonic = 0 }"#,
        r#"case.toml, line 19: dynamics.force = { amplitude = "1000 N", harmonic = 0 }: no force of harmonic 1 drives the structure; give one"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "1000 N", harmonic = 1.5 }"#,
        "case.toml, line 19: dynamics.force.harmonic = 1.5: must be an integer of 0 to 1000",
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitude = "1000 N", harmonic = 1001 }"#,
        "case.toml, line 19: dynamics.force.harmonic = 1001: must be an integer of 0 to 1000",
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = { amplitud = "1000 N" }"#,
        r#"case.toml, line 19: dynamics.force.amplitud = "1000 N": there is no such key; did you mean dynamics.force.amplitude?"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        "force = [{ amplitude = \"1000 N\" }, { amplitude = \"5 N\", harmonic = 5 }]\nharmonics = [0, 1, 2]",
        r#"case.toml, line 19: dynamics.force = [{ amplitude = "1000 N" }, { amplitude = "5 N", harmonic = 5 }]: harmonic 5 is not in dynamics.harmonics = [0, 1, 2]; add it there"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = [{ amplitude = "1000 N" }, { amplitude = "5 N", harmonic = 0, phase = "90 deg" }]"#,
        r#"case.toml, line 19: dynamics.force[1].phase = "90 deg": harmonic = 0 is a constant force, which has no phase; remove the phase"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = [{ amplitude = "1000 N" }, { direction = "y" }]"#,
        r#"case.toml, line 19: dynamics.force[1].amplitude is missing; add to [dynamics.force[1]]: amplitude = "1000 N""#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = [{ amplitude = "1000 N" }, { amplitud = "5 N" }]"#,
        r#"case.toml, line 19: dynamics.force.amplitud = "5 N": there is no such key; did you mean dynamics.force.amplitude?"#,
    ),
    (
        r#"force = { amplitude = "1000 N", at = "far_wall", direction = "x" }"#,
        r#"force = [{ amplitude = "1000 N" }, 5]"#,
        r#"case.toml, line 19: dynamics.force = [{ amplitude = "1000 N" }, 5]: must be a table such as { amplitude = "1000 N", at = "far_wall", direction = "x" }, or a list of such tables"#,
    ),
    (
        "frequency =",
        r#"method = "time"
frequency ="#,
        r#"case.toml, line 20: dynamics.method = "time": there is no such key any more: every forced response is computed by harmonic balance; remove the key"#,
    ),
    (
        "frequency =",
        r#"response = "far_wall"
frequency ="#,
        r#"case.toml, line 20: dynamics.response = "far_wall": must be a section, [dynamics.response], with keys: at, direction"#,
    ),
    (
        "frequency =",
        r#"response = { at = "wall" }
frequency ="#,
        r#"case.toml, line 20: dynamics.response.at = "wall": must be one of "far_wall", "block""#,
    ),
    (
        "frequency =",
        "harmonics = 3
frequency =",
        "case.toml, line 20: dynamics.harmonics = 3: must be a list of different integers of 0 to 1000, 0 and 1 among them, such as [0, 1, 2, 3]",
    ),
    (
        "frequency =",
        "harmonics = [1, 2, 3]
frequency =",
        "case.toml, line 20: dynamics.harmonics = [1, 2, 3]: must be a list of different integers of 0 to 1000, 0 and 1 among them, such as [0, 1, 2, 3]",
    ),
    (
        "frequency =",
        "harmonics = [0, 2]
frequency =",
        "case.toml, line 20: dynamics.harmonics = [0, 2]: must be a list of different integers of 0 to 1000, 0 and 1 among them, such as [0, 1, 2, 3]",
    ),
    (
        "frequency =",
        "harmonics = [0, 1, 1]
frequency =",
        "case.toml, line 20: dynamics.harmonics = [0, 1, 1]: must be a list of different integers of 0 to 1000, 0 and 1 among them, such as [0, 1, 2, 3]",
    ),
    (
        "frequency =",
        "harmonics = [0, 1, -1]
frequency =",
        "case.toml, line 20: dynamics.harmonics = [0, 1, -1]: must be a list of different integers of 0 to 1000, 0 and 1 among them, such as [0, 1, 2, 3]",
    ),
    (
        "frequency =",
        "harmonics = [0, 1, 4000]
frequency =",
        "case.toml, line 20: dynamics.harmonics = [0, 1, 4000]: must be a list of different integers of 0 to 1000, 0 and 1 among them, such as [0, 1, 2, 3]",
    ),
    (
        "frequency =",
        "modes = 0
frequency =",
        "case.toml, line 20: dynamics.modes = 0: must be an integer of 1 to 1000",
    ),
    (
        "frequency =",
        "modes = 1e9
frequency =",
        "case.toml, line 20: dynamics.modes = 1000000000.0: must be an integer of 1 to 1000",
    ),
    (
        "frequency =",
        "damping_ratio = 1
frequency =",
        "case.toml, line 20: dynamics.damping_ratio = 1: must be zero or greater, and less than 1",
    ),
    (
        "frequency =",
        "damping_ratio = -0.1
frequency =",
        "case.toml, line 20: dynamics.damping_ratio = -0.1: must be zero or greater, and less than 1",
    ),
    (
        "frequency =",
        r#"damping_basis = "open"
frequency ="#,
        r#"case.toml, line 20: dynamics.damping_basis = "open": must be one of "stuck", "free""#,
    ),
    (
        "frequency =",
        r#"friction_law = "disc"
frequency ="#,
        r#"case.toml, line 20: dynamics.friction_law = "disc": must be one of "cone", "box""#,
    ),
    (
        "frequency =",
        "points = 1
frequency =",
        "case.toml, line 20: dynamics.points = 1: must be an integer of 2 to 100000",
    ),
    (
        "frequency =",
        "points = 1e9
frequency =",
        "case.toml, line 20: dynamics.points = 1000000000.0: must be an integer of 2 to 100000",
    ),
    (
        r#"frequency = ["900 Hz", "1050 Hz"]"#,
        "",
        r#"case.toml: dynamics.frequency is missing; add to [dynamics]: frequency = ["900 Hz", "1050 Hz"]"#,
    ),
    (
        r#"frequency = ["900 Hz", "1050 Hz"]"#,
        r#"frequency = "900 Hz""#,
        r#"case.toml, line 20: dynamics.frequency = "900 Hz": must be a list of the lowest and the highest frequency, such as ["900 Hz", "1050 Hz"]"#,
    ),
    (
        r#"frequency = ["900 Hz", "1050 Hz"]"#,
        "frequency = [900, 1050]",
        r#"case.toml, line 20: dynamics.frequency: "900" has no unit; a frequency is wanted, such as "900 Hz""#,
    ),
    (
        r#"frequency = ["900 Hz", "1050 Hz"]"#,
        r#"frequency = ["1050 Hz", "900 Hz"]"#,
        r#"case.toml, line 20: dynamics.frequency = ["1050 Hz", "900 Hz"]: must be a list with the lower frequency first, such as ["900 Hz", "1050 Hz"]"#,
    ),
    (
        r#"frequency = ["900 Hz", "1050 Hz"]"#,
        r#"frequency = ["0 Hz", "900 Hz"]"#,
        r#"case.toml, line 20: dynamics.frequency = ["0 Hz", "900 Hz"]: must be greater than zero"#,
    ),
    (
        r#"frequency = ["900 Hz", "1050 Hz"]"#,
        r#"frequency = ["900 Hz"]"#,
        r#"case.toml, line 20: dynamics.frequency = ["900 Hz"]: must be a list of the lowest and the highest frequency, such as ["900 Hz", "1050 Hz"]"#,
    ),
];

/// Replaced text of the rough joint, new text, and message, for updates, samples and pruning.
const OF_WEAR: &[(&str, &str, &str)] = &[
    (
        "stiffness_change = 0.10",
        "",
        "case.toml: update.stiffness_change is missing; add to [update]: stiffness_change = 0.10",
    ),
    (
        "stiffness_change = 0.10",
        "stiffness_change = 0",
        "case.toml, line 25: update.stiffness_change = 0: must be greater than 0 and less than 1, such as 0.1",
    ),
    (
        "stiffness_change = 0.10",
        "stiffness_change = 1",
        "case.toml, line 25: update.stiffness_change = 1: must be greater than 0 and less than 1, such as 0.1",
    ),
    (
        "stiffness_change = 0.10",
        "iterations = 0",
        "case.toml, line 25: update.iterations = 0: must be an integer of 1 to 1000000000",
    ),
    (
        "stiffness_change = 0.10",
        "iterations = 1e10",
        "case.toml, line 25: update.iterations = 10000000000.0: must be an integer of 1 to 1000000000",
    ),
    (
        "stiffness_change = 0.10",
        r#"wear_volume = "0 mm^3""#,
        r#"case.toml, line 25: update.wear_volume = "0 mm^3": must be greater than zero"#,
    ),
    (
        "stiffness_change = 0.10",
        "wear_volume = 5",
        r#"case.toml, line 25: update.wear_volume: "5" has no unit; a volume is wanted, such as "5 um^3" or "5 mm^3""#,
    ),
    (
        "stiffness_change = 0.10",
        "stiffness_change = 0.1
iterations = 5",
        "case.toml, line 26: update.iterations = 5: update.stiffness_change decides already when to update; give one of them",
    ),
    (
        "stiffness_change = 0.10",
        "change = 0.1",
        "case.toml, line 25: update.change = 0.1: there is no such key; known here: stiffness_change, volume_growth, extrapolate, iterations, wear_volume",
    ),
    (
        r#"[wear]
coefficient = "2e3 um^3/J"
cycles = 10_000_000
"#,
        "",
        "case.toml, line 21: section [update]: without [wear] the contact never changes; remove it",
    ),
    (
        "[update]",
        "[fidelity]
aft_samples = 6
[update]",
        "case.toml, line 25: fidelity.aft_samples = 6: must be an even integer of 8 to 65536: more than twice the highest harmonic, 3",
    ),
    (
        "[update]",
        "[fidelity]
aft_samples = 65
[update]",
        "case.toml, line 25: fidelity.aft_samples = 65: must be an even integer of 8 to 65536: more than twice the highest harmonic, 3",
    ),
    (
        "[update]",
        "[output]
response_at = 5
[update]",
        "case.toml, line 25: output.response_at = 5: must be a list of numbers of cycles in ascending order, such as [0, 1e6, 1e7]",
    ),
    (
        "[update]",
        "[output]
response_at = [1e6, 0]
[update]",
        "case.toml, line 25: output.response_at = [1000000.0, 0]: must be a list of numbers of cycles in ascending order, such as [0, 1e6, 1e7]",
    ),
    (
        "[update]",
        "[output]
response_at = [0, 0]
[update]",
        "case.toml, line 25: output.response_at = [0, 0]: must be a list of numbers of cycles in ascending order, such as [0, 1e6, 1e7]",
    ),
    (
        "[update]",
        "[output]
response_at = [-1, 0]
[update]",
        "case.toml, line 25: output.response_at = [-1, 0]: must be a list of numbers of cycles in ascending order, such as [0, 1e6, 1e7]",
    ),
    (
        "[update]",
        "[output]
response_at = [0, 1.5]
[update]",
        "case.toml, line 25: output.response_at = [0, 1.5]: must be a list of numbers of cycles in ascending order, such as [0, 1e6, 1e7]",
    ),
    (
        "[update]",
        "[output]
response_at = [0, 1e8]
[update]",
        "case.toml, line 25: output.response_at = [0, 100000000.0]: must be a list of numbers of cycles up to wear.cycles = 10000000",
    ),
];

#[test]
fn faults_of_dynamics() {
    assert_faults(ROUGH, OF_DYNAMICS);
    assert_faults(ROUGH, OF_WEAR);
}

#[test]
fn an_update_in_one_word() {
    assert_eq!(
        message_of(ROUGH, &["update=no"]),
        r#"--set update=no: update = "no": must be "never" or a table such as { stiffness_change = 0.10 }"#
    );
}

#[test]
fn lists_of_too_many() {
    let numbers = |count: u64| (0..count).map(|k| format!("{k}, ")).collect::<String>();
    for (key, count, limit) in [
        ("dynamics.harmonics", 1002, 1001),
        ("output.response_at", 10_001, 10_000),
    ] {
        let set = format!("{key}=[{}]", numbers(count));
        let message = message_of(ROUGH, &[&set]);
        let end = format!(
            ": {key} = (a list with {count} items): must be a list of at most {limit} items"
        );
        assert!(message.ends_with(&end), "{message}");
    }
    let message = message_of(
        ROUGH,
        &["wear.volume=1 mm^3", "output.response_at=[0, 1e17]"],
    );
    assert!(
        message.ends_with("must be a list of numbers of cycles up to 9007199254740992"),
        "{message}"
    );
}
