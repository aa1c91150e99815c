"""What the tests of nodes share: a graph of their own for every test, over the real middleware, without launch files."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from fric_nodes.cli.env import variables
from fric_nodes.domain import reserved_domain
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.client import Client
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

NodeT = TypeVar("NodeT", bound=Node)
LIMIT = 90.0  # [s] generous: a wait ends when its condition holds, and the machine may be busy
_ROOT = Path(__file__).resolve().parents[2]
_ASK_AGAIN = 5.0  # [s]


class Graph:
    """Nodes, executors and processes in one ROS domain that nothing else on this machine uses meanwhile."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._reserved = contextlib.ExitStack()
        self.domain = self._reserved.enter_context(reserved_domain())
        self.environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(self.domain),
            "ROS_LOG_DIR": str(folder / "log"),
            "PYTHONFAULTHANDLER": "1",
        }
        self._contexts: list[Context] = []
        self._executors: list[tuple[Executor, threading.Thread]] = []
        self._processes: list[subprocess.Popen[str]] = []
        self._nodes: list[Node] = []
        self._closing = False

    def context(self, *args: str) -> Context:
        """A context of its own, initialised with ROS arguments such as ``-r a:=b``."""
        context = Context()
        rclpy.init(context=context, domain_id=self.domain, args=["--ros-args", *args] if args else [])
        self._contexts.append(context)
        return context

    def node(self, name: str, **options: Any) -> Node:
        """A plain node of the test."""
        return self.owns(Node(name, context=self.context(), **options))

    def owns(self, node: NodeT) -> NodeT:
        """Destroy ``node`` when the test ends, after the executors."""
        self._nodes.append(node)
        return node

    def model_change(self, node: Node) -> ModelChange:
        """What lets the plant's model be exchanged while it runs."""
        return ModelChange(self, node)

    def spin(self, *nodes: Node, kind: Callable[..., Executor] = SingleThreadedExecutor) -> None:
        """Serve ``nodes`` from a thread until the test ends."""
        executor = kind(context=nodes[0].context)
        for node in nodes:
            executor.add_node(node)

        def work() -> None:
            try:
                with contextlib.suppress(ExternalShutdownException):
                    # Without a limit of its own the events executor of rclpy 7.1 waits for ever.
                    while kind is EventsExecutor and not self._closing:
                        executor.spin_once(timeout_sec=0.1)
                    if kind is not EventsExecutor:
                        executor.spin()
            except (AttributeError, InvalidHandle):
                # rclpy's shutdown may take the guards away while the last wait is being set up, or a last callback ends.
                if not self._closing:
                    raise

        thread = threading.Thread(target=work, name=f"spin-{nodes[0].get_name()}")
        thread.start()
        self._executors.append((executor, thread))

    def start(self, *args: str, **options: Any) -> subprocess.Popen[str]:
        """``python ARGS`` as a process in this domain; its output is text, both streams piped."""
        return self.execute(sys.executable, *args, **options)

    def execute(self, *command: str, **options: Any) -> subprocess.Popen[str]:
        """``command`` as a process in this domain, which leads a group of its own; its output is text, both streams piped."""
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        kept = {"env": self.environment, "cwd": self.folder, "start_new_session": True}
        process = subprocess.Popen(command, **{**pipes, **kept, **options})
        self._processes.append(process)
        return process

    def start_node(self, name: str, **parameters: object) -> subprocess.Popen[str]:
        """One of fric's nodes as a process, with ROS parameters."""
        pairs = [item for key, value in parameters.items() for item in ("-p", f"{key}:={value}")]
        return self.start("-m", f"fric_nodes.nodes.{name}", "--ros-args", *pairs)

    @staticmethod
    def until(condition: Callable[[], object], what: str, limit: float = LIMIT) -> None:
        """Wait until ``condition`` holds, and fail with ``what`` when it doesn't within ``limit`` [s]."""
        deadline = time.monotonic() + limit
        while not condition():
            if time.monotonic() > deadline:
                pytest.fail(f"not within {limit:g} s: {what}")
            time.sleep(0.01)

    def meet(self, *nodes: Node) -> None:
        """Wait until the publishers and subscriptions of ``nodes`` know each other, from both sides.

        Either side may know of the other first; what is published until then is lost without a word.
        """

        def have_met() -> bool:
            publishers = [publisher for node in nodes for publisher in node.publishers]
            subscriptions = [subscription for node in nodes for subscription in node.subscriptions]
            heard = Counter(each.topic_name for each in publishers)
            hearing = Counter(each.topic_name for each in subscriptions)
            return all(each.get_subscription_count() >= hearing[each.topic_name] for each in publishers) and all(
                each.get_publisher_count() >= heard[each.topic_name] for each in subscriptions
            )

        self.until(have_met, f"{', '.join(node.get_name() for node in nodes)} have met")

    def ask(self, client: Client, request: Any, whom: str, process: subprocess.Popen[str] | None = None) -> Any:
        """The answer to ``request``, which may be asked twice: of nodes that have only just met, a request can be lost.

        Where none comes, what ``process`` has said, and where each of its threads is, is the failure's text.
        """
        futures = []
        deadline = time.monotonic() + LIMIT
        while time.monotonic() < deadline and (process is None or process.poll() is None):
            futures.append(client.call_async(request))
            again = min(time.monotonic() + _ASK_AGAIN, deadline)
            while time.monotonic() < again:
                answers = [future.result() for future in futures if future.done()]
                if answers:
                    return answers[0]
                time.sleep(0.01)
        said = self.finish(process, signal.SIGABRT) if process is not None else ""
        pytest.fail(f"no answer of {whom} within {LIMIT:g} s, asked {len(futures)} times: {said}")

    @staticmethod
    def finish(process: subprocess.Popen[str], number: int | None = None, limit: float = LIMIT) -> tuple[int, str, str]:
        """Send signal ``number`` if given, wait for the end: exit status, standard output, standard error."""
        if number is not None:
            process.send_signal(number)
        out, error = process.communicate(timeout=limit)
        return process.returncode, out or "", error or ""

    def close(self) -> None:
        """End everything, in an order in which nothing is used after it is gone."""
        self._closing = True
        for process in self._processes:
            # What a process has started holds its streams open, too.
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.communicate(timeout=LIMIT)
        for executor, thread in self._executors:
            executor.shutdown(timeout_sec=5.0)
            thread.join(timeout=10.0)
            assert not thread.is_alive(), f"{thread.name} does not end"
        for node in self._nodes:
            node.destroy_node()
        for context in self._contexts:
            context.try_shutdown()
        self._reserved.close()


