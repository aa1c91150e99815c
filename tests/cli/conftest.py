"""What the tests of the command share: the command itself, in this process or in one of its own."""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
from collections.abc import Callable
from unittest import mock

import pytest
from fric_nodes.cli.main import main

Command = Callable[..., "subprocess.CompletedProcess[str]"]


def _within(*arguments: object) -> subprocess.CompletedProcess[str]:
    words = ["fric", *map(str, arguments)]
    out, error = io.StringIO(), io.StringIO()
    status: object = 0
    with mock.patch.object(sys, "argv", words), contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        try:
            main()
        except SystemExit as end:
            status = end.code or 0
    assert isinstance(status, int)
    return subprocess.CompletedProcess(words, status, out.getvalue(), error.getvalue())


def _apart(*arguments: object) -> subprocess.CompletedProcess[str]:
    code = "from fric_nodes.cli.main import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True, timeout=110, check=False
    )


def _refused(done: subprocess.CompletedProcess[str]) -> str:
    assert done.returncode == 2, done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("fric:")]
    assert len(lines) == 1, done.stderr
    assert "Traceback" not in done.stderr
    return lines[0]


@pytest.fixture(scope="session")
def fric() -> Command:
    """The command, called in this process: what it imports and compiles is there at the next call."""
    return _within


@pytest.fixture(scope="session")
def fric_apart() -> Command:
    """The command in a process of its own, as a shell would start it."""
    return _apart


@pytest.fixture(scope="session")
def refusal() -> Callable[..., str]:
    """The one line with which the command refuses its arguments."""
    return lambda *arguments: _refused(_within(*arguments))
