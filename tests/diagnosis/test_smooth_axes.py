"""The diagnosis of axes without dry friction, whose truth a general solver of differential equations integrates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fric.diagnosis import Diagnosis, diagnose
from fric.model import Model, Term, build_model, term
from fric.record import Array, Record
from scipy.integrate import solve_ivp

pytestmark = pytest.mark.timeout(600)

_STEP = 1e-3  # [s]
_MASS, _VISCOUS, _SPRING = 2.0, 10.0, 200.0  # [kg], [N s/m], [N/m]
_SWINGS = ((0.31, 0.3), (0.83, 1.9), (1.9, 4.4))  # [Hz], [rad]


def _recording(
    force: Callable[[float], float], size: float, travel: float, noise: float, seed: int, duration: float = 12.0
) -> Record:
    """A stage on a spring under swings of ``size`` [N], with the force ``force`` of the position [N] that is concealed."""
    generator = np.random.default_rng(seed)
    shift = generator.uniform(0.0, 6.0)

    def push(t: float) -> float:
        return size * sum(float(np.sin(2.0 * np.pi * f * t + p + shift)) for f, p in _SWINGS)

    def rates(t: float, x: Array) -> list[float]:
        return [x[1], (push(t) - _VISCOUS * x[1] - _SPRING * x[0] - force(x[0])) / _MASS]

    time = np.arange(0.0, duration, _STEP)
    answer = solve_ivp(rates, (0.0, duration), [0.0, 0.0], t_eval=time, rtol=1e-9, atol=1e-12, max_step=_STEP)
    assert float(np.max(np.abs(answer.y[0]))) > 0.3 * travel
    effort = np.array([push(float(t)) for t in time]) + noise * generator.standard_normal(time.shape[0])
    position = np.round(answer.y[0] / (1e-5 * travel)) * 1e-5 * travel
    return Record(time, position, effort, effort_hold="linear", source=f"truth {seed}")


def _nominal(*more: Term) -> Model:
    """The stage without what is concealed, its values off."""
    known = [term("viscous", coefficient=1.3 * _VISCOUS), term("stiffness", stiffness=0.8 * _SPRING), *more]
    return build_model("rigid", {"mass": 0.8 * _MASS}, known)


def _diagnosed(force: Callable[[float], float], size: float, travel: float, noise: float) -> Diagnosis:
    held = [_recording(force, size, travel, noise, seed) for seed in (1, 2)]
    return diagnose(held[:1], held[1:], _nominal())


def test_a_hardening_spring_is_named_whatever_its_unit_makes_of_it() -> None:
    travel = 3e-5  # [m]
    cubic = 0.6 * _SPRING / travel**2  # [N/m^3], a hundred billion
    found = _diagnosed(lambda q: cubic * q**3, 0.5 * _SPRING * travel, travel, 1e-3 * _SPRING * travel)
    assert [each.effect for each in found.findings] == ["nonlinear_stiffness"]
    fitted = {p.name: p.value for p in found.model.parameters()}
    assert fitted["nonlinear_stiffness.stiffness"] == pytest.approx(cubic, rel=0.03)


@pytest.mark.long
def test_a_ripple_far_below_the_noise_is_named() -> None:
    ripple, period, noise = 0.5, 0.031, 1.5  # [N], [m], [N]
    found = _diagnosed(lambda q: ripple * float(np.sin(2.0 * np.pi * q / period)), 14.0, 0.1, noise)
    assert [each.effect for each in found.findings] == ["ripple"]
    fitted = {p.name: p.value for p in found.model.parameters()}
    assert fitted["ripple.period"] == pytest.approx(period, rel=0.01)
    assert np.hypot(fitted["ripple.cosine"], fitted["ripple.sine"]) == pytest.approx(ripple, rel=0.3)


def test_noise_alone_is_nothing() -> None:
    found = _diagnosed(lambda _: 0.0, 14.0, 0.1, 1.5)
    assert not found.mismatch
    assert found.findings == ()
