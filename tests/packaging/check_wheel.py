"""Checks the contents of a wheel: its tag, licence texts, long description and metadata.

    python tests/packaging/check_wheel.py WHEEL [--tag manylinux_2_17_x86_64]
"""

import argparse
import email
import sys
import zipfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import readme  # noqa: E402

# A wheel must contain a text of each of these licences of the dependencies (SPDX names).
LICENCES = ["MIT License", "Apache License", "BSD 3-Clause", "zlib License"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--tag", help="platform tag that the wheel must have")
    given = parser.parse_args()
    name = given.wheel.name
    if given.tag:
        tags = name.removesuffix(".whl").split("-")[-1].split(".")
        assert given.tag in tags, f"{name} has no tag {given.tag}"
    with zipfile.ZipFile(given.wheel) as wheel:
        files = wheel.namelist()
        texts = {file: wheel.read(file).decode() for file in files if ".dist-info/" in file}
    metadata = email.message_from_string(next(text for file, text in texts.items() if file.endswith("/METADATA")))
    licences = {Path(file).name: text for file, text in texts.items() if "/licenses/" in file}
    assert {"LICENSE", "THIRD_PARTY_LICENSES.md"} <= licences.keys(), f"{name} has the licence texts {sorted(licences)}"
    missing = [licence for licence in LICENCES if licence not in licences["THIRD_PARTY_LICENSES.md"]]
    assert not missing, f"the third-party licences lack {missing}"
    assert metadata["License-Expression"] == "MIT", metadata["License-Expression"]
    for field in ("Summary", "Keywords", "Requires-Python", "Classifier"):
        assert metadata[field], f"{name} has no {field}"
    relative = readme.relative_links(metadata.get_payload())
    assert not relative, f"the long description has links that no package index resolves: {relative}"
    programs = [file for file in files if file.split("/")[-1] in ("fretwear", "fretwear.exe")]
    assert len(programs) == 1, programs
    print(f"{name}: tag, licences, metadata and links are correct")


if __name__ == "__main__":
    main()
