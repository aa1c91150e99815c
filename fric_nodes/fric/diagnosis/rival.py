"""A rival: a candidate, or a pair of them, fitted in full, with what it leaves and what it costs; and how rivals compare.

Models with slip dynamics are followed by an observer that sets the position, others by one that pushes it. The first finds less
missing force, by the factor that :meth:`fric.diagnosis.track.Track.unpaid` gives, and what such a rival leaves is multiplied by
that factor before the two kinds are compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..effect import Effect
from ..model import Model
from .fitting import State, left_by
from .least_squares import Fit
from .price import implausible, price_of
from .screen import Screening, Tried
from .track import Track

__all__ = ["Rival", "brings_slip", "name_of", "rival_of", "side_by_side"]


@dataclass(frozen=True, eq=False)
class Rival:
    """A candidate, or a pair of them, fitted in full.

    Attributes:
        effect: the first one.
        left: sum of squares on unseen blocks [F^2].
        fit: of the model with it.
        fair: ``left`` as it is held against that of other rivals [F^2].
        dear: price of its parameters, and of what is implausible about it [F^2]; what is small beside the rest must not decide
            between effects.
        offer: the trials that it was fitted from.
        names: of its terms in the fitted model.
        halfway: what the first of a pair leaves alone [F^2].
        screened: all candidates at first order then, the best first.
    """

    effect: Effect
    left: float
    fit: Fit
    fair: float
    dear: float
    offer: tuple[Tried, ...]
    names: tuple[str, ...]
    halfway: float
    screened: tuple[Tried, ...]

    @property
    def slips(self) -> bool:
        """True where it brings slip dynamics."""
        return brings_slip(self.offer)

    @property
    def score(self) -> float:
        """What it leaves and what it costs [F^2]."""
        return self.fair + self.dear


def rival_of(track: Track, state: State, offer: tuple[Tried, ...], fit: Fit, found: Screening) -> Rival:
    """``offer`` as a rival.

    Args:
        track: of the recordings.
        state: what they come to without it.
        offer: the trials of the candidate, one per effect.
        fit: of the model with it.
        found: the screening that it comes from.
    """
    effects = [each.column.term.effect for each in offer]
    left = left_by(track, fit) * (found.unpaid if brings_slip(offer) else 1.0)
    dear = sum(price_of(effect, state.excess) for effect in effects) + state.excess * implausible(track, fit.model)
    names = [name_of(fit.model, effect) for effect in effects]
    halfway = min((each.left for each in offer), default=left)
    return Rival(effects[0], left, fit, left, dear, offer, tuple(names), max(halfway, left), found.tried)


def side_by_side(track: Track, fitted: Sequence[Rival], unpaid: float) -> list[Rival]:
    """``fitted`` in the order of their scores, the best first, with slip dynamics and without on one scale.

    A rival with slip dynamics leaves less because its position is set. By which factor depends on what is missing, so that the
    factor ``unpaid`` [1] of the screening no longer holds after the fits. It is replaced by that of the best rival without slip
    dynamics, where that is smaller.
    """
    pushed = [rival for rival in fitted if not rival.slips]
    if len(pushed) < len(fitted) and pushed and unpaid > 1.0:
        now = min(track.unpaid(min(pushed, key=lambda rival: rival.score).fit.model), unpaid)
        fitted = [replace(rival, fair=rival.left * now / unpaid) if rival.slips else rival for rival in fitted]
    return sorted(fitted, key=lambda rival: rival.score)


def brings_slip(offer: Sequence[Tried]) -> bool:
    """True where a candidate of ``offer`` has slip dynamics."""
    return any(each.column.term.effect.slip is not None for each in offer)


def name_of(model: Model, effect: Effect) -> str:
    """The prefix of the newest term of ``effect``, by whatever law."""
    of_it = [prefix for prefix, held in zip(model.prefixes, model.terms, strict=True) if held.effect.id == effect.id]
    own = [prefix for prefix, held in zip(model.prefixes, model.terms, strict=True) if held.effect is effect]
    return (own or of_it)[-1]
