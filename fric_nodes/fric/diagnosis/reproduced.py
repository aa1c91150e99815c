"""Terms that one half of the recordings does not find again in the other go (backward elimination by cross-validation).

Terms that come together may leave little where they were fitted and yet correct each other: what each is, one half of the
recordings tells otherwise than the other. Such a term makes the other half worse. It goes where the model without it, fitted
anew to each half and judged on the other, is no worse than the model with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from .deadline import is_over
from .fitting import refit, without_place
from .growth import Growth
from .halves import Halves
from .settle import audit, renamed

__all__ = ["reproduced"]

_WHY = "one half of the recordings does not find it again in the other"


def reproduced(growth: Growth, tell: Callable[[str], None] = lambda _: None) -> Growth:
    """``growth`` without the terms that its halves contradict each other about.

    Args:
        growth: with all of its terms.
        tell: told what goes.
    """
    needed: set[str] = set()
    while len(growth.steps) > 1 and not is_over():
        judged, model = Halves(growth.track, growth.end), growth.end.fit.model
        nats = {step.term: judged.least(model.prefixes.index(step.term)) for step in growth.steps if step.term not in needed}
        least = min(nats, key=lambda name: nats[name], default=None)
        if least is None or nats[least] >= 0.0:
            break
        place = model.prefixes.index(least)
        end = refit(growth.track, without_place(model, place), 8)
        rest = audit(growth.track, growth.begin.fit.model, end.fit.model)
        steps = tuple(renamed(step, model, place) for step in growth.steps if step.term != least)
        gone = (*growth.rejected, (least.split("#")[0], _WHY))
        fewer = replace(growth, end=end, steps=steps, rest=rest, rejected=gone)
        if fewer.price > growth.price:
            needed.add(least)
            continue
        tell(f"{least}: {_WHY} ({nats[least]:.0f} nats)")
        growth, needed = fewer, set()
    return growth
