"""The score of an examination: every figure with its definition, its goal and, for rates, its interval.

The first finding of a report is what it says first; a report that sees a mismatch and names nothing says ``unknown``, one
that sees none says ``nothing``, and a diagnosis that failed says ``failure``.

*Where it shows.* The key holds the true energy of the mismatch in cells of 10 ms. What the named spans (those of all that is
missing) hold is summed over cells, a cell that is partly covered counting in part. The shortest set of spans that holds as
much is found on a grid of 50 ms, finer than which nobody looks, by taking the fullest first; ``length ratio`` is the length
of the named spans over the length of that set.

*Confidence* is calibrated when of the findings with a confidence of c a share c is right; the expected calibration error is
the mean over ten bins of what lies between the two, weighted by the number of findings. Every finding of every case counts.

Rates come with Wilson's interval of 95 %. Where the truth's laws are others than the candidates', or the sampling is, the goals
of shares are wider by five points.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from scipy.stats import binomtest

from ...effect import Place
from ...effects import EFFECTS
from ...figure import Figure
from ...record import Array
from .reliability import calibration_bins, calibration_error, error_by_chance

__all__ = ["Found", "Outcome", "Rate", "Score", "components_of", "energy_held", "outcome_of", "scored"]

_GRID = 0.05  # [s]
_SLACK = 0.05  # by which the goals of shares are wider in variants of the examination

_COMPONENTS = {
    Place.COMMAND_PATH: frozenset({"command path"}),
    Place.TRANSMISSION: frozenset({"transmission"}),
    Place.SLIP_LEVEL: frozenset({"guideway friction"}),
    Place.SLIP_DYNAMICS: frozenset({"guideway friction"}),
    # A force on the moving body may be called friction of its guideway (viscous) or a load (a spring); both are the place.
    Place.FORCE: frozenset({"guideway friction", "load"}),
    Place.SENSOR: frozenset({"sensor"}),
}


def components_of(effect: str) -> frozenset[str]:
    """In which components an effect of the vocabulary may be placed."""
    found = [_COMPONENTS[each.place] for each in EFFECTS.values() if each.id == effect]
    return frozenset[str]().union(*found)


@dataclass(frozen=True)
class Found:
    """One finding of a report."""

    effect: str
    confidence: float
    runner_up: str
    component: str


@dataclass(frozen=True)
class Outcome:
    """What was concealed in a case, and what was found; ``held`` and ``ratio`` are None where nothing was located.

    Attributes:
        number: of the case.
        kind: of the case.
        effects: concealed; ``unknown`` among them for physics outside the vocabulary; empty where nothing is missing.
        outside: name of the physics outside the vocabulary, or empty.
        components: in which it sits.
        mismatch: whether the report sees a mismatch.
        findings: in the report's order.
        held: share of the mismatch's energy in the spans named.
        ratio: length of the spans named over the shortest that hold as much.
        noe_nominal, noe_refit, noe_augmented: as reported, on the validation [%].
        noe_own: of the true structure fitted to the same data, or None.
        strength: NOE of the refitted nominal structure without noise [%].
        floor: NOE of the noise alone [%].
        seconds: that the diagnosis took.
        failure: what went wrong in it.
    """

    number: int
    kind: str
    effects: tuple[str, ...]
    outside: str
    components: frozenset[str]
    mismatch: bool
    findings: tuple[Found, ...]
    held: float | None
    ratio: float | None
    noe_nominal: float
    noe_refit: float
    noe_augmented: float
    noe_own: float | None
    strength: float
    floor: float
    seconds: float
    failure: str = ""

    @property
    def said(self) -> str:
        """What the report says first."""
        if self.failure:
            return "failure"
        if self.findings:
            return self.findings[0].effect
        return "unknown" if self.mismatch else "nothing"

    @property
    def right(self) -> bool:
        """Whether that is what was concealed: both of two; the place too where all is outside the vocabulary."""
        named = {each.effect for each in self.findings}
        if self.kind == "nothing":
            return self.said == "nothing"
        if self.kind in ("pair", "mixed", "compound"):
            return not self.failure and set(self.effects) <= named
        if self.kind == "unknown":
            return self.said == "unknown" and bool(self.findings) and self.findings[0].component in self.components
        return self.said == self.effects[0]

    @property
    def runner_up_right(self) -> bool:
        """Whether a wrong first finding has the right effect as its runner-up."""
        return not self.right and bool(self.findings) and self.findings[0].runner_up in self.effects


@dataclass(frozen=True)
class Rate:
    """A share of cases with Wilson's interval of 95 %."""

    hits: int
    of: int

    @property
    def value(self) -> float:
        """The share, NaN of none."""
        return self.hits / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper end."""
        if not self.of:
            return math.nan, math.nan
        interval = binomtest(self.hits, self.of).proportion_ci(0.95, "wilson")
        return float(interval.low), float(interval.high)


@dataclass(frozen=True)
class Score:
    """All figures of an examination.

    Attributes:
        figures: with their goals.
        rates: those figures that are rates, by name.
        confusion: number of cases by what was concealed and what was said first.
        bins: of confidence: mean confidence, share right, number.
    """

    figures: tuple[Figure, ...]
    rates: Mapping[str, Rate]
    confusion: Mapping[tuple[str, str], int]
    bins: tuple[tuple[float, float, int], ...] = field(default=())

    @property
    def missed(self) -> tuple[Figure, ...]:
        """Figures that miss their goal."""
        return tuple(each for each in self.figures if each.reached is False)


def outcome_of(key: Mapping[str, Any], folder: Path, noe_own: float | None) -> Outcome:
    """The outcome of a case from its opened key and what the diagnosis has written."""
    done = json.loads((folder / "done.json").read_text())
    report: dict[str, Any] = {}
    if not done["failure"]:
        report = json.loads((folder / "report.json").read_text())
    findings = tuple(_finding(each) for each in report.get("findings", ()))
    held = ratio = None
    spans = [(float(first), float(last)) for first, last in report.get("where", {}).get("time", ())]
    if spans and key["kind"] != "nothing":
        held, ratio = energy_held(np.array(key["energy"]), key["cell"], spans)
    components = frozenset(key["components"])
    components = components.union(*(components_of(effect) for effect in key["effects"] if effect != "unknown"))
    validation = report.get("validation", {})
    return Outcome(
        number=key["number"],
        kind=key["kind"],
        effects=tuple(key["effects"]),
        outside=key["physics_outside"] or "",
        components=components,
        mismatch=bool(report.get("mismatch", False)),
        findings=findings,
        held=held,
        ratio=ratio,
        noe_nominal=float(validation.get("noe_nominal", math.nan)),
        noe_refit=float(validation.get("noe_refit", math.nan)),
        noe_augmented=float(validation.get("noe_augmented", math.nan)),
        noe_own=noe_own,
        strength=key["noe_refit"],
        floor=key["noise_floor"],
        seconds=done["seconds"],
        failure=done["failure"],
    )


def _finding(entry: Mapping[str, Any]) -> Found:
    where = entry.get("where", {})
    return Found(
        effect=entry["effect"],
        confidence=float(entry.get("confidence", math.nan)),
        runner_up=(entry.get("runner_up") or {}).get("effect", ""),
        component=where.get("component", ""),
    )


def energy_held(energy: Array, cell: float, spans: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Share of ``energy`` ``(n_cells,)`` within ``spans`` [s], and their length over that of the shortest that hold as much."""
    n = energy.shape[0]
    covered = np.zeros(n)
    edges = np.arange(n + 1) * cell
    for first, last in _merged(spans):
        covered += np.clip(np.minimum(edges[1:], last) - np.maximum(edges[:-1], first), 0.0, cell) / cell
    total = float(np.sum(energy))
    if total <= 0.0:
        return 0.0, math.inf
    held = float(energy @ covered) / total
    per = max(round(_GRID / cell), 1)
    coarse = np.sort(np.add.reduceat(energy, np.arange(0, n, per)))[::-1] / total
    cumulated = np.cumsum(coarse)
    whole = int(np.searchsorted(cumulated, held * (1 - 1e-12)))
    before = float(cumulated[whole - 1]) if whole > 0 else 0.0
    part = (held - before) / float(coarse[whole]) if whole < coarse.shape[0] and coarse[whole] > 0.0 else 0.0
    shortest = (whole + part) * per * cell
    length = float(np.sum(covered)) * cell
    return held, length / shortest if shortest > 0.0 else math.inf


