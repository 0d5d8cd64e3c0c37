"""Measures the cost of starting many short runs, with and without a campaign:

    python tests/campaign/overhead.py target/release/fretwear [RUNS]

The runs have the same scene with different surfaces; two runs compute at a time. The compared commands are `xargs fretwear run`,
`xargs fretwear campaign run --index`, and `fretwear campaign run --jobs 2`, which keeps whole runs or only histories. The script prints
wall seconds and CPU seconds per run.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM = Path(sys.argv[1]).resolve()
RUNS = int(sys.argv[2]) if len(sys.argv) > 2 else 1000
# The commands alternate, because the load of the machine varies.
ROUNDS = 4

SCENE = """
[joint]
size = ["4 mm", "3 mm"]
grid = [48, 40]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "1 um"
correlation_length = ["0.3 mm", "0.25 mm"]
seed = 3
[contact]
friction_coefficient = 0.6
normal_load = "200 N"
[motion]
amplitude = "1 um"
[wear]
coefficient = "2e3 um^3/J"
cycles = 2_000_000
"""
CAMPAIGN = """
scene = "joint.toml"
keep = "{keep}"
{set}
[grid]
surface.seed = {{ from = 1, to = {runs} }}
"""


def measured(command, folder):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.monotonic()
    subprocess.run(["bash", "-c", command], check=True, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seconds = time.monotonic() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, cpu


def main():
    runs = -(-RUNS // ROUNDS)
    last = runs - 1
    rows = f"{PROGRAM} campaign run --dir c --quiet"
    cases = [
        (
            "xargs -P2 fretwear run",
            None,
            f"seq 1 {runs} | xargs -P2 -I{{}} {PROGRAM} run joint.toml --quiet --set surface.seed={{}} --run plain/{{}}",
        ),
        ("xargs -P2 fretwear campaign run --index", ("runs", ""), f"seq 0 {last} | xargs -P2 -I{{}} {rows} --index {{}}"),
        ("fretwear campaign run --jobs 2", ("runs", ""), f"{rows} --jobs 2"),
        ("the same, keep = history, durability = end", ("history", '[set]\noutput.durability = "end"'), f"{rows} --jobs 2"),
    ]
    sums = {name: [[], []] for name, _, _ in cases}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "joint.toml").write_text(SCENE)
        for _ in range(ROUNDS):
            for name, plan, command in cases:
                if plan:
                    keep, more = plan
                    (folder / "case.toml").write_text(CAMPAIGN.format(keep=keep, set=more, runs=runs))
                    planning = [PROGRAM, "campaign", "plan", "case.toml", "--dir", "c", "--no-rehearsal"]
                    subprocess.run(planning, check=True, cwd=folder, stdout=subprocess.DEVNULL)
                for own, figure in zip(sums[name], measured(command, folder)):
                    own.append(figure / runs)
                shutil.rmtree(folder / ("c" if plan else "plain"))
            print(f"load {os.getloadavg()[0]:.1f}", flush=True)
    for name, (seconds, cpu) in sums.items():
        rounds = " ".join(f"{second:.3f}" for second in seconds)
        print(f"{name:45} {sum(seconds) / ROUNDS:.3f} s ({rounds}), {sum(cpu) / ROUNDS:.3f} CPU s per run")


if __name__ == "__main__":
    main()
