"""Lock-step bookkeeping, deadlines and conversions, each alone."""

from __future__ import annotations

import math

import pytest
from fric.model import ModelError, build_model, term
from fric_nodes.convert import MessageError, joint_sample, model_from_message, model_to_message, nanoseconds, set_stamp
from fric_nodes.lockstep import Answers, Stream
from fric_nodes.timing import Deadlines
from sensor_msgs.msg import JointState


def test_stream_keeps_what_waits_for_its_sample() -> None:
    stream: Stream[str] = Stream()
    for stamp in (0, 2, 4):
        stream.put(stamp, f"at {stamp}")
    stream.forget_before(2)
    assert [stream.get(stamp) for stamp in (0, 2, 4)] == [None, "at 2", "at 4"]


def test_an_earlier_message_takes_back_all_later_ones() -> None:
    stream: Stream[str] = Stream()
    for stamp in (2, 4, 6):
        stream.put(stamp, "old")
    stream.put(4, "new")
    assert [stream.get(stamp) for stamp in (2, 4, 6)] == ["old", "new", None]


def test_stream_is_bounded() -> None:
    stream: Stream[int] = Stream(capacity=3)
    for stamp in range(5):
        stream.put(stamp, stamp)
    assert [stream.get(stamp) for stamp in range(5)] == [None, None, 2, 3, 4]


def test_answers_are_found_for_the_same_question_only() -> None:
    answers: Answers[float, str] = Answers()
    answers.keep(10, 1.5, "a")
    answers.keep(12, 2.5, "b")
    assert answers.find(10, 1.5) == "a"
    assert answers.find(10, 9.9) is None
    assert answers.goes_back(10)
    assert not answers.goes_back(14)
    answers.clear()
    assert answers.find(10, 1.5) is None
    assert not answers.goes_back(0)


def test_deadlines_by_hand() -> None:
    deadlines = Deadlines(0.01)
    for now in (0.0, 0.01, 0.02, 0.036, 0.04, 0.05):
        deadlines.tick(now)
    deadlines.latency(0.001)
    deadlines.latency(0.003)
    report = deadlines.report()
    assert (report["periods"], report["misses"]) == ("5", "1")
    assert float(report["period mean [s]"]) == pytest.approx(0.01)
    assert float(report["period max [s]"]) == pytest.approx(0.016)
    # Deviations 0, 0, 6, -6, 0 ms.
    assert float(report["jitter std [s]"]) == pytest.approx(math.sqrt(72e-6 / 5), abs=1e-6)
    assert float(report["latency mean [s]"]) == pytest.approx(0.002)
    deadlines.tick(0.06)
    assert float(deadlines.report()["period max [s]"]) == pytest.approx(0.01)


def test_stamps_keep_every_nanosecond() -> None:
    message = JointState()
    set_stamp(message.header.stamp, 1_700_000_000_123_456_789)
    assert nanoseconds(message.header.stamp) == 1_700_000_000_123_456_789


def test_one_joint_of_several() -> None:
    message = JointState(name=["a", "b"], position=[1.0, 2.0], effort=[3.0, 4.0])
    sample = joint_sample(message, "b")
    assert (sample.position, sample.effort) == (2.0, 4.0)
    assert math.isnan(sample.velocity)
    for bad, said in (
        (JointState(name=["a"], position=[1.0]), "no joint 'b'"),
        (JointState(name=["b"]), "no position"),
        (JointState(name=["b"], position=[math.inf]), "inf"),
        (JointState(name=["b"], position=[0.0], velocity=[math.inf]), "infinite"),
    ):
        with pytest.raises(MessageError, match=said):
            joint_sample(bad, "b")


def test_model_survives_the_way_through_a_message() -> None:
    terms = [term("coulomb", force=4.0), term("presliding", "lugre", stiffness=1e6, damping=100.0), term("bias", force=-1.0)]
    model = build_model("rigid", {"mass": 1.2}, terms, joint="slide", standard_errors={"mass": 0.01, "coulomb.force": 0.1})
    again = model_from_message(model_to_message(model, 5))
    assert again.names == model.names
    assert list(again.values) == list(model.values)
    assert (again.joint, again.units) == ("slide", model.units)
    assert again.standard_errors == model.standard_errors


@pytest.mark.parametrize("fault", ["plant", "effect", "value", "name"])
def test_messages_that_are_no_model_are_refused(fault: str) -> None:
    message = model_to_message(build_model("rigid", {"mass": 1.2}, [term("coulomb", force=4.0)]), 0)
    if fault == "plant":
        message.plant.effect = "balloon"
    elif fault == "effect":
        message.terms[0].effect = "magic"
    elif fault == "value":
        message.terms[0].parameters[0].value = -4.0
    else:
        message.terms[0].parameters[0].name = "farce"
    with pytest.raises(ModelError):
        model_from_message(message)
