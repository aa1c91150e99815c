"""Names of effects and of their laws."""

from __future__ import annotations

from fric.effects import by_name


def test_the_law_without_a_name() -> None:
    stribeck = by_name("stribeck")
    assert stribeck is not None
    assert stribeck.law == "exponential"
