"""Feedforward of the force that a model needs along the reference, with changes that don't jump.

The force is that of :class:`fric.simulation.Predictor`: inertia, velocity-dependent friction and the state of the slip
dynamics, on the *reference* motion, so that no measurement noise and no delay enters. A command given for sample k acts over
the interval that follows, hence the force is wanted for a moment ``preview`` later: the reference is extrapolated with its
velocity, its acceleration, and the difference of its accelerations. Half a sample is right for a force that is held over one
sample.

A new model is mixed in over ``transition_time`` while the old one still runs: force = sum of w_i F_i with sum of w_i = 1.
Switching on and off is a gain that ramps alike. A model without slip dynamics has no friction force of its own at zero
velocity; there the last friction force is let down over ``rest_fade_time``, since a static friction force that is kept up at
rest (or flips with rounding) hunts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..model import Model
from ..simulation import Predictor

__all__ = ["SPEED", "Feedforward", "FeedforwardError", "fastest_identified", "prepare", "refuse_impossible"]

_LONGEST_STEP = 10.0  # periods: a longer pause of the reference is taken as a pause, not as motion


class FeedforwardError(InputError):
    """A feedforward that can't be set up as asked."""


SPEED = "largest speed"
"""Key of a model's provenance: how fast the recordings were that it was identified from [x/s]."""

_FASTER = 1.1  # numerical: a reference may be so many times as fast before that is said; the speed recorded is an estimate


def refuse_impossible(model: Model) -> None:
    """Refuse a model with a value outside of what its parameter may be, as a fit without bounds can give it.

    Raises:
        FeedforwardError: a value is.
    """
    for parameter in model.parameters():
        said = parameter.declaration.refusal(parameter.value)
        if said is not None:
            raise FeedforwardError("model", f"{parameter.name} {said}", "identify it again, from more motion or with a bound")


def fastest_identified(model: Model) -> float:
    """Largest speed [x/s] of the recordings of ``model``; infinite where the model doesn't say it."""
    try:
        return float(model.provenance[SPEED].split()[0])
    except (KeyError, ValueError, IndexError):
        return math.inf


def prepare(model: Model) -> None:
    """Compile what ``model`` needs, or fetch it from the cache, which may take seconds; a change to it then takes none."""
    Predictor(model).step(0.0, 0.0, 0.0, 0.0, 1e-3)


class _Voice:
    """One model, or silence, with its weight in the mix."""

    def __init__(self, model: Model | None, weight: float, rest_fade_time: float) -> None:
        self.weight = weight
        self._model = model
        self._predictor = Predictor(model) if model is not None else None
        self._keeps_state = model is not None and any(held.effect.slip is not None for held in model.terms)
        self._fade_time = rest_fade_time
        self._at_rest = 0.0
        self._friction = 0.0
        self.friction = 0.0
        self._inputs = np.zeros((4, 1))

    def command(self, time: float, position: float, velocity: float, acceleration: float, duration: float) -> float:
        """What to command for the motion [F]."""
        if self._predictor is None or self._model is None:
            return 0.0
        return self._model.uncommand(self._force(self._predictor, time, position, velocity, acceleration, duration))

    def _force(
        self, predictor: Predictor, time: float, position: float, velocity: float, acceleration: float, duration: float
    ) -> float:
        inputs = self._inputs
        inputs[0, 0], inputs[1, 0], inputs[2, 0], inputs[3, 0] = time, position, velocity, acceleration
        effort, friction = predictor.run(inputs[0], inputs[1], inputs[2], inputs[3], duration)
        self.friction = float(friction[0])
        if self._keeps_state:
            return float(effort[0])
        if velocity != 0.0:
            self._at_rest = 0.0
            self._friction = float(friction[0])
            return float(effort[0])
        self._at_rest += duration
        left = 1.0 - self._at_rest / self._fade_time if self._fade_time > 0.0 else 0.0
        self.friction = self._friction * max(left, 0.0)
        return float(effort[0]) + self.friction


