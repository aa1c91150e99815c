"""Sphinx configuration of this site: ``sphinx-build -W --keep-going docs docs/_build``."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "fric_nodes"))  # the API pages describe this tree, not an installed one

import fric  # noqa: E402

project = "fric"
author = "fric maintainers"
copyright = author
version = release = fric.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"fric {release}"

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings say what arguments are, with their units
autodoc_default_options = {"members": True, "show-inheritance": False}
napoleon_use_ivar = True
napoleon_use_rtype = False

_EQUATION_SIGNS = re.compile(r"(?<![\\`])([*|])")


def _escape(app: object, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Equations in docstrings are plain text: their bars and stars are signs, not markup."""
    for number, line in enumerate(lines):
        parts = re.split(r"(``.*?``|\*\*[^*]+\*\*|\*[^*\s][^*]*\*(?=\W|$)|:\w+:`[^`]*`)", line)
        lines[number] = "".join(
            part if index % 2 or line.startswith("    ") else _EQUATION_SIGNS.sub(r"\\\1", part)
            for index, part in enumerate(parts)
        )


def setup(app: object) -> None:
    """Connect the escaping of equations."""
    app.connect("autodoc-process-docstring", _escape)  # type: ignore[attr-defined]
