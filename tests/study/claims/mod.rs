//! The claims: each can hold and can fail, on made-up runs; and what they read of real ones.

mod runs;
mod study;

use fretwear::study::claims::{CLAIMS, Evidence, Finding, Verdict, judge, markdown, table};
use fretwear::tables::{Provenance, TableName, from_parquet, to_parquet};

use study::{CYCLES, all, sliding_loop};

fn of(findings: &[Finding], claim: u32) -> Vec<&Finding> {
    findings
        .iter()
        .filter(|finding| finding.claim == claim)
        .collect()
}

fn named<'a>(study: &'a mut [Evidence], name: &str) -> &'a mut Evidence {
    study
        .iter_mut()
        .find(|run| run.name == name)
        .expect("a run of that name")
}

#[test]
fn every_claim_holds_where_it_should() {
    let findings = judge(&all());
    for claim in CLAIMS {
        let found = of(&findings, claim.number);
        assert!(
            found.iter().any(|f| f.verdict == Verdict::Holds),
            "{claim:?}: {found:?}"
        );
        assert!(
            found.iter().all(|f| f.verdict != Verdict::Fails),
            "{claim:?}: {found:?}"
        );
        for finding in found {
            assert!(
                !finding.measured.is_empty() && finding.cause.is_empty(),
                "{finding:?}"
            );
        }
    }
}

/// Something of a run, to be changed.
type Spoil = fn(&mut [Evidence]);

fn set(run: &mut Evidence, column: &str, change: impl Fn(usize, f64) -> f64) {
    let values = run
        .summary
        .get_mut(column)
        .unwrap_or_else(|| panic!("no {column}"));
    for (k, value) in values.iter_mut().enumerate() {
        *value = change(k, *value);
    }
}

fn respond(run: &mut Evidence, column: &str, values: [f64; 2]) {
    run.worn_response.insert(column.to_owned(), values.to_vec());
}

fn worn(run: &mut Evidence) -> &mut fretwear::study::claims::Worn {
    run.worn.as_mut().expect("it wears")
}

const LAST: usize = CYCLES.len() - 1;

