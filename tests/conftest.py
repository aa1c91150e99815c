"""What all tests share: those on published recordings run where the recordings are, and say so where they are not."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

_REASON = (
    "tests on published recordings need the environment variable FRIC_DATA (the folder that holds emps/, tiago_torso/, ...)"
)
_LEFT_OUT = pytest.StashKey[int]()


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "real_data: reads published recordings from the folder FRIC_DATA")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    left_out = [item for item in items if item.get_closest_marker("real_data")]
    if left_out and not os.environ.get("FRIC_DATA"):
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("real_data")]
        config.stash[_LEFT_OUT] = len(left_out)


def pytest_sessionfinish(session: pytest.Session) -> None:
    if hasattr(session.config, "workeroutput"):  # a process of pytest-xdist: the one that reports collects nothing
        session.config.workeroutput["left_out"] = session.config.stash.get(_LEFT_OUT, 0)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    node.config.stash[_LEFT_OUT] = getattr(node, "workeroutput", {}).get("left_out", 0)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    count = config.stash.get(_LEFT_OUT, 0)
    if count:
        terminalreporter.write_line(f"{count} tests deselected: {_REASON}")


@pytest.fixture
def data_folder() -> Path:
    """The folder of published recordings."""
    return Path(os.environ["FRIC_DATA"])
