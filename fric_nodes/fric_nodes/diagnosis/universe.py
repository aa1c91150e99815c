"""Every candidate effect in one compiled structure, absent until it is given values.

A diagnosis tries hundreds of models: each candidate, alone and with others. Compiling a structure for each would take minutes, so
there is one structure that holds all effects which some value of a parameter makes vanish (:attr:`fric_nodes.effect.Effect.neutral`),
and a model is a vector of values for it. Slip dynamics and transmissions have no such value: they change what the states are.
A structure that holds one of them is a further universe, and there are as many as models ask for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..effect import Effect, Place
from ..effects import EFFECTS
from ..engine.compile import Loops, loops_for
from ..model import Model
from ..plant import Plant
from ..record import Array

__all__ = ["Universe", "common_effects", "universe_of"]


@dataclass(frozen=True, eq=False)
class Universe:
    """One compiled structure and where its values are.

    Attributes:
        plant: kind of plant, its driven form where the structure holds a transmission.
        effects: in the order of assembly.
        loops: compiled.
        neutral: values at which every effect is absent, the plant's own zero, shape ``(n_values,)``.
        offset: of each effect's first value, by its key.
        n_memory: number of states in the memory.
    """

    plant: Plant
    effects: tuple[Effect, ...]
    loops: Loops
    neutral: Array
    offset: Mapping[str, int]
    n_memory: int

    def values(self, model: Model) -> Array:
        """The values of ``model`` for this structure, shape ``(n_values,)``."""
        values = self.neutral.copy()
        values[: len(model.plant_values)] = model.plant_values
        for held in model.terms:
            at = self.offset[held.effect.key]
            values[at : at + len(held.values)] = held.values
        return values

    def inner_states(self, model: Model) -> tuple[Array, Array]:
        """States of the slip dynamics and memory of all effects at the start of a run."""
        slip = [held.effect.start(held.values) for held in model.terms if held.effect.slip is not None]
        return (slip[0] if slip else np.zeros(0)), np.zeros(self.n_memory)


@lru_cache(maxsize=1)
def common_effects() -> tuple[Effect, ...]:
    """The effects that every universe holds: one law of each kind, or all where no law is the usual one."""
    able = [effect for effect in EFFECTS.values() if effect.neutral is not None]
    with_usual = {effect.id for effect in EFFECTS.values() if effect.usual}
    return tuple(effect for effect in able if effect.usual or effect.id not in with_usual)


def universe_of(model: Model) -> Universe:
    """The structure that holds the common effects and every term of ``model``."""
    common = {effect.key for effect in common_effects()}
    own = tuple(sorted(held.effect.key for held in model.terms if held.effect.key not in common))
    return _universe(model.plant, own)


@lru_cache(maxsize=64)
def _universe(plant: Plant, own: tuple[str, ...]) -> Universe:
    places = list(Place)
    effects = sorted(
        (*common_effects(), *(EFFECTS[key] for key in own)), key=lambda effect: (places.index(effect.place), effect.order)
    )
    neutral: list[float] = [0.0] * len(plant.parameters)
    offset = {}
    for effect in effects:
        offset[effect.key] = len(neutral)
        neutral += effect.neutral or [1.0] * len(effect.parameters)
    n_memory = sum(effect.n_memory for effect in effects)
    return Universe(plant, tuple(effects), loops_for(plant, effects), np.array(neutral), offset, n_memory)
