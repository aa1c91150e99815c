"""Excitations that answer the motion, and the sequence that goes through them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from fric.excitation import EXCITATIONS
from fric.excitation.parametric_oscillation import Oscillation
from fric.excitation.sequence import Sequence
from fric.excitation_kind import ExcitationError
from fric.model import build_model, term
from fric.simulation import Simulator

H = 5e-4


def _oscillation(**changes: float) -> Oscillation:
    kind = EXCITATIONS["parametric_oscillation"]
    values = {parameter.name: parameter.default for parameter in kind.parameters}
    assert set(changes) <= set(values)
    feedback = kind.answer({**values, **changes})  # type: ignore[misc, dict-item]
    assert isinstance(feedback, Oscillation)
    return feedback


def _free_motion(feedback: Oscillation, viscous: float) -> list[np.ndarray]:
    """Position over each free oscillation, of an axis of 2 kg."""
    simulator = Simulator(build_model("rigid", {"mass": 2.0}, [term("viscous", coefficient=viscous)]))
    positions = []
    for k in range(round(feedback.duration / H)):
        positions.append(simulator.position)
        simulator.step(feedback.force(k * H, simulator.position), H)
    whole = np.array(positions)
    release, cycle = round(feedback.release / H), round(feedback.cycle / H)
    return [whole[n * cycle + release : (n + 1) * cycle] for n in range(len(feedback.stiffness))]


def _frequency_and_decay(q: np.ndarray) -> tuple[float, float]:
    """Angular frequency and decay rate [1/s] from zero crossings and peaks."""
    at = np.flatnonzero(np.diff(np.sign(q)) != 0)
    crossings = (at + q[at] / (q[at] - q[at + 1])) * H
    peaks = [np.abs(q[first : last + 1]).max() for first, last in pairwise(at)]
    half = float(np.mean(np.diff(crossings)))
    return np.pi / half, float(-np.polyfit(np.arange(len(peaks)) * half, np.log(peaks), 1)[0])


def test_an_overdamped_axis_oscillates_and_tells_its_mass() -> None:
    # Without the feedback of velocity the axis, c/(2 sqrt(P m)) = 1.8, would creep back without a single crossing.
    feedback = _oscillation(
        stiffness_low=400.0, stiffness_high=1200.0, gains=2.0, damping=-97.0, deflection=0.02, damping_set=0.0,
        set_time=0.5, hold=1.5, oscillation_time=2.0, filter_time=0.0, sides=2.0,
    )  # fmt: skip
    parts = _free_motion(feedback, viscous=100.0)
    squares = []
    for q, stiffness, side in zip(parts, (400.0, 1200.0), (1.0, -1.0), strict=True):
        assert q[0] == pytest.approx(side * 0.02, rel=1e-2)
        omega, decay = _frequency_and_decay(q)
        # The held force of a sample is half a sample late, and so is the difference quotient: each takes damping away.
        damping = 100.0 - 97.0 - 0.5 * H * stiffness
        expected = np.sqrt(stiffness / (2.0 + 97.0 * H))  # half and half a sample of delay in the velocity act like mass
        assert decay == pytest.approx(damping / 4.0, abs=0.06)
        assert omega == pytest.approx(np.sqrt(expected**2 - decay**2), rel=3e-3)
        squares.append(omega**2 + decay**2)
    mass = (1200.0 - 400.0) / (squares[1] - squares[0])
    assert mass == pytest.approx(2.0 + 97.0 * H, rel=0.005)
    creeping = _free_motion(_oscillation(stiffness_low=400.0, gains=1.0, damping=0.0, deflection=0.02, hold=3.0), 100.0)[0]
    assert creeping.min() > 0.0


def test_it_starts_anew_when_time_goes_back_and_repeats_its_numbers() -> None:
    feedback = _oscillation()
    times = np.arange(400) * 0.01
    q = np.sin(times)
    first = [feedback.force(t, x) for t, x in zip(times.tolist(), q.tolist(), strict=True)]
    assert first == [feedback.force(t, x) for t, x in zip(times.tolist(), q.tolist(), strict=True)]
    assert feedback.force(0.0, 0.5) == -500.0 * 0.5  # nothing is known of the velocity yet


def test_beyond_the_travel_it_is_damped_until_the_next_release() -> None:
    feedback = _oscillation(damping=-20.0, damping_set=40.0, filter_time=0.0, travel=0.08, gains=2.0)
    release, cycle = feedback.release, feedback.cycle

    def damping(time: float) -> float:
        """From the force for 0.01 x/s at position 0."""
        feedback.force(time, -1e-5)
        return -feedback.force(time + 1e-3, 0.0) / 0.01

    feedback.force(release, 0.01)
    assert damping(release + 0.1) == pytest.approx(-20.0)
    feedback.force(release + 0.2, 0.081)
    assert damping(release + 0.3) == pytest.approx(40.0)
    feedback.force(cycle + 0.5, 0.0)
    feedback.force(cycle + release, 0.0)
    assert damping(cycle + release + 0.1) == pytest.approx(-20.0)


def test_what_cannot_be_done_is_refused() -> None:
    with pytest.raises(ExcitationError, match="exceeds stiffness_high"):
        _oscillation(stiffness_low=3000.0)
    with pytest.raises(ExcitationError, match="exceeds travel"):
        _oscillation(deflection=0.1)


def test_a_sequence_goes_through_plans_and_feedbacks() -> None:
    push = EXCITATIONS["free_decay"]
    values = {parameter.name: parameter.default for parameter in push.parameters}
    plan = push.part(values, {}, np.random.default_rng(0))  # type: ignore[arg-type]
    feedback = _oscillation(gains=1.0)
    assert not Sequence([plan], delay=1.0).has_feedback
    whole = Sequence([plan, feedback], delay=1.0, pause=0.5)
    assert whole.has_feedback
    begins = 1.0 + plan.duration + 0.5
    assert whole.duration == pytest.approx(begins + feedback.duration + 0.5)
    assert whole.force(0.5, 3.0) == 0.0
    assert whole.force(3.0, 3.0) == pytest.approx(50.0)
    assert whole.force(begins + 0.01, 0.1) == pytest.approx(-50.0, rel=0.01)
    assert whole.force(begins + feedback.duration + 0.01, 0.1) == 0.0
    assert not any(values.any() for values in whole.at(np.array([begins + 0.01])))
    again = Sequence([feedback], pause=0.5, repeat=True)
    later = 7 * (feedback.duration + 0.5)
    assert again.force(later + 1e-9, 0.1) == pytest.approx(-50.0, rel=1e-6)
