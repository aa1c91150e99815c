"""How large a concealed effect has to be, against a full fit of the nominal model to the recording that holds it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis.blocks import in_blocks
from fric.diagnosis.candidates import scales_of
from fric.diagnosis.diagnose import diagnose
from fric.diagnosis.fitting import bounds_of, free_names
from fric.diagnosis.prove.injection import injected
from fric.diagnosis.prove.yardstick import Yardstick
from fric.diagnosis.result import Diagnosis
from fric.diagnosis.track import Track
from fric.model import Model, term
from fric.record import Record

from .small_axis import NOMINAL, recorded


@pytest.fixture(scope="module")
def restless() -> Record:
    """An axis that lacks nothing but a force that belongs to no effect, 0.3 N rms."""
    plain = recorded(duration=8.0, noise=1e-6)
    white = np.random.default_rng(4).standard_normal(plain.effort.size)
    return replace(plain, effort=plain.effort + 0.3 * white)


@pytest.fixture(scope="module")
def bare(restless: Record) -> Diagnosis:
    return told(restless, NOMINAL)


def told(record: Record, nominal: Model) -> Diagnosis:
    return diagnose(*in_blocks([record], 4), nominal, at_most=1.0)


def lacking(record: Record, bandwidth: float) -> np.ndarray:
    track = Track.of([record], bandwidth, NOMINAL)
    return track.fit(NOMINAL, free_names(NOMINAL), 30, bounds_of(NOMINAL, scales_of(track))).residual


@pytest.mark.parametrize("effect", ["quadratic_drag", "stiffness", "ripple", "shear_thinning", "actuator_lag", "gear_friction"])
def test_the_size_said_leaves_so_much_missing_beside_the_refitted_model(restless: Record, bare: Diagnosis, effect: str) -> None:
    measure = Yardstick([restless], bare).measure(effect, 10.0)
    (changed,) = injected([restless], effect, measure.size - measure.opposite)
    now, before = lacking(changed, bare.bandwidth), lacking(restless, bare.bandwidth)
    acts = np.abs(now - before) > 0.05 * np.max(np.abs(now - before))
    rest = float(np.sqrt(np.mean(before[acts] ** 2)))
    assert float(np.sqrt(np.mean((now - before)[acts] ** 2))) == pytest.approx(10.0 * rest, rel=0.2)


def test_what_the_nominal_model_has_a_parameter_for_can_not_show(restless: Record) -> None:
    nominal = NOMINAL.with_terms([*NOMINAL.terms, term("quadratic_drag", coefficient=1.0)])
    yardstick = Yardstick([restless], told(restless, nominal))
    assert np.isinf(yardstick.measure("quadratic_drag", 1.0).size)
    assert np.isfinite(yardstick.measure("stiffness", 1.0).size)


def test_the_opposite_that_the_axis_lacks_is_made_up_for(restless: Record) -> None:
    (softer,) = injected([restless], "stiffness", -2.0)
    measure = Yardstick([softer], told(softer, NOMINAL)).measure("stiffness", 1.0)
    assert measure.opposite == pytest.approx(2.0, rel=0.15)
