"""The site of these pages. `.ci/site` builds it: it copies MathJax from its npm package to docs/_static/mathjax, then runs Sphinx.

    sphinx-build -W --keep-going docs build/site
"""

import sys
import tomllib
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(SOURCES / "src" / "python"))

project = "fretwear"
author = "The fretwear developers"
release = tomllib.loads((SOURCES / "Cargo.toml").read_text(encoding="utf-8"))["package"]["version"]

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
exclude_patterns = ["_static", "data"]

# Directives stand in the index and in generated pages alone: a forge shows the other pages as they are.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "off"

# Backticks in the docstrings of the module are code.
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_format = "short"
autodoc_type_aliases = {name: name for name in ("Milestone", "Scene", "Value")}

# The site loads nothing from a network.
mathjax_path = "mathjax/tex-svg.js"
html_theme = "furo"
html_title = f"fretwear {release}"
html_static_path = ["_static"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
