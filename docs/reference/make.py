"""Writes the pages of this folder: from what the program prints, from the sources of messages, and from a run.

    python docs/reference/make.py --program target/release/fretwear            writes them
    python docs/reference/make.py --program target/release/fretwear --check    ends with 1 if one differs

`mistaken_units.md` is written by a test of the program: FRETWEAR_REWRITE_PAGES=1 cargo test --release --test main -- plan::plausible
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
SOURCES = HERE.parents[1] / "src"

# Files and folders of a run, beside the tables that the page of tables lists.
RUN_FILES = {
    "run.json": "Identity of the run: scene, versions, machine, and the hash of every file outside the iterations.",
    "run.copy.json": "Copy of `run.json`, read if that file is damaged.",
    "scene.toml": "Scene as the run computes it: every key with its value, defaults included.",
    "scene.original.toml": "Scene as it was given, with comments.",
    "plan.json": "Decisions of the recipe, each with its reason.",
    "schemas.json": "Unit, dimension and meaning of every column of every table.",
    "history.parquet": "All iterations in one table: one row per iteration. It is rebuilt if it is missing.",
    "log.txt": "Notices and warnings with their times.",
    "lock": "Lock of the process that computes the run. The operating system releases it when that process ends.",
    "staging": "Iteration in progress. The program removes or completes it at the next start.",
    "once": "Tables that are computed once per run: surface, structure, reference.",
    "iterations": "One folder per committed iteration, `wear_iteration=7`. Each has its tables and `commit.json`.",
    "commit.json": "Hashes of the iteration's tables and of the iteration before. Its presence commits the iteration.",
    "report.html": "Page that `fretwear report` writes.",
}

# What to do at each exit code; the meanings are those that the program prints.
ADVICE = {
    "0": "",
    "1": "Read the message. A full disk or a missing permission is the usual cause; repeat the command.",
    "2": "Correct the key or the option that the message names.",
    "3": "Read the numbers of the message, and refine the scene or relax the tolerance that it names. Committed iterations stay.",
    "4": "Run `fretwear verify` on the folder. Restore it from a copy, or start a new run from the last good iteration (`--from`).",
    "75": "Repeat the same command.",
}

SCENE = """[joint]
size = ["10 mm", "8 mm"]
grid = [24, 20]
[material]
youngs_modulus = "200 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "1 um"
correlation_length = ["1 mm", "1 mm"]
seed = 1
[contact]
normal_load = "1 kN"
friction_coefficient = 0.6
[motion]
amplitude = ["10 um", "0 m"]
[wear]
coefficient = "2e3 um^3/J"
cycles = 1000
"""


def generated(title, about, body):
    """A page of this folder."""
    return f"# {title}\n\n{about} This page is generated.\n\n{body.strip()}\n"


def with_links(markdown):
    """Links to the sections, before the sections."""
    names = re.findall(r"^## `(.*)`$", markdown, re.MULTILINE)
    links = " · ".join(f"[`{name}`](#{name.replace('.', '')})" for name in names)
    return f"{links}\n\n{markdown}"


def commands(call):
    """The help of every command."""
    text, pages = call("--help"), []

    def names(help_text):
        """Commands in a help, which has them in groups."""
        listed = help_text.split("\nOptions:")[0]
        return [name for name in re.findall(r"^  ([a-z]+)(?:  |$)", listed, re.MULTILINE) if name != "help"]

    for name in names(text):
        printed = call(name, "--help")
        pages.append((name, printed))
        if f"fretwear {name} <COMMAND>" in printed:
            pages += [(f"{name} {inner}", call(name, inner, "--help")) for inner in names(printed)]
    body = "".join(f"\n## `{name}`\n\n```text\n{printed.strip()}\n```\n" for name, printed in pages) + importing()
    return with_links(f"```text\n{text.strip()}\n```\n{body}")


def importing():
    """The options of the command `fretwear-import`, which is part of the Python package."""
    sys.path.insert(0, str(SOURCES / "python"))
    from fretwear.importing.__main__ import parser

    command = parser()
    rows = []
    for action in command._actions:
        if action.dest != "help":
            names = ", ".join(action.option_strings) or action.metavar
            value = f" {action.metavar}" if action.option_strings and action.metavar else ""
            rows.append(f"| `{names}{value}` | {action.help} |")
    table = "\n".join(rows)
    return f"\n## `fretwear-import`\n\n{command.description}\n\n| option | meaning |\n|---|---|\n{table}\n"


def argument_names(text):
    """The names of the arguments that follow the text of an error, such as `path` of `path.display()`."""
    depth, parts = 0, [""]
    for character in text:
        depth += (character in "([{") - (character in ")]}")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    # `listed(.keys)` is the argument `keys`.
    found = (re.match(r"\s*\w+\(\.([a-z_]+)|.*?([a-z_]{2,})", part, re.DOTALL) for part in parts if part.strip())
    return [(name[1] or name[2]) if name else "value" for name in found]


def messages():
    """The errors of the sources: text and meaning, by component."""
    error = re.compile(r'((?:^ *///[^\n]*\n)*)^ *#\[error\(\s*"((?:[^"\\]|\\.)*)"(.*?)\)\]$', re.MULTILINE | re.DOTALL)
    sections = []
    for folder in sorted(path for path in SOURCES.iterdir() if path.is_dir()):
        rows = []
        for file in sorted(folder.rglob("*.rs")):
            for comment, message, rest in error.findall(file.read_text(encoding="utf-8")):
                unnamed = iter(argument_names(rest))

                def placeholder(found, unnamed=unnamed):
                    name = found[1].split(":")[0]
                    name = name if name and not name.isdigit() else next(unnamed, "value")
                    # A conditional part has no name.
                    return "" if name == "if" else f"<{name}>"

                message = re.sub(r"\\\n\s*", "", message).replace("{{", "\0").replace("}}", "\1")
                message = re.sub(r"\{([^{}]*)\}", placeholder, message).replace("\0", "{").replace("\1", "}")
                message = message.replace('\\"', '"').replace("\\n", " ").strip()
                meaning = " ".join(line.strip(" /") for line in comment.splitlines())
                # Messages that only pass on another one have no words of their own.
                if re.search(r"[a-z]{2}", re.sub(r"<\w+>", "", message)):
                    rows.append((message.replace("|", "\\|"), re.sub(r"\[`?([^`\]]*)`?\]", r"`\1`", meaning).replace("|", "\\|")))
        if rows:
            table = "\n".join(f"| `` {message} `` | {meaning} |" for message, meaning in sorted(set(rows)))
            sections.append(f"## `{folder.name}`\n\n| message | meaning |\n|---|---|\n{table}")
    return with_links("\n\n".join(sections))


def run_folder(call):
    """Exit codes as the program prints them, and the files of a run as it writes them."""
    printed = re.search(r"Exit codes:\n(.*)", call("--help"), re.DOTALL)[1]
    codes = re.findall(r"(\d+) ([^;]+)", re.sub(r"\s+", " ", printed))
    assert {code for code, _ in codes} == set(ADVICE), codes
    rows = "\n".join(f"| {code} | {meaning.strip()} | {ADVICE[code]} |" for code, meaning in codes)
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        scene.write_text(SCENE, encoding="utf-8")
        run = Path(folder) / "run"
        call("run", str(scene), "--run", str(run), "--quiet")
        call("report", str(run))
        written = {path.name for path in run.iterdir()} | {"commit.json"}
    assert written <= set(RUN_FILES), written - set(RUN_FILES)
    assert set(RUN_FILES) <= written | {"staging"}, set(RUN_FILES) - written
    files = "\n".join(f"| `{name}` | {meaning} |" for name, meaning in RUN_FILES.items())
    return (
        f"## Exit codes\n\n| code | meaning | what to do |\n|---|---|---|\n{rows}\n\n"
        f"## Files of a run\n\n| file or folder | content |\n|---|---|\n{files}\n\n"
        "The tables are listed in [Tables of a run](tables.md). Tables are Parquet files in SI units; the unit of each column is stored in the file.\n"
    )


def pages(program):
    """The text of each page by its file name."""

    def call(*arguments):
        return subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout

    python = "```{eval-rst}\n.. automodule:: fretwear\n   :members:\n   :imported-members:\n   :undoc-members:\n```\n"
    return {
        "keys.md": generated(
            "Keys of a scene",
            "Every key of a scene, with type, default and meaning. `fretwear schema KEY` explains a single key.",
            with_links(call("schema", "scene", "--markdown")),
        ),
        "tables.md": generated(
            "Tables of a run",
            "Every table of a run: its file, when the program writes it, and the unit, type and meaning of each column.",
            with_links(call("schema", "--markdown")),
        ),
        "commands.md": generated("Commands", "Every command with its options, as `--help` prints them.", commands(call)),
        "messages.md": generated(
            "Messages",
            "Every error message and its meaning, by component. Names in angle brackets are placeholders. Search this page for the fixed words of a message.",
            messages(),
        ),
        "run_folder.md": generated("Exit codes and run folder", "The exit codes of all commands, and the files of a run.", run_folder(call)),
        "python.md": generated("Python API", "Every function and class of the Python module.", python),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--check", action="store_true")
    given = parser.parse_args()
    differing = []
    for name, text in pages(str(Path(given.program).resolve())).items():
        path = HERE / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            differing.append(name)
            if not given.check:
                path.write_text(text, encoding="utf-8")
    print("\n".join(f"{name} {'differs' if given.check else 'is written'}" for name in differing) or "all pages are up to date")
    return 1 if given.check and differing else 0


if __name__ == "__main__":
    sys.exit(main())