/// A fault for every claim.
const FAULTS: [(u32, Spoil); 46] = [
    (1, |s| {
        named(s, "rq5")
            .depth_rate
            .iter_mut()
            .for_each(|rate| *rate *= 2.0)
    }),
    (2, |s| named(s, "explicit").depth_rate[7] *= 0.9),
    (3, |s| worn(named(s, "rq5")).least_growth = -1e-12),
    (4, |s| worn(named(s, "rq5")).volume *= 1.0 + 1e-8),
    (5, |s| worn(named(s, "explicit")).deepest = 2.6e-6),
    (6, |s| named(s, "rq5").seconds = 16_200.0),
    (7, |s| {
        set(named(s, "rq5"), "dissipated_energy", |k, e| {
            if k == LAST { 1.2 * e } else { e }
        })
    }),
    (8, |s| worn(named(s, "rq5")).never_touched_depth = 1e-15),
    (9, |s| {
        set(
            named(s, "rq5"),
            "rq",
            |k, rq| if k == 4 { 1.2 * rq } else { rq },
        )
    }),
    (10, |s| {
        set(named(s, "rq5"), "mean_height", |k, h| {
            if k == 3 { h * (1.0 + 1e-6) } else { h }
        })
    }),
    (11, |s| {
        set(
            named(s, "rq5"),
            "sk",
            |k, sk| if k == 0 { -0.2 } else { sk },
        )
    }),
    (12, |s| set(named(s, "rq5"), "ku", |_, ku| ku.min(2.99))),
    (13, |s| {
        set(
            named(s, "rq5"),
            "sk",
            |k, sk| if k < 4 { -0.05 } else { sk },
        )
    }),
    (14, |s| {
        set(
            named(s, "rq1"),
            "rq",
            |k, rq| if k == 0 { rq } else { 0.96e-6 },
        )
    }),
    (15, |s| {
        set(named(s, "rq5"), "contact_area_fraction", |k, a| {
            if k == 5 { 0.4 * a } else { a }
        })
    }),
    (16, |s| named(s, "rq5").last.high_pressure = 3e9),
    (17, |s| {
        set(named(s, "rq05"), "contact_area_fraction", |k, a| {
            if k == 0 { 0.05 } else { a }
        })
    }),
    (18, |s| {
        set(named(s, "rq05"), "contact_area_fraction", |k, _| {
            0.1 + 0.08 * CYCLES[k] / 1e6
        })
    }),
    (19, |s| {
        set(named(s, "rq5"), "kn", |k, _| 4e9 + 100.0 * CYCLES[k])
    }),
    (20, |s| {
        set(
            named(s, "rq10"),
            "kn",
            |k, kn| if k == LAST { 4e9 } else { kn },
        )
    }),
    (21, |s| set(named(s, "rq5"), "kt", |_, kt| 0.8 * kt)),
    (22, |s| named(s, "tangent").last.element_kn = vec![2e7; 3]),
    (23, |s| {
        respond(named(s, "rq1"), "resonance_frequency", [949.5, 964.9])
    }),
    (24, |s| named(s, "rq5").first.normal_load = Some([3e4, 2e3])),
    (25, |s| {
        let moments = named(s, "rq5")
            .response
            .get_mut("moment_variation")
            .expect("moments");
        moments[LAST] = 0.06;
    }),
    (26, |s| {
        named(s, "rq5").first.displacement = Some([5e-8, 1e-5])
    }),
    (27, |s| {
        respond(named(s, "finer"), "peak_amplitude", [71e-6, 86.5e-6])
    }),
    (28, |s| named(s, "rq5").scene.dundurs_beta = 0.01),
    (29, |s| {
        set(named(s, "rq5"), "dissipated_energy", |k, e| {
            if k == 2 { 0.1 * e } else { e }
        })
    }),
    (30, |s| {
        set(named(s, "u05"), "wear_rate", |k, rate| {
            if k > 3 { 0.85 * rate } else { rate }
        })
    }),
    (31, |s| {
        set(
            named(s, "u05"),
            "kn",
            |k, kn| if k > 3 { 0.96 * kn } else { kn },
        )
    }),
    (32, |s| {
        respond(named(s, "u20"), "peak_amplitude", [70e-6, 83e-6])
    }),
    (33, |s| {
        respond(named(s, "never"), "peak_frequency", [930.0, 962.0])
    }),
    (34, |s| {
        respond(named(s, "rq5"), "resonance_frequency", [930.0, 929.0])
    }),
    (35, |s| {
        respond(named(s, "rq5"), "peak_amplitude", [70e-6, 69e-6])
    }),
    (36, |s| {
        named(s, "rq5").last.hysteresis = Some(sliding_loop(1.2e-5, 1.8e4, 4e9))
    }),
    (37, |s| {
        respond(named(s, "rq10"), "peak_amplitude", [60e-6, 53e-6])
    }),
    (38, |s| {
        set(named(s, "rq10"), "wear_rate", |k, rate| {
            if k == LAST { 0.8 * rate } else { rate }
        })
    }),
    (39, |s| {
        set(named(s, "sphere600"), "contact_area_fraction", |_, _| 0.09)
    }),
    (40, |s| {
        set(named(s, "plastic"), "max_pressure", |_, p| 1.001 * p)
    }),
    (41, |s| {
        set(named(s, "plastic"), "kn", |k, kn| {
            if k == 0 { 1.1 * kn } else { kn }
        })
    }),
    (42, |s| {
        set(named(s, "plastic"), "kn", |k, kn| {
            if k > 4 { 0.94 * kn } else { kn }
        })
    }),
    (43, |s| {
        set(named(s, "plastic"), "dissipated_energy", |k, e| {
            if k < 2 { e / 1.1 } else { e }
        })
    }),
    (44, |s| {
        set(named(s, "rq5"), "error_tangential", |k, e| {
            if k == 6 { 2e-3 } else { e }
        })
    }),
    (45, |s| named(s, "rq5").modes = None),
    (46, |s| named(s, "rq5").force[2] = 1.9e4),
];

