"""Draws sentences for a reader's test: from the README, the help of the commands, a report, and the docstrings.

Whoever hasn't seen the code reads each sentence alone and says what it means. ``python tests/docs/draw_sentences.py REPORT
[SEED]`` prints ten of each, where REPORT is the page of a diagnosis (``fric diagnose … --out FOLDER`` writes
``FOLDER/index.html``). The same seed draws the same sentences.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
EACH = 10
WORDS = 5  # a shorter piece is a heading or a cell of a table


class _Text(HTMLParser):
    """The text of a page, without scripts, styles and drawings."""

    def __init__(self) -> None:
        super().__init__()
        self.parts: list[str] = []
        self._hidden = 0

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag in ("script", "style", "svg", "pre", "table"):
            self._hidden += 1
        if tag in ("p", "li", "div", "h1", "h2", "h3"):
            self.parts.append("\n\n")

    def handle_endtag(self, tag: str) -> None:
        if tag in ("script", "style", "svg", "pre", "table"):
            self._hidden -= 1

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.parts.append(data)


def of_page(path: Path) -> str:
    """Text of an HTML page."""
    reader = _Text()
    reader.feed(path.read_text(encoding="utf-8"))
    return "".join(reader.parts)


def of_help() -> str:
    """Help of every command, as it is written at its function and its options."""
    from fric_nodes.cli import main

    texts: list[str] = []

    def collect(command: Any) -> None:
        texts.append(command.help or "")
        texts.extend(getattr(option, "help", None) or "" for option in command.params)
        for each in getattr(command, "commands", {}).values():
            collect(each)

    for verb in main.verbs():
        collect(main._loaded(verb))
    return "\n\n".join(texts)


def of_docstrings() -> str:
    """Docstrings of the library and the nodes."""
    texts = []
    for path in sorted((ROOT / "fric_nodes").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
                texts.append(ast.get_docstring(node) or "")
    return "\n\n".join(texts)


def of_markdown(path: Path) -> str:
    """Prose of a Markdown file: no code, no tables, links as their text."""
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return "\n".join("" if line.startswith(("|", "#")) else line for line in text.splitlines())


def sentences(text: str) -> Iterator[str]:
    """The sentences of ``text``."""
    for paragraph in re.split(r"\n\s*\n|\n\s*[-*]\s", text):
        joined = " ".join(paragraph.split())
        for each in re.split(r"(?<=[.!?:;])\s+(?=[A-Z`'\"])", joined):
            if len(each.split()) >= WORDS:
                yield each


def main() -> None:
    """Print the draw."""
    if len(sys.argv) < 2 or not Path(sys.argv[1]).is_file():
        sys.exit("give the page of a diagnosis, FOLDER/index.html, and if you like a seed")
    random = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    for title, text in (
        ("README", of_markdown(ROOT / "README.md")),
        ("--help", of_help()),
        ("report", of_page(Path(sys.argv[1]))),
        ("docstrings", of_docstrings()),
    ):
        found = sorted(set(sentences(text)))
        print(f"\n{title} ({len(found)} sentences)")
        for k in sorted(random.choice(len(found), min(EACH, len(found)), replace=False)):
            print(f"- {found[k]}")


if __name__ == "__main__":
    main()
