#!/usr/bin/env python3
"""Lists the values of the recipe that each key of a scene changes.

    python3 tests/scene/moves.py PROGRAM [--key KEY ...] [--json FILE]

The script sets each key to other values with `--set`, in each shipped scene that accepts the values, and compares the recipes of `plan`
before and after. The script prints the values of the recipe that each key changes, the values that several keys change, and the keys
without effect. Reasons (`why`) and titles are texts for people and are ignored. The script needs only Python.
"""

import argparse
import json
import re
import subprocess
import sys
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCENES = sorted((ROOT / "pipelines").glob("*.toml"))
# Number in a text with a unit, as in "5 um".
NUMBER = re.compile(r"^(\"?)(-?[0-9][0-9_.eE+-]*)")
FACTORS = (1.25, 0.75, 2.0)


def recipe(program, scene, *sets):
    arguments = [program, "plan", scene, "--json", "--no-rehearsal"]
    for item in sets:
        arguments += ["--set", item]
    done = subprocess.run(arguments, capture_output=True, text=True)
    return json.loads(done.stdout)["recipe"] if done.returncode == 0 else None


def leaves(value, path=""):
    """Values below a path. The paths omit indices of lists, so that lists of different lengths are comparable."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in ("why", "title"):
                yield from leaves(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value and isinstance(value[0], (dict, list)):
        for inner in value:
            yield from leaves(inner, path)
    else:
        yield path, json.dumps(value)


def moved(before, after):
    found = defaultdict(list), defaultdict(list)
    for own, value in zip(found, (before, after)):
        for path, leaf in leaves(value):
            own[path].append(leaf)
    return {path for path in {*found[0], *found[1]} if found[0].get(path) != found[1].get(path)}


def values(about):
    """Values for a test: the words of a choice, the example, and multiples of the example."""
    example = about["example"].split("=", 1)[1].strip()
    tried = [f'"{choice["word"]}"' for choice in about.get("choices", [])] + [example]
    if NUMBER.match(example):
        for factor in FACTORS:
            scaled = NUMBER.sub(lambda hit: f"{hit[1]}{float(hit[2].replace('_', '')) * factor:.12g}", example)
            tried.append(scaled)
    return tried + [word for word in ("true", "false") if about["type"].startswith(("true", "a truth", "\"true"))]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("--key", action="append")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    listed = subprocess.run([options.program, "schema", "scene", "--json"], capture_output=True, text=True, check=True)
    keys = json.loads(listed.stdout)
    bases = {scene: recipe(options.program, scene) for scene in SCENES}

    def of_key(key):
        paths = set()
        for value in values(keys[key]):
            for scene, base in bases.items():
                after = recipe(options.program, scene, f"{key}={value}")
                if after is not None:
                    paths |= moved(base, after)
        return key, sorted(paths)

    with ThreadPoolExecutor(2) as pool:
        moves = dict(pool.map(of_key, options.key or keys))
    for key, paths in moves.items():
        print(f"{key}: {', '.join(paths) or '-'}")
    by_value = defaultdict(list)
    for key, paths in moves.items():
        for path in paths:
            by_value[path].append(key)
    print("\nvalues that several keys change")
    for path, own in sorted(by_value.items()):
        if len(own) > 1:
            print(f"{path}: {', '.join(own)}")
    print("\nkeys without effect:", ", ".join(key for key, paths in moves.items() if not paths) or "-")
    if options.json:
        options.json.write_text(json.dumps(moves, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