#[test]
fn every_claim_fails_where_it_should() {
    let sound = judge(&all());
    let mut missed = Vec::new();
    for (claim, spoil) in FAULTS {
        let mut study = all();
        spoil(&mut study);
        let findings = judge(&study);
        let found = of(&findings, claim);
        let fails = found.iter().any(|f| f.verdict == Verdict::Fails);
        // Without a reduction that verifies there is nothing to tell by.
        let untold = claim == 45 && found.len() + 1 == of(&sound, claim).len();
        if !fails && !untold {
            missed.push(format!("{claim}: {found:?}"));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

/// Criteria that are met by a hair, and missed by one.
#[test]
fn criteria_are_where_they_are_said_to_be() {
    let fails = |claim: u32, spoil: &dyn Fn(&mut [Evidence])| {
        let mut study = all();
        spoil(&mut study);
        of(&judge(&study), claim)
            .iter()
            .any(|f| f.verdict == Verdict::Fails)
    };
    for (factor, fail) in [
        (1.49, false),
        (1.51, true),
        (1.0 / 1.49, false),
        (1.0 / 1.51, true),
    ] {
        let found = fails(1, &|s| {
            named(s, "rq5")
                .depth_rate
                .iter_mut()
                .for_each(|rate| *rate *= factor)
        });
        assert_eq!(found, fail, "{factor} of 231");
    }
    for (peak, fail) in [(0.021, true), (0.019, false)] {
        let worn = 86.5e-6 * (1.0 + peak);
        assert_eq!(
            fails(32, &|s| respond(
                named(s, "u20"),
                "peak_amplitude",
                [70e-6, worn]
            )),
            fail
        );
    }
    for (share, fail) in [(0.999, true), (0.9, true), (1.0, false)] {
        let found = fails(40, &|s| {
            set(named(s, "plastic"), "max_pressure", |k, p| {
                if k == 0 { share * p } else { p }
            });
        });
        assert_eq!(found, fail, "{share} of the cap");
    }
}

#[test]
fn causes_come_from_the_numbers() {
    let cause = |claim: u32, run: &str, spoil: &dyn Fn(&mut [Evidence])| {
        let mut study = all();
        spoil(&mut study);
        let findings = judge(&study);
        let found = of(&findings, claim)
            .into_iter()
            .find(|f| f.verdict == Verdict::Fails && f.runs.iter().any(|name| name == run));
        found
            .unwrap_or_else(|| panic!("{claim} does not fail on {run}"))
            .cause
            .clone()
    };
    let rising =
        |s: &mut [Evidence]| set(named(s, "rq5"), "max_pressure", |k, _| 1e9 + 1e9 * k as f64);
    assert_eq!(cause(16, "rq5", &rising), "");
    let sticking = |s: &mut [Evidence]| {
        rising(s);
        named(s, "rq5").last.peak_dissipation = 0.0;
    };
    assert!(cause(16, "rq5", &sticking).contains("sticks"));
    let wider = |s: &mut [Evidence]| {
        let response = &mut named(s, "u05").response;
        response.insert("displacement_spread".to_owned(), vec![0.3; CYCLES.len()]);
        set(named(s, "u05"), "wear_rate", |_, rate| 0.5 * rate);
    };
    assert!(cause(30, "u05", &wider).contains("up to 30\u{a0}% more or less than the mean"));
    // Without updates the amplitude stays, and the loop of a stiffer joint grows.
    let driven = |s: &mut [Evidence]| {
        named(s, "never").last.hysteresis = Some(sliding_loop(1.2e-5, 1.8e4, 4e9))
    };
    assert!(cause(36, "never", &driven).starts_with("no update: the displacement stays 11.5 µm"));
}

#[test]
fn which_run_is_which_follows_from_the_scene() {
    // Names and order say nothing.
    let mut study = all();
    study.reverse();
    for (k, run) in study.iter_mut().enumerate() {
        run.name = format!("run{k}");
    }
    let verdicts = |findings: &[Finding]| -> Vec<(u32, Verdict)> {
        let mut all: Vec<_> = findings.iter().map(|f| (f.claim, f.verdict)).collect();
        all.sort_by_key(|(claim, verdict)| (*claim, *verdict as u8));
        all
    };
    assert_eq!(verdicts(&judge(&study)), verdicts(&judge(&all())));
    // A run of another joint belongs to no set.
    named(&mut study, "run13").scene.base = "another".to_owned();
    let findings = judge(&study);
    assert!(
        of(&findings, 40)
            .iter()
            .all(|f| f.verdict == Verdict::NotApplicable),
        "{findings:?}"
    );
}

#[test]
fn what_cannot_be_told_says_why() {
    let findings = judge(&[]);
    assert_eq!(findings.len(), CLAIMS.len());
    for (finding, claim) in findings.iter().zip(CLAIMS) {
        assert_eq!(
            (finding.claim, finding.verdict),
            (claim.number, Verdict::NotApplicable)
        );
        assert!(finding.measured.starts_with("needs "), "{finding:?}");
    }
    let mut study = all();
    study.iter_mut().for_each(|run| run.done = false);
    let findings = judge(&study);
    assert!(
        findings
            .iter()
            .all(|f| f.verdict == Verdict::NotApplicable
                && f.measured.contains("not finished: rq5, "))
    );
    // A run that ends early says nothing about ten million cycles.
    let mut short = study::run("short", 5.0);
    short
        .summary
        .values_mut()
        .for_each(|column| column.truncate(4));
    let findings = judge(&[short]);
    for claim in [1, 6, 7, 19, 21] {
        assert_eq!(
            of(&findings, claim)[0].verdict,
            Verdict::NotApplicable,
            "{claim}"
        );
    }
    // Pressures of an elastic joint cannot tell what a cap does.
    assert_eq!(of(&findings, 40)[0].verdict, Verdict::NotApplicable);
}

#[test]
fn findings_are_a_table_and_a_text() {
    let mut study = all();
    respond(named(&mut study, "u20"), "peak_amplitude", [70e-6, 83e-6]);
    let findings = judge(&study);
    let written = table(&findings).expect("a table");
    let provenance = Provenance {
        scene_hash: "a b".to_owned(),
        program_version: "0".to_owned(),
    };
    let bytes = to_parquet(&written, &provenance).expect("bytes");
    let read = from_parquet(&bytes, TableName::Claims.schema()).expect("the table");
    assert_eq!(read, written);
    assert_eq!(read.rows(), findings.len());
    let numbers = read.i32("claim").expect("numbers");
    assert!(numbers.is_sorted() && (1..=46).all(|claim| numbers.contains(&claim)));
    let row = numbers
        .iter()
        .position(|claim| *claim == 32)
        .expect("a row");
    assert_eq!(read.text("verdict").expect("texts")[row], "fails");
    assert_eq!(read.text("runs").expect("texts")[row], "u05 rq5 u20");

    let text = markdown(&findings);
    let rows: Vec<&str> = text.lines().filter(|line| line.starts_with("| ")).collect();
    assert!(
        rows.iter().all(|row| row.matches(" | ").count() == 4),
        "{rows:#?}"
    );
    for claim in CLAIMS {
        assert!(
            text.contains(&format!("| {} | {} | ", claim.number, claim.place)),
            "{claim:?}"
        );
        assert!(
            text.contains(&format!("\n{}. {}\n", claim.number, claim.criterion)),
            "{claim:?}"
        );
    }
    assert!(text.contains("| fails | u05, rq5, u20: "), "{text}");
    let counted = findings
        .iter()
        .filter(|f| f.verdict == Verdict::Holds)
        .count();
    assert!(
        text.starts_with(&format!(
            "{} findings on 46 claims: {counted} hold, 1 fail, ",
            findings.len()
        )),
        "{text}"
    );
}

/// Runs that were never updated belong together, whatever their scenes would allow; a set within another says nothing more.
#[test]
fn roughnesses_without_updates_are_a_set_of_their_own() {
    let mut study = all();
    for name in ["rq05", "rq1"] {
        named(&mut study, name)
            .summary
            .insert("updated".to_owned(), vec![0.0; CYCLES.len()]);
    }
    let findings = judge(&study);
    let sets: Vec<Vec<&str>> = of(&findings, 17)
        .iter()
        .map(|finding| finding.runs.iter().map(String::as_str).collect())
        .collect();
    assert_eq!(
        sets,
        [
            vec!["rq05", "rq1", "rq5", "rq10"],
            vec!["rq05", "rq1", "never"]
        ]
    );
}

/// A folder may have any name; its claims are one row each all the same, and name it as it is.
#[test]
fn the_name_of_a_run_is_only_a_name() {
    let mut study = all();
    for run in &mut study {
        run.name += "<script>|`![x](y)\\\n\u{1b}[2J\u{202e}";
    }
    let text = markdown(&judge(&study));
    let shown = "<script>\\|\\`!\\[x](y)\\\\ \\\\u{1b}\\[2J\\\\u{202e}";
    assert!(text.contains(&format!("rq5\\{shown}")), "{text}");
    assert!(!text.contains(['\u{1b}', '\u{202e}']), "{text}");
    for row in text.lines().filter(|line| line.starts_with("| ")) {
        assert_eq!(row.matches(" | ").count(), 4, "{row}");
        assert!(!row.replace("\\<", "").contains("<script"), "{row}");
    }
}