class Feedforward:
    """The force for a reference, sample by sample.

    Args:
        period: time between two references [s].
        preview: how much later than its stamp the force of a reference acts, on average [s]; None: half a period.
        transition_time: for a change of model and for switching on and off [s].
        rest_fade_time: for the static friction force at rest [s].
        terms: ids of the effects to use; empty uses all.
        include_inertia: False leaves the acceleration out.
        enabled: switched on at the start.

    Attributes:
        enabled: may be changed at any time.
        include_inertia: may be changed at any time.
        preview: may be changed at any time.
        friction: share of the last force that is friction [F].
        beyond: number of references that were faster than the recordings of the model; friction is extrapolated there.
    """

    def __init__(
        self,
        period: float,
        *,
        preview: float | None = None,
        transition_time: float = 0.2,
        rest_fade_time: float = 0.1,
        terms: Sequence[str] = (),
        include_inertia: bool = True,
        enabled: bool = True,
    ) -> None:
        self._period = period
        self.preview = 0.5 * period if preview is None else preview
        self._transition_time = transition_time
        self._rest_fade_time = rest_fade_time
        self._terms = tuple(terms)
        self.include_inertia = include_inertia
        self.enabled = enabled
        self._model: Model | None = None
        self._fastest = math.inf
        self.friction = 0.0
        self.beyond = 0
        self.reset()

    def reset(self) -> None:
        """Start anew with the model in use, without a transition."""
        self._voices = [self._voice(self._model, 1.0)]
        self._gain = 1.0 if self.enabled else 0.0
        self._time: float | None = None
        self._acceleration = 0.0
        self.friction = 0.0

    def _voice(self, model: Model | None, weight: float) -> _Voice:
        return _Voice(model, weight, self._rest_fade_time)

    @property
    def model(self) -> Model | None:
        """The model in use, or coming into use."""
        return self._model

    def selected(self, model: Model) -> Model:
        """``model`` with those of its terms that are to be compensated.

        Raises:
            FeedforwardError: the model has none of an effect that was asked for, or a value that can't be.
        """
        refuse_impossible(model)
        if self._terms:
            present = {held.effect.id for held in model.terms}
            missing = [name for name in self._terms if name not in present]
            if missing:
                has = ", ".join(sorted(present)) or "none"
                raise FeedforwardError("terms", f"the model has no '{missing[0]}'", f"choose among those it has: {has}")
            model = model.with_terms([held for held in model.terms if held.effect.id in self._terms])
        return model

    def set_model(self, model: Model | None, at_once: bool = False) -> None:
        """Change to ``model`` (None: no force), over the transition time, or ``at_once``.

        Call :func:`prepare` before, elsewhere, where a pause of the loop would hurt.

        Raises:
            FeedforwardError: the model has none of an effect that was asked for.
        """
        if model is not None:
            model = self.selected(model)
            prepare(model)
        self._model = model
        self._fastest = math.inf if model is None else _FASTER * fastest_identified(model)
        if at_once or self._transition_time <= 0.0:
            self._voices = [self._voice(model, 1.0)]
        else:
            self._voices = [*self._voices, self._voice(model, 0.0)]

    def _mix(self, duration: float) -> None:
        """Move the weights and the gain on by ``duration`` [s]."""
        part = duration / self._transition_time if self._transition_time > 0.0 else 1.0
        aim = 1.0 if self.enabled else 0.0
        self._gain += min(max(aim - self._gain, -part), part)
        if len(self._voices) == 1:
            return
        newest = self._voices[-1]
        weight = min(newest.weight + part, 1.0)
        if weight >= 1.0:
            newest.weight = 1.0
            self._voices = [newest]
            return
        for voice in self._voices[:-1]:
            voice.weight *= (1.0 - weight) / (1.0 - newest.weight)
        newest.weight = weight

    def step(self, time: float, position: float, velocity: float, acceleration: float) -> float:
        """Force [F] for the reference ``position`` [x], ``velocity`` [x/s], ``acceleration`` [x/s^2] at ``time`` [s].

        Raises:
            FeedforwardError: a value isn't finite; the state is left as it was.
        """
        if not (math.isfinite(position) and math.isfinite(velocity) and math.isfinite(acceleration)):
            raise FeedforwardError("reference", "a value is not finite", "leave the sample out")
        if abs(velocity) > self._fastest:
            self.beyond += 1
        duration = self._period if self._time is None else time - self._time
        if not 0.0 < duration < _LONGEST_STEP * self._period:
            duration = self._period
        jerk = 0.0 if self._time is None else (acceleration - self._acceleration) / duration
        self._time, self._acceleration = time, acceleration
        ahead = self.preview
        if ahead != 0.0 and (velocity != 0.0 or acceleration != 0.0):
            position += ahead * (velocity + ahead * (0.5 * acceleration + ahead * jerk / 6.0))
            velocity += ahead * (acceleration + 0.5 * ahead * jerk)
            acceleration += ahead * jerk
        if not self.include_inertia:
            acceleration = 0.0
        self._mix(duration)
        total = friction = 0.0
        for voice in self._voices:
            total += voice.weight * voice.command(time + ahead, position, velocity, acceleration, duration)
            friction += voice.weight * voice.friction
        self.friction = self._gain * friction
        return self._gain * total
