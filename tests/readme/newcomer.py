"""Does what a newcomer does with the README alone, in an empty home: its commands as they stand, then a surface of his own from NumPy and
one from Parquet as pandas writes it, to the report and to the Python module.

    python tests/readme/newcomer.py --program target/release/fretwear FOLDER

FOLDER contains `runs/lap_joint`, which the run of the README finds done: what it computes is held elsewhere. Wants numpy, pandas and
pyarrow. The module `fretwear` is that of src/python.
"""

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
# Commands that fetch and build: whoever runs this has built.
BUILDING = ("git ", "cd ", "cargo test", "pip ")
CARGO = "cargo run --release -- "


def blocks(page, language):
    text = (REPOSITORY / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


def commands(page):
    """The commands of a page that run the program, without their comments."""
    for block in blocks(page, "sh"):
        for line in block.splitlines():
            if line.strip() and not line.startswith(BUILDING):
                words = shlex.split(line.replace(CARGO, "fretwear "), comments=True)
                if words and words[0] == "fretwear":
                    yield words


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", required=True)
    parser.add_argument("folder", type=Path)
    arguments = parser.parse_args()
    program = shutil.which(arguments.program) or sys.exit(f"{arguments.program} is no program")
    program = str(Path(program).resolve())
    done = []
    with tempfile.TemporaryDirectory() as scratch:
        home, work = Path(scratch) / "home", Path(scratch) / "fretwear"
        home.mkdir()
        work.mkdir()
        for name in ("pipelines", "data"):
            (work / name).symlink_to(REPOSITORY / name)
        shutil.copytree(arguments.folder / "runs/lap_joint", work / "runs/lap_joint")
        environment = {"HOME": str(home), "PATH": os.environ["PATH"], "FRETWEAR": program, "PYTHONPATH": str(REPOSITORY / "src/python")}

        def does(words, code=0):
            did = subprocess.run(words, cwd=work, env=environment, capture_output=True, text=True, check=False)
            said = f"{shlex.join(map(str, words))}: {did.returncode}\n{did.stdout}{did.stderr}"
            assert did.returncode == code, said
            done.append(words)
            return did.stdout

        for words in commands("README.md"):
            does([program, *words[1:]])
        assert len(done) >= 5, done
        assert (work / "runs/lap_joint/report.html").is_file()

        # The surfaces of the page on surfaces, written, run and looked at.
        for block in blocks("docs/surface.md", "python"):
            does([sys.executable, "-c", block])
        scenes = []
        for block in blocks("docs/surface.md", "toml"):
            name = re.match(r"# (\w+\.toml)\n", block)
            if name and f'path = "{name[1].removesuffix(".toml")}.' in block:
                (work / name[1]).write_text(block, encoding="utf-8")
                scenes.append(name[1])
        assert len(scenes) >= 2, f"a scene with a map from NumPy and one from pandas, not {scenes}"
        for scene in scenes:
            run = f"runs/{scene.removesuffix('.toml')}"
            does([program, "check", scene])
            does([program, "run", scene, "--quiet"])
            does([program, "report", run])
            look = f"import fretwear; r = fretwear.Run({run!r}); p = r.field('pressure'); assert p.max() > 0; print(p.shape)"
            does([sys.executable, "-c", look])
            assert (work / run / "report.html").stat().st_size > 10_000
        left = sorted(path.name for path in home.iterdir())
        assert set(left) <= {".cache"}, left
    print(f"{len(done)} commands of a newcomer hold")


if __name__ == "__main__":
    main()
