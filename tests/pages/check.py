"""Checks the pages by their texts alone: what they name exists, what they quote is stored, and they are short.

    python tests/pages/check.py --program target/release/fretwear [--statistics] [PAGE…]

- Every key, command, option, table and file in code exists.
- Every quoted figure of docs/data/figures.csv stands on its page and equals the stored value to the digits that are quoted.
- Words and lengths of sentences are within the limits below. Code, tables, headings and lists of links do not count; every item of a
  list ends a sentence.
- Pages of Start and How to show a picture before their second heading.

Links, anchors and pictures are checked by Sphinx.
"""

import argparse
import json
import re
import shlex
import statistics
import subprocess
import sys
from functools import cache
from pathlib import Path

import blocks

ROOT, DOCS = blocks.ROOT, blocks.DOCS
HOW_TO, EXPLANATION, LONG, MOST_LONG = 700, 1500, 1600, 4
MEDIAN, LONGEST, SHARE = 16, 30, 0.05
# Folders of the sources that pages may name.
FOLDERS = ("src", "docs", "data", "pipelines", "schemas", "tests", ".ci", ".github")
FILE_ENDINGS = ("parquet", "csv", "md", "toml", "json", "rs", "py", "svg", "html", "pvd", "vtu", "inp", "mtx", "npz", "npy", "sh")


def hand_pages():
    """The pages that are written by hand."""
    by_hand = {DOCS / "reference" / name for name in ("formats.md", "glossary.md")}
    pages = [path for path in sorted(DOCS.rglob("*.md")) if path.parent.name != "reference" or path in by_hand]
    return [ROOT / "README.md", *pages]


