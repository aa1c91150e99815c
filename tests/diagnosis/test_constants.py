"""The diagnosis gets no more numbers of its own, and each says why it is what it is."""

from __future__ import annotations

import ast
from pathlib import Path

import fric.diagnosis

MOST = 255
"""What there are now; a change that takes some away lowers it."""


def numbers(node: ast.expr) -> int:
    """How many numbers are written in an expression."""
    return sum(isinstance(each, ast.Constant) and type(each.value) in (int, float) for each in ast.walk(node))


def constants() -> list[tuple[str, int, str]]:
    """File, line and name of every number that a module of the diagnosis, its examination aside, gives a name to."""
    found = []
    root = Path(fric.diagnosis.__file__).parent
    for path in sorted([*root.glob("*.py"), *root.glob("additive/*.py")]):
        for each in ast.parse(path.read_text(encoding="utf-8")).body:
            named = isinstance(each, (ast.Assign, ast.AnnAssign)) and each.value is not None
            if named and numbers(each.value):  # type: ignore[union-attr, arg-type]
                target = each.targets[0] if isinstance(each, ast.Assign) else each.target  # type: ignore[union-attr]
                found.append((path.name, each.lineno, ast.unparse(target)))
    return found


def test_there_are_no_more_of_them() -> None:
    assert len(constants()) <= MOST


def test_each_says_why() -> None:
    root = Path(fric.diagnosis.__file__).parent
    bare = []
    for name, line, target in constants():
        path = next(iter([*root.glob(name), *root.glob(f"additive/{name}")]))
        lines = path.read_text(encoding="utf-8").splitlines()
        around = [lines[line - 2], lines[line - 1], *lines[line : line + 2]]
        if not any("#" in each or '"""' in each for each in around):
            bare.append(f"{name}:{line} {target}")
    assert not bare, "\n".join(bare)
