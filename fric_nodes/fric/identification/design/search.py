"""The search for the next excitation: which kinds, with which settings, in which order of worth.

Sought is the recording that, together with what is known already, makes the worst relative error of all parameters smallest
(minimax); the mean of their squares (A-optimal) decides between equals. Information adds up, so that parts are looked at one by
one: settings of every excitation for the whole time and for shares of it, each simulated once. Single parts and pairs of
different kinds that fit into the time are ranked by the sum of what they are worth; the best are simulated as one recording and
refined by Nelder-Mead over the logarithms of their settings. The parameters behind all this are those of a first fit and are
not right, so that the best that were found have to keep the limits with each parameter a standard error higher and lower as
well, and the worst error is judged by the mean over these.
Source: minimax and A-optimal criteria as in Pronzato and Pazman 2013, Design of Experiments in Nonlinear Models, chapter 5.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from ...control.feedbacks.pid import PidGains
from ...excitation_kind import Excitation
from ...model import Model
from ...record import Array, Mask
from ..free_parameters import FreeParameters
from ..result import Options
from ..sensitivity import Information
from .limits import Limits, Rig
from .settings import draw, moved, ranges_of
from .trial import OVERHEAD, Choice, Motion, judged, simulated

__all__ = ["Candidate", "Problem", "Trial", "best_of_each", "explored", "search"]

_SHARES = (1.0, 0.5, 0.3)  # of the time, of which parts are looked at
_KEEP = 0.96  # of the limits in the search: the rest is for parameters that are a little different
_WHOLE = 16  # candidates simulated as one recording
_REFINED = 3
_CHECKED = 12  # of the best, held to the limits with other parameters
_FINALISTS = 4
_TIE = 0.02  # weight of the mean
_SHOWN = 1.0  # relative error from which on a parameter isn't shown


@dataclass(frozen=True, eq=False)
class Problem:
    """What is sought.

    Attributes:
        model: with the values known so far.
        free: parameters to be known better.
        errors: standard errors so far, shape ``(n_free,)``; 0 where not known.
        known: what earlier recordings are worth, or None.
        size: what an error is relative to, shape ``(n_free,)``.
        limits: of the recording.
        rig: its instruments.
        gains: of the controller that follows a planned motion.
        options: of the fit.
        predicts: what its method predicts.
        index: tracking index of a prediction from sample to sample; 0: as each recording asks for.
        reachable: parameters that count, shape ``(n_free,)``: those that some excitation shows at all; None: all.
    """

    model: Model
    free: FreeParameters
    errors: Array
    known: Information | None
    size: Array
    limits: Limits
    rig: Rig
    gains: PidGains
    options: Options
    predicts: str = "force"
    index: float = 0.0
    reachable: Mask | None = None

    def worth(self, model: Model, motion: Motion) -> Information | None:
        """What a recording of ``motion`` is worth when ``model`` made it."""
        return judged(model, self.free, motion, self.rig, self.options, self.size, self.predicts, self.index)

    def together(self, found: Information) -> Information:
        """What ``found`` and the earlier recordings are worth together."""
        return found if self.known is None else self.known + found

    def before(self) -> Array:
        """Relative error of each parameter so far, shape ``(n_free,)``; infinite where nothing is known."""
        if self.known is None:
            return np.full(self.size.shape[0], np.inf)
        errors = self.known.errors
        return np.where(errors < 1e3, errors, np.inf)

    def cost(self, found: Information) -> float:
        """Worst relative error with ``found`` and what is known, and a little of the mean of all."""
        errors = np.minimum(self.together(found).total_errors, 1e6)
        if self.reachable is not None:
            errors = errors[self.reachable]
        return float(np.max(errors) + _TIE * np.sqrt(np.mean(errors**2)))

    def neighbours(self) -> list[Model]:
        """The model with each parameter a standard error (at most half of it) higher and lower."""
        found = []
        values = self.model.values
        for k, number in enumerate(self.free.index.tolist()):
            step = min(float(self.errors[k]), 0.5 * abs(values[number]))
            for sign in (1.0, -1.0) if step > 0.0 else ():
                changed = values.copy()
                changed[number] = min(max(values[number] + sign * step, self.free.lower[k]), self.free.upper[k])
                found.append(self.model.with_values(changed))
        return found


@dataclass(frozen=True, eq=False)
class Candidate:
    """Excitations one after the other, and what a recording of them is worth.

    Attributes:
        parts: at least one.
        worth: of their recording alone.
        cost: see :meth:`Problem.cost`.
    """

    parts: tuple[Choice, ...]
    worth: Information
    cost: float

    @property
    def title(self) -> str:
        """Its kinds."""
        return " + ".join(part.kind.id for part in self.parts)


@dataclass(frozen=True, eq=False)
class Trial:
    """How the search ended.

    Attributes:
        problem: with the parameters that can be reached.
        best: the proposal.
        motion: of the model under it.
        ranking: candidates in the order of their cost, the refined ones included.
        robust: worst error over the parameters' neighbours.
        refused: how many candidates broke a limit, by the limit.
        evaluated: number of simulations.
    """

    problem: Problem
    best: Candidate
    motion: Motion
    ranking: tuple[Candidate, ...]
    robust: float
    refused: dict[str, int]
    evaluated: int


class _Search:
    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.inner = problem.limits.narrowed(_KEEP)
        self.time = problem.limits.duration - OVERHEAD
        self.refused: dict[str, int] = {}
        self.evaluated = 0

    def worth(self, parts: tuple[Choice, ...]) -> Candidate | None:
        """The candidate of these parts when the model keeps the limits under them."""
        problem = self.problem
        self.evaluated += 1
        motion = simulated(problem.model, parts, problem.rig, problem.limits, problem.gains)
        trouble = motion.trouble(self.inner)
        if trouble:
            limit = trouble.split()[0]
            self.refused[limit] = self.refused.get(limit, 0) + 1
            return None
        worth = problem.worth(problem.model, motion)
        return None if worth is None else Candidate(parts, worth, problem.cost(worth))

    def parts(
        self, kinds: Sequence[Excitation], n_each: int, progress: Callable[[str], None], shares: Sequence[float] = _SHARES
    ) -> list[Candidate]:
        """Single parts, as long as these shares of the time."""
        problem = self.problem
        found = []
        for number, share in enumerate(shares):
            duration = share * self.time
            ranges = ranges_of(problem.model, problem.limits, problem.rig, duration)
            drawn = draw(kinds, ranges, self.inner, n_each, seed=1 + 100 * number)
            progress(f"simulating {len(drawn)} excitations of up to {duration:.3g} s")
            found += [candidate for choice in drawn if (candidate := self.worth((choice,))) is not None]
        return sorted(found, key=lambda each: each.cost)

    def reached(self, singles: Sequence[Candidate]) -> list[Candidate]:
        """The same in the order of cost when parameters that nothing shows don't count."""
        if not singles:
            return []
        least = np.min([self.problem.together(each.worth).total_errors for each in singles], axis=0)
        reachable = least < _SHOWN
        self.problem = replace(self.problem, reachable=reachable if np.any(reachable) else None)
        again = [replace(each, cost=self.problem.cost(each.worth)) for each in singles]
        return sorted(again, key=lambda each: each.cost)

    def pairs(self, singles: Sequence[Candidate]) -> list[tuple[float, tuple[Choice, ...]]]:
        """Pairs of different kinds that fit into the time, by the sum of what they are worth."""
        found = []
        for one, two in itertools.combinations(singles, 2):
            a, b = one.parts[0], two.parts[0]
            if a.kind is b.kind or a.output != b.output or a.duration + b.duration > self.time:
                continue
            found.append((self.problem.cost(one.worth + two.worth), (a, b)))
        return sorted(found, key=lambda each: each[0])

    def refined(self, start: Candidate, evaluations: int) -> list[Candidate]:
        """Better ones from ``start`` on, by Nelder-Mead over the logarithms of its settings."""
        problem = self.problem
        ranges = [ranges_of(problem.model, problem.limits, problem.rig, part.duration) for part in start.parts]
        # A part may become as long as the others leave it time.
        spare = self.time - sum(part.duration for part in start.parts)
        ranges = [type(each)(each.by_dimension, each.duration + max(spare, 0.0) / len(ranges)) for each in ranges]
        active = [
            (number, k)
            for number, part in enumerate(start.parts)
            for k, parameter in enumerate(part.kind.parameters)
            if (found := ranges[number].of(parameter)) is not None and found[0] < found[1]
        ]
        seen: list[Candidate] = []

        def cost(point: Array) -> float:
            parts = []
            for number, part in enumerate(start.parts):
                steps = np.zeros(len(part.kind.parameters))
                for (of, k), value in zip(active, point.tolist(), strict=True):
                    if of == number:
                        steps[k] = value
                changed = moved(part, ranges[number], self.inner, steps)
                if changed is None:
                    return 1e3
                parts.append(changed)
            candidate = self.worth(tuple(parts))
            if candidate is None:
                return 1e3
            seen.append(candidate)
            return float(np.log(candidate.cost))

        if active:
            n = len(active)
            simplex = np.vstack([np.zeros(n), 0.35 * np.eye(n) * np.where(np.arange(n) % 2 == 0, 1.0, -1.0)[:, None]])
            options = {"maxfev": evaluations, "initial_simplex": simplex, "adaptive": True, "xatol": 0.02, "fatol": 0.005}
            minimize(cost, np.zeros(n), method="Nelder-Mead", options=options)
        return seen

    def robust(self, candidate: Candidate, neighbours: Sequence[Model]) -> float | None:
        """Mean cost over the neighbours of the model's values, or None when a limit is broken with one of them."""
        problem = self.problem
        costs = [candidate.cost]
        for model in (problem.model, *neighbours):
            motion = simulated(model, candidate.parts, problem.rig, problem.limits, problem.gains)
            self.evaluated += 1
            trouble = motion.trouble(problem.limits)
            if trouble:
                limit = trouble.split()[0]
                self.refused[limit] = self.refused.get(limit, 0) + 1
                return None
            if model is not problem.model:
                worth = problem.worth(model, motion)
                costs.append(1e6 if worth is None else problem.cost(worth))
        return float(np.mean(costs))


