"""The catalogue of effects: one physical effect per file, found by being here.

A new effect is one new module with a constant ``EFFECT``, and its test. Nothing has to be registered anywhere else.
"""

from __future__ import annotations

import copyreg
from typing import Any

from ..effect import Effect
from ..registry import discover

__all__ = ["EFFECTS", "by_name"]

EFFECTS: dict[str, Effect] = {effect.key: effect for effect in discover(__name__, "EFFECT", Effect)}
"""Every effect by its key, ``id`` or ``id/law``."""


def by_name(effect: str, law: str = "") -> Effect | None:
    """The effect ``effect`` in the form ``law``; without a law the usual form, or else the first by file name."""
    if law:
        return EFFECTS.get(f"{effect}/{law}")
    laws = [found for found in EFFECTS.values() if found.id == effect]
    return next((found for found in laws if found.usual), laws[0] if laws else None)


def _known(key: str) -> Effect:
    return EFFECTS[key]


def _pickled(effect: Effect) -> tuple[Any, ...]:
    """An effect of the catalogue goes to another process by its key: there is one of each, and its functions are not copied."""
    return (_known, (effect.key,)) if EFFECTS.get(effect.key) is effect else object.__reduce_ex__(effect, 2)  # type: ignore[return-value]


copyreg.pickle(Effect, _pickled)
