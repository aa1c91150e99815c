"""How sure a finding is: what moves it, and which way."""

from __future__ import annotations

import numpy as np
import pytest
from fric.diagnosis.confidence import confidence_of, is_doubtful, unknown_confidence
from fric.diagnosis.settle import Step


def came(after: float = 2.0) -> Step:
    """A term that left ``after`` of 100, above a floor of 1, and had no rival."""
    return Step("ripple", 100.0, after, 1.0, 99.0, (), ())


def test_what_is_left_and_what_explains_little_make_unsure() -> None:
    for rest in (0.0, 0.05, 0.2):
        sure = [confidence_of(rest, came(30.0), share) for share in (0.005, 0.01, 0.03, 0.1, 0.2, 0.9)]
        assert np.all(np.diff(sure) >= 0.0)
        assert sure[0] == sure[1]  # so little comes only where it is nearly all that the others leave
        assert sure[-1] == sure[-2]
    assert confidence_of(0.2, came(30.0), 0.5) < confidence_of(0.02, came(30.0), 0.5) < confidence_of(0.0, came(30.0), 0.5)
    assert confidence_of(0.0, came(60.0), 0.5) < confidence_of(0.0, came(10.0), 0.5)


def test_a_hundredth_of_the_mismatch_is_as_likely_a_mend_as_the_examinations_say() -> None:
    """Odds fall with the share by its power of 0.7: to an eighth between a fifth of the mismatch and a hundredth."""
    odds = [p / (1.0 - p) for p in (confidence_of(0.1, came(30.0), share) for share in (0.2, 0.01))]
    assert odds[1] / odds[0] == pytest.approx(20.0**-0.7, rel=0.02)


def test_what_is_fainter_than_the_noise_is_hardly_told() -> None:
    assert unknown_confidence(0.0, 0.9) < 0.5 < unknown_confidence(0.0, 1.1) == unknown_confidence(0.0)


def test_nobody_is_ever_certain() -> None:
    assert confidence_of(0.0, came(1.0), 1.0) < 1.0
    assert unknown_confidence(1.0) < 1.0


def test_many_that_leave_something_are_believed_only_where_all_are_likely_right() -> None:
    assert is_doubtful([0.55, 0.46, 0.43], 0.07)
    assert not is_doubtful([0.9, 0.9, 0.9], 0.07)
    # What leaves nothing explains it, and two effects are no crowd.
    assert not is_doubtful([0.55, 0.46, 0.43], 0.02)
    assert not is_doubtful([0.55, 0.46], 0.07)
    assert is_doubtful([0.45, 0.45], 0.0)
    assert is_doubtful([], 0.0)
