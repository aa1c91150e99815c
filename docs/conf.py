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

# Names in the fields of a docstring ("position", "Finding") may have several targets; each is still a link to one of them.
suppress_warnings = ["ref.python"]

_MARKUP = re.compile(r"(``.*?``|\*\*[^*]+\*\*|\*[^*\s][^*]*\*(?=\W|$)|:[\w:]+:`[^`]*`)")


def _as_markup(app: object, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Equations in docstrings are plain text: indented ones become literal blocks, signs within a line are no markup."""
    found: list[str] = []
    literal = False
    for line in lines:
        indented = line.startswith("    ")
        if what == "module" and indented and not literal and found and not found[-1].strip():
            last = next((before for before in reversed(found) if before.strip()), "")
            literal = not last.startswith((" ", "-", "*", ".. ", ":")) or last.endswith("::")
            if literal and not last.endswith("::"):
                found += ["::", ""]
        elif line.strip() and not indented:
            literal = False
        if not indented:
            parts = _MARKUP.split(line)
            parts[::2] = [re.sub(r"(?<![\\`])([*|])", r"\\\1", part) for part in parts[::2]]
            line = "".join(parts)  # noqa: PLW2901
        found.append(line)
    lines[:] = found


def setup(app: object) -> None:
    """Connect the treatment of equations."""
    app.connect("autodoc-process-docstring", _as_markup)  # type: ignore[attr-defined]
