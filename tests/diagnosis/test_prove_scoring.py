"""Scores of made-up outcomes against figures counted by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fric.diagnosis.prove.reliability import calibration_bins, error_by_chance
from fric.diagnosis.prove.scoring import (
    Found,
    Outcome,
    Rate,
    components_of,
    energy_held,
    scored,
)


def _outcome(kind: str, effects: tuple[str, ...], findings: tuple[Found, ...], **changes: object) -> Outcome:
    values: dict[str, object] = {
        "number": 0,
        "kind": kind,
        "effects": effects,
        "outside": "",
        "components": frozenset({"load"}),
        "mismatch": bool(findings),
        "findings": findings,
        "held": 0.9,
        "ratio": 1.5,
        "noe_nominal": 9.0,
        "noe_refit": 5.0,
        "noe_augmented": 1.0,
        "noe_own": 1.0,
        "strength": 5.0,
        "floor": 0.05,
        "seconds": 2.0,
        **changes,
    }
    return Outcome(**values)  # type: ignore[arg-type]


def _found(effect: str, confidence: float = 0.9, runner_up: str = "", component: str = "load") -> Found:
    return Found(effect, confidence, runner_up, component)


def test_wilson_interval_of_a_known_case() -> None:
    low, high = Rate(9, 10).interval
    assert low == pytest.approx(0.5958, abs=1e-4)
    assert high == pytest.approx(0.9821, abs=1e-4)
    assert Rate(0, 60).interval[1] == pytest.approx(0.0602, abs=1e-4)


def test_what_counts_as_right() -> None:
    assert _outcome("moderate", ("ripple",), (_found("ripple"), _found("bias"))).right
    assert not _outcome("moderate", ("ripple",), (_found("bias"), _found("ripple"))).right
    assert _outcome("weak", ("ripple",), (_found("bias", runner_up="ripple"),)).runner_up_right
    assert _outcome("pair", ("ripple", "bias"), (_found("bias"), _found("ripple"))).right
    assert not _outcome("pair", ("ripple", "bias"), (_found("bias"),)).right
    assert _outcome("nothing", (), ()).right
    assert not _outcome("nothing", (), (), mismatch=True).right
    assert not _outcome("nothing", (), (), failure="ValueError: x").right
    assert _outcome("unknown", ("unknown",), (_found("unknown"),)).right
    assert not _outcome("unknown", ("unknown",), (_found("unknown", component="sensor"),)).right
    assert not _outcome("unknown", ("unknown",), (_found("ripple"),)).right
    assert _outcome("mixed", ("ripple", "unknown"), (_found("unknown"), _found("ripple", 0.3))).right
    assert not _outcome("mixed", ("ripple", "unknown"), (_found("unknown"), _found("bias", 0.3))).right


def test_of_several_effects_it_counts_what_is_found_at_least_half_sure_and_how_much_of_that_is_so() -> None:
    first = _outcome(
        "compound", ("ripple", "bias", "stribeck"), (_found("ripple"), _found("bias", 0.5), _found("backlash", 0.6))
    )
    second = _outcome("compound", ("ripple", "bias", "delay"), (_found("unknown"), _found("ripple", 0.49), _found("bias", 0.7)))
    third = _outcome("compound", ("coulomb", "bias", "delay"), (_found("delay"), _found("coulomb"), _found("bias")))
    rates = scored([first, second, third], "compound").rates
    assert rates["several effects: each found with a presence of at least 0.5"] == Rate(6, 9)
    assert rates["the same: effects told with at least 0.5 that are there"] == Rate(6, 7)
    assert rates["the same: all effects of a case found"] == Rate(1, 3)


def test_energy_within_spans_against_the_shortest_set() -> None:
    energy = np.zeros(1000)
    energy[200:250] = 1.0
    energy[700:750] = 1.0
    held, ratio = energy_held(energy, 0.01, [(2.0, 2.5), (7.0, 7.5)])
    assert (held, ratio) == (pytest.approx(1.0), pytest.approx(1.0))
    held, ratio = energy_held(energy, 0.01, [(1.5, 2.5), (2.25, 3.0)])
    assert held == pytest.approx(0.5)
    assert ratio == pytest.approx(1.5 / 0.5)
    held, ratio = energy_held(energy, 0.01, [(0.0, 10.0)])
    assert (held, ratio) == (pytest.approx(1.0), pytest.approx(10.0))
    assert math.isinf(energy_held(energy, 0.01, [(4.0, 5.0)])[1])


def test_calibration_error_counted_by_hand() -> None:
    pairs = [(0.95, True)] * 9 + [(0.95, False)] + [(0.35, True)] * 2 + [(0.35, False)] * 2
    assert calibration_bins(pairs) == (
        (pytest.approx(0.35), pytest.approx(0.5), 4),
        (pytest.approx(0.95), pytest.approx(0.9), 10),
    )
    outcomes = [_outcome("moderate", ("ripple",), (_found("ripple" if right else "bias", c),)) for c, right in pairs]
    figure = next(each for each in scored(outcomes).figures if "calibration" in each.name)
    assert figure.value == pytest.approx((10 * 0.05 + 4 * 0.15) / 14)


def test_a_few_findings_that_are_right_as_often_as_they_say_have_a_calibration_error() -> None:
    """Of n findings of a confidence c it is the mean deviation of a binomial's share, sqrt(2 c (1 - c) / (pi n))."""
    for confidence, n in ((0.5, 100), (0.9, 50)):
        expected = math.sqrt(2.0 * confidence * (1.0 - confidence) / (math.pi * n))
        assert error_by_chance([confidence] * n) == pytest.approx(expected, rel=0.1)
    assert error_by_chance([0.95] * 20) > error_by_chance([0.95] * 2000)