def explored(problem: Problem, kinds: Sequence[Excitation], n_each: int = 2) -> list[Candidate]:
    """Single excitations within the limits, a few settings of each, in the order of their cost."""
    return _Search(problem).parts(kinds, n_each, lambda text: None, (1.0, 0.4))


def search(
    problem: Problem,
    kinds: Sequence[Excitation],
    n_each: int = 6,
    n_refining: int = 70,
    progress: Callable[[str], None] = lambda text: None,
) -> Trial | None:
    """The best excitation that is found; None when none keeps the limits.

    Args:
        problem: what is sought.
        kinds: excitations to choose from.
        n_each: settings of each that are looked at, per length.
        n_refining: evaluations of Nelder-Mead for each candidate that is refined.
        progress: is told what is going on.
    """
    work = _Search(problem)
    singles = work.reached(work.parts(kinds, n_each, progress))
    if not singles:
        return None
    problem = work.problem
    whole: list[Candidate] = list(singles)
    for _, parts in work.pairs(singles)[:_WHOLE]:
        candidate = work.worth(parts)
        if candidate is not None:
            whole.append(candidate)
    whole.sort(key=lambda each: each.cost)
    for start in _different(whole, _REFINED):
        progress(f"refining {start.title}: worst relative error {100.0 * start.cost:.3g} %")
        whole += work.refined(start, n_refining)
    whole.sort(key=lambda each: each.cost)
    progress("checking the limits of the best with other parameter values")
    neighbours = problem.neighbours()
    finalists: list[tuple[float, Candidate]] = []
    for candidate in whole[:_CHECKED] + _different(whole[_CHECKED:], _CHECKED):
        mean = work.robust(candidate, neighbours)
        if mean is not None:
            finalists.append((mean, candidate))
        if len(finalists) == _FINALISTS:
            break
    if not finalists:
        return None
    mean, best = min(finalists, key=lambda each: each[0])
    motion = simulated(problem.model, best.parts, problem.rig, problem.limits, problem.gains)
    return Trial(work.problem, best, motion, tuple(whole), mean, work.refused, work.evaluated)


def _different(candidates: Sequence[Candidate], most: int) -> list[Candidate]:
    """The best of each combination of kinds, at most so many."""
    return best_of_each(candidates)[:most]


def best_of_each(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The best candidate of each combination of kinds, from a list in order of cost."""
    found: dict[str, Candidate] = {}
    for candidate in candidates:
        found.setdefault("+".join(sorted(part.kind.id for part in candidate.parts)), candidate)
    return list(found.values())
