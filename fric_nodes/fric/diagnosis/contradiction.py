"""Recordings of one axis that contradict each other: which of them differs from the others, in which value, and by how much.

One model fitted to recordings that were made with different loads, lubricants or gains of the force sensor averages them, and
what is then missing in each of them is no effect. So, once a model has been grown, its parameters and the gain of the force
are given values of their own in each recording, one parameter after the other while that helps (:mod:`.own_values`). Where
these explain more than all effects that grew, at the same price for each value, the recordings contradict each other.

Own values are fitted in full only where they promise that at first order. Recordings that agree cost no fit.

Nothing is said where a measured load or temperature differs between the recordings by more than it varies within each, and the
values follow it: that is a cause that effects can tell.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..model import Model
from ..record import Array, Record
from .additive.residual import independent_values
from .candidates import place_of
from .confidence import UNEXPLAINED
from .fitting import NOTHING, State
from .growth import Growth
from .limits import EVIDENCE
from .own_values import GAIN, Differing, Own
from .price import OF_EXCESS, OF_FLOOR, PER_PARAMETER

__all__ = ["Contradiction", "Told", "contradiction_of", "without_stand_ins"]


@dataclass(frozen=True)
class Told:
    """A parameter whose value differs between recordings.

    Attributes:
        parameter: its name in the model, or that of the gain of the force.
        unit: of the values.
        component: part of the machine.
        recording: number, from 1, and source of the one that differs most from the others.
        value: there.
        others: mean of the values in the others, each weighted by how well it is known.
        difference: between the two.
        std: standard error of the difference.
        interval: of the difference, 95 %.
        values: source, value and standard error in each recording.
    """

    parameter: str
    unit: str
    component: str
    recording: tuple[int, str]
    value: float
    others: float
    difference: float
    std: float
    interval: tuple[float, float]
    values: tuple[tuple[str, float, float], ...]

    @property
    def phrase(self) -> str:
        """Values and difference in words."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        number, source = self.recording
        digits = max(1 - math.floor(math.log10(max(self.std, 1e-300))), 0)  # two of the standard error
        low, high = self.interval
        return (
            f"{self.parameter} is {self.value:.4g}{unit} in recording {number} ({source}) and {self.others:.4g}{unit} in the "
            f"other{'s' if len(self.values) > 2 else ''}, a difference of {self.difference:+.{digits}f} ± "
            f"{self.std:.{digits}f}{unit} (95 %: {low:+.{digits}f} to {high:+.{digits}f})"
        )

    def as_json(self) -> dict[str, Any]:
        """As ``report.json`` has it."""
        return {
            "parameter": self.parameter,
            "unit": self.unit,
            "recording": {"number": self.recording[0], "source": self.recording[1]},
            "value": self.value,
            "others": self.others,
            "difference": self.difference,
            "std": self.std,
            "interval": list(self.interval),
            "values": [{"source": source, "value": value, "std": std} for source, value, std in self.values],
        }


@dataclass(frozen=True)
class Contradiction:
    """How recordings contradict each other.

    Attributes:
        differs: parameters with values of their own in each recording, what explains most first.
        share: of what is missing that this explains.
        by_effects: the share that all effects that grew explain.
        beside: True where some of what is missing takes these effects as well.
    """

    differs: tuple[Told, ...]
    share: float
    by_effects: float
    beside: bool

    @property
    def sentence(self) -> str:
        """In one sentence."""
        return f"The recordings learnt from contradict each other: {'; '.join(each.phrase for each in self.differs)}."

    def as_json(self) -> dict[str, Any]:
        """As ``report.json`` has it."""
        return {
            "sentence": self.sentence,
            "differs": [each.as_json() for each in self.differs],
            "share": self.share,
            "share_of_effects": self.by_effects,
            "beside_effects": self.beside,
        }


