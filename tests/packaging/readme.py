"""Writes the README for package indexes: links and pictures become absolute, or plain text if the address of the sources is unknown.

    python tests/packaging/readme.py README.md --version 0.1.0 [--repository https://…] --output FILE
"""

import argparse
import re
from pathlib import Path

# Markdown link or picture whose target is a file of the sources.
LINK = re.compile(r"(?P<picture>!?)\[(?P<text>[^\]]*)\]\((?P<target>(?!https?://|#)[^)]+)\)")


def absolute(text, repository, version):
    """Returns the text with links to a tag of the repository."""

    def link(found):
        if not repository:
            return "" if found["picture"] else found["text"]
        kind = "raw" if found["picture"] else "blob"
        return f"{found['picture']}[{found['text']}]({repository.rstrip('/')}/{kind}/v{version}/{found['target']})"

    return re.sub(r"\n{3,}", "\n\n", LINK.sub(link, text))


def relative_links(text):
    """Returns link targets that a package index cannot resolve."""
    return [found["target"] for found in LINK.finditer(text)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("readme", type=Path)
    parser.add_argument("--version", required=True)
    parser.add_argument("--repository", default="", help="address of the sources; without it, links become text")
    parser.add_argument("--output", type=Path, required=True)
    given = parser.parse_args()
    text = absolute(given.readme.read_text(encoding="utf-8"), given.repository, given.version)
    assert not relative_links(text)
    given.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
