#!/usr/bin/env python3
"""Finds the numeric constants of the solvers that decide a result.

    python tests/constants/sensitivity.py FOLDER [--module dynamics] [--table sensitivity.csv] [--jobs 2]

The script builds a copy of the sources in FOLDER. In this copy, the environment can scale every `const NAME: f64 = …` (also usize, u64,
u32, i32) of the modules below. The script halves and doubles each constant and runs the scenes of the yardstick that read it.
A constant decides a result if a figure of `--json` changes by more than a tenth of its error bar, or if the exit code changes.
Constants that the compiler needs (lengths of arrays, patterns) cannot be varied; the table lists them, too.

The table has one row per constant: module, file, name, value, whether the constant decides a result, the largest change in units of the
error bar (of the first case with a decisive change), and the figure and the scene of this change. The committed table also has the column
`home`: the setting that replaced a decisive constant, or the reason why it stays a constant. The script needs pyarrow and numpy, as the
yardstick does.
"""

import argparse
import concurrent.futures
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
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / "tests" / "yardstick"))
import scenes  # noqa: E402

MODULES = ["dynamics", "contact", "structure", "wear", "model_update"]
FACTORS = [0.5, 2.0]
# Fraction of the error bar above which a change counts.
SHARE = 0.1
# A run that takes longer counts as endless [s].
LONGEST = 120.0

DECLARATION = re.compile(
    r"^(?P<indent> *)(?P<visibility>pub(?:\([a-z:\s_]+\))? )?const (?P<name>[A-Z][A-Z0-9_]*): (?P<type>f64|usize|u64|u32|i32) =\s*(?P<value>[^;]+);",
    re.MULTILINE,
)
COPIED = ["schemas", "pipelines", "data", "docs", "Cargo.toml", "Cargo.lock", "README.md"]

TUNED = """
//! Scales one constant: FRETWEAR_SCALE="file:NAME=2.0". FRETWEAR_READ names a file that lists all constants that a run reads.

use std::io::Write;
use std::sync::OnceLock;

/// Returns the scaled value of a constant.
pub fn scaled(key: &str, value: f64) -> f64 {
    static SCALE: OnceLock<Option<(String, f64)>> = OnceLock::new();
    if let Some(path) = std::env::var_os("FRETWEAR_READ") {
        let file = std::fs::OpenOptions::new().append(true).create(true).open(path);
        let _ = file.map(|mut file| file.write_all(format!("{key}\\n").as_bytes()));
    }
    let scale = SCALE.get_or_init(|| {
        let text = std::env::var("FRETWEAR_SCALE").ok()?;
        let (key, factor) = text.rsplit_once('=')?;
        Some((key.to_owned(), factor.parse().ok()?))
    });
    match scale {
        Some((name, factor)) if name == key => value * factor,
        _ => value,
    }
}
"""


class Constant:
    """One declaration of a constant in the sources."""

    def __init__(self, path, found):
        self.path, self.name = path, found["name"]
        self.type, self.value = found["type"], " ".join(found["value"].split())
        self.key = f"{path}:{self.name}"
        self.module = path.split("/")[0]

    def function(self, found):
        """Returns the function that replaces the constant."""
        whole = "" if self.type == "f64" else ".round().max(1.0)"
        first = found["indent"] + (found["visibility"] or "")
        return (
            f"{first}fn {self.name}() -> {self.type} {{ static VALUE: std::sync::OnceLock<{self.type}> = std::sync::OnceLock::new(); "
            f'*VALUE.get_or_init(|| crate::tuned::scaled("{self.key}", ({found["value"]}) as f64){whole} as {self.type}) }}'
        )


def declared(modules):
    """Returns all constants by file."""
    found = {}
    for module in modules:
        for path in sorted((REPOSITORY / "src" / module).rglob("*.rs")):
            name = str(path.relative_to(REPOSITORY / "src"))
            text = path.read_text(encoding="utf-8")
            constants = [Constant(name, match) for match in DECLARATION.finditer(text)]
            if constants:
                found[name] = constants
    return found


