"""Runs the blocks of the user pages, page by page, each in an empty folder.

    python tests/pages/blocks.py --program target/release/fretwear [PAGE…]           on reduced scenes
    python tests/pages/blocks.py --program target/release/fretwear --full [PAGE…]    as they stand, then figures and pictures

- A `sh` or `python` block is executed, in the order of the page.
- A `toml` block whose first line is `# NAME.toml` is written to that file. The keys of every other `toml` block must exist.
- A `console` block has commands of other programs, such as pip and sbatch, and is not executed. It must not start with `fretwear`.
- A `text` block is what a command prints.

Reduced scenes have at most 64 x 48 cells, 6 modes, the harmonics 0 and 1 and the preset "fast".

With `--full`, every quoted figure of docs/data/figures.csv is computed again, and every picture is drawn by docs/pictures/NAME.py, in the
folder of its page. `--write` stores both.
"""

import argparse
import csv
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
FIGURES = DOCS / "data" / "figures.csv"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
CELLS, MODES = (64, 48), 6
# Relative difference that a figure may have on another machine.
TOLERANCE = 1e-6

# In the place of the program: what `fretwear new` writes is reduced.
WRAPPER = """#!{python}
import subprocess, sys
sys.path.insert(0, {here!r})
code = subprocess.run([{program!r}, *sys.argv[1:]]).returncode
if code == 0 and sys.argv[1:2] == ["new"] and "--help" not in sys.argv:
    import blocks
    blocks.reduce_file(sys.argv[2])
sys.exit(code)
"""


def reduced(text):
    """A scene with fewer cells, modes and harmonics, and the preset "fast"."""

    def smaller(most):
        def counts(found):
            given = [int(found[2]), int(found[3])]
            return f"{found[1]}[{min(given[0], most[0])}, {min(given[1], most[1])}]"

        return counts

    text = re.sub(r"(\bgrid = )\[(\d+), *(\d+)\]", smaller(CELLS), text)
    text = re.sub(r"(\bmodes = )(\d+)", lambda found: f"{found[1]}{min(int(found[2]), MODES)}", text)
    text = re.sub(r"(\bharmonics = )\[0, 1, 2, 3\]", r"\1[0, 1]", text)
    if "points = " not in text:
        text = re.sub(r"^(modes = .*)$", r"\1\npoints = 2", text, flags=re.MULTILINE)
    return re.sub(r'(\bpreset = )"(balanced|reference|paper)"', r'\1"fast"', text)


def reduce_file(name):
    """Reduces the scene that `fretwear new NAME` has written."""
    path = Path(name)
    path = path if path.suffix == ".toml" else path.with_name(path.name + ".toml")
    path.write_text(reduced(path.read_text(encoding="utf-8")), encoding="utf-8")


def user_pages():
    """Pages whose blocks a reader runs."""
    return [ROOT / "README.md", DOCS / "cheat_sheet.md", *sorted((DOCS / "start").glob("*.md")), *sorted((DOCS / "how_to").glob("*.md"))]


def blocks(page):
    """(line, language, text) of each block."""
    text = page.read_text(encoding="utf-8")
    return [(text.count("\n", 0, found.start()) + 1, found[1], found[2]) for found in BLOCK.finditer(text)]


def leaves(table, prefix=""):
    """The dotted names of a TOML table."""
    for name, value in table.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name