def _merged(spans: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    found: list[tuple[float, float]] = []
    for first, last in sorted(spans):
        if found and first <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], last))
        elif last > first:
            found.append((first, last))
    return found


def _widened(goal: str, slack: float) -> str:
    """``goal``, if there is one, easier by ``slack``."""
    relation, _, limit = goal.partition(" ")
    return goal and f"{relation} {float(limit) + (slack if relation == '<=' else -slack):.3g}"


def scored(outcomes: Sequence[Outcome], variant: str = "standard") -> Score:
    """The score of these outcomes of an examination of the kind ``variant``.

    What shows between the samples of a slow log alone can't be named: there only what is said wrongly has a goal.
    """
    slack = 0.0 if variant == "standard" else _SLACK
    by_kind = {
        kind: [each for each in outcomes if each.kind == kind]
        for kind in ("moderate", "weak", "pair", "unknown", "nothing", "mixed", "compound")
    }
    rates: dict[str, Rate] = {}
    figures: list[Figure] = []

    def rate(name: str, cases: Sequence[Outcome], hit: Callable[[Outcome], bool], goal: str = "") -> None:
        found = Rate(sum(hit(each) for each in cases), len(cases))
        if found.of:
            rates[name] = found
            unseen = variant == "slow-log" and goal.startswith(">") and "unknown" not in name
            figures.append(Figure(name, found.value, "1", "" if unseen else _widened(goal, slack)))

    rate("single effects of moderate strength, named first", by_kind["moderate"], lambda o: o.right, ">= 0.95")
    rate("weak single effects, named first", by_kind["weak"], lambda o: o.right, ">= 0.75")
    rate("pairs, both named", by_kind["pair"], lambda o: o.right, ">= 0.8")
    rate("nothing missing, but something found (false alarms)", by_kind["nothing"], lambda o: not o.right, "<= 0.02")
    rate("outside the vocabulary, said to be unknown, at the right place", by_kind["unknown"], lambda o: o.right, ">= 0.9")
    rate("outside the vocabulary, said to be unknown", by_kind["unknown"], lambda o: o.said == "unknown")
    mixed = by_kind["mixed"]
    rate("an effect beside physics outside the vocabulary: the effect named", mixed, lambda o: _names(o, o.effects[0]))
    rate("the same: said that something unknown is there", mixed, lambda o: _names(o, "unknown"))
    rate("the same: something else named that is more than half sure", mixed, _sure_and_wrong)
    figures += _compound_figures(by_kind["compound"], rates)
    single = by_kind["moderate"] + by_kind["weak"]
    wrong = [each for each in single if not each.right]
    rate("wrong single effects whose runner-up is right", wrong, lambda o: o.runner_up_right)
    rate("single effects with further findings", single, lambda o: len(o.findings) > 1)
    rate("first finding in the right component", [o for o in outcomes if o.effects and o.findings], _component_right)
    figures += _place_figures(by_kind, rates)
    figures += _noe_figures(outcomes, by_kind, "" if variant == "slow-log" else "<= 1.1")
    stated = [(f.confidence, f.effect in o.effects) for o in outcomes for f in o.findings if f.confidence >= 0]
    bins = calibration_bins(stated)
    if stated:
        error = calibration_error(stated)
        figures.append(Figure("expected calibration error of the confidence", error, "1", _widened("<= 0.05", slack)))
        chance = error_by_chance([confidence for confidence, _ in stated])
        figures.append(Figure("the same by chance alone, were every confidence exact", chance, "1"))
    figures.append(Figure("diagnoses that failed", float(sum(bool(o.failure) for o in outcomes)), "", "<= 0"))
    figures.append(Figure("time of a diagnosis, median", median(o.seconds for o in outcomes), "s"))
    figures.append(Figure("time of a diagnosis, longest", max(o.seconds for o in outcomes), "s"))
    confusion: dict[tuple[str, str], int] = {}
    for each in outcomes:
        if each.kind not in ("pair", "mixed", "compound"):
            at = (each.effects[0] if each.effects else "nothing", each.said)
            confusion[at] = confusion.get(at, 0) + 1
    return Score(tuple(figures), rates, confusion, bins)


