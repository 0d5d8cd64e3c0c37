"""Makes the checkpoints in data/: the published case at one iteration before its contact elements are renewed, to go on from; with
contact elements that do what the fine contact does, and with those of the paper.

    python3 data/make_checkpoint.py PROGRAM

PROGRAM is target/release/fretwear. The case is run in a temporary folder to its first update after UPDATES updates; what is kept
is the iteration before, the unworn one, the unworn surface, and (expected.json) the summaries of the iterations that follow. The
reduced structure is left out for its size: it is computed again.
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
# Enough cycles for one update after the first, few enough for a minute of work.
CYCLES = 200_000


def make(program, target, sets):
    scene = REPOSITORY / "pipelines/lap_joint.toml"
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        rows = []
        command = [program, "run", str(scene), *sets, "--run", str(run), "--until", "summary", "--quiet", "--json"]
        # `--until` the last stage makes one iteration a start.
        while not rows or rows[-1]["cycles"] < CYCLES:
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            row = json.loads(done.stdout)
            # Times differ from run to run.
            for name in ("timing", "timing_fft_pairs", "cost"):
                row.pop(name, None)
            rows.append(row)
            updates = [r["wear_iteration"] for r in rows[1:] if r["updated"]]
            if updates and rows[-1]["wear_iteration"] > updates[0]:
                break
        update = updates[0]
        checkpoint = Path(folder) / "checkpoint"
        # The same scene, so that what is inherited stays as it is; then what is kept may change.
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