def contradiction_of(growth: Growth, train: Sequence[Record]) -> Contradiction | None:
    """How the recordings ``train``, that ``growth`` was learnt from, contradict each other; None where they don't."""
    begin, end = growth.begin, growth.end
    if len(set(growth.track.record)) < 2 or begin.excess <= NOTHING * begin.floor:
        return None
    tried = []
    for state in (begin, end) if growth.steps else (begin,):
        own = _grown(Own.of(growth.track, state), begin, end)
        if own is not None:
            # Effects that are there besides have their price.
            n_more = len(own.model.values) - len(begin.fit.model.values) + own.n_additional
            left = max(own.left() - begin.floor, 0.0)
            tried.append((left + PER_PARAMETER * n_more * begin.excess, left, state is not begin, own))
    if not tried:
        return None
    _, left, beside, own = min(tried, key=lambda each: each[0])
    differs = [own.differing(name) for name in own.own]
    sure = [each for each in differs if each.is_sure]
    if not sure or any(_follows(each, own, train) for each in sure):
        return None
    told = tuple(_told(each, own, train) for each in sure)
    return Contradiction(told, 1.0 - left / begin.excess, max(1.0 - end.excess / begin.excess, 0.0), beside)


def without_stand_ins(growth: Growth, found: Contradiction) -> Growth:
    """``growth`` without effects that only stand in for what ``found`` says."""
    if found.beside:
        return growth
    why = tuple(
        (step.term.split("#")[0], "explains less than the contradiction of the recordings does") for step in growth.steps
    )
    rejected = (*growth.rejected, *why)
    return replace(growth, end=growth.begin, steps=(), rest=1.0, beyond=0.0, rejected=rejected, unhelped=None)


def _grown(own: Own, begin: State, end: State) -> Own | None:
    """``own`` with values of their own for as many parameters as earn them; None where all effects explain as much."""
    rest = max(own.left() - begin.floor, 0.0)
    price = PER_PARAMETER * (len(own.records) - 1) * begin.excess
    while (offer := own.offered()) is not None:
        least = max(OF_EXCESS * rest, OF_FLOOR * begin.floor, price)
        if rest - max(offer[1] - begin.floor, 0.0) < least:
            break
        fitted = own.fitted(offer[0])
        left = max(fitted.left() - begin.floor, 0.0)
        if rest - left < least:
            break
        own, rest = fitted, left
    if not own.own or rest + PER_PARAMETER * own.n_additional * begin.excess > end.excess:
        return None
    nats = 0.5 * independent_values(own.track, own.residual) * math.log(max(end.left, 1e-300) / max(own.left(), 1e-300))
    return own if nats > EVIDENCE else None


def _follows(found: Differing, own: Own, train: Sequence[Record]) -> bool:
    """Whether the values follow a measured load or temperature that differs between recordings more than within each."""
    about = np.sum((found.values - np.mean(found.values)) ** 2)
    for name in ("normal_load", "temperature"):
        if any(name not in train[number].extra for number in own.records):
            continue
        measured = [train[number].extra[name][train[number].mask] for number in own.records]
        means = np.array([float(np.mean(each)) for each in measured])
        if float(np.ptp(means)) > max(float(np.ptp(each)) for each in measured) and _off_line(means, found.values) < (
            UNEXPLAINED * about
        ):
            return True
    return False


def _off_line(x: Array, y: Array) -> float:
    """Sum of squares that the straight line through ``y`` over ``x`` leaves."""
    line = np.column_stack([np.ones(x.shape[0]), x - np.mean(x)])
    return float(np.sum((y - line @ np.linalg.lstsq(line, y, rcond=None)[0]) ** 2))


def _told(found: Differing, own: Own, train: Sequence[Record]) -> Told:
    sources = [train[number].source for number in own.records]
    unit, component = _where(found.parameter, own.model)
    return Told(
        parameter=found.parameter,
        unit=unit,
        component=component,
        recording=(found.number + 1, train[found.number].source),
        value=found.others + found.difference,
        others=found.others,
        difference=found.difference,
        std=found.std,
        interval=(found.difference - found.reach, found.difference + found.reach),
        values=tuple(zip(sources, found.values.tolist(), found.stds.tolist(), strict=True)),
    )


def _where(parameter: str, model: Model) -> tuple[str, str]:
    """Unit of a parameter, and the part of the machine that it belongs to."""
    if parameter == GAIN:
        return "1", "sensor"
    unit = next(p.declaration.unit(model.units) for p in model.parameters() if p.name == parameter)
    held = next(
        (term for name, term in zip(model.prefixes, model.terms, strict=True) if parameter.startswith(f"{name}.")), None
    )
    return unit, "load" if held is None else place_of(held.effect)
