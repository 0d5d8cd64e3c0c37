"""Makes data/old_runs/VERSION: one small run of every shipped scene, for tests that this version's runs stay readable.

    python3 data/make_old_runs.py PROGRAM COMMIT

PROGRAM is target/release/fretwear, built from COMMIT. Grids are small and cycles few, so that all runs together stay in a
repository. Beside the runs, `expected.json` has what each must give: its iterations and the summary of the last. Needs pyarrow.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pyarrow.parquet as pq

REPOSITORY = Path(__file__).resolve().parents[1]
TARGET = REPOSITORY / "data/old_runs"

# The coarsest mesh of the resonator, and a hole as wide as 21 of its 9 x 9 contact elements.
RESONATOR = [
    "joint.elements=[9, 9]",
    'joint.hole.diameter="23 mm"',
    *(
        f"structure.{name}_cells={cells}"
        for name, cells in {
            "half_depth": 2, "block": 3, "stub": 1, "gap": 1, "leaf": 1, "window": 3, "wall": 2, "inner": 2, "rim": 1, "head": 1
        }.items()
    ),
    "dynamics.modes=10",
    "dynamics.points=3",
    'dynamics.frequency=["900 Hz", "1100 Hz"]',
    "fidelity.aft_samples=32",
]
LAP_JOINT = [*RESONATOR, "joint.grid=[18, 18]", "dynamics.harmonics=[0, 1]", "wear.cycles=300_000", "fidelity.preset=fast"]
FRETTING = ["joint.grid=[16, 16]", "wear.cycles=2_000_000", "output.curves_every=2"]
# The last iteration alone, and the unworn one, which is always kept.
LAST = "output.keep={ last = 1, updates = false }"

# A start that ends with the first iteration, and one that ends within the second.
FIRST = ["--until", "fretting_cycle"]
WITHIN = ["--until", "static_contact"]

# Scene, what is changed of it, and what each start is given beside it.
RUNS = {
    "hertz_fretting": (["joint.grid=[24, 18]"], [[]]),
    "lap_joint": (LAP_JOINT, [[]]),
    "lap_joint_no_update": (LAP_JOINT, [FIRST]),
    "lap_joint_plastic": (LAP_JOINT, [FIRST]),
    "lap_joint_rq05": (LAP_JOINT, [FIRST]),
    "lap_joint_rq1": (LAP_JOINT, [FIRST]),
    "lap_joint_rq10": (LAP_JOINT, [FIRST]),
    "lap_joint_update05": ([*LAP_JOINT, LAST], [[]]),
    # Unfinished: the draft of its second iteration has the wear field and the pressure.
    "lap_joint_update20": (LAP_JOINT, [FIRST, WITHIN]),
    "lap_of_bars": (["joint.grid=[20, 18]", "dynamics.harmonics=[0, 1, 2, 3]", "dynamics.points=3", "wear.cycles=300_000"], [[]]),
    "measured_surface": (["joint.grid=[16, 12]", "output.keep={ every = 50, last = 1 }"], [[]]),
    "oscillator": (["dynamics.points=9", "dynamics.harmonics=[0, 1, 3]", "fidelity.aft_samples=64"], [[]]),
    "prescribed_fretting": (FRETTING, [[]]),
    # Goes on from another run with another scene.
    "prescribed_fretting_plastic": (FRETTING, [["--from", "runs/prescribed_fretting@1"]]),
    "resonator_springs": ([*RESONATOR, "dynamics.harmonics=[0, 1]"], [[]]),
    "static_contact": (["joint.grid=[24, 18]"], [[]]),
}
# Runs that keep the reduced structure, the largest table there is; for the others it is computed again.
WITH_STRUCTURE = {"lap_joint"}
# The files that scenes name, in `scene.toml` as absolute paths.
FILES = ["data/ground_face.x3p", "data/lap_of_bars.inp"]


def number(value):
    """As text, since readers of JSON may round the last digit of a number."""
    return repr(value) if isinstance(value, float) else value


def make(program, name, sets, starts, folder):
    """Runs a scene in a folder; the path of its run."""
    run = folder / "runs" / name
    for start in starts:
        command = [program, "run", f"pipelines/{name}.toml", "--run", f"runs/{name}", "--quiet", *start]
        command += [word for key in sets for word in ("--set", key)]
        environment = {**os.environ, "FRETWEAR_CACHE": str(folder / "cache")}
        subprocess.run(command, check=True, cwd=folder, stdout=subprocess.DEVNULL, env=environment)
    # No hash covers the path of a file, only its content.
    scene = run / "scene.toml"
    text = scene.read_text(encoding="utf-8")
    for file in FILES:
        text = text.replace(f"{folder}/pipelines/../{file}", f"../../../{Path(file).name}")
    scene.write_text(text, encoding="utf-8")
    return run


def expected_of(run, finished):
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    iterations = sorted(int(path.name.split("=")[1]) for path in (run / "iterations").iterdir())
    (row,) = pq.read_table(run / f"iterations/wear_iteration={iterations[-1]}/summary.parquet", partitioning=None).to_pylist()
    return {
        "finished": finished,
        "iterations": iterations,
        "pruned": sorted(map(int, record["pruned"])),
        "origin": record["origin"] and f"{record['origin']['run']}@{record['origin']['wear_iteration']}",
        "drafted": sorted(path.stem for path in run.glob("staging/wear_iteration=*/*.parquet")),
        "summary": {column: number(value) for column, value in row.items()},
    }


def main():
    program, commit = str(Path(sys.argv[1]).resolve()), sys.argv[2]
    said = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout
    version = said.split()[1]
    scenes = {path.stem for path in (REPOSITORY / "pipelines").glob("*.toml")}
    assert scenes == set(RUNS), f"scenes without a run, or runs without a scene: {sorted(scenes ^ set(RUNS))}"
    target = TARGET / version
    if target.exists():
        shutil.rmtree(target)
    with tempfile.TemporaryDirectory() as temporary:
        # As the scenes see it, links and all.
        folder = Path(temporary).resolve()
        shutil.copytree(REPOSITORY / "pipelines", folder / "pipelines")
        (folder / "data").mkdir()
        for file in FILES:
            shutil.copy(REPOSITORY / file, folder / file)
        expected = {"commit": commit, "runs": {}}
        # A run that others begin from comes before them.
        for name, (sets, starts) in RUNS.items():
            run = make(program, name, sets, starts, folder)
            expected["runs"][name] = expected_of(run, finished="--until" not in starts[-1])
            # Staging has a draft, or else what the last commit was looked up by, which nothing reads again.
            left_out = ["lock"]
            left_out += [] if expected["runs"][name]["drafted"] else ["staging"]
            left_out += [] if name in WITH_STRUCTURE else ["structure*"]
            shutil.copytree(run, target / name, ignore=shutil.ignore_patterns(*left_out))
        for path in target.rglob("*"):
            for place in (folder, REPOSITORY, Path.home()) if path.is_file() else ():
                assert str(place).encode() not in path.read_bytes(), f"{path} names {place}"
    (target / "expected.json").write_text(json.dumps(expected, indent=1) + "\n", encoding="utf-8")
    size = sum(path.stat().st_size for path in target.rglob("*"))
    print(f"{target}: {len(RUNS)} runs, {size / 1e6:.1f} MB")


main()
