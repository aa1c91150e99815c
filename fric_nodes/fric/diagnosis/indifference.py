"""How little a model minds the recorded effort: what would have passed as well with any other effort explains none.

A dead zone that swallows nearly all of the effort, a limit that falls onto the level of friction, or friction that changes
with the sign of the acceleration lets a light body move on as it did, whatever the effort was. Hardly any force is missing
then; but the recorded effort was not foretold at all. The probability of the recorded effort is that of the missing force r
times |dr/du|, the change of variables from r to the effort u. A model that minds the effort has dr/du = -1, which an observer
gives exactly at frequency zero, whatever friction, springs and masses the model has. So the derivative is measured: a constant
force of the size of what the nominal model lacks is added to the effort, and taken from it, and what of it shows up in r is
counted. Below what noise leaves nothing could show: there a model minds nothing, and it costs the logarithm of that ratio.

While an axis rests, friction holds it against any effort, in every model: that is not counted.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..model import Model
from ..threads import mapped
from .runs import SETTLING

if TYPE_CHECKING:
    from .track import Track

__all__ = ["dearer", "indifference"]


def indifference(track: Track, model: Model) -> float:
    """Mean over all values of -log|dr/du| while the axis moves [nats per value]; 0 for a model that minds all of the effort.

    Args:
        track: of the recordings; its ``noticeable`` says by which force, and how much of it noise would hide.
        model: with the values at which it is asked.
    """
    if track.noticeable is None or model.plant.led:
        return 0.0
    size, hidden = track.noticeable
    if size <= hidden:
        return 0.0
    if model.has_slip_dynamics:
        # Bristles are springs: they mind all of it. But led by its position, a model shows less of what is missing.
        model = model.with_terms(held for held in model.terms if held.effect.slip is None)
    less, more = mapped(lambda added: track.residual(model, track.with_effort(added)), (-size, size))
    # Where the force leads a body to another place, what shows of it swings about one: more counts as much as less.
    shown = np.clip((less - more) / (2.0 * size), hidden / size, size / hidden)
    return max(float(np.mean(np.where(_moves(track), -np.log(shown), 0.0))), 0.0)


def dearer(track: Track, model: Model) -> float:
    """The factor by which what ``model`` leaves [F^2] counts more for its indifference; at least 1."""
    return math.exp(2.0 * indifference(track, model))


def _moves(track: Track) -> NDArray[np.bool_]:
    """True for the values of a residual at which the axis moves, and has done so for a while; shape ``(n,)``."""
    parts = []
    for k, run in enumerate(track.runs):
        velocity = track.motion[k].velocity
        rests = (np.abs(velocity) <= track.rest(k)) | (np.diff(np.sign(velocity), append=0.0) != 0.0)
        # What an observer shows hangs on what was before, not on what comes.
        reach = math.ceil(SETTLING / (track.bandwidth * run.sample_time))
        parts.append((np.convolve(rests, np.ones(reach + 1))[: rests.shape[0]] < 0.5).astype(np.float64))
    return np.asarray(track.joined(parts), dtype=np.bool_)
