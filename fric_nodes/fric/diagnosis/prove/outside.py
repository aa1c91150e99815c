"""Physics outside the vocabulary: what no effect of the registry equals, and where it sits.

The right answer to these is ``unknown`` together with the place. Each is a fault or a property that machines have: a part that
is picked up, a motor that heats up, a supply that dips, a drag chain, dirt, a floor that shakes, a motor that fades
with speed, grease that thins while it is being sheared, an encoder that doesn't run true.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .axis import Setting
from .concealed import Changes, Maker

__all__ = ["OUTSIDE", "Outside"]


@dataclass(frozen=True)
class Outside:
    """One kind of physics that the vocabulary doesn't have.

    Attributes:
        name: of the kind.
        title: in a sentence.
        make: as of a concealed effect.
        components: in which a finding is at the right place.
        windows: True when it acts in spans of time drawn for each recording.
        lacks: parts that the axis may not have.
    """

    name: str
    title: str
    make: Maker
    components: frozenset[str]
    windows: bool = False
    lacks: frozenset[str] = frozenset()


def _payload(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    # The time is that of a recording of usual length; each recording shifts it.
    when = float(random.uniform(0.35, 0.6)) * at.validation_time
    return lambda s: {"payload": min(0.3 * s, 3.0) * at.physics.mass, "payload_time": when}


def _heat(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    time = float(random.uniform(2.0, 6.0))
    usual = at.friction + 0.3 * at.physics.mass * at.acceleration
    return lambda s: {"heat": 0.3 * s, "heat_time": time, "heat_force": usual}


def _dips(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"dip": min(0.3 * s, 0.85)}


def _cable(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    play = at.travel * float(random.uniform(0.08, 0.15))
    begin = at.travel * float(random.uniform(-0.1, 0.0))
    return lambda s: {"cable": s * at.friction / (0.3 * at.travel), "cable_play": play, "cable_position": begin}


def _dirt(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"dirt": 0.6 * s}


def _floor(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    frequency = float(random.uniform(0.15, 0.5)) * at.band
    return lambda s: {"floor": 0.2 * s * at.friction, "floor_frequency": frequency}


def _fading(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    return lambda s: {"fading": min(0.2 * s, 0.8) / at.top_speed}


def _thixotropy(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    time = float(random.uniform(1.0, 4.0))
    shear = float(random.uniform(2.0, 5.0)) / (0.3 * at.top_speed * time)
    return lambda s: {"thixotropy": 2.0 * s * at.friction / at.top_speed, "thixotropy_time": time, "thixotropy_shear": shear}


def _eccentricity(at: Setting, random: np.random.Generator, form: int) -> Callable[[float], Changes]:
    # Short enough for its acceleration to count, long enough to lie in the band.
    period = at.travel * float(random.uniform(0.1, 0.2))
    return lambda s: {"eccentricity": min(0.01 * s, 0.12) * period, "eccentricity_period": period}


_MOTOR = frozenset({"command path", "load"})
_LOAD, _GUIDEWAY, _COMMAND = frozenset({"load"}), frozenset({"guideway friction"}), frozenset({"command path"})

_CATALOGUE = (
    Outside("payload_step", "a payload that is picked up midway", _payload, _LOAD),
    Outside("heating", "an actuator whose gain falls as it heats up", _heat, _COMMAND),
    Outside("supply_dips", "a supply that dips at times", _dips, _COMMAND, windows=True),
    Outside("cable_chain", "a drag chain that pulls on one side, with play", _cable, _LOAD),
    Outside("dirt", "dirt on the guideway at times", _dirt, _GUIDEWAY, windows=True),
    Outside("floor_vibration", "a floor that shakes at a fixed frequency", _floor, _LOAD),
    Outside("fading", "a motor that gives less force the faster it runs", _fading, _MOTOR),
    Outside("thixotropy", "grease that thins while it is sheared", _thixotropy, _GUIDEWAY),
    Outside("eccentricity", "an encoder that runs out of true", _eccentricity, frozenset({"sensor"})),
)  # fmt: skip

OUTSIDE: dict[str, Outside] = {each.name: each for each in _CATALOGUE}
"""By name."""
