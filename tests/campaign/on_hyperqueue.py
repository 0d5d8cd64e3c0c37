"""Runs a campaign on HyperQueue through its Python interface (`pip install hyperqueue`):

    python tests/campaign/on_hyperqueue.py target/release/fretwear

A local cluster runs one task per row. The script kills one long row and stops another row with exit code 75. Then it ends the server while
tasks are running, and submits all rows to a new server. The tables must equal the tables of a local campaign bit for bit.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from hyperqueue import Job, LocalCluster
from hyperqueue.cluster import WorkerConfig

PROGRAM = Path(sys.argv[1]).resolve()
SHORT = 14
LONG = 2
ROWS = SHORT + LONG
# Largest number of submissions until the workers of the ended server have released their rows.
REPEATS = 60

SCENE = """
[joint]
size = ["4 mm", "3 mm"]
grid = [26, 22]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "1 um"
correlation_length = ["0.5 mm", "0.4 mm"]
seed = 3
[contact]
friction_coefficient = 0.6
normal_load = "200 N"
[motion]
amplitude = "1 um"
[wear]
coefficient = "2e3 um^3/J"
cycles = 600_000
"""


def campaign(*arguments, code=0):
    done = subprocess.run([PROGRAM, "campaign", *arguments], capture_output=True, text=True)
    assert done.returncode == code, (arguments, done.returncode, done.stderr)
    return done.stdout


def job(rows, folder, more=()):
    """Returns a job with one task per row."""
    job = Job()
    for row in rows:
        arguments = [str(PROGRAM), "campaign", "run", "--dir", folder, "--index", str(row), "--quiet", *more]
        job.program(arguments, name=str(row), env={"FRETWEAR_CACHE": f"{folder}/cache"})
    return job


def tables(folder):
    """Returns all tables of all runs by path, except the tables that contain times."""
    found = {}
    for path in sorted(Path(folder, "runs").rglob("*.parquet")):
        if path.name not in ("timing.parquet", "history.parquet"):
            found[str(path.relative_to(folder))] = path.read_bytes()
    return found


def wait_for(what, seconds=60):
    for _ in range(20 * seconds):
        if what():
            return
        time.sleep(0.05)
    raise SystemExit("the condition is still false")


def cluster():
    made = LocalCluster()
    made.start_worker(WorkerConfig(cores=2))
    return made


def main():
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        Path("scene.toml").write_text(SCENE)
        lists = [f"surface.seed = {list(range(1, ROWS + 1))}"]
        lists.append(f"joint.grid = {[[26, 22]] * SHORT + [[120, 90]] * LONG}")
        lists.append(f"wear.tolerance = {[1e-3] * SHORT + [1e-6] * LONG}")
        Path("campaign.toml").write_text('scene = "scene.toml"\n[list]\n' + "\n".join(lists) + "\n")
        for folder in ("hq", "local"):
            campaign("plan", "campaign.toml", "--dir", folder, "--no-rehearsal")
        folder = str(Path("hq").resolve())

        with cluster() as running:
            client = running.client()
            killed, stopped = SHORT, SHORT + 1
            first = client.submit(job([killed, *range(SHORT)], folder))
            second = client.submit(job([stopped], folder, ["--max-wall", "1 s"]))
            run = Path("hq/runs", f"{killed:06}")
            wait_for(lambda: (run / "iterations" / "wear_iteration=2").exists())
            os.kill(int((run / "lock").read_text()), signal.SIGKILL)
            client.wait_for_jobs([first, second], raise_on_error=False)
            failed = [client.get_failed_tasks(each) for each in (first, second)]
            print("failed tasks, killed and stopped:", [len(each) for each in failed])
            assert [len(each) for each in failed] == [1, 1], failed
            assert "75" in str(list(failed[1].values())[0]), failed[1]
            # This task is running when the server ends.
            client.submit(job([killed], folder))
            time.sleep(1.0)
        state = campaign("status", "--dir", "hq")
        print(state)
        with cluster() as running:
            client = running.client()
            begin = time.perf_counter()
            last = client.submit(job(range(ROWS), folder))
            client.wait_for_jobs([last], raise_on_error=False)
            again = sorted(client.get_failed_tasks(last))
            for _ in range(REPEATS):
                if not again:
                    break
                # A worker of the ended server may still lock its row.
                print("rows that are still locked:", again)
                time.sleep(1.0)
                last = client.submit(job(range(ROWS), folder))
                client.wait_for_jobs([last], raise_on_error=False)
                again = sorted(client.get_failed_tasks(last))
            assert not again, f"rows {again} still fail after all submissions"
            print(f"all rows are done after {time.perf_counter() - begin:.1f} s of the second server")
        campaign("run", "--dir", "local", "--jobs", "2", "--quiet")
        found, expected = tables("hq"), tables("local")
        assert found.keys() == expected.keys()
        assert found == expected
        print(f"{len(found)} tables of {ROWS} rows are equal bit for bit")


if __name__ == "__main__":
    main()
