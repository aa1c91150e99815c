"""The laws that a diagnosis tries by themselves; :mod:`fric.diagnosis.other_laws` puts others in the place of these."""

from __future__ import annotations

from functools import lru_cache

from ..effect import Effect
from ..effects import EFFECTS

__all__ = ["worth_trying"]


@lru_cache(maxsize=1)
def worth_trying() -> tuple[Effect, ...]:
    """One law of each effect, or all where no law is the usual one; a law that can be absent beside a usual one that can't.

    Not those that come near another, and of the forms of another law only those that may show where that one doesn't.
    """
    usual = {effect.id: effect for effect in EFFECTS.values() if effect.usual}
    return tuple(
        effect
        for effect in EFFECTS.values()
        if not effect.near
        and (
            effect.shows_alone
            or effect.usual
            or effect.id not in usual
            or (effect.neutral is not None and usual[effect.id].neutral is None)
        )
        and (effect.shows_alone or not effect.form_of)
    )
