"""Publishing to S3 and fetching from it, against a server of this machine, run by hand:

    pip install 'moto[server]' boto3 polars
    cargo build --release --features object_store
    python tests/campaign/on_s3.py target/release/fretwear

A campaign comes back to the same bytes; publications are killed outright at forty moments, after which nothing is visible and the next
one completes them; two publish at once; Polars reads the shards where they are; and what an enemy writes into the bucket is refused.
"""

import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import boto3
import polars as pl

PROGRAM = Path(sys.argv[1]).resolve()
ROWS = 24
KILLS = 40
ROUNDS = 6
# A publication is a hundred small requests to a server that answers in milliseconds.
PATIENCE = 120
BUCKET = "fretting"

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
cycles = 200_000
"""
CAMPAIGN = f"""
scene = "joint.toml"
keep = "history"
[grid]
surface.seed = {{ from = 1, to = {ROWS} }}
"""


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


class Server:
    """A server of S3, and how it is reached."""

    def __init__(self, **more):
        port = free_port()
        self.endpoint = f"http://127.0.0.1:{port}"
        command = [Path(sys.executable).parent / "moto_server", "-H", "127.0.0.1", "-p", str(port)]
        quiet = subprocess.DEVNULL
        self.process = subprocess.Popen(command, env={**os.environ, **more}, stdout=quiet, stderr=quiet)
        until = time.monotonic() + PATIENCE
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                break
            except OSError:
                assert time.monotonic() < until and self.process.poll() is None, "the server does not start"
                time.sleep(0.1)
        self.env = {
            "AWS_ENDPOINT_URL": self.endpoint,
            "AWS_ACCESS_KEY_ID": "testing",
            "AWS_SECRET_ACCESS_KEY": "testing",
            "AWS_REGION": "us-east-1",
        }
        self.client = boto3.client(
            "s3",
            endpoint_url=self.endpoint,
            aws_access_key_id="testing",
            aws_secret_access_key="testing",
            region_name="us-east-1",
        )

    def objects(self, prefix):
        pages = self.client.get_paginator("list_objects_v2").paginate(Bucket=BUCKET, Prefix=prefix + "/")
        return {o["Key"][len(prefix) + 1 :]: o["ETag"] for page in pages for o in page.get("Contents", [])}

    def read(self, key):
        return self.client.get_object(Bucket=BUCKET, Key=key)["Body"].read()

    def put(self, key, body):
        self.client.put_object(Bucket=BUCKET, Key=key, Body=body)


def environment(env):
    plain = {key: value for key, value in os.environ.items() if not key.startswith("AWS_")}
    # Neither files of profiles nor proxies of whoever runs this.
    return {**plain, **env}


def run(*arguments, env=None, code=0):
    did = subprocess.run(
        [PROGRAM, *map(str, arguments)],
        capture_output=True,
        text=True,
        env=environment(env or {}),
        timeout=PATIENCE,
    )
    assert did.returncode == code, (arguments, did.returncode, did.stdout, did.stderr)
    return did.stdout if code == 0 else did.stderr


def files(root):
    root = Path(root)
    found = (path for path in root.rglob("*") if path.is_file() and path.name != "lock")
    return {str(path.relative_to(root)): path.read_bytes() for path in found}


def place(prefix):
    return f"s3://{BUCKET}/{prefix}"


def main(server, folder):
    def publish(source, prefix, **more):
        return json.loads(run("publish", source, "--to", place(prefix), "--json", env=server.env, **more))

    def fetch(prefix, name, code=0):
        shutil.rmtree(folder / name, ignore_errors=True)
        return run("fetch", place(prefix), "--to", folder / name, env=server.env, code=code)

    (folder / "joint.toml").write_text(SCENE)
    (folder / "case.toml").write_text(CAMPAIGN)
    c, half, other_half = folder / "c", folder / "half", folder / "other_half"
    for root in (c, half, other_half):
        run("campaign", "plan", folder / "case.toml", "--dir", root, "--no-rehearsal")
    run("campaign", "run", "--dir", c, "--index", f"0-{ROWS - 1}", "-q")
    run("campaign", "collect", "--dir", c)
    expected = files(c)

    # There and back.
    began = time.monotonic()
    first = publish(c, "whole")
    seconds = time.monotonic() - began
    assert first["changed"] and first["files"] == len(expected), first
    fetch("whole", "back")
    assert files(folder / "back") == expected
    again = publish(c, "whole")
    assert again["uploaded"] == 0 and not again["changed"], again
    print(f"round trip of {first['files']} files, {first['bytes'] / 1e6:.2f} MB: the same bytes; published in {seconds:.2f} s")

    # What Polars reads where it is.
    options = {
        "aws_endpoint_url": server.endpoint,
        "aws_access_key_id": "testing",
        "aws_secret_access_key": "testing",
        "aws_region": "us-east-1",
        "aws_allow_http": "true",
    }
    there = pl.scan_parquet(place("whole") + "/collected/*.parquet", storage_options=options).collect()
    here = pl.scan_parquet(c / "collected/*.parquet").collect()
    assert there.equals(here) and there["index"].n_unique() == ROWS
    print(f"polars.scan_parquet on S3: {there.height} rows of {there['index'].n_unique()} runs, those of the folder")

    # Killed outright.
    partial = 0
    uploads = 0
    whole = set(server.objects("whole"))
    chance = random.Random(1)
    for k in range(KILLS):
        prefix = f"killed{k}"
        command = [PROGRAM, "publish", c, "--to", place(prefix)]
        process = subprocess.Popen(command, env=environment(server.env), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(seconds * chance.random())
        process.send_signal(signal.SIGKILL)
        process.wait()
        before = set(server.objects(prefix))
        if "published.json" not in before:
            partial += bool(before - {"conditions"})
            said = fetch(prefix, "killed", code=2)
            assert "nothing is published" in said, said
            assert not (folder / "killed").exists()
        next_one = publish(c, prefix)
        uploads += next_one["uploaded"]
        after = set(server.objects(prefix))
        assert after == whole, after ^ whole
        # Requests that were under way when it was killed may have arrived since.
        assert next_one["uploaded"] <= len(after - before - {"published.json", "conditions"}), (next_one, before)
        fetch(prefix, "killed")
        assert files(folder / "killed") == expected
    assert partial > KILLS // 4, partial
    print(f"killed outright {KILLS} times, {partial} with a part uploaded: nothing visible, and completed by the next")

    # Two at once: the same folder copied, and halves of the same campaign.
    run("campaign", "run", "--dir", half, "--index", f"0-{ROWS // 2 - 1}", "-q")
    run("campaign", "run", "--dir", other_half, "--index", f"{ROWS // 2}-{ROWS - 1}", "-q")
    copied = folder / "copied"
    shutil.copytree(c, copied)
    for sources, both in [((c, copied), expected), ((half, other_half), {**files(half), **files(other_half)})]:
        for k in range(ROUNDS):
            prefix = f"two-{sources[1].name}-{k}"
            processes = [
                subprocess.Popen([PROGRAM, "publish", s, "--to", place(prefix)], env=environment(server.env), stdout=subprocess.DEVNULL)
                for s in sources
            ]
            assert [p.wait(PATIENCE) for p in processes] == [0, 0]
            fetch(prefix, "two")
            assert files(folder / "two") == both
    print(f"two publishers at once, {2 * ROUNDS} times: all that both had")

    # What is something else.
    (folder / "case.toml").write_text(CAMPAIGN.replace("from = 1", "from = 2"))
    run("campaign", "plan", folder / "case.toml", "--dir", folder / "other", "--no-rehearsal")
    before = server.objects("whole")
    said = run("publish", folder / "other", "--to", place("whole"), env=server.env, code=4)
    assert "holds another campaign" in said, said
    assert server.objects("whole") == before
    print("another campaign:", said.strip())

    # An enemy.
    sound = json.loads(server.read("whole/published.json"))
    some = sound["files"]["ended/000003.parquet"]
    for path in ["../x.parquet", "ended/../../x.parquet", "/tmp/x.parquet", "lock", ".profile"]:
        publish_hostile = {**sound, "files": {**sound["files"], path: some}}
        server.put("hostile/published.json", json.dumps(publish_hostile).encode())
        said = fetch("hostile", "hostile", code=4)
        assert "no file of a campaign" in said and not (folder / "hostile").exists(), said
    server.put("hostile/published.json", b"[" * (65 << 20))
    said = fetch("hostile", "hostile", code=4)
    assert "no publication of this program has more" in said, said
    shard = bytearray(server.read("whole/collected/shard-00000.parquet"))
    shard[len(shard) // 2] ^= 1
    server.put("whole/collected/shard-00000.parquet", bytes(shard))
    said = fetch("whole", "hostile", code=4)
    assert "its hash is another" in said and not (folder / "hostile/campaign.parquet").exists(), said
    print("paths that lead elsewhere, 65 MB of brackets, a flipped bit: refused")

    # A whole run.
    run("run", folder / "joint.toml", "--run", folder / "r", "-q")
    run("publish", folder / "r", "--to", place("run"), env=server.env)
    fetch("run", "r2")
    assert files(folder / "r2") == files(folder / "r")
    run("verify", folder / "r2")
    print("a run: the same bytes, and it verifies")

    # What is wrong is said.
    cases = [
        ("no bucket", "s3://nowhere/x", server.env, "there is no such bucket"),
        ("no answer", place("x"), {**server.env, "AWS_ENDPOINT_URL": f"http://127.0.0.1:{free_port()}"}, "does not answer"),
        ("no place", "fretting/x", server.env, "s3://BUCKET/PREFIX"),
        ("no credentials", place("x"), {"AWS_ENDPOINT_URL": server.endpoint}, "no credentials were found"),
    ]
    strict = Server(INITIAL_NO_AUTH_ACTION_COUNT="0")
    try:
        cases.append(("wrong credentials", place("x"), strict.env, "does not know these credentials"))
        for name, to, env, says in cases:
            for command in (["publish", c, "--to", to], ["fetch", to, "--to", folder / "nothing"]):
                began = time.monotonic()
                did = subprocess.run([PROGRAM, *command], env=environment(env), capture_output=True, text=True, timeout=PATIENCE)
                assert did.returncode in (1, 2) and says in did.stderr, (name, did.returncode, did.stderr)
            print(f"{name} ({time.monotonic() - began:.1f} s): {did.stderr.strip()}")
    finally:
        strict.process.kill()


if __name__ == "__main__":
    server = Server()
    try:
        server.client.create_bucket(Bucket=BUCKET)
        with tempfile.TemporaryDirectory() as folder:
            main(server, Path(folder))
    finally:
        server.process.kill()
