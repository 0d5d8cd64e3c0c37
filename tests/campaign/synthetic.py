"""Measures a campaign of many finished runs: files, bytes, and the time and memory of plan, status, collect and report:

    python tests/campaign/synthetic.py target/release/fretwear [ROWS]

The script runs some rows and copies their histories to all other rows. Polars and DuckDB read the shards if they are installed.
"""

import math
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM = Path(sys.argv[1]).resolve()
ROWS = int(sys.argv[2]) if len(sys.argv) > 2 else 10_000
RUN = 60

SCENE = """
[joint]
size = ["4 mm", "3 mm"]
grid = [16, 12]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "1 um"
correlation_length = ["0.8 mm", "0.7 mm"]
seed = 3
[contact]
friction_coefficient = 0.6
normal_load = "200 N"
[motion]
amplitude = "1 um"
[wear]
coefficient = "2e3 um^3/J"
cycles = 600_000
tolerance = 1e-3
[output]
curves_every = 0
"""

DRAW = random.Random(1)
DRAWN = {
    "contact.friction_coefficient": [DRAW.gauss(0.6, 0.05) for _ in range(RUN)],
    "contact.normal_load": [f"{DRAW.uniform(150, 250):.6g} N" for _ in range(RUN)],
    "wear.coefficient": [f"{DRAW.lognormvariate(math.log(2e3), 0.26):.6g} um^3/J" for _ in range(RUN)],
    "surface.seed": [DRAW.randrange(1, 1_000_000) for _ in range(RUN)],
}
# The draws repeat, because a history belongs to the content of its row.
LIST = "".join(f"{key} = {(values * (ROWS // RUN + 1))[:ROWS]}\n" for key, values in DRAWN.items())
CAMPAIGN = f"""
scene = "scene.toml"
keep = "history"
[list]
{LIST}"""


def measured(name, *arguments):
    """Runs a command of the campaign; prints its seconds and its peak memory."""
    begin = time.perf_counter()
    process = subprocess.Popen([PROGRAM, "campaign", *arguments, "--dir", "c"], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    assert status == 0, (arguments, status)
    wall = time.perf_counter() - begin
    print(f"{name:10} {wall:7.2f} s  {usage.ru_utime + usage.ru_stime:7.2f} s of CPU  {usage.ru_maxrss / 1024:6.0f} MB", flush=True)


def told(folder):
    files = [path for path in Path(folder).rglob("*") if path.is_file()]
    print(f"{folder:12} {len(files):6} files {sum(path.stat().st_size for path in files) / 1e6:8.1f} MB", flush=True)


def main():
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        Path("scene.toml").write_text(SCENE)
        Path("campaign.toml").write_text(CAMPAIGN)
        measured("plan", "plan", "campaign.toml")
        measured(f"run {RUN}", "run", "--index", f"0-{RUN - 1}", "--quiet")
        for row in range(RUN, ROWS):
            shutil.copy(f"c/ended/{row % RUN:06}.parquet", f"c/ended/{row:06}.parquet")
        told("c/ended")
        measured("status", "status")
        measured("collect", "collect")
        told("c/collected")
        measured("status", "status")
        measured("again", "collect")
        measured("report", "report")
        try:
            import polars

            begin = time.perf_counter()
            scan = polars.scan_parquet("c/collected/*.parquet")
            worn = scan.group_by("index").agg(polars.col("wear_volume").max()).collect()
            assert len(worn) == ROWS
            print(f"polars reads the shards in {time.perf_counter() - begin:.3f} s")
        except ImportError:
            pass
        try:
            import duckdb

            begin = time.perf_counter()
            worn = duckdb.sql("select index, max(wear_volume) from 'c/collected/*.parquet' group by index").fetchall()
            assert len(worn) == ROWS
            print(f"duckdb reads the shards in {time.perf_counter() - begin:.3f} s")
        except ImportError:
            pass


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    main()
