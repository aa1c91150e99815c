"""Who may import whom: no circle among modules, type-only imports included, and the layers of pyproject.toml."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import grimp
import pytest
from importlinter.cli import lint_imports

ROOT = Path(__file__).resolve().parents[2]


def circles(imports: Mapping[str, Collection[str]]) -> list[list[str]]:
    """Groups of modules that import each other, directly or around: the strongly connected components (Tarjan 1972)."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    path: list[str] = []
    found: list[list[str]] = []

    def visit(start: str) -> None:
        work: list[tuple[str, Iterator[str]]] = [(start, iter(imports[start]))]
        number[start] = lowest[start] = len(number)
        path.append(start)
        while work:
            module, others = work[-1]
            for other in others:
                if other not in number:
                    number[other] = lowest[other] = len(number)
                    path.append(other)
                    work.append((other, iter(imports[other])))
                    break
                if other in path:
                    lowest[module] = min(lowest[module], number[other])
            else:
                work.pop()
                if work:
                    lowest[work[-1][0]] = min(lowest[work[-1][0]], lowest[module])
                if lowest[module] == number[module]:
                    at = path.index(module)
                    group = sorted(path[at:])
                    del path[at:]
                    if len(group) > 1:
                        found.append(group)

    for module in sorted(imports):
        if module not in number:
            visit(module)
    return found


@pytest.fixture(scope="module")
def imports() -> dict[str, set[str]]:
    """What each module of both packages imports, also for its types only."""
    graph = grimp.build_graph("fric", "fric_nodes", cache_dir=None)
    return {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}


def test_no_modules_import_each_other(imports: dict[str, set[str]]) -> None:
    found = circles(imports)
    assert len(imports) > 300
    assert not found, "\n".join(" <-> ".join(group) for group in found)


def test_circles_are_noticed(imports: dict[str, set[str]]) -> None:
    assert circles({"a": ["b"], "b": ["c", "d"], "c": ["a"], "d": ["e"], "e": []}) == [["a", "b", "c"]]
    assert circles({**imports, "fric.errors": {"fric.model"}})


def test_the_layers_hold(capsys: pytest.CaptureFixture[str]) -> None:
    status = lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True, no_logo=True)
    assert status == 0, capsys.readouterr().out
