"""When a mismatch shows, and in which regime of the motion: energies of missing force whose places are known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fric.diagnosis.candidates import Scales, scales_of
from fric.diagnosis.locate import Where, direction, locate, moved_back, steady
from fric.diagnosis.track import Track
from fric.model import term
from fric.record import Array, Mask

from .small_axis import NOMINAL, STEP, followed, recorded

TRACK = followed()
SCALES = scales_of(TRACK)
POSITION, TIME = TRACK.runs[0].position, TRACK.time[0]
VELOCITY = np.gradient(POSITION, STEP)


def found(energy: Array, scales: Scales = SCALES) -> Where:
    return locate(TRACK, [energy], scales, NOMINAL)


def where(chosen: Mask) -> Where:
    return found(chosen.astype(np.float64))


def test_energy_of_a_short_while_is_found_at_that_time() -> None:
    short = where((TIME > 1.0) & (TIME < 1.2))
    ((begin, end),) = short.time[0]
    assert begin == pytest.approx(1.0, abs=0.011)
    assert end == pytest.approx(1.2, abs=0.011)
    assert short.share >= 0.97


def test_two_whiles_are_two_spans_but_for_a_small_gap() -> None:
    long_gap = where(((TIME > 1.0) & (TIME < 1.2)) | ((TIME > 2.0) & (TIME < 2.2)))
    assert len(long_gap.time[0]) == 2
    short_gap = where(((TIME > 1.0) & (TIME < 1.2)) | ((TIME > 1.215) & (TIME < 1.4)))
    assert len(short_gap.time[0]) == 1


def test_a_little_energy_all_the_time_does_not_widen_the_spans() -> None:
    with_noise = found(np.where((TIME > 1.0) & (TIME < 1.2), 1.0, 1e-4))
    assert len(with_noise.time[0]) == 1
    assert with_noise.time[0][0][1] < 1.25


def test_energy_that_is_spread_evenly_has_no_regime() -> None:
    even = where(np.ones_like(TIME, dtype=np.bool_))
    assert even.quantity == ""
    assert even.regime == "everywhere, both directions"
    assert even.time_share == 1.0
    nothing = where(np.zeros_like(TIME, dtype=np.bool_))
    assert nothing.quantity == ""
    assert nothing.time == ((),)


REGIMES: dict[str, Callable[[], tuple[Array, float, float]]] = {
    "speed": lambda: (np.abs(VELOCITY), 0.30, 0.40),
    "position": lambda: (POSITION, *np.quantile(POSITION, [0.4, 0.5])),
    "force": lambda: (np.abs(TRACK.runs[0].effort), 10.0, 12.0),
    "time": lambda: (TIME, 2.0, 2.5),
}


@pytest.mark.parametrize("quantity", REGIMES)
def test_the_quantity_that_governs_the_energy_is_named_with_its_range(quantity: str) -> None:
    signal, low, high = REGIMES[quantity]()
    inside = (signal > low) & (signal < high)
    sits = where(inside)
    assert sits.quantity == quantity
    width = high - low
    assert low - 0.1 * width <= sits.range[0] < sits.range[1] <= high + 0.1 * width
    assert sits.range[1] - sits.range[0] > 0.6 * width
    assert sits.time_share == pytest.approx(0.8 * np.mean(inside), abs=0.02)


def test_energy_after_each_reversal_is_told_by_the_distance_from_it() -> None:
    turned = np.flatnonzero(np.diff(np.sign(VELOCITY)) != 0.0)
    energy = np.zeros_like(TIME)
    for first, last in zip(turned, [*turned[1:], TIME.size], strict=True):
        gone = np.abs(POSITION[first:last] - POSITION[first])
        energy[first:last] = gone < 0.004
    sits = found(energy)
    assert sits.quantity == "distance since reversal"
    # Of a range that holds energy evenly over time, any part of that length in time is as short.
    assert sits.range[1] <= 0.0042
    assert sits.time_share == pytest.approx(0.8 * np.mean(energy), abs=0.02)
    assert sits.regime.startswith("within ")
    assert "after each reversal" in sits.regime


@pytest.mark.parametrize(("sign", "words"), [(1.0, "forward only"), (-1.0, "backward only")])
def test_a_mismatch_of_one_direction(sign: float, words: str) -> None:
    assert where(sign * VELOCITY > 0.0).regime.endswith(words)


def test_a_direction_is_one_from_which_hardly_anything_is_missing() -> None:
    assert direction(0.9) == "forward only"
    assert direction(0.1) == "backward only"
    assert direction(0.8) == direction(0.5) == direction(0.2) == "both directions"


def test_energy_of_the_second_recording_is_found_there() -> None:
    both = Track.of([recorded(), recorded(term("bias", force=1.0), seed=1)], 45.0, NOMINAL)
    late = ((both.time[1] > 3.0) & (both.time[1] < 3.5)).astype(np.float64)
    sits = locate(both, [np.zeros_like(both.time[0]), late], scales_of(both), NOMINAL)
    assert sits.time[0] == ()
    assert [pytest.approx(each, abs=0.011) for each in sits.time[1]] == [(3.0, 3.5)]


def test_a_load_counts_where_it_was_recorded() -> None:
    (run,) = TRACK.runs
    load = np.random.default_rng(5).permutation(np.linspace(-1.0, 1.0, run.effort.size))
    loaded = replace(TRACK, runs=(replace(run, load=load),))
    heavy = load > 0.8
    sits = locate(loaded, [heavy.astype(np.float64)], SCALES, NOMINAL)
    assert sits.quantity == "load"
    assert sits.range[0] >= 0.8
    assert where(heavy).quantity == ""


def test_energy_is_spread_over_20_ms_and_none_is_lost() -> None:
    single = np.zeros(100)
    single[50] = 3.0
    spread = steady(single, STEP)
    assert np.count_nonzero(spread) == 10
    assert np.sum(spread) == pytest.approx(3.0)


def test_what_an_observer_shows_late_is_moved_back_by_two_of_its_time_constants() -> None:
    signal = np.arange(100.0)
    back = moved_back(signal, STEP, 50.0)
    assert back.tolist() == [*range(20, 100), *[0] * 20]
    assert moved_back(signal[:5], STEP, 50.0).tolist() == [0.0] * 5