def rewrite(folder, constants, left):
    """Writes the sources with functions in place of all constants except the constants in `left`."""
    source = folder / "src"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(REPOSITORY / "src", source)
    (source / "tuned.rs").write_text(TUNED, encoding="utf-8")
    library = source / "lib.rs"
    library.write_text(library.read_text(encoding="utf-8").replace("pub mod", "#[doc(hidden)]\npub mod tuned;\npub mod", 1), encoding="utf-8")
    varied = [constant for constant in constants if constant.key not in left]
    own = {}
    for constant in varied:
        own.setdefault(constant.path, {})[constant.name] = constant
    shared = {constant.name for constant in varied}
    # Stems of the files that declare a name; a path to the constant ends with this stem.
    declaring = {}
    for constant in varied:
        declaring.setdefault(constant.name, set()).add(Path(constant.path).stem)

    def called(found):
        ends_with = found[1].rstrip(":").split("::")[-1]
        return found[0] + ("()" if ends_with in declaring.get(found[2], ()) else "")

    for path in source.rglob("*.rs"):
        name = str(path.relative_to(source))
        text = path.read_text(encoding="utf-8")
        mine = own.get(name, {})
        declares = {match["name"] for match in re.finditer(r"\b(?:const|static) (?P<name>[A-Z][A-Z0-9_]*):", text)}
        imported = {n for use in re.findall(r"\buse [^;]+;", text) for n in re.findall(r"\b[A-Z][A-Z0-9_]+\b", use)}
        text = DECLARATION.sub(lambda m: mine[m["name"]].function(m) if m["name"] in mine else m[0], text)
        lines, in_use = [], False
        for line in text.split("\n"):
            stripped = line.lstrip()
            in_use = in_use or re.match(r"(?:pub(?:\([a-z:\s_]+\))? )?use ", stripped) is not None
            if in_use or stripped.startswith("//"):
                lines.append(line)
                in_use = in_use and not stripped.endswith(";")
                continue
            names = set(mine) | {n for n in imported & shared if n not in declares}
            body = line
            if names:
                body = re.sub(rf"(?<![\w\"])(?<!rs:)((?:\w+::)*)({'|'.join(sorted(names, key=len, reverse=True))})\b(?!\s*\()", r"\1\2()", body)
            lines.append(re.sub(r"\b((?:\w+::)+)([A-Z][A-Z0-9_]+)\b(?!\s*[(:])", called, body))
        path.write_text("\n".join(lines), encoding="utf-8")


def build(folder, constants):
    """Builds the program with all constants that the compiler does not need; returns the program and the keys of the other constants."""
    for name in COPIED:
        target = folder / name
        if (REPOSITORY / name).is_dir():
            shutil.copytree(REPOSITORY / name, target, dirs_exist_ok=True)
        else:
            shutil.copy(REPOSITORY / name, target)
    left = set()
    while True:
        rewrite(folder, constants, left)
        environment = os.environ | {"RUSTFLAGS": "--cap-lints allow", "CARGO_TARGET_DIR": str(folder / "target")}
        command = ["cargo", "check", "--release", "--message-format", "json", "--bin", "fretwear"]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            break
        by_name = {}
        for constant in constants:
            by_name.setdefault(constant.name, []).append(constant)
        named = set()
        for line in done.stdout.splitlines():
            message = json.loads(line).get("message")
            if not message or message.get("level") != "error":
                continue
            for span in message["spans"]:
                shown = " ".join(part["text"] for part in span["text"])
                path = str(Path(span["file_name"]).relative_to("src")) if span["file_name"].startswith("src/") else ""
                for name in set(re.findall(r"\b[A-Z][A-Z0-9_]+\b", shown)) & set(by_name):
                    here = [c for c in by_name[name] if c.path == path]
                    named |= {c.key for c in here or by_name[name]}
        if not named - left:
            sys.exit(f"the copy does not compile:\n{done.stderr[-3000:]}")
        left |= named
        print(f"{len(left)} constants cannot be varied", flush=True)
    command = ["cargo", "build", "--release", "--bin", "fretwear"]
    subprocess.run(command, cwd=folder, env=environment, check=True)
    return folder / "target" / "release" / "fretwear", left


def figures(printed):
    """Returns the figures with error bars in the output of a start: value and absolute error bar."""
    found = {}
    for line in printed.splitlines():
        try:
            values = json.loads(line)
        except ValueError:
            continue
        if not isinstance(values, dict):
            continue
        for name, bar in values.items():
            if not name.startswith("error_") or not isinstance(bar, float):
                continue
            value = values.get(name.removeprefix("error_"))
            # `error_cycles` belongs to the computed cycle, not to the number of cycles.
            if name != "error_cycles" and isinstance(value, (int, float)):
                found[name.removeprefix("error_")] = (float(value), abs(bar * value))
    return found