def _names(outcome: Outcome, effect: str) -> bool:
    return any(each.effect == effect for each in outcome.findings)


def _sure_and_wrong(outcome: Outcome) -> bool:
    return any(each.effect not in outcome.effects and each.confidence > 0.5 for each in outcome.findings)


def _component_right(outcome: Outcome) -> bool:
    return outcome.findings[0].component in outcome.components


def _compound_figures(cases: Sequence[Outcome], rates: dict[str, Rate]) -> list[Figure]:
    """Of what is concealed in several effects at once: how much is found at least half sure, how much of that is so."""
    if not cases:
        return []
    surely = [[each.effect for each in case.findings if each.confidence >= 0.5 and each.effect != "unknown"] for case in cases]
    pairs = list(zip(cases, surely, strict=True))
    found = {
        "several effects: each found with a presence of at least 0.5": (
            Rate(sum(len(set(case.effects) & set(told)) for case, told in pairs), sum(len(case.effects) for case in cases)),
            ">= 0.8",
        ),
        "the same: effects told with at least 0.5 that are there": (
            Rate(sum(effect in case.effects for case, told in pairs for effect in told), sum(len(told) for told in surely)),
            ">= 0.92",
        ),
        "the same: all effects of a case found": (
            Rate(sum(set(case.effects) <= set(told) for case, told in pairs), len(cases)),
            ">= 0.5",
        ),
    }
    rates.update({name: rate for name, (rate, _) in found.items() if rate.of})
    return [Figure(name, rate.value, "1", goal) for name, (rate, goal) in found.items() if rate.of]


