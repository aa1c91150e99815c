"""The compensator as a node: models by file, topic and service, without a jump; refusals; switching."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from fric.errors import InputError
from fric.model import Model, build_model, term
from fric.model_file import write_model
from fric_nodes.convert import model_to_message, set_stamp
from fric_nodes.nodes.compensator import CompensatorNode
from fric_nodes.qos import MODEL
from rcl_interfaces.srv import SetParameters
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from std_msgs.msg import Float64

from fric_interfaces.msg import FrictionModel, Reference
from fric_interfaces.srv import LoadModel

if TYPE_CHECKING:
    from .conftest import Graph

H = 0.01


def _model(level: float) -> Model:
    return build_model("rigid", {"mass": 1.0}, [term("coulomb", force=level)])


class Bench:
    """Sends references at a constant velocity of 1 m/s and keeps the forces."""

    def __init__(self, graph: Graph, **parameters: object) -> None:
        # References are sent as fast as they are answered, and not in their time.
        given = {"period": H, "transition_time": 0.2, "reference_timeout": 100.0, "clock_tolerance": 100.0, **parameters}
        overrides = [Parameter(key, value=value) for key, value in given.items()]
        self._origin = time.time_ns()
        self.compensator = graph.owns(CompensatorNode(context=graph.context(), parameter_overrides=overrides))
        graph.spin(self.compensator, kind=EventsExecutor)
        self.graph, self.forces, self._k = graph, [], 0
        self.node = graph.node("bench")
        self.node.create_subscription(Float64, "feedforward_force", lambda m: self.forces.append(m.data), 1000)
        self._references = self.node.create_publisher(Reference, "reference", 1000)
        self.models = self.node.create_publisher(FrictionModel, "friction/model", MODEL)
        graph.spin(self.node)
        graph.meet(self.node, self.compensator)

    def send(self, n: int, velocity: float = 1.0) -> list[float]:
        """Forces for the next ``n`` references."""
        start = len(self.forces)
        for _ in range(n):
            self._k += 1
            message = Reference(position=self._k * H, velocity=velocity)
            set_stamp(message.header.stamp, self._origin + round(self._k * H * 1e9))
            self._references.publish(message)
        self.graph.until(lambda: len(self.forces) >= start + n, "an answer to each")
        return self.forces[start:]

    def call(self, kind: type[Any], name: str, request: Any) -> Any:
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(10.0)
        return self.graph.ask(client, request, name)


def test_without_a_model_the_force_is_zero_but_comes(graph: Graph) -> None:
    assert Bench(graph).send(10) == [0.0] * 10


def test_model_by_service_from_a_file_comes_in_without_a_jump(graph: Graph) -> None:
    write_model(_model(3.0), graph.folder / "old.yaml")
    write_model(_model(8.0), graph.folder / "new.yaml")
    bench = Bench(graph, model_file=str(graph.folder / "old.yaml"))
    before = bench.send(5)
    assert np.allclose(before, 3.0)
    answer = bench.call(LoadModel, "compensator/load_model", LoadModel.Request(path=str(graph.folder / "new.yaml")))
    assert answer.success, answer.message
    after = bench.send(40)
    assert np.abs(np.diff([*before, *after])).max() <= 5.0 * H / 0.2 * (1.0 + 1e-4)
    assert math.isclose(after[-1], 8.0)


def test_model_by_topic_and_by_message(graph: Graph) -> None:
    bench = Bench(graph)
    bench.models.publish(model_to_message(_model(4.0), 0))
    graph.until(lambda: bench.compensator.counters["models"] == 1, "the model is taken over")
    assert math.isclose(bench.send(40)[-1], 4.0)
    answer = bench.call(LoadModel, "compensator/load_model", LoadModel.Request(model=model_to_message(_model(6.0), 0)))
    assert answer.success, answer.message
    assert math.isclose(bench.send(40)[-1], 6.0)


def test_bad_models_and_references_are_refused_and_the_old_model_stays(graph: Graph) -> None:
    write_model(_model(3.0), graph.folder / "old.yaml")
    (graph.folder / "bad.yaml").write_text("format: fric-model/1\n", encoding="utf-8")
    bench = Bench(graph, model_file=str(graph.folder / "old.yaml"))
    bad = model_to_message(_model(4.0), 0)
    bad.terms[0].parameters[0].value = math.nan
    stranger = model_to_message(_model(4.0), 0)
    stranger.joint = "elbow"
    bench.models.publish(bad)
    graph.until(lambda: bench.compensator.counters["refused model"] == 1, "a refusal of NaN")
    bench.models.publish(stranger)
    graph.until(lambda: bench.compensator.counters["refused model"] == 2, "a refusal of another joint's model")
    for path in ("bad.yaml", "missing.yaml"):
        answer = bench.call(LoadModel, "compensator/load_model", LoadModel.Request(path=str(graph.folder / path)))
        assert not answer.success
        assert path in answer.message
    reference = Reference(velocity=math.inf)
    bench._references.publish(reference)
    graph.until(lambda: bench.compensator.counters["refused reference"] == 1, "a refusal of an infinite velocity")
    assert np.allclose(bench.send(30), 3.0)


def test_enabled_can_be_set_at_run_time_and_other_things_cannot(graph: Graph) -> None:
    write_model(_model(3.0), graph.folder / "old.yaml")
    bench = Bench(graph, model_file=str(graph.folder / "old.yaml"))
    bench.send(5)

    def set_parameter(name: str, value: object) -> Any:
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        return bench.call(SetParameters, "compensator/set_parameters", request).results[0]

    assert set_parameter("enabled", False).successful
    off = bench.send(40)
    assert off[-1] == 0.0
    assert np.abs(np.diff(off)).max() <= 3.0 * H / 0.2 * (1.0 + 1e-4)
    refused = set_parameter("preview", 11.0)
    assert not refused.successful
    assert not set_parameter("model_file", "x").successful


def test_references_of_another_time_and_absurd_ones_leave_nothing_behind(graph: Graph) -> None:
    write_model(_model(3.0), graph.folder / "old.yaml")
    bench = Bench(graph, model_file=str(graph.folder / "old.yaml"), reference_timeout=10.0, clock_tolerance=5.0)
    assert np.allclose(bench.send(5), 3.0)
    for position, acceleration, shift in ((1e308, 0.0, 0), (0.1, 1e308, 0), (0.1, 0.0, 60), (0.1, 0.0, -60)):
        message = Reference(position=position, velocity=1.0, acceleration=acceleration)
        set_stamp(message.header.stamp, time.time_ns() + shift * 10**9)
        bench._references.publish(message)

    def refused() -> int:
        return sum(n for name, n in bench.compensator.counters.items() if name.startswith("refused reference"))

    graph.until(lambda: refused() == 4, "four refusals")
    assert np.allclose(bench.send(30), 3.0)


FILE = """
format: fric-controller/1
units: {position: m, force: N}
period: 0.01
controller: {type: pid, proportional: 100.0}
feedforward: {type: static_table, file: table.txt}
"""


def _file(graph: Graph, text: str = FILE) -> str:
    (graph.folder / "table.txt").write_text("0.0 4.0\n2.0 8.0\n", encoding="utf-8")
    path = graph.folder / "controller.yaml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_any_feedforward_of_a_file_scaled_limited_and_shared(graph: Graph) -> None:
    bench = Bench(graph, controller_file=_file(graph), scale=0.5)
    friction: list[float] = []
    bench.node.create_subscription(Float64, "feedforward_friction", lambda m: friction.append(m.data), 1000)
    graph.until(lambda: bench.compensator.count_subscribers("feedforward_friction") > 0, "the friction's listener")
    # 6 N of the table at 1 m/s, half of it.
    assert np.allclose(bench.send(5), 3.0)
    graph.until(lambda: len(friction) >= 5, "the share of friction")
    assert np.allclose(friction, 3.0)
    values = [Parameter("scale", value=1.0), Parameter("force_limit", value=5.0), Parameter("slew_limit", value=20.0)]
    request = SetParameters.Request(parameters=[each.to_parameter_msg() for each in values])
    assert all(each.successful for each in bench.call(SetParameters, "compensator/set_parameters", request).results)
    forces = bench.send(30)
    # No more than 0.2 N in 10 ms, and no more than 5 N.
    assert np.max(np.abs(np.diff([3.0, *forces]))) <= 0.2 + 1e-4  # stamps are in nanoseconds
    assert forces[-1] == 5.0
    # A model isn't taken while the file's feedforward is in use.
    write_model(_model(8.0), graph.folder / "new.yaml")
    answer = bench.call(LoadModel, "compensator/load_model", LoadModel.Request(path=str(graph.folder / "new.yaml")))
    assert not answer.success
    assert "is in use" in answer.message


@pytest.mark.parametrize(
    ("change", "given", "message"),
    [
        (("period: 0.01", "period: 0.002"), {}, "is for a period of 0.002 s"),
        (("feedforward: {type: static_table, file: table.txt}", ""), {}, "names no feedforward"),
        (("", ""), {"model_file": "model.yaml"}, "has a model_file and a controller_file"),
        (("file: table.txt", "file: table.txt, scale: 1.5"), {}, "scale is 1.5"),
    ],
)
def test_a_file_that_does_not_fit_is_refused(
    graph: Graph, change: tuple[str, str], given: dict[str, str], message: str
) -> None:
    path = _file(graph, FILE.replace(*change) if change[0] else FILE)
    values = {"period": H, "controller_file": path, **given}
    overrides = [Parameter(key, value=value) for key, value in values.items()]
    with pytest.raises(InputError, match=message):
        graph.owns(CompensatorNode(context=graph.context(), parameter_overrides=overrides))


def test_references_faster_than_the_recordings_of_the_model_are_said(graph: Graph) -> None:
    known = replace(_model(3.0), provenance={"largest speed": "0.5 m/s"})
    write_model(known, graph.folder / "known.yaml")
    bench = Bench(graph, model_file=str(graph.folder / "known.yaml"))
    bench.send(4, velocity=0.4)
    assert bench.compensator.state_of()["references faster than the model's recordings"] == "0"
    bench.send(6, velocity=1.0)
    assert bench.compensator.state_of()["references faster than the model's recordings"] == "6"
