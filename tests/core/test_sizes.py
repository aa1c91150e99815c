"""No function over 60 lines outside compiled kernels, no file over 400, no node over 150; ruff counts the rest."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LINES_OF_A_FUNCTION = 60
LINES_OF_A_FILE = 400
LINES_OF_A_NODE = 150
COMPILED = {"compiled", "compiled_loop", "kernel", "loop", "njit"}
"""Decorators of :mod:`fric.engine.kernel` and numba: what they compile is one piece, since a call would cost time."""


def files() -> list[Path]:
    folders = ("fric_nodes", "fric_interfaces", "tests", "docs")
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py")) if "__pycache__" not in path.parts]


def compiled(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    for decorator in function.decorator_list:
        called = decorator.func if isinstance(decorator, ast.Call) else decorator
        name = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
        if name in COMPILED:
            return True
    return False


def too_long(path: Path) -> Iterator[str]:
    """What is over a limit in a file."""
    text = path.read_text(encoding="utf-8")
    name, lines = path.relative_to(ROOT).as_posix(), len(text.splitlines())
    limit = LINES_OF_A_NODE if path.parent == ROOT / "fric_nodes/fric_nodes/nodes" else LINES_OF_A_FILE
    if lines > limit:
        yield f"{name}: {lines} lines, at most {limit}"
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not compiled(node):
            length = (node.end_lineno or 0) - node.lineno + 1
            if length > LINES_OF_A_FUNCTION:
                yield f"{name}:{node.lineno} {node.name}: {length} lines, at most {LINES_OF_A_FUNCTION}"


def test_files_and_functions_are_short() -> None:
    found = [line for path in files() for line in too_long(path)]
    assert not found, "\n".join(found)


def test_a_long_function_and_a_long_file_are_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    body = "\n    a = 1" * LINES_OF_A_FUNCTION
    text = f"def long():{body}\n\n\n@kernel\ndef fast():{body}\n\n\n@njit(cache=True)\ndef faster():{body}\n"
    path = tmp_path / "some.py"
    path.write_text(text)
    assert list(too_long(path)) == ["some.py:1 long: 61 lines, at most 60"]
    path.write_text("a = 1\n" * 401)
    assert list(too_long(path)) == ["some.py: 401 lines, at most 400"]
