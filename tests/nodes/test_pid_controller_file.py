"""The node ``pid`` with the controller of a file: its answers are those of the law, and what doesn't fit is refused."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from fric.control.controller import Setpoint
from fric.control.feedbacks.cascade import Cascade, CascadeGains
from fric.errors import InputError
from fric_nodes.convert import set_stamp
from fric_nodes.nodes.pid import PidNode
from rclpy.experimental import EventsExecutor
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState

from fric_interfaces.msg import Reference, StampedForce

if TYPE_CHECKING:
    from .conftest import Graph

H = 0.01
CASCADE = """
format: fric-controller/1
units: {position: m, force: N}
period: 0.01
force_limit: 8.0
controller: {type: cascade, position_gain: 12.0, velocity_gain: 30.0, velocity_integral: 40.0, velocity_weight: 1.0}
"""


def _node(graph: Graph, text: str, **given: object) -> PidNode:
    path = Path(graph.folder) / "controller.yaml"
    path.write_text(text, encoding="utf-8")
    values = {"period": H, "lock_step": True, "use_feedforward": False, "controller_file": str(path), **given}
    overrides = [Parameter(key, value=value) for key, value in values.items()]
    return graph.owns(PidNode(context=graph.context(), parameter_overrides=overrides))


def test_a_cascade_answers_as_its_law_does(graph: Graph) -> None:
    pid = _node(graph, CASCADE)
    graph.spin(pid, kind=EventsExecutor)
    forces: list[float] = []
    bench = graph.node("bench")
    bench.create_subscription(StampedForce, "force_command", lambda message: forces.append(message.force), 100)
    references = bench.create_publisher(Reference, "reference", 100)
    states = bench.create_publisher(JointState, "joint_states", 100)
    graph.spin(bench)
    graph.meet(bench, pid)
    law = Cascade(CascadeGains(12.0, 30.0, 40.0, 1.0), 8.0)
    expected = []
    for k in range(40):
        wanted = Setpoint(0.05 * np.sin(0.3 * k), 1.5 * np.cos(0.3 * k), -4.5 * np.sin(0.3 * k))
        measured = 0.04 * np.sin(0.3 * k - 0.2)
        expected.append(law.answer(wanted, measured, H))
        reference = Reference(position=wanted.position, velocity=wanted.velocity, acceleration=wanted.acceleration)
        state = JointState(name=["axis"], position=[measured], effort=[0.0])
        for message in (reference, state):
            set_stamp(message.header.stamp, round((k + 1) * H * 1e9))
        references.publish(reference)
        states.publish(state)
        graph.until(lambda k=k: len(forces) > k, "an answer to each state")
    np.testing.assert_allclose(forces, expected, atol=1e-12)
    assert max(abs(force) for force in forces) == 8.0, "the limit of the file holds"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("period: 0.01", "period: 0.002"), "is for a period of 0.002 s"),
        (("type: cascade", "type: cascad"), "'cascad' is not known"),
        (("force_limit: 8.0", "feedforward: {type: dither, amplitude: 0.1, frequency: 20.0}"), "names a feedforward"),
    ],
)
def test_what_does_not_fit_is_refused(graph: Graph, change: tuple[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        _node(graph, CASCADE.replace(*change))
