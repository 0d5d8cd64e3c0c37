//! Wear ends this resonance: its frequency approaches an antiresonance of the structure, until the displacement is nowhere near it 90°
//! behind the force. The program must not replace the resonance by another one of the range.

use std::path::Path;

use fretwear::dynamics::DynamicsError;
use fretwear::scene;
use fretwear::stages::RunError;

use super::Start;
use crate::support::{Bench, latest};

/// Range of the resonance before its end \[Hz\]. The next resonance of the structure is above 2000 Hz.
const BEFORE: [f64; 2] = [400.0, 430.0];

#[test]
#[ignore = "long: 10 seconds"]
fn a_run_does_not_go_on_at_another_resonance() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/stages/lost_resonance.toml");
    let bench = Bench::new();
    let root = bench.path("lost");
    let (result, _) = Start::new(scene::load(&file, &[]).expect("a scene"), &root).run();
    let Err(RunError::Dynamics {
        wear_iteration,
        source: DynamicsError::ResonanceLost { before, found },
    }) = result
    else {
        panic!("{:?}", result.err());
    };
    assert!(BEFORE[0] < before && before < BEFORE[1], "{before}");
    assert!(found > 2.0 * before, "{found}");
    // The run stores the wear before the end of the resonance.
    assert_eq!(latest(&root) + 1, wear_iteration);
    assert!(wear_iteration > 1, "{wear_iteration}");
}
