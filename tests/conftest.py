"""What all tests share: what is left out unless it is asked for, those that take long or need recordings, and is said to be."""

from __future__ import annotations

import contextlib
import faulthandler
import fcntl
import os
import tempfile
import threading
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any, NamedTuple, TextIO

import pytest
from fric.threads import keep_linear_algebra_in_one
from hypothesis import HealthCheck, settings

# How long it takes to draw an example says more about what else the machine does than about what is tested.
settings.register_profile("fric", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("fric")

_BEYOND = 600.0  # [s] after a test's own time limit
_STDERR = pytest.StashKey[TextIO]()
_LEFT_OUT = pytest.StashKey[dict[str, int]]()


class _Kind(NamedTuple):
    """Tests that run when they are asked for."""

    about: str
    asked: Callable[[pytest.Config], bool]
    how: str


_KINDS = {
    "real_data": _Kind(
        "reads published recordings from the folder FRIC_DATA",
        lambda _: bool(os.environ.get("FRIC_DATA")),
        "set the environment variable FRIC_DATA to the folder that holds emps/, tiago_torso/, ...",
    ),
    "long": _Kind("among the slowest", lambda config: bool(config.getoption("--long")), "give --long"),
}


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="also the slowest tests")


def pytest_configure(config: pytest.Config) -> None:
    keep_linear_algebra_in_one()  # as every command and node does; several tests run at a time
    config.stash[_STDERR] = os.fdopen(os.dup(2), "w")  # while it isn't captured yet
    config.addinivalue_line("markers", "alone: measures time, or runs in it: no other test at the same time")
    for name, kind in _KINDS.items():
        config.addinivalue_line("markers", f"{name}: {kind.about}")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    count: dict[str, int] = {}
    for name, kind in _KINDS.items():
        left_out = [item for item in items if item.get_closest_marker(name)]
        if left_out and not kind.asked(config):
            config.hook.pytest_deselected(items=left_out)
            items[:] = [item for item in items if not item.get_closest_marker(name)]
            count[name] = len(left_out)
    config.stash[_LEFT_OUT] = count


def pytest_unconfigure(config: pytest.Config) -> None:
    config.stash[_STDERR].close()


def pytest_sessionfinish(session: pytest.Session) -> None:
    if hasattr(session.config, "workeroutput"):  # a process of pytest-xdist: the one that reports collects nothing
        session.config.workeroutput["left_out"] = session.config.stash.get(_LEFT_OUT, {})


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    node.config.stash[_LEFT_OUT] = getattr(node, "workeroutput", {}).get("left_out", {})


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    for name, count in config.stash.get(_LEFT_OUT, {}).items():
        terminalreporter.write_line(f"{count} tests left out ({_KINDS[name].about}): to run them, {_KINDS[name].how}")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Where several processes test at once, those tests that need the machine for themselves wait for all others to stop."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        with _no_hang(item):
            return (yield)
    # Who waits to be alone holds the gate meanwhile, or the others would never all have stopped.
    gate, room = (Path(tempfile.gettempdir()) / f"fric-test-{name}-{os.getuid()}.lock" for name in ("gate", "room"))
    with gate.open("w") as waiting, room.open("w") as running:
        fcntl.flock(waiting, fcntl.LOCK_EX)
        fcntl.flock(running, fcntl.LOCK_EX if item.get_closest_marker("alone") else fcntl.LOCK_SH)
        fcntl.flock(waiting, fcntl.LOCK_UN)
        with _no_hang(item):
            return (yield)


@contextlib.contextmanager
def _no_hang(item: pytest.Item) -> Iterator[None]:
    """End the process, and say where it stood, when a test's own time limit was not able to end it.

    A signal does not reach what waits in compiled code, and after a test has failed nothing limits what tidies up behind it.
    """

    def end() -> None:
        stream = item.config.stash[_STDERR]
        print(f"\n{item.nodeid} does not end:", file=stream, flush=True)
        faulthandler.dump_traceback(stream)
        os._exit(1)

    own = item.get_closest_marker("timeout")
    guard = threading.Timer(_BEYOND + float(own.args[0] if own else item.config.getini("timeout")), end)
    guard.daemon = True
    guard.start()
    try:
        yield
    finally:
        guard.cancel()


@pytest.fixture
def data_folder() -> Path:
    """The folder of published recordings."""
    return Path(os.environ["FRIC_DATA"])
