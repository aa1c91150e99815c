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
from dataclasses import replace

import numpy as np

from ..model import Model
from ..record import Array, Record
from .additive.residual import independent_values
from .candidates import place_of
from .confidence import UNEXPLAINED
from .differences import Contradiction, Told
from .fitting import NOTHING, State
from .growth import Growth
from .judging import most_left
from .limits import EVIDENCE
from .own_values import GAIN, Differing, Own
from .price import OF_EXCESS, OF_FLOOR, PER_PARAMETER

__all__ = ["contradiction_of", "without_stand_ins"]


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
            # Recordings at other speeds or places tell other averages of physics that has no name here, too.
            if left > begin.excess * most_left(growth if state is end else replace(growth, steps=())):
                continue
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
    while price < end.excess:
        least = max(OF_EXCESS * rest, OF_FLOOR * begin.floor, price)
        names = [name for name, left in own.promised().items() if own.left() - left > least]
        # First order fails where a contact sticks in the model and slides in the machine.
        fits = [own.fitted((*own.own, name)) for name in names]
        best = min(fits, key=lambda each: each.left(), default=own)
        left = max(best.left() - begin.floor, 0.0)
        if rest - left < least:
            break
        own, rest = best, left
        # What stood in for the last one goes again.
        for name in own.own[:-1]:
            without = own.fitted(tuple(each for each in own.own if each != name))
            if (lacks := max(without.left() - begin.floor, 0.0)) - rest < least:
                own, rest = without, lacks
    if not own.own:
        return None
    own = own.fitted(own.own)  # to its end, wherever the last fit began
    rest = max(own.left() - begin.floor, 0.0)
    if rest + PER_PARAMETER * own.n_additional * begin.excess > end.excess:
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
        others_agree=found.others_agree,
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
