"""What is missing by component, as plain data for reports and programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...model import Model
from ..fitting import refit
from ..track import Track
from .forms import Form, forms_of
from .residual import PRESENT, additive
from .together import middle_of

__all__ = ["ComponentFinding", "LawShare", "by_component"]

_REAL_PART = 0.02  # of the missing energy: a seventh of its amplitude; less says nothing about the cause
_WORTH_NAMING = 0.05  # probability among the laws of a component
_MOST_LAWS = 3


@dataclass(frozen=True)
class LawShare:
    """A law of the vocabulary for what is missing in a component.

    Attributes:
        effect: its id.
        law: which of the effect's laws; empty where it has one.
        title: in a sentence.
        probability: among all laws that could be meant there.
        explained: share of the component's evidence that it reaches by itself, 0 to 1.
        parameters: values at first order, by name, in SI.
    """

    effect: str
    law: str
    title: str
    probability: float
    explained: float
    parameters: dict[str, float]


@dataclass(frozen=True)
class ComponentFinding:
    """What is missing in one component of the machine.

    Attributes:
        component: its id.
        title: in a sentence.
        place: part of the machine.
        presence: probability, by Bayes' rule, that the component's function is needed beside all others. It is no verdict on a
            cause: physics that belongs to none of the components, and laws at first order, show as several of them.
        evidence: logarithm of the Bayes factor behind that [nats].
        force: root mean square of the force that is missing there [F].
        share: of the missing force's energy that comes back when this component alone is left out, 0 to 1.
        laws: that could explain it, the most probable first.
    """

    component: str
    title: str
    place: str
    presence: float
    evidence: float
    force: float
    share: float
    laws: tuple[LawShare, ...]

    @property
    def is_there(self) -> bool:
        """True where its function is needed, and makes up a real part of what is missing."""
        return self.presence >= PRESENT and self.share >= _REAL_PART

    def sentence(self, unit: str) -> str:
        """In one sentence; ``unit`` is that of forces."""
        told = f"of what is left, {self.force:.2g} {unit} rms goes with {self.title}"
        if not self.laws:
            return f"{told}; no law of the vocabulary describes it"
        best = self.laws[0]
        others = [each.title for each in self.laws[1:]]
        beside = f" (or {', '.join(others)})" if others else ""
        return f"{told}; {best.title}{beside} explains {100.0 * best.explained:.0f} % of that"

    def as_json(self) -> dict[str, object]:
        """For programs."""
        return {
            "component": self.component,
            "title": self.title,
            "place": self.place,
            "presence": self.presence,
            "evidence_nats": self.evidence,
            "force_rms": self.force,
            "share": self.share,
            "laws": [
                {
                    "effect": each.effect,
                    "law": each.law,
                    "probability": each.probability,
                    "explained": each.explained,
                    "parameters": each.parameters,
                }
                for each in self.laws
            ],
        }


def by_component(tracks: Sequence[Track], model: Model) -> tuple[ComponentFinding, ...]:
    """What ``model`` lacks, component by component, the largest evidence first.

    Beside much that is missing in one component a little shows in others, by which functions and first-order laws fall short
    of it. So this is asked of the model to which all has been added that explains something.

    Args:
        tracks: the recordings learnt from, followed at one or several bandwidths.
        model: fitted to them.
    """
    track = middle_of(tracks)
    state = refit(track, model)
    taken = additive(track, state)
    forms = forms_of(state, taken)
    found = []
    for each in taken.presences:
        mine = [form for form in forms if form.component == each.component.id and form.nats > 0.0]
        found.append(
            ComponentFinding(
                each.component.id,
                each.component.title,
                each.component.place,
                round(each.probability, 4),
                round(each.nats, 2),
                each.rms,
                each.share,
                tuple(_law(form, each.nats) for form in mine if form.probability >= _WORTH_NAMING)[:_MOST_LAWS],
            )
        )
    return tuple(found)


def _law(form: Form, whole: float) -> LawShare:
    effect = form.term.effect
    explained = min(max(form.nats / max(whole, 1e-300), 0.0), 1.0)
    return LawShare(effect.id, effect.law, effect.title, round(form.probability, 4), explained, form.term.by_name)
