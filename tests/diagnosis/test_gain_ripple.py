"""A motor whose gain repeats over position, on recordings of another integrator."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.diagnosis import diagnose
from fric.diagnosis.result import Finding
from fric.model import build_model, term
from fric.record import Record

PERIOD = 0.018


def record(seed: int, duration: float, ripple: float, dry: float = 6.0, cogging: float = 0.0, rubbing: float = 0.0) -> Record:
    """One body of 2 kg under a PD controller at 500 Hz, moved on by plain small steps.

    With the sine of the position, its motor gives more by the share ``ripple``, and its dry friction grows by ``rubbing``;
    ``cogging`` is a force.
    """
    h, fine = 2e-3, 40
    t, planned = h * np.arange(round(duration / h)), np.random.default_rng(seed)
    wanted = np.zeros_like(t)
    for k in range(5):
        frequency = planned.uniform(0.1, 0.5) if k < 3 else planned.uniform(0.5, 1.5)
        size = 0.05 * planned.uniform(0.3, 1.0) / (1 + k)
        wanted += size * np.sin(2.0 * math.pi * frequency * t + planned.uniform(0.0, 6.28))
    wanted -= wanted[0]
    rate, noise = np.gradient(wanted, h), np.random.default_rng(seed + 1)
    position, force = np.empty(t.size), np.empty(t.size)
    q = v = 0.0
    for k in range(t.size):
        position[k] = q
        u = force[k] = 8e3 * (wanted[k] - q) + 120.0 * (rate[k] - v)
        for _ in range(fine):
            wave = math.sin(2.0 * math.pi * q / PERIOD)
            f = u * (1.0 + ripple * wave) - cogging * wave
            rubs = dry * (1.0 + rubbing * wave)
            if v == 0.0:
                v = h / fine / 2.0 * math.copysign(max(abs(f) - rubs, 0.0), f)
            else:
                after = v + h / fine / 2.0 * (f - math.copysign(rubs, v) - 20.0 * v)
                v = 0.0 if after * v < 0.0 else after
            q += h / fine * v
    seen = np.round((position + 2e-7 * noise.standard_normal(t.size)) / 1e-7) * 1e-7
    return Record(t, seen, force + 0.05 * noise.standard_normal(t.size), effort_hold="following", source=f"run {seed}")


def found(**values: float) -> list[Finding]:
    own = [term("coulomb", force=1.05 * values.get("dry", 6.0)), term("viscous", coefficient=22.0), term("bias", force=0.0)]
    nominal = build_model("rigid", {"mass": 2.1}, own)
    return list(diagnose([record(1, 15.0, **values)], [record(7, 10.0, **values)], nominal).findings)


@pytest.mark.parametrize(("ripple", "dry"), [(0.15, 6.0), (0.3, 15.0), (0.05, 6.0)])
def test_it_is_told_with_its_size_and_nothing_else(ripple: float, dry: float) -> None:
    (told,) = found(ripple=ripple, dry=dry)
    assert told.effect == "gain_ripple"
    assert told.confidence > 0.5
    values = {name: each.value for name, each in told.parameters.items()}
    assert math.hypot(values["gain_ripple.cosine"], values["gain_ripple.sine"]) == pytest.approx(ripple, rel=0.05)
    assert values["gain_ripple.period"] == pytest.approx(PERIOD, rel=0.01)


def test_what_else_repeats_over_position_keeps_its_name() -> None:
    assert [each.effect for each in found(ripple=0.0, cogging=1.0)] == ["ripple"]
    assert [each.effect for each in found(ripple=0.0, rubbing=0.15)] == ["position_dependence"]
    assert {each.effect for each in found(ripple=0.15, cogging=1.0)} == {"gain_ripple", "ripple"}