def start(program, case, folder, environment):
    """Returns the exit codes and figures of all starts of a case."""
    place = Path(tempfile.mkdtemp(dir=folder))
    case.prepare(place / "case")
    found = []
    for arguments in case.starts:
        try:
            done = subprocess.run(
                [str(program), *arguments],
                cwd=place / "case",
                env=os.environ | environment | {"FRETWEAR_CACHE": ""},
                capture_output=True,
                text=True,
                timeout=LONGEST,
                stdin=subprocess.DEVNULL,
                check=False,
            )
            found.append((done.returncode, figures(done.stdout)))
        except subprocess.TimeoutExpired:
            found.append((None, {}))
    shutil.rmtree(place)
    return found


def change(before, after):
    """Returns the largest change in units of the error bar, and its figure; infinite if an exit code changes."""
    largest = (0.0, "")
    for (code, old), (other, new) in zip(before, after, strict=True):
        if code != other:
            return (math.inf, f"ends with {other} in place of {code}")
        for name in old.keys() & new.keys():
            moved, bar = abs(new[name][0] - old[name][0]), old[name][1]
            if moved > 0.0:
                largest = max(largest, (moved / bar if bar > 0.0 else math.inf, name))
    return largest


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--module", action="append", choices=MODULES)
    parser.add_argument("--table", type=Path, default=Path("sensitivity.csv"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--case", action="append", help="only this case of the yardstick; may be repeated")
    parser.add_argument("--most", type=int, default=10, help="cases per constant, spread over its readers [default: %(default)s]")
    parser.add_argument("--longest", type=float, default=3.0, help="skip cases that take longer [s, default: %(default)s]")
    parser.add_argument("--built", action="store_true", help="use the program that an earlier start has built in FOLDER")
    given = parser.parse_args()
    folder = given.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    constants = [constant for each in declared(given.module or MODULES).values() for constant in each]
    names = folder / "not_varied.json"
    if given.built and names.exists():
        program, left = folder / "target" / "release" / "fretwear", set(json.loads(names.read_text()))
    else:
        program, left = build(folder, constants)
        names.write_text(json.dumps(sorted(left)))
    cases = [case for case in [*scenes.shipped(False), *scenes.drawn()] if not case.folders]
    unknown = set(given.case or []) - {case.name for case in cases}
    if unknown:
        sys.exit(f"no case {', '.join(sorted(unknown))}; see tests/yardstick/scenes.py")
    cases = [case for case in cases if not given.case or case.name in given.case]
    fixed = sum(constant.key in left for constant in constants)
    print(f"{len(constants)} constants, {fixed} cannot be varied; {len(cases)} cases", flush=True)

    def read_by(case):
        log = folder / f"read-{case.name.replace('/', '_')}"
        log.unlink(missing_ok=True)
        begun = time.monotonic()
        found = start(program, case, folder, {"FRETWEAR_READ": str(log)})
        read = set(log.read_text().split("\n")) if log.exists() else set()
        return case, found, read, time.monotonic() - begun

    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        # Quick cases first, so that the selected cases of a constant have different lengths.
        plain = sorted(pool.map(read_by, cases), key=lambda found: found[3])
        plain = [found for found in plain if found[3] <= given.longest]
        print(f"{len(plain)} cases take at most {given.longest} s", flush=True)

        def judge(constant):
            largest = (0.0, "", "", "")
            readers = [(case, before) for case, before, read, _ in plain if constant.key in read]
            step = max(1.0, len(readers) / given.most)
            for k in range(min(given.most, len(readers))):
                case, before = readers[int(k * step)]
                if largest[0] > SHARE:
                    break
                for factor in FACTORS:
                    after = start(program, case, folder, {"FRETWEAR_SCALE": f"{constant.key}={factor}"})
                    found, figure = change(before, after)
                    largest = max(largest, (found, figure, case.name, factor))
            is_read = bool(readers)
            return constant, is_read, largest

        varied = [constant for constant in constants if constant.key not in left]
        with open(given.table, "w", encoding="utf-8", newline="") as file:
            table = csv.writer(file)
            table.writerow(["module", "file", "name", "value", "decides", "change_over_bar", "figure", "case", "factor"])
            for constant, is_read, (largest, figure, case, factor) in pool.map(judge, varied):
                decides = "yes" if largest > SHARE else "no" if is_read else "not read"
                row = [constant.module, constant.path, constant.name, constant.value, decides, f"{largest:.3g}", figure, case, factor]
                table.writerow(row)
                file.flush()
            for constant in constants:
                if constant.key in left:
                    table.writerow([constant.module, constant.path, constant.name, constant.value, "not varied", "", "", "", ""])


if __name__ == "__main__":
    main()
