"""Evaluates the Polars queries below the figures of reports, in the folder to which their paths are relative.

    queries.py FOLDER REPORT.html…

The script needs Polars.
"""

import os
import re
import sys
from html import unescape
from pathlib import Path

import polars as pl


def rows(result):
    frames = result.values() if isinstance(result, dict) else [result]
    return min(frame.height for frame in frames)


def main():
    reports = [Path(name).resolve() for name in sys.argv[2:]]
    os.chdir(sys.argv[1])
    for report in reports:
        text = report.read_text(encoding="utf-8")
        figures = re.findall(r'<figure id="([^"]+)">', text)
        queries = re.findall(r'<p class="data">.*<code>([^<]*pl\.[^<]*)</code></p>', text)
        assert len(queries) == len(figures) > 0, f"{report}: {len(queries)} queries for {len(figures)} figures"
        for figure, query in zip(figures, map(unescape, queries)):
            assert rows(eval(query, {"pl": pl})) > 0, f"{figure}: the query {query} gives no rows"
        print(f"{report}: {len(queries)} queries give rows")


if __name__ == "__main__":
    main()