def test_a_score_counts_confusion_rates_and_goals() -> None:
    outcomes = [
        *[_outcome("moderate", ("ripple",), (_found("ripple", 0.95),))] * 19,
        _outcome("moderate", ("ripple",), (_found("bias", 0.4, runner_up="ripple"),), noe_augmented=5.5),
        *[_outcome("nothing", (), (), held=None, ratio=None, noe_own=None)] * 49,
        _outcome("nothing", (), (_found("bias", 0.3),), held=None, ratio=None, noe_own=None),
    ]
    score = scored(outcomes)
    by_name = {each.name: each for each in score.figures}
    assert score.confusion == {
        ("ripple", "ripple"): 19,
        ("ripple", "bias"): 1,
        ("nothing", "nothing"): 49,
        ("nothing", "bias"): 1,
    }
    assert by_name["single effects of moderate strength, named first"].value == pytest.approx(0.95)
    assert by_name["single effects of moderate strength, named first"].reached
    assert by_name["nothing missing, but something found (false alarms)"].value == pytest.approx(0.02)
    assert score.rates["wrong single effects whose runner-up is right"].hits == 1
    worse = by_name["cases where unseen data are worse than with the refitted nominal"]
    assert (worse.value, worse.reached) == (1.0, False)
    assert worse in score.missed


def test_variants_have_goals_five_points_wider_for_shares_and_the_same_for_all_else() -> None:
    outcomes = [_outcome("weak", ("ripple",), (_found("ripple"),)), _outcome("nothing", (), ())]
    usual, other = ({each.name: each.goal for each in scored(outcomes, name).figures} for name in ("standard", "form"))
    changed = {name: goal for name, goal in other.items() if goal != usual[name]}
    assert changed == {
        "weak single effects, named first": ">= 0.7",
        "nothing missing, but something found (false alarms)": "<= 0.07",
        "expected calibration error of the confidence": "<= 0.1",
    }


def test_in_a_slow_log_only_what_is_said_wrongly_has_a_goal() -> None:
    outcomes = [
        _outcome("moderate", ("ripple",), (_found("ripple"),)),
        _outcome("pair", ("ripple", "bias"), (_found("ripple"),)),
        _outcome("nothing", (), ()),
    ]
    goals = {each.name: each.goal for each in scored(outcomes, "slow-log").figures}
    assert goals["single effects of moderate strength, named first"] == goals["pairs, both named"] == ""
    assert goals["NOE on unseen data over the true structure's own, median"] == ""
    assert goals["nothing missing, but something found (false alarms)"] == "<= 0.07"
    assert goals["expected calibration error of the confidence"] == "<= 0.1"


def test_components_come_from_the_registry() -> None:
    assert components_of("delay") == {"command path"}
    assert components_of("stribeck") == {"guideway friction"}
    assert "transmission" in components_of("compliance")
