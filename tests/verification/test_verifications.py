"""Every verification of ``fric verify`` must reach its goals, and its page must say so, or say what it missed."""

from __future__ import annotations

import importlib
import math
import pkgutil

import fric.verification
import plotly.graph_objects as go
import pytest
from fric.figure import Figure
from fric.report.verification import verification_page
from fric.verification import VERIFICATIONS
from fric.verification.verification import Evidence, Verification

_LONG = {
    "amthor",
    "asperity-dwell",
    "asperity-dynamics",
    "asperity-velocity",
    "calibration",
    "compensation-guideway",
    "compensation-robust",
    "excitations",
    "free-oscillation",
    "lugre-reference",
    "online",
    "passivity",
    "pneumatic",
    "quarter-car",
    "static-maps",
    "steady-curves",
    "stick-slip",
    "tensor-product",
    "transmission",
}


def _marks(name: str) -> list[pytest.MarkDecorator]:
    # The concealed cases are whole diagnoses, a minute each.
    return [pytest.mark.long] if name in _LONG or name.startswith("concealed") else []


@pytest.mark.parametrize("name", [pytest.param(name, marks=_marks(name)) for name in VERIFICATIONS])
def test_it_reaches_its_goals(name: str) -> None:
    check = VERIFICATIONS[name]
    evidence = check.run()
    assert evidence.figures
    assert any(figure.goal for figure in evidence.figures), "a verification that cannot fail verifies nothing"
    assert all(math.isfinite(figure.value) for figure in evidence.figures)
    missed = [figure for figure in evidence.figures if figure.reached is False]
    assert not missed
    assert evidence.plots, "every verification has a picture"
    for plot, caption in evidence.plots:
        assert isinstance(plot, go.Figure)
        assert len(caption) > 20
    assert len(check.source) > 5


def test_every_module_of_the_folder_is_in_the_catalogue() -> None:
    modules = {info.name for info in pkgutil.iter_modules(fric.verification.__path__)}
    defining = {name for name in modules if hasattr(importlib.import_module(f"fric.verification.{name}"), "VERIFICATION")}
    assert len(defining) == len(VERIFICATIONS)


def _page(*figures: Figure) -> str:
    check = Verification("one", "A law <of> nature", "somebody 1999", lambda: Evidence(figures))
    return verification_page([(check, check.run())])


def test_the_page_says_what_was_missed() -> None:
    page = _page(Figure("drift", 2.0, "m", "<= 1"), Figure("force", 3.0, "N", ">= 1"), Figure("time", 4.0, "s"))
    assert "1 of 2" in page
    assert "drift: 2 m, goal &lt;= 1" in page
    assert "MISSED" in page
    assert "A law &lt;of&gt; nature" in page
    assert "fric verify one" in page


def test_the_page_doesn_t_speak_of_misses_when_there_are_none() -> None:
    page = _page(Figure("drift", 0.0, "m", "== 0"))
    assert "1 of 1" in page
    assert "issed" not in page.split("<body")[1].split("<section")[-1]


@pytest.mark.parametrize(
    ("value", "goal", "reached"), [(1.0, "<= 1", True), (1.1, "<= 1", False), (0.0, "== 0", True), (1e-300, "== 0", False)]
)
def test_goals(value: float, goal: str, reached: bool) -> None:
    assert Figure("x", value, "", goal).reached is reached
