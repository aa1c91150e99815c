"""A graph of node processes: started, watched, stopped, and their words kept.

Nodes are children of this process, each an interpreter of its own, on a ROS domain of their own that doesn't leave this
machine. A child that ends early with an error, or hangs, ends the run with its last words; whatever happens, no child
outlives the graph.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType

from fric.errors import InputError

__all__ = ["Graph", "GraphError", "NodeSetup"]

_STOP_TIME = 15.0  # [s] that a node has to end after SIGINT


class GraphError(InputError):
    """A node process that ended, or didn't end, as it should."""


class NodeSetup:
    """One node: its executable's name and its parameters.

    Args:
        name: executable, also the default name of the node.
        parameters: values by name; strings, numbers, booleans or lists of strings.
        params_file: a ROS parameter file read first.
    """

    def __init__(self, name: str, parameters: Mapping[str, object], params_file: Path | None = None) -> None:
        self.name = name
        self.parameters = dict(parameters)
        self.params_file = params_file

    def command(self) -> list[str]:
        """The command line that starts it."""
        line = [sys.executable, "-m", f"fric_nodes.nodes.{self.name}", "--ros-args"]
        if self.params_file is not None:
            line += ["--params-file", str(self.params_file)]
        for key, value in self.parameters.items():
            line += ["-p", f"{key}:={_as_yaml(value)}"]
        return line


def _as_yaml(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        # With a decimal point in the mantissa, or YAML reads an integer or a string and ROS refuses the type.
        mantissa, exponent, power = repr(value).partition("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.0'}{exponent}{power}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_as_yaml(entry) for entry in value) + "]"
    return str(value)


class Graph:
    """Running node processes; a context manager.

    Args:
        nodes: started in this order.
        logs: folder for what they print, one file each.
        domain: ROS domain id.
    """

    def __init__(self, nodes: Sequence[NodeSetup], logs: Path, domain: int) -> None:
        self._nodes = nodes
        self._logs = logs
        self._environment = os.environ | {
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "PYTHONUNBUFFERED": "1",
        }
        self._children: dict[str, subprocess.Popen[bytes]] = {}

    def __enter__(self) -> Graph:
        self._logs.mkdir(parents=True, exist_ok=True)
        try:
            for node in self._nodes:
                self.start(node)
        except BaseException:
            self._kill()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is None:
            self.stop()
        self._kill()

    @property
    def processes(self) -> dict[str, int]:
        """Number of the process of each node."""
        return {name: child.pid for name, child in self._children.items()}

    def start(self, node: NodeSetup) -> None:
        """Start one more node."""
        with (self._logs / f"{node.name}.log").open("wb") as log:
            self._children[node.name] = subprocess.Popen(
                node.command(), stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, env=self._environment
            )

    def wait_for_text(self, name: str, text: str, timeout: float) -> None:
        """Wait until the node ``name`` has printed ``text``.

        Raises:
            GraphError: a node failed, or ``timeout`` [s] passed.
        """
        end = time.monotonic() + timeout
        while text not in self.text_of(name):
            self.check()
            if time.monotonic() > end:
                raise GraphError(
                    name, f"did not come to '{text}' within {timeout:.0f} s", f"its last words: {self._last_words(name)}"
                )
            time.sleep(0.02)

    def wait_for(self, name: str, timeout: float) -> None:
        """Wait until the node ``name`` ends by itself.

        Raises:
            GraphError: it, or another node, failed, or ``timeout`` [s] passed.
        """
        end = time.monotonic() + timeout
        while self._children[name].poll() is None:
            self.check()
            if time.monotonic() > end:
                raise GraphError(
                    name, f"did not finish within {timeout:.0f} s", f"see {self._logs / name}.log. {self._last_words(name)}"
                )
            time.sleep(0.02)
        if self._children[name].returncode != 0:
            self._failed(name)

    def run_for(self, duration: float) -> None:
        """Let the graph run for ``duration`` [s]."""
        end = time.monotonic() + duration
        while time.monotonic() < end:
            self.check()
            time.sleep(0.05)

    def check(self) -> None:
        """Raise when a node has ended with an error."""
        for name, child in self._children.items():
            if child.poll() not in (None, 0):
                self._failed(name)

    def stop(self) -> None:
        """Stop every node with SIGINT, the one started last first, and wait for all.

        Raises:
            GraphError: a node didn't end cleanly.
        """
        for child in reversed(self._children.values()):
            if child.poll() is None:
                child.send_signal(signal.SIGINT)
        end = time.monotonic() + _STOP_TIME
        for name, child in self._children.items():
            try:
                child.wait(max(end - time.monotonic(), 0.1))
            except subprocess.TimeoutExpired:
                raise GraphError(name, f"did not stop within {_STOP_TIME:.0f} s of SIGINT", self._last_words(name)) from None
            if child.returncode != 0:
                self._failed(name)

    def text_of(self, name: str) -> str:
        """What the node has printed so far."""
        return (self._logs / f"{name}.log").read_text(encoding="utf-8", errors="replace")

    def _failed(self, name: str) -> None:
        code = self._children[name].returncode
        raise GraphError(f"node {name}", f"ended with status {code}", f"its last words: {self._last_words(name)}")

    def _last_words(self, name: str) -> str:
        lines = [line for line in self.text_of(name).splitlines() if line.strip()]
        return lines[-1] if lines else "none"

    def _kill(self) -> None:
        for child in self._children.values():
            if child.poll() is None:
                child.kill()
                child.wait()
