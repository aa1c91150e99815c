"""Does an experiment design keep its word? Designed from a first fit, recorded on the true axis many times, fitted, compared.

The truth is another than the values that the design was made with, and is integrated in steps four times as fine. A first
recording (4 s of multisine) gives the values and their errors. The proposed recording, and a random-phase multisine of the same
length that uses the same limits to the full, are then made 60 times each with fresh noise of force and position, and fitted by
prediction error together with the first, from start values far off.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context

import numpy as np

from ...excitation import EXCITATIONS
from ...figure import Figure
from ...identification import METHODS
from ...identification.design import Limits, Proposal, Rig, problem_for, propose, rig_of
from ...identification.design.trial import Choice, gains_for, recorded, simulated
from ...identification.result import Options
from ...model import Model, build_model, term
from ...record import Array, Record
from ...threads import alone
from ..benchmark import Benchmark

__all__ = ["BENCHMARK", "CASES", "Case", "first_recording", "fitted", "proposal", "retold"]

_SEEDS = range(60)
_PROCESSES = 2
_FINER = 4
_METHOD = "prediction-error"
_RIG = Rig(period=2e-3, position_noise=3e-8, force_noise=0.3)
_LIMITS = Limits(position=(-0.05, 0.05), speed=0.3, force=(-60.0, 60.0), duration=10.0)

Parts = tuple[tuple[str, dict[str, float]], ...]


@dataclass(frozen=True)
class Case:
    """An axis and where its fits start."""

    truth: Model
    start: Model


def _case(truth: dict[str, dict[str, float]], start: dict[str, dict[str, float]]) -> Case:
    def model(mass: float, terms: dict[str, dict[str, float]]) -> Model:
        return build_model("rigid", {"mass": mass}, [term(name, "", **values) for name, values in terms.items()])

    return Case(model(2.0, truth), model(1.0, start))


_TRUE = {"coulomb": {"force": 10.0}, "viscous": {"coefficient": 35.0}}
_FAR = {"coulomb": {"force": 1.0}, "viscous": {"coefficient": 1.0}}
CASES = {
    "Stribeck": _case(
        _TRUE | {"stribeck": {"force": 4.0, "velocity": 0.005}}, _FAR | {"stribeck": {"force": 1.0, "velocity": 0.02}}
    ),
    "bristles": _case(
        _TRUE | {"presliding": {"stiffness": 3e5, "damping": 400.0}},
        _FAR | {"presliding": {"stiffness": 1e5, "damping": 100.0}},
    ),
}
"""Axes whose friction shows in slow motion only, and in small reversals only."""


def retold(parts: Sequence[Choice]) -> Parts:
    """Excitations as plain values, for other processes."""
    return tuple((part.kind.id, dict(part.values)) for part in parts)


def _recorded(case: Case, parts: Parts, seed: int) -> Record:
    choices = tuple(Choice.of(EXCITATIONS[kind], values) for kind, values in parts)
    motion = simulated(case.truth, choices, _RIG, _LIMITS, gains_for(case.truth, _RIG.period), _FINER)
    if motion.trouble(_LIMITS):
        raise ValueError(f"the true axis breaks the limits: {motion.trouble(_LIMITS)}")
    return recorded(motion, _RIG, np.random.default_rng(seed), f"seed {seed}")


def first_recording(case: Case, seed: int) -> Record:
    """The recording that is there before a design."""
    kind = EXCITATIONS["multisine"]
    values = {p.name: float(p.default or 0.0) for p in kind.parameters} | {"duration": 4.0, "amplitude": 0.04, "speed": 0.25}
    return _recorded(case, ((kind.id, values),), seed)


def proposal(case: Case, n_each: int = 6, n_refining: int = 70) -> Proposal:
    """The design from the first recording of ``case``."""
    record = first_recording(case, 1)
    first = METHODS[_METHOD].fit(case.start, [record], Options())
    predicts = METHODS[_METHOD].predicts
    problem, notes = problem_for(first.model, first, [record], Options(), _LIMITS, rig_of([record]), predicts)
    return propose(problem, n_each=n_each, n_refining=n_refining, notes=notes)


def fitted(name: str, parts: Parts, seed: int) -> tuple[list[float], list[float]]:
    """Estimates and standard errors from a first recording and one of ``parts``, by parameter of the case ``name``."""
    case = CASES[name]
    records = [first_recording(case, 2 * seed + 1000), _recorded(case, parts, 2 * seed + 1001)]
    model = METHODS[_METHOD].fit(case.start, records, Options()).model
    return [model.value(each) for each in model.names], [model.standard_errors.get(each, np.nan) for each in model.names]


def _spread(name: str, found: Proposal, parts: Parts, pool: ProcessPoolExecutor) -> tuple[Array, Array]:
    """Spread and root mean square error of the estimates over the seeds, relative to the true values, ``(n_free,)`` each."""
    rows = np.array([row[0] for row in pool.map(partial(fitted, name, parts), _SEEDS)])
    truth = CASES[name].truth
    index = found.problem.free.index
    error = (rows - truth.values)[:, index] / truth.values[index]
    return np.asarray(np.std(error, axis=0, ddof=1)), np.asarray(np.sqrt(np.mean(error**2, axis=0)))


def run() -> list[Figure]:
    """Predicted and achieved worst errors of every case."""
    figures = []
    with ProcessPoolExecutor(_PROCESSES, get_context("spawn"), initializer=alone) as pool:
        for name, case in CASES.items():
            found = proposal(case)
            if found.generic is None:
                raise ValueError("no multisine keeps the limits")
            problem = found.problem
            before = float(np.max(problem.before()))
            promised = float(np.max(problem.together(found.trial.best.worth).errors))
            spread, rms = _spread(name, found, retold(found.parts), pool)
            generic_spread, generic_rms = _spread(name, found, retold(found.generic.parts), pool)
            achieved = float(np.max(spread))
            head = f"{name} ({found.trial.best.title})"
            figures += [
                Figure(f"{head}: worst relative standard error before", 100.0 * before, "%"),
                Figure(f"{head}: promised", 100.0 * promised, "%"),
                Figure(f"{head}: achieved, spread over {len(_SEEDS)} fits", 100.0 * achieved, "%"),
                Figure(f"{head}: achieved, root mean square error", 100.0 * float(np.max(rms)), "%"),
                Figure(f"{head}: achieved over promised", achieved / promised, "1", ">= 0.7"),
                Figure(f"{head}: achieved over promised, the same", achieved / promised, "1", "<= 1.3"),
                Figure(f"{head}: multisine over proposal, spread", float(np.max(generic_spread)) / achieved, "1", ">= 1"),
                Figure(f"{head}: multisine over proposal, root mean square", float(np.max(generic_rms) / np.max(rms)), "1"),
            ]
    return figures


BENCHMARK = Benchmark("design", "promised and achieved errors of a designed experiment", run, long=True)
