"""The map from evidence to probability: it rises with evidence, and is learnt from examinations as it should be."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fric.diagnosis.calibration import Calibration, Evidence, calibration, measures_of
from fric.diagnosis.prove.calibrating import Trial, fitted, learnt
from fric.errors import InputError

PLAIN = Evidence(share=0.3, rest=0.2, halves=50.0, functions=40.0)


@pytest.mark.parametrize(
    ("name", "less", "more"),
    [("share", 0.01, 0.9), ("rest", 0.9, 0.02), ("halves", -50.0, 500.0), ("functions", -50.0, 500.0), ("rivals", 0.01, 1.0)],
)
def test_more_evidence_never_makes_less_sure(name: str, less: float, more: float) -> None:
    known = calibration()
    for effect in (*known.effects, "an effect that no examination found"):
        worse, better = (known.probability(effect, replace(PLAIN, **{name: value})) for value in (less, more))
        assert 0.0 <= worse <= better <= 1.0


def test_the_published_map_says_what_it_was_learnt_from() -> None:
    import fric.diagnosis.calibration as at

    content = json.loads(Path(at.__file__).with_name("calibration.json").read_text())
    assert content["format"] == "fric-calibration/1"
    assert content["findings"] >= 30
    assert {each.get("variant", "injected") for each in content["examinations"]} >= {"compound", "injected"}
    assert all(len(each["sha256"]) == 64 for each in content["examinations"])
    assert all(each.get("cases", each.get("injections", 0)) > 0 for each in content["examinations"])
    assert min(content["weights"].values()) >= 0.0


def test_what_findings_were_drawn_from_is_learnt_and_calibrated() -> None:
    """Findings whose truth follows a known map: what is learnt from one half is as sure as the other half is right."""
    random = np.random.default_rng(5)
    true = Calibration(-3.0, {**dict.fromkeys(measures_of(PLAIN), 0.0), "halves": 1.0, "share": 0.7}, {"ripple": -1.5})
    trials = []
    for _ in range(3000):
        effect = str(random.choice(["stribeck", "ripple"]))
        share, rest, halves, functions = random.uniform([0.01, 0.01, 0.0, 0.0], [1.0, 0.9, 300.0, 300.0])
        evidence = Evidence(share, rest, halves, functions)
        trials.append(Trial(effect, evidence, bool(random.random() < true.probability(effect, evidence))))
    content = fitted(trials[:1500])
    found = Calibration(content["offset"], content["weights"], content["effects"])
    said = np.array([found.probability(trial.effect, trial.evidence) for trial in trials[1500:]])
    right = np.array([trial.right for trial in trials[1500:]])
    for low, high in ((0.0, 0.2), (0.2, 0.4), (0.4, 0.6), (0.6, 0.8)):
        inside = (said >= low) & (said < high)
        assert np.count_nonzero(inside) > 50
        assert np.mean(right[inside]) == pytest.approx(np.mean(said[inside]), abs=4.0 * 0.5 / np.sqrt(np.count_nonzero(inside)))
    assert content["effects"]["ripple"] < content["effects"]["stribeck"] - 0.8


def test_one_wrong_finding_hardly_counts_against_an_effect() -> None:
    trials = [Trial("stribeck", PLAIN, k % 2 == 0) for k in range(40)] + [Trial("drag", PLAIN, False)]
    content = fitted(trials)
    found = Calibration(content["offset"], content["weights"], content["effects"])
    assert 0.3 < found.probability("drag", PLAIN) < 0.5


def test_a_folder_without_an_examination_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no examination"):
        learnt([tmp_path])
