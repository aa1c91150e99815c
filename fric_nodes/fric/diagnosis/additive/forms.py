"""How much of a component's function the laws of the vocabulary explain.

A law belongs to the component whose function can do nearly the same along the recorded motion. It is weighed in place of that
function, with the functions of all other components left in: log evidence with the law, less that without either. The
evidence for the function itself says how much there is to explain. Laws that explain it equally well share the probability by
Bayes' rule; the part of the function's evidence that the best of them reaches says how completely it is explained.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model import Term
from ...record import Array
from ..costs import NATS_PER_PARAMETER, further_parameters
from ..fitting import State
from ..screen import Column
from .evidence import Grouped
from .residual import PRESENT, Additive

__all__ = ["Form", "forms_of"]

_TRIALS = 2  # of each effect that are weighed in full: the best two by least squares
_ROUNDS = 20  # iterations from the sizes that hold with the functions


@dataclass(frozen=True, eq=False)
class Form:
    """A law in place of a component's function.

    Attributes:
        term: the law, with amplitudes as they come out at first order.
        component: id of the component.
        nats: evidence for the law beside all other components.
        probability: among all laws of the component.
    """

    term: Term
    component: str
    nats: float
    probability: float = 0.0


def forms_of(state: State, taken: Additive) -> list[Form]:
    """The laws that explain what is missing in each component where something is, the best first.

    Args:
        state: of the model that lacks something.
        taken: what it lacks, by components.
    """
    present = {each.component.id for each in taken.presences if each.probability >= PRESENT}
    laws = {f"law {k}": law for k, law in enumerate(taken.laws) if law.place in present}
    groups = {**taken.groups, **{name: law.parts for name, law in laws.items()}}
    grouped = Grouped(state.fit.residual[taken.rows], state.fit.jacobian[taken.rows], groups)
    kept: dict[tuple[str, str], list[tuple[float, str]]] = {}
    for name, law in laws.items():
        target = taken.grouped.residual(taken.weighed) + taken.grouped.part(law.place, taken.weighed)
        effect = law.column.term.effect
        kept.setdefault((law.place, effect.key if effect.form_of else effect.id), []).append(
            (grouped.explained(name, target), name)
        )
    best: dict[str, dict[str, Form]] = {}
    noise = float(np.log(taken.weighed.noise / grouped.size))
    for (place, _), scored in kept.items():
        without = taken.withouts[place]
        others = list(without.groups)
        start = dict(zip(others, without.sizes, strict=True))
        for _, name in sorted(scored, reverse=True)[:_TRIALS]:
            found = grouped.weighed([*others, name], start, noise, _ROUNDS)
            held = _possible(laws[name].column, -grouped.amounts(name, found) / laws[name].sizes)
            if held is None:
                continue
            nats = taken.dependence * (found.log_evidence - without.log_evidence)
            # In doubt it is the simpler law: what a form was chosen for beyond its size, the evidence doesn't count.
            nats -= NATS_PER_PARAMETER * further_parameters(held.effect)
            before = best.setdefault(place, {}).get(held.effect.id)
            if before is None or nats > before.nats:
                best[place][held.effect.id] = Form(held, place, nats)
    return sorted(_shared(best), key=lambda each: -each.nats)


def _shared(best: dict[str, dict[str, Form]]) -> list[Form]:
    """The laws of each component with their shares of the probability."""
    forms = []
    for of_place in best.values():
        nats = np.array([each.nats for each in of_place.values()])
        weight = np.exp(nats - np.max(nats))
        for each, share in zip(of_place.values(), weight / np.sum(weight), strict=True):
            forms.append(Form(each.term, each.component, each.nats, float(share)))
    return forms


def _possible(column: Column, amounts: Array) -> Term | None:
    """The law with its amplitudes, or None where these are such as it can't have."""
    held = column.term
    if not column.amplitudes:
        return held if amounts[0] > 0.0 else None
    wanted = dict(zip(column.amplitudes, amounts.tolist(), strict=True))
    values = []
    for p, value in zip(held.effect.parameters, held.values, strict=True):
        new = wanted.get(p.name, value)
        if p.name in wanted and not p.lower <= new <= p.upper:
            return None
        values.append(new)
    return Term(held.effect, tuple(values))
