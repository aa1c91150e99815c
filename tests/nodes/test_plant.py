"""The plant node with every plant there is: same numbers as the core alone, its signals beside the states, same bag again."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from fric.axis import SimulatedAxis
from fric.bagio import iterate_raw, read_record
from fric.excitation import EXCITATIONS
from fric.excitation.sequence import Sequence
from fric.model_file import read_model
from fric.plants import PLANTS
from fric_nodes.nodes.excitation import ExcitationNode
from fric_nodes.nodes.plant import PlantNode
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from fric_interfaces.msg import StampedForce

if TYPE_CHECKING:
    from .conftest import Graph

CONFIG = Path(__file__).resolve().parents[2] / "config"
MODELS = sorted(
    path.name for path in CONFIG.glob("*.yaml") if re.search("^format: fric-model/1", path.read_text(), re.MULTILINE)
)
WITH_SIGNALS = "quarter_car_model.yaml"
H = 0.001
SAMPLES = 250
DEEP = QoSProfile(depth=20_000)
PUSH = {"duration": 1.0, "ramp": 0.2, "frequency_low": 1.0, "frequency_high": 8.0, "speed": 1e4}
SENSOR = {"resolution": 1e-9, "position_noise": 1e-8, "readings": 3, "force_noise": 0.05, "seed": 7}


def _size(file: str) -> float:
    """A command that does something to the axis, and no harm."""
    command = read_model(CONFIG / file).plant.command
    return 5.0 if command.dimension == "F" else 0.05


def _expected(file: str, n_samples: int) -> dict[str, np.ndarray]:
    """Position, effort and signals at each sample by the core alone."""
    kind = EXCITATIONS["multisine"]
    values: dict[str, Any] = {p.name: p.default for p in kind.parameters}
    plan = kind.part({**values, **PUSH, "amplitude": _size(file)}, {}, np.random.default_rng(5))
    force = Sequence([plan], delay=0.02).at(np.arange(n_samples) * H).position
    axis = SimulatedAxis(read_model(CONFIG / file), **SENSOR)
    axis.advance(0.0, 1e-12)
    axis.measure()
    rows = []
    for command in force.tolist():
        state = axis.measure()
        rows.append((state.position, state.effort, *axis.signals()))
        axis.advance(command, H)
    return dict(zip(("position", "effort", *axis.signal_names), np.array(rows).T, strict=True))


class Listener:
    """Keeps joint states, and the plant's signals by their stamps."""

    def __init__(self, graph: Graph, names: tuple[str, ...]) -> None:
        self.node: Node = graph.node("listener")
        self.states: dict[int, JointState] = {}
        self.signals: dict[str, dict[int, float]] = {name: {} for name in names}
        for name in names:
            self.node.create_subscription(StampedForce, name, self._keeper(name), DEEP)
        self.node.create_subscription(JointState, "joint_states", self._on_state, DEEP)
        graph.spin(self.node, kind=EventsExecutor)

    def _keeper(self, name: str) -> Any:
        return lambda message: self.signals[name].__setitem__(_sample(message), message.force)

    def _on_state(self, message: JointState) -> None:
        self.states[_sample(message)] = message

    def complete(self, n_samples: int) -> bool:
        return all(len(kept) > n_samples for kept in (self.states, *self.signals.values()))


def _sample(message: Any) -> int:
    return round((message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec) / H)


def _overrides(**values: object) -> list[Parameter]:
    return [Parameter(name, value=value) for name, value in values.items()]


def _push(file: str) -> dict[str, object]:
    """Parameters of an excitation that gives the force of :func:`_expected`."""
    motion = {f"multisine.{key}": value for key, value in {**PUSH, "amplitude": _size(file)}.items()}
    return {"lock_step": True, "period": H, "output": "force", "seed": 5, "start_delay": 0.02, **motion}


def test_every_plant_comes_with_a_model_file() -> None:
    assert {read_model(CONFIG / name).plant.id for name in MODELS} == set(PLANTS)


