"""Writes the checkpoints in data/: the published case one iteration before the first model update. One checkpoint has the default
contact elements (sliders), and the other has the contact elements of the paper.

    python3 data/make_checkpoint.py PROGRAM

PROGRAM is target/release/fretwear. The script runs the case in a temporary folder up to its first model update. It keeps the iteration
before the update, the unworn iteration, the unworn surface, and the summaries of the following iterations (expected.json). It omits the
reduced structure because of its size. The program computes the structure again.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
TARGETS = {
    REPOSITORY / "data/lap_joint_checkpoint": [],
    REPOSITORY / "data/lap_joint_checkpoint_total": ["--set", "contact.stiffness=total"],
}
# Enough cycles for one update after iteration 0, and few enough for a minute of work.
CYCLES = 200_000


def make(program, target, sets):
    scene = REPOSITORY / "pipelines/lap_joint.toml"
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        rows = []
        command = [program, "run", str(scene), *sets, "--run", str(run), "--until", "summary", "--quiet", "--json"]
        # With `--until` the last stage, each start computes one iteration.
        while not rows or rows[-1]["cycles"] < CYCLES:
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            row = json.loads(done.stdout)
            # Times differ between runs.
            for name in ("timing", "timing_fft_pairs", "cost"):
                row.pop(name, None)
            rows.append(row)
            updates = [r["wear_iteration"] for r in rows[1:] if r["updated"]]
            if updates and rows[-1]["wear_iteration"] > updates[0]:
                break
        update = updates[0]
        checkpoint = Path(folder) / "checkpoint"
        # The first start keeps the scene, so the inherited iterations do not change. The second start changes the kept iterations.
        for arguments in (["--from", f"{run}@{update - 1}"], ["--set", "output.keep={ last = 1 }"]):
            subprocess.run(
                [program, "run", "--run", str(checkpoint), *arguments, "--until", "structure", "--quiet"], check=True
            )
        if target.exists():
            shutil.rmtree(target)
        shutil.copytree(checkpoint, target, ignore=shutil.ignore_patterns("structure*", "lock", "staging"))
        (target / "expected.json").write_text(json.dumps(rows[update:], indent=1, sort_keys=True) + "\n", encoding="utf-8")
    print(f"{target}: iteration {update - 1}; {len(rows) - update} expected")


def main():
    program = str(Path(sys.argv[1]).resolve())
    for target, sets in TARGETS.items():
        make(program, target, sets)


main()
