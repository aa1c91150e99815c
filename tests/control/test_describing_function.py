"""Harmonic balance: against the textbook's formulas, and against simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest
from fric.axis import SimulatedAxis
from fric.control.autotune import Timing, autotune
from fric.control.describing_function import friction_harmonic, law_harmonic, limit_cycles
from fric.control.feedbacks import CONTROLLERS
from fric.control.feedbacks.pid import Pid, PidGains
from fric.control.trial import follow, point_to_point
from fric.errors import InputError
from fric.model import Model, build_model, term

H = 1e-3
TIMING = Timing(H, 2e-3, 1e-6, 200.0)
AXIS = build_model(
    "rigid",
    {"mass": 95.0},
    [
        term("coulomb", force=20.0),
        term("presliding", "lugre", stiffness=1.5e6, damping=500.0),
        term("viscous", coefficient=205.0),
    ],
)


def test_coulomb_and_viscous_friction_are_those_of_the_textbook() -> None:
    model = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=6.0), term("viscous", coefficient=20.0)])
    amplitude, frequency = 1e-3, 5.0
    w = 2.0 * math.pi * frequency
    found = friction_harmonic(model, amplitude, frequency)
    # A relay's first harmonic is 4 F/pi, in phase with the velocity.
    assert found.imag == pytest.approx(4.0 * 6.0 / (math.pi * amplitude) + 20.0 * w, rel=1e-2)
    assert abs(found.real) < 0.02 * found.imag


def test_a_linear_law_has_its_frequency_response() -> None:
    gains = PidGains(2e4, 0.0, 250.0, 0.0)
    z = np.exp(1j * 2.0 * math.pi * 5.0 * H)
    expected = 2e4 + 250.0 * (1.0 - 1.0 / z) / H
    assert law_harmonic(Pid(gains), 1e-3, 5.0, H) == pytest.approx(expected, rel=1e-6)
    # A limit far below what is wanted makes it a relay of the limit's height.
    small = law_harmonic(Pid(PidGains(2e4), 0.1), 1e-3, 5.0, H)
    assert abs(small) == pytest.approx(4.0 * 0.1 / (math.pi * 1e-3), rel=0.02)


def _resting(name: str, gains: Mapping[str, float]) -> tuple[float, float]:
    """Amplitude [x] and main frequency [Hz] in the last part of a rest."""
    axis = SimulatedAxis(AXIS, resolution=TIMING.resolution, force_limit=TIMING.force_limit)
    law = CONTROLLERS[name].build(gains, TIMING.force_limit)
    course = follow(axis, law, point_to_point(H, [0.0, 0.02, 0.005], 0.4, 4.0), delay=2)
    last = course.position[-1500:] - np.mean(course.position[-1500:])
    spectrum = np.abs(np.fft.rfft(last))
    return 0.5 * float(np.ptp(last)), float(np.fft.rfftfreq(1500, H)[1 + np.argmax(spectrum[1:])])


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("pid", {"proportional": 4.0, "derivative": 4.0}),
        ("disturbance_observer", {"proportional": 4.0, "derivative": 4.0}),
        ("friction_observer", {"reference_share": 0.0, "stiffness": 70.0, "bristle_damping": 0.0, "coulomb": 1.3}),
    ],
)
def test_what_is_foretold_is_what_the_simulation_does(name: str, changed: dict[str, float]) -> None:
    kind = CONTROLLERS[name]
    tuned = autotune(AXIS, kind, TIMING, draws=10)
    crossover = 2.0 * math.pi * tuned.nominal.crossover

    def cycles(model: Model, gains: Mapping[str, float]) -> list[tuple[float, float]]:
        found = limit_cycles(
            model, lambda: kind.build(gains, TIMING.force_limit), H, delay=TIMING.delay, resolution=TIMING.resolution,
            smallest=1.5e-6, largest=3e-3, crossover=crossover,
        )  # fmt: skip
        return [(each.amplitude, each.frequency) for each in found if each.stable]

    # As tuned: nothing is foretold and nothing swings.
    assert not tuned.cycles
    assert not tuned.foretold
    assert _resting(name, tuned.gains)[0] < 1.5e-6
    wild = {**tuned.gains, **{key: factor * tuned.gains[key] for key, factor in changed.items()}}
    ((amplitude, frequency),) = cycles(AXIS, wild)
    swung, at = _resting(name, wild)
    assert amplitude == pytest.approx(swung, rel=0.3)
    assert frequency == pytest.approx(at, rel=0.3)


def test_a_range_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="give 0 < smallest < largest"):
        limit_cycles(AXIS, lambda: Pid(PidGains(1.0)), H, smallest=1.0, largest=0.5, crossover=10.0)
