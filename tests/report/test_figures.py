"""Lines of the reports: thinned without losing a peak, broken where nothing was recorded."""

from __future__ import annotations

import numpy as np
from fric.report.figures import in_parts, thinned


def test_a_line_breaks_where_nothing_was_recorded() -> None:
    x = np.concatenate([np.arange(0.0, 10.0, 0.01), np.arange(20.0, 30.0, 0.01), np.arange(30.02, 31.0, 0.01)])
    x_shown, y_shown = in_parts(x, np.sin(x))
    (at,) = np.flatnonzero(np.isnan(x_shown))  # a few samples that are missing break nothing
    assert np.isnan(y_shown[at])
    assert x_shown[at - 1] < 10.0 < 20.0 <= x_shown[at + 1]
    np.testing.assert_array_equal(x_shown[~np.isnan(x_shown)], x)


def test_a_line_that_goes_back_is_left_alone() -> None:
    x = np.cos(np.linspace(0.0, 20.0, 500))
    x_shown, _ = in_parts(x, x)
    np.testing.assert_array_equal(x_shown, x)


def test_every_peak_stays() -> None:
    x = np.arange(100_000) * 1e-3
    y = np.zeros(100_000)
    y[[777, 50_001]] = 1.0, -1.0
    x_shown, y_shown = in_parts(x, y)
    assert x_shown.shape[0] <= 4001
    assert y_shown.max() == 1.0
    assert y_shown.min() == -1.0
    np.testing.assert_array_equal(thinned(x, y)[1], y_shown)