def prose(text):
    """The sentences of a page."""
    text = re.sub(r"^(```|~~~).*?^\1.*?$", "\n", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^\$\$.*?^\$\$", "\n", text, flags=re.MULTILINE | re.DOTALL)
    paragraphs = []
    for line in text.splitlines():
        line = line.strip()
        if not line or line.startswith(("#", "|", "![", "<", ":::")):
            paragraphs.append("")
            continue
        item = re.match(r"(?:[-*]|\d+\.)\s+(.*)", line)
        if item:
            paragraphs += ["", item[1]]
        else:
            paragraphs[-1:] = [f"{paragraphs[-1]} {line}" if paragraphs else line]
    sentences = []
    for paragraph in paragraphs:
        paragraph = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", paragraph)
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", paragraph)
        # A list of links is no prose.
        if not plain.strip() or not re.sub(r"\[[^\]]*\]\([^)]*\)|[·,.|:–-]", "", paragraph).strip():
            continue
        # A formula and a piece of code count as a word.
        plain = re.sub(r"\$[^$]*\$|`[^`]*`", "X", plain)
        sentences += [each for each in re.split(r"(?<=[.!?:])[\"')*_]*\s+(?=[\"'(*_]*[A-Z0-9])", plain) if re.search(r"\w", each)]
    return sentences


def words(sentence):
    return len(re.findall(r"[\w%µ][\w'’.,/-]*", sentence))


@cache
def help_of(program, *command):
    done = subprocess.run([program, *command, "--help"], capture_output=True, text=True)
    return done.stdout if done.returncode == 0 else None


class Names:
    """What pages may name."""

    def __init__(self, program):
        self.program = str(program)

        def ask(*arguments):
            printed = subprocess.run([program, "schema", *arguments], check=True, capture_output=True, text=True).stdout
            return json.loads(printed)

        self.keys = set(ask("scene", "--json"))
        self.sections = {key.split(".")[0] for key in self.keys if "." in key}
        markdown = subprocess.run([program, "schema", "--markdown"], check=True, capture_output=True, text=True).stdout
        self.tables = set(re.findall(r"^## `(\w+)`$", markdown, re.MULTILINE))

    def wrong_command(self, line):
        """Why a command line cannot be given, or None."""
        try:
            given = shlex.split(line, comments=True)
        except ValueError:
            return None
        if not given or given[0] != "fretwear" or len(given) < 2 or given[1].startswith("-"):
            return None
        path = [given[1]]
        if given[1] == "campaign" and len(given) > 2 and given[2].isalpha() and given[2].islower():
            path.append(given[2])
        if path[0].isupper() or "…" in path[0]:
            return None
        text = help_of(self.program, *path)
        if text is None:
            return f"there is no command `fretwear {' '.join(path)}`"
        options = {each.split("=")[0] for each in given if re.match(r"--?[a-zA-Z]", each)}
        missing = [each for each in options if not re.search(rf"(?<![\w-]){re.escape(each)}(?![\w-])", text)]
        if missing:
            return f"`fretwear {' '.join(path)}` has no {', '.join(missing)}"
        sets = re.findall(r"--set[ =]\"?([a-z_][a-z_0-9.]*)=", line)
        unknown = [key for key in sets if key not in self.keys and not any(each.startswith(f"{key}.") for each in self.keys)]
        if unknown and not any(key.startswith(f"{each}.") for key in unknown for each in self.keys):
            return f"there is no key {unknown[0]}"
        return None

    def wrong_name(self, code):
        """Why a piece of code cannot be right, or None."""
        if code.startswith("fretwear "):
            return self.wrong_command(code)
        key = re.match(r"([a-z_]+(?:\.[a-z_0-9]+)+)(?: = .*|=.*)?$", code)
        if key and key[1].split(".")[0] in self.sections and key[1] not in self.keys:
            if not any(each.startswith(f"{key[1]}.") or key[1].startswith(f"{each}.") for each in self.keys):
                if key[1].rsplit(".", 1)[1] not in FILE_ENDINGS:
                    return f"there is no key {key[1]}"
        if re.fullmatch(r"[\w./-]+", code) and code.split("/")[0] in FOLDERS and "/" in code and not (ROOT / code).exists():
            return f"there is no file {code}"
        table = re.fullmatch(r"(\w+)\.parquet", code)
        if table and table[1] not in self.tables | {"history"} | self.others:
            return f"there is no table {table[1]}"
        return None

    # Tables beside those of a run.
    others = frozenset({"claims", "trade", "backbone", "figures", "bands", "sensitivity"})


def check_page(page, names):
    """What a page names that does not exist."""
    text = page.read_text(encoding="utf-8")
    name = page.relative_to(ROOT)
    faults = []
    for line, language, block in blocks.blocks(page):
        if language == "sh":
            for number, each in enumerate(block.replace("\\\n", " ").splitlines()):
                wrong = names.wrong_command(each.strip())
                # At a terminal the command would read the next lines of a pasted block as answers.
                if each.startswith("fretwear new ") and not re.search("--like|--set", each):
                    wrong = "`fretwear new` asks questions without --like or --set"
                if wrong:
                    faults.append(f"{name}:{line + 1 + number}: {wrong}")
    bare = re.sub(r"^```.*?^```$", lambda found: "\n" * found[0].count("\n"), text, flags=re.MULTILINE | re.DOTALL)
    for found in re.finditer(r"`([^`\n]+)`", bare):
        if wrong := names.wrong_name(found[1]):
            faults.append(f"{name}:{bare.count(chr(10), 0, found.start()) + 1}: {wrong}")
    if page.parent.name in ("start", "how_to"):
        first = re.split(r"^## ", text, maxsplit=1, flags=re.MULTILINE)[0]
        if "![" not in first:
            faults.append(f"{name}: no picture before the second heading")
    return faults


def check_figures():
    """Quoted figures that stand nowhere, or differ from what is stored."""
    faults = []
    for row in blocks.figure_rows():
        text = (ROOT / row["page"]).read_text(encoding="utf-8")
        if " ".join(row["text"].split()) not in " ".join(text.split()):
            faults.append(f"{row['page']}: does not have the figure {row['text']!r}")
            continue
        quoted = re.search(r"[−-]?\d[\d ]*(?:\.\d+)?(?:e[−-]?\d+)?", row["text"])[0].replace(" ", "").replace("−", "-")
        mantissa, _, exponent = quoted.partition("e")
        digits = len(mantissa.partition(".")[2])
        half = 0.5 * 10.0 ** (int(exponent or 0) - digits)
        # A whole number may be rounded to tens or hundreds.
        if not digits and not exponent:
            half *= 10.0 ** (len(mantissa) - len(mantissa.rstrip("0")))
        value = float(row["value"]) * float(row["scale"] or 1)
        if abs(float(quoted) - value) > half * 1.001:
            faults.append(f"{row['page']}: {row['text']!r} is stored as {value:.6g}")
    return faults


def check_lengths(pages, show):
    """Pages and sentences that are too long."""
    faults, all_lengths, long_pages, total = [], [], [], 0
    for page in pages:
        lengths = [words(each) for each in prose(page.read_text(encoding="utf-8"))]
        if not lengths:
            continue
        count, share = sum(lengths), sum(each > LONGEST for each in lengths) / len(lengths)
        name = page.relative_to(ROOT)
        most = HOW_TO if page.parent.name in ("how_to", "start") else EXPLANATION if page.parent.name == "trust" else None
        if count > LONG:
            long_pages.append(str(name))
        elif most and count > most:
            faults.append(f"{name}: {count} words of prose, at most {most}")
        if show:
            print(f"{name}: {count} words, median {statistics.median(lengths):g}, {100 * share:.0f} % over {LONGEST}")
        total += page.stat().st_size
        all_lengths += lengths
    if len(long_pages) > MOST_LONG:
        faults.append(f"{len(long_pages)} pages have more than {LONG} words: {', '.join(long_pages)}; at most {MOST_LONG} may")
    share = sum(each > LONGEST for each in all_lengths) / len(all_lengths)
    median = statistics.median(all_lengths)
    print(f"{len(pages)} pages, {total / 1000:.0f} kB, {len(all_lengths)} sentences: median {median:g} words, {100 * share:.1f} % over {LONGEST}")
    if median > MEDIAN or share > SHARE:
        faults.append(f"sentences: at most a median of {MEDIAN} words and {100 * SHARE:.0f} % over {LONGEST}")
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=Path, required=True)
    parser.add_argument("--statistics", action="store_true")
    parser.add_argument("pages", type=Path, nargs="*")
    given = parser.parse_args()
    pages = [page.resolve() for page in given.pages] or hand_pages()
    names = Names(given.program.resolve())
    faults = [fault for page in pages for fault in check_page(page, names)]
    faults += check_figures() + check_lengths(pages, given.statistics)
    for fault in faults:
        print(f"FAILED {fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