def _place_figures(by_kind: Mapping[str, Sequence[Outcome]], rates: dict[str, Rate]) -> list[Figure]:
    strong = [each for kind in ("moderate", "pair", "unknown") for each in by_kind[kind]]
    located = [(each.held, each.ratio) for each in strong if each.held is not None and each.ratio is not None]
    if not strong:
        return []
    good = Rate(sum(held >= 0.8 and ratio <= 2.0 for held, ratio in located), len(strong))
    rates["spans hold 80 % and are at most twice the shortest"] = good
    figures = [Figure("spans hold 80 % and are at most twice the shortest", good.value, "1")]
    if located:
        figures += [
            Figure("share of the mismatch's energy in the named spans, median", median(h for h, _ in located), "1", ">= 0.8"),
            Figure("named spans over the shortest that hold as much, median", median(r for _, r in located), "1", "<= 2"),
        ]
    return figures


def _noe_figures(outcomes: Sequence[Outcome], by_kind: Mapping[str, Sequence[Outcome]], goal: str) -> list[Figure]:
    named = [each for kind in ("moderate", "weak", "pair") for each in by_kind[kind]]
    own = [each.noe_augmented / each.noe_own for each in named if each.noe_own is not None and each.noe_own > 0.0]
    own = [each for each in own if math.isfinite(each)]
    figures = []
    if own:
        figures.append(Figure("NOE on unseen data over the true structure's own, median", median(own), "1", goal))
        figures.append(Figure("cases with a fit of the true structure", float(len(own)), ""))
    said = [each for each in outcomes if math.isfinite(each.noe_augmented) and math.isfinite(each.noe_refit)]
    worse = sum(each.noe_augmented > each.noe_refit * (1.0 + 1e-9) for each in said)
    figures.append(Figure("cases where unseen data are worse than with the refitted nominal", float(worse), "", "<= 0"))
    return figures