class ModelChange:
    """Exchanges the model in a running plant, and gets the plant's own time of it, which no sender or listener knows.

    Args:
        graph: has one plant.
        node: asks, and hears; served from a thread that begins after this.
    """

    def __init__(self, graph: Graph, node: Node) -> None:
        self._graph = graph
        self._since: list[float] = []  # [s]
        self._client = node.create_client(SetParameters, "plant/set_parameters")
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_report, 10)

    def _on_report(self, report: DiagnosticArray) -> None:
        for status in report.status:
            self._since.extend(float(pair.value) for pair in status.values if pair.key == "model since [s]")

    def to(self, model_file: Path) -> float:
        """Let the plant move by another model, and give the stamp [s] of its last state before that."""
        assert self._client.wait_for_service(timeout_sec=30.0)
        self._graph.until(lambda: self._since, "the plant's report")
        before = self._since[-1]
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=str(model_file))
        request = SetParameters.Request(parameters=[Parameter(name="model_file", value=value)])
        assert self._graph.ask(self._client, request, "the plant").results[0].successful
        self._graph.until(lambda: self._since[-1] > before, "the time of the change")
        return self._since[-1]


@pytest.fixture
def graph(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Graph]:
    """A graph of this test alone."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    graph = Graph(tmp_path)
    yield graph
    graph.close()


@pytest.fixture
def quick_switches() -> Iterator[None]:
    """rclpy's multi-threaded executor spins while a callback runs, and hands the interpreter over at this interval only."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-4)
    yield
    sys.setswitchinterval(usual)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder like the root of the source tree, with the commands that a shell would find."""
    folder = tmp_path / "tree"
    folder.mkdir()
    for name in ("config", "bags"):
        shutil.copytree(_ROOT / name, folder / name)
    tools = tmp_path / "tools"
    tools.mkdir()
    if shutil.which("ros2") is None:
        stand_in = tools / "ros2"
        stand_in.write_text(
            '#!/bin/sh\n[ "$1 $2" = "run fric_nodes" ] || exit 3\nshift 2\nexec fric node "$@"\n', encoding="utf-8"
        )
        stand_in.chmod(0o755)
    return folder


@pytest.fixture
def path_of_shell(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment's own commands first, then those of the test; what ``fric env`` sets, for a real ``ros2``."""
    for name, value in variables(Path(sys.prefix), os.environ).items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv(
        "PATH", os.pathsep.join([str(Path(sys.executable).parent), str(place.parent / "tools"), os.environ["PATH"]])
    )