@pytest.mark.parametrize("file", MODELS)
def test_every_model_runs_in_lock_step_as_the_core_alone(graph: Graph, file: str) -> None:
    expected = _expected(file, SAMPLES)
    names = tuple(expected)[2:]
    assert all(np.isfinite(values).all() for values in expected.values())
    assert np.ptp(expected["effort"]) > 0.0
    listener = Listener(graph, names)
    context = graph.context()
    plant = graph.owns(
        PlantNode(
            context=context,
            parameter_overrides=_overrides(
                lock_step=True, period=H, model_file=str(CONFIG / file), wait_for_subscribers=2, duration=SAMPLES * H, **SENSOR
            ),
        )
    )
    excitation = graph.owns(ExcitationNode(context=context, parameter_overrides=_overrides(**_push(file))))
    graph.spin(plant, excitation, kind=EventsExecutor)
    graph.until(lambda: plant.done, "the plant ends")
    graph.until(lambda: listener.complete(SAMPLES), "the last messages arrive")
    states = [listener.states[k] for k in range(SAMPLES)]
    assert np.array([m.position[0] for m in states]) == pytest.approx(expected["position"], rel=1e-9, abs=1e-15)
    assert np.array([m.effort[0] for m in states]) == pytest.approx(expected["effort"], rel=1e-9, abs=1e-12)
    for name in names:
        said = np.array([listener.signals[name][k] for k in range(SAMPLES)])
        assert said == pytest.approx(expected[name], rel=1e-9, abs=1e-15), name
    # The number of topics is the number of signals: a plant without any costs nothing more.
    assert len(list(plant.publishers)) == len(list(graph.owns(ExcitationNode(context=context)).publishers)) + len(names)


@pytest.mark.long
def test_two_runs_with_signals_give_the_same_bag(graph: Graph) -> None:
    names = [s.name for s in read_model(CONFIG / WITH_SIGNALS).plant.signals]
    assert len(names) > 1
    topics = ["joint_states", *names]
    contents = []
    watcher = graph.node("watcher")
    for run in range(2):
        bag = graph.folder / f"bag{run}"
        recorder = graph.start_node("recorder", bag=bag, log_time="stamp", topics=f"[{','.join(topics)}]", drain_period=0.01)
        plant = graph.start_node(
            "plant", lock_step=True, period=H, model_file=CONFIG / WITH_SIGNALS, duration=400 * H,
            wait_for_subscribers=1, **SENSOR,
        )  # fmt: skip
        # Without commands the plant stays at the first sample.
        graph.until(lambda: all(watcher.count_subscribers(topic) for topic in topics), "the recorder has found every topic")
        excitation = graph.start_node("excitation", **_push(WITH_SIGNALS))
        assert graph.finish(plant)[0] == 0
        graph.finish(excitation, signal.SIGINT)
        status, _, error = graph.finish(recorder, signal.SIGINT)
        assert status == 0, error
        assert " 0 lost" in error
        contents.append([(raw.log_time_ns, raw.topic, raw.data) for raw in iterate_raw(bag)])
        graph.until(lambda: not any(watcher.count_subscribers(topic) for topic in topics), "the recorder is gone")
    # The first sample is repeated while the recorder finds one topic after the other; from the second on, all must be the same.
    once, again = ([entry for entry in content if entry[0] > 0] for content in contents)
    assert once == again
    assert len(once) == 400 * len(topics)
    # What the plant measured besides is part of the record, without anybody naming it.
    record = read_record(bag)
    assert set(names) <= set(record.extra)
    assert all(np.ptp(record.extra[name]) > 0.0 for name in names)


def test_in_wall_time_signals_are_plain_numbers(graph: Graph) -> None:
    heard: dict[str, list[float]] = {"normal_load": [], "pressure_1": []}
    node = graph.node("listener")
    for name, values in heard.items():
        node.create_subscription(Float64, name, lambda message, to=values: to.append(message.data), DEEP)
    plant = graph.owns(
        PlantNode(context=graph.context(), parameter_overrides=_overrides(period=0.01, model_file=str(CONFIG / WITH_SIGNALS)))
    )
    states: list[JointState] = []
    node.create_subscription(JointState, "joint_states", states.append, DEEP)
    graph.spin(node, kind=EventsExecutor)
    graph.spin(plant, kind=EventsExecutor)
    graph.until(lambda: all(len(values) > 5 for values in heard.values()) and len(states) > 5, "numbers arrive")
    # At rest in equilibrium: nothing presses on the bearings, and the cylinder carries the weight (285 kg) over both areas.
    assert heard["normal_load"][-1] == pytest.approx(0.0, abs=1e-6)
    p_1 = heard["pressure_1"][-1]
    assert p_1 * 1.96e-3 - (200e5 - p_1) * 0.94e-3 == pytest.approx(285.0 * 9.81, rel=1e-6)


def test_a_file_that_comes_with_fric_is_found_by_its_name(graph: Graph, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(graph.folder)
    plant = graph.owns(PlantNode(context=graph.context(), parameter_overrides=_overrides(model_file="guideway_model.yaml")))
    assert plant.condition()["samples"] == 0


@pytest.mark.parametrize("file", sorted(path.name for path in CONFIG.glob("*plant.yaml")))
def test_every_plant_of_the_configuration_starts(graph: Graph, monkeypatch: pytest.MonkeyPatch, file: str) -> None:
    monkeypatch.chdir(CONFIG.parent)  # as the files are meant to be used
    node = graph.owns(PlantNode(context=graph.context("--params-file", str(CONFIG / file))))
    assert node.condition()["samples"] == 0
