"""The comparison of methods of compensation: its reckoning by hand, and one axis from recording to figures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.bench.benchmarks.compensation import figures_of, step_times
from fric.bench.compensation.catalogue import AXES
from fric.bench.compensation.circle import circle_plot, peak, rounds
from fric.bench.compensation.competition import Cell, Outcome, compete, interval, rest_figures, table
from fric.bench.compensation.methods import METHODS, NEEDS_SPRINGS, QUICK, peak_at_reversals
from fric.bench.compensation.page import competition_page, text_of_gain
from fric.control.trial import Course, point_to_point, sine
from fric.errors import InputError


def test_interval_by_hand() -> None:
    middle, low, high = interval(np.array([2.0, 8.0]))
    assert middle == pytest.approx(4.0)
    # Two values: t of 90 % with one degree of freedom is 6.314; their logarithms scatter by log(4)/sqrt(2).
    half = 6.3138 * math.log(4.0) / math.sqrt(2.0) / math.sqrt(2.0)
    assert (low, high) == pytest.approx((4.0 * math.exp(-half), 4.0 * math.exp(half)), rel=1e-3)
    assert interval(np.array([3.0]))[1:] == (0.0, math.inf)


def test_peaks_are_those_after_reversals() -> None:
    reference = sine(1e-3, 1.0, 1.0, 4.0)
    error = np.zeros(4000)
    turns = [round(1e3 * (0.25 + 0.5 * k)) for k in range(8)]
    for k in turns:
        error[k + 10] = 0.3
    error[1500] = 5.0  # in the middle of a stroke
    zero = np.zeros(4000)
    course = Course(reference, reference.position - error, zero, zero, zero, zero, 0, True)
    assert peak_at_reversals(course, 2000) == pytest.approx(0.3)


def test_a_failure_is_told_and_counts_for_nothing() -> None:
    good, bad = Outcome(1.0, 2.0, 3.0, 0), Outcome(math.nan, math.nan, math.nan, 0, "unstable")
    rows = table([Cell("slide", "pid", (good, good)), Cell("slide", "other", (bad, bad))])
    assert rows[1][2] == "unstable"
    page = competition_page(
        [Cell("slide", "pid", (good, good)), Cell("slide", "other", (bad, bad))], "fric compete", 1.0, False
    )
    assert "unstable" in page


def test_settling_counts_from_the_end_of_a_move() -> None:
    reference = point_to_point(1e-3, [0.0, 1.0, 0.5], 0.1, 0.4)
    zero = np.zeros(reference.position.shape[0])
    error = zero.copy()
    error[101:151] = 0.2  # 50 samples after the first move
    error[601:] = 0.2  # the second never settles
    error[-50:] += 0.1 * np.arange(50)
    course = Course(reference, reference.position - error, zero, zero, zero, zero, 0, True)
    settling, unsettled, width = rest_figures(course, 0.1)
    assert settling == pytest.approx(0.5 * (0.05 + 0.4), abs=2e-3)
    assert unsettled == 1
    assert width == pytest.approx(4.9)


def test_a_gain_counts_only_beyond_one() -> None:
    assert text_of_gain((2.0, 1.1, 3.0)) == "2"
    assert text_of_gain((2.0, 0.9, 3.0)) == "(2)"
    assert text_of_gain((math.nan,) * 3) == "–"


def test_unknown_names_are_refused() -> None:
    with pytest.raises(InputError, match="no method 'magic'"):
        compete([1], ["slide"], ["magic"])
    with pytest.raises(InputError, match="no axis 'boat'"):
        compete([1], ["boat"])


def test_drawn_axes_differ_within_a_fifth() -> None:
    axis = AXES["slide"]
    names = [p.name for p in axis.nominal.parameters()]
    ratio = axis.drawn(7).values / axis.nominal.values
    assert np.all(np.abs(ratio - 1.0) <= 0.2 + 1e-12)
    assert ratio[names.index("stribeck.exponent")] == 1.0
    assert np.ptp(ratio) > 0.05


def test_a_compensator_takes_microseconds() -> None:
    figures = step_times()
    assert len(figures) == 4
    # Processor time, of a machine that may be busy with other things: a factor of three is left.
    assert all(figure.value < 3.0 * float(figure.goal.split()[1]) for figure in figures)


@pytest.mark.long
def test_models_beat_tables_on_the_slide() -> None:
    methods = ["pid", "pid + velocity", "pid + table", "pid + pre-sliding model", "friction observer + velocity"]
    cells = compete([11], ["slide"], methods)
    rms = {cell.method: float(cell.values("rms")[0]) for cell in cells}
    assert rms["pid + table"] < 0.6 * rms["pid + velocity"]
    assert rms["pid + pre-sliding model"] < 0.3 * rms["pid + table"]
    assert rms["friction observer + velocity"] < rms["pid + table"]
    goals = [figure for figure in figures_of(cells) if figure.goal]
    assert goals
    assert all(figure.reached for figure in goals), goals


def test_there_are_twelve_methods_on_five_axes() -> None:
    assert len(METHODS) - len(NEEDS_SPRINGS) >= 12
    assert len(AXES) >= 5
    assert set(QUICK) <= set(METHODS)


def test_one_cell_has_every_figure_and_the_page_shows_it() -> None:
    cells = compete([3], ["cylinder"], ["pid", "tensor product + velocity"])
    for cell in cells:
        (found,) = cell.outcomes
        assert not found.failed
        assert 0.0 < found.without_lag <= found.rms
        assert 0.0 < found.share <= 1.0
        assert found.settling >= 0.0
        assert found.power > 0.0
        assert cell.error is not None
    # Where the PID hunts on the cylinder's stick-slip, the design by linear matrix inequalities rests.
    assert cells[0].outcomes[0].hunts
    assert not cells[1].outcomes[0].hunts
    page = competition_page(cells, "fric compete --axis cylinder", 1.0, True)
    assert "tensor product + velocity" in page
    assert "after its friction has changed" in page


def test_the_cylinder_gives_the_force_that_is_wanted() -> None:
    axis = AXES["cylinder"]
    body = axis.body(axis.drawn(5), 5)
    body.measure()
    efforts = []
    for k in range(1000):
        body.advance(8.0 * math.sin(2.0 * math.pi * 2.0 * k * 1e-3), 1e-3)
        efforts.append(body.measure().effort)
    wanted = 8.0 * np.sin(2.0 * np.pi * 2.0 * 1e-3 * np.arange(1000))
    assert np.sqrt(np.mean((np.array(efforts) - wanted)[200:] ** 2)) < 2.0
    assert abs(body.position) < 0.05


@pytest.mark.long
def test_a_circle_shows_its_quadrants_and_a_model_flattens_them() -> None:
    held = rounds(3, 1.0, ("pid + velocity", "pid + pre-sliding model"))
    before, after = (peak(error) for _, error in held.values())
    assert before > 1e-5
    assert after < 0.2 * before
    angle, error = held["pid + velocity"]
    # The largest deviations are just after the axes' reversals, at whole quarters of a turn.
    at = math.degrees(angle[np.argmax(np.abs(error - np.mean(error)))]) % 90.0
    assert min(at, 90.0 - at) < 15.0
    plot, caption = circle_plot(held)
    assert len(plot.data) == 2
    assert "magnified" in caption
