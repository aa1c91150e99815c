"""Every candidate effect in one compiled structure, absent until it is given values.

A diagnosis tries hundreds of models: each candidate, alone and with others. Compiling a structure for each would take minutes,
so there is one structure that holds all effects which some value of a parameter makes vanish
(:attr:`fric.effect.Effect.neutral`), and a model is a vector of values for it. Slip dynamics and transmissions have no
such value: they change what the states are. A structure that holds one of them is a further universe, and there are as many as
models ask for. Effects of which a model may have several have two places in each; more places make another universe.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..effect import Effect, Place
from ..effects import EFFECTS
from ..engine.compile import Loops, loops_for
from ..model import Model, Term
from ..plant import Plant
from ..record import Array

__all__ = ["Universe", "common_effects", "universe_of", "worth_trying"]


_PLACES = 2  # numerical: of a repeatable effect; each costs compiling time, and a look at its switch in every step


@dataclass(frozen=True, eq=False)
class Universe:
    """One compiled structure and where its values are.

    Attributes:
        plant: kind of plant, its driven form where the structure holds a transmission.
        effects: in the order of assembly.
        loops: compiled.
        neutral: values at which every effect is absent and switched off, the plant's own zero, shape ``(n_values,)``.
        places: of each effect in ``effects`` and of its first value, by its key; several where it may come several times.
    """

    plant: Plant
    effects: tuple[Effect, ...]
    loops: Loops
    neutral: Array
    places: Mapping[str, tuple[tuple[int, int], ...]]

    def values(self, model: Model) -> Array:
        """The values of ``model`` for this structure, shape ``(n_values,)``."""
        values = self.neutral.copy()
        values[: len(model.plant_values)] = model.plant_values
        for held in model.terms:
            self.put(values, held)
        return values

    def put(self, values: Array, term: Term) -> None:
        """Switch ``term`` on in ``values``, at a free place of its effect; where none is free, in place of the last."""
        switches = len(values) - len(self.effects)
        places = self.places[term.effect.key]
        number, at = next((place for place in places if values[switches + place[0]] == 0.0), places[-1])
        values[at : at + len(term.values)] = term.values
        values[switches + number] = 1.0

    def inner_states(self, model: Model, velocity: float = 0.0, force: float = 0.0) -> tuple[Array, Array]:
        """States of the slip dynamics and memory of all effects at the start of a run.

        It begins with ``velocity`` [x/s], and under ``force`` [F] at the contact where that is known.
        """
        slip = [held.effect.start(held.values, force) for held in model.terms if held.effect.slip is not None]
        memory = [effect.memory(velocity) for effect in self.effects]
        return (slip[0] if slip else np.zeros(0)), np.concatenate([np.zeros(0), *memory])


@lru_cache(maxsize=1)
def common_effects() -> tuple[Effect, ...]:
    """The effects that every universe holds: those that can be absent, see :func:`worth_trying`."""
    return tuple(effect for effect in worth_trying() if effect.neutral is not None)


@lru_cache(maxsize=1)
def worth_trying() -> tuple[Effect, ...]:
    """One law of each effect, or all where no law is the usual one; a law that can be absent beside a usual one that can't.

    Not those that come near another.
    """
    usual = {effect.id: effect for effect in EFFECTS.values() if effect.usual}
    return tuple(
        effect
        for effect in EFFECTS.values()
        if not effect.near
        and not effect.form_of
        and (effect.usual or effect.id not in usual or (effect.neutral is not None and usual[effect.id].neutral is None))
    )


def universe_of(model: Model) -> Universe:
    """The structure that holds the common effects and every term of ``model``, and one more of what may be absent."""
    common = {effect.key for effect in common_effects()}
    own = [held.effect.key for held in model.terms if held.effect.key not in common]
    # Not of what can't be absent: a place that no term takes would act.
    several = Counter(held.effect.key for held in model.terms if held.effect.repeatable and held.effect.key in common)
    for key, count in several.items():
        own += [key] * max(count + 1 - _PLACES, 0)
    return _universe(model.plant, tuple(sorted(own)))


@lru_cache(maxsize=64)
def _universe(plant: Plant, own: tuple[str, ...]) -> Universe:
    places = list(Place)
    common = [effect for effect in common_effects() for _ in range(_PLACES if effect.repeatable else 1)]
    effects = sorted((*common, *(EFFECTS[key] for key in own)), key=lambda effect: (places.index(effect.place), effect.order))
    neutral: list[float] = [0.0] * len(plant.parameters)
    at: dict[str, tuple[tuple[int, int], ...]] = {}
    for number, effect in enumerate(effects):
        at[effect.key] = (*at.get(effect.key, ()), (number, len(neutral)))
        neutral += effect.neutral or [1.0] * len(effect.parameters)
    neutral += [0.0] * len(effects)  # the switches
    return Universe(plant, tuple(effects), loops_for(plant, effects, switched=True), np.array(neutral), at)