class Reader:
    """Does what a page says, in a folder of its own."""

    def __init__(self, program, full, scratch):
        self.full = full
        tools = scratch / "bin"
        tools.mkdir()
        if full:
            (tools / "fretwear").symlink_to(program)
        else:
            (tools / "fretwear").write_text(WRAPPER.format(python=sys.executable, here=str(Path(__file__).parent), program=str(program)))
            (tools / "fretwear").chmod(0o755)
        (tools / "python").symlink_to(sys.executable)
        (scratch / "home").mkdir()
        path = f"{tools}:{Path(sys.executable).parent}:{os.environ['PATH']}"
        self.environment = os.environ | {
            "PATH": path,
            "FRETWEAR": str(tools / "fretwear"),
            "PYTHONPATH": str(ROOT / "src" / "python"),
            "FRETWEAR_CACHE": os.environ.get("FRETWEAR_CACHE", str(scratch / "cache")),
            "HOME": str(scratch / "home"),
            "MPLBACKEND": "Agg",
        }
        printed = subprocess.run([program, "schema", "scene", "--json"], check=True, capture_output=True, text=True).stdout
        self.keys = set(json.loads(printed))

    def execute(self, words, folder):
        """The output of a command; raises with what it printed where it fails."""
        done = subprocess.run(words, cwd=folder, env=self.environment, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if done.returncode:
            raise RuntimeError(f"exit code {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-4000:]}")
        return done.stdout

    def toml(self, text, folder):
        table = tomllib.loads(text)
        name = re.match(r"# (\w+\.toml)\n", text)
        if name:
            (folder / name[1]).write_text(text if self.full else reduced(text), encoding="utf-8")
            return
        unknown = [key for key in leaves(table) if not any(key == known or key.startswith(f"{known}.") for known in self.keys)]
        if unknown:
            raise RuntimeError(f"no such keys: {', '.join(unknown)}")

    def read(self, page, folder):
        """Executes the blocks of a page."""
        for line, language, text in blocks(page):
            try:
                if language == "sh":
                    self.execute(["bash", "-euo", "pipefail", "-c", text], folder)
                elif language == "python":
                    self.execute([sys.executable, "-c", text], folder)
                elif language == "toml":
                    self.toml(text, folder)
                elif language == "console":
                    if re.search(r"^\s*fretwear\b", text, re.MULTILINE):
                        raise RuntimeError("a console block is not executed; commands of fretwear belong into sh blocks")
                elif language not in ("text", "mermaid"):
                    raise RuntimeError(f"no rule for the language {language!r}")
            except (RuntimeError, tomllib.TOMLDecodeError) as error:
                raise RuntimeError(f"{page.relative_to(ROOT)}:{line}: {language} block: {error}") from None

    def figures(self, rows, folder):
        """The values of quoted figures, by the expressions of their rows."""
        code = "import json, sys, polars as pl, fretwear\nfrom fretwear import Run\nprint(json.dumps([float(eval(each)) for each in json.load(sys.stdin)]))"
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=folder, env=self.environment, capture_output=True, text=True,
            input=json.dumps([row["expression"] for row in rows]),
        )  # fmt: skip
        if done.returncode:
            raise RuntimeError(f"figures: {done.stderr}")
        return json.loads(done.stdout)


def figure_rows():
    with FIGURES.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def recompute(reader, page, folder, rows, write):
    """Computes the figures and pictures of a page again; returns what differs."""
    name = str(page.relative_to(ROOT))
    own = [row for row in rows if row["page"] == name and row["expression"]]
    differing = []
    for row, value in zip(own, reader.figures(own, folder) if own else [], strict=True):
        if not row["value"] or not math.isclose(float(row["value"]), value, rel_tol=TOLERANCE):
            differing.append(f"{name}: {row['text']}: {row['expression']} is {value!r}, stored is {row['value'] or 'nothing'}")
            row["value"] = repr(value)
    for picture in re.findall(r"!\[[^\]]*\]\((?:\.\./|docs/)?pictures/([\w.]+)\)", page.read_text(encoding="utf-8")):
        script = DOCS / "pictures" / f"{Path(picture).stem}.py"
        if script.exists():
            reader.execute([sys.executable, str(script), picture], folder)
            if write:
                shutil.copyfile(folder / picture, DOCS / "pictures" / picture)
    return differing


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=Path, required=True)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--keep", type=Path, help="folder for what the pages write, one folder per page")
    parser.add_argument("pages", type=Path, nargs="*")
    given = parser.parse_args()
    pages = [page.resolve() for page in given.pages] or user_pages()
    failed, begun, rows = [], time.monotonic(), figure_rows()
    with tempfile.TemporaryDirectory() as scratch:
        reader = Reader(given.program.resolve(), given.full, Path(scratch))

        def read(page):
            started = time.monotonic()
            folder = (given.keep or Path(scratch)).resolve() / page.stem
            folder.mkdir(parents=True)
            faults = []
            try:
                reader.read(page, folder)
                if given.full:
                    faults = recompute(reader, page, folder, rows, given.write)
            except RuntimeError as error:
                faults = [str(error)]
            print(f"{page.relative_to(ROOT)}: {time.monotonic() - started:.1f} s", flush=True)
            return faults

        # Pages on reduced scenes share the cores; at full size, each run has all of them.
        with ThreadPoolExecutor(1 if given.full else os.cpu_count()) as pool:
            for faults in pool.map(read, pages):
                failed += faults
    if given.write:
        with FIGURES.open("w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, rows[0], lineterminator="\n")
            table.writeheader()
            table.writerows(rows)
    print(f"{len(pages)} pages in {time.monotonic() - begun:.0f} s")
    for fault in failed:
        print(f"FAILED {fault}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
