"""Learning the map from evidence to probability (:mod:`..calibration`) from examinations that are over.

Every finding is one trial: the effect was concealed in that case or not. The weights maximise the
penalised likelihood of all trials (logistic regression; a normal prior on the weights and a narrower one on what is added per
effect, so that an effect that was seldom seen is taken for an ordinary one). Each weight is kept from falling below zero.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize

from ...errors import InputError
from ...record import Array
from ..calibration import FORMAT, Calibration, Evidence, calibration, measures_of
from .injection_exam import told_in
from .reliability import calibration_error, error_by_chance
from .sealing import case_folder, open_key, published

__all__ = ["Trial", "fitted", "learnt", "off_in_use", "off_on_others", "trials_of"]

_WEIGHT = 2.0  # statistical: standard deviation of a weight before anything is known
_EFFECT = 1.0  # statistical: of what is added for an effect: odds of three to one are nothing special
_FEWEST = 30  # statistical: trials from which weights can be learnt


@dataclass(frozen=True)
class Trial:
    """One finding: of which effect, what spoke for it, whether it was right, and in which case of which examination."""

    effect: str
    evidence: Evidence
    right: bool
    case: str = ""


def trials_of(out: Path) -> Iterator[Trial]:
    """The findings of the examination in the folder ``out``, but those of something unknown.

    Of recordings of a real axis with an effect concealed in them, what was named in these as they are may be there or not: it
    is no trial. They all are one case.

    Raises:
        InputError: it holds none.
    """
    for told in told_in(out):
        concealed = told["injected"]["effect"]
        for each in told["findings"]:
            if each["weighed"] and (each["effect"] == concealed or each["effect"] not in told["own"]):
                yield Trial(each["effect"], _evidence(each["weighed"]), each["effect"] == concealed, str(out))
    if next(told_in(out), None) is not None:
        return
    if published(out) is None:
        raise InputError(out, "holds no examination", "give a folder that 'fric prove --out FOLDER' has written")
    for key in open_key(out):
        at = case_folder(out, key["number"]) / "report.json"
        findings = json.loads(at.read_text(encoding="utf-8"))["findings"] if at.exists() else []
        for each in findings:
            if each.get("weighed"):
                right, case = each["effect"] in key["effects"], str(case_folder(out, key["number"]))
                yield Trial(each["effect"], _evidence(each["weighed"]), right, case)


def _evidence(weighed: dict[str, Any]) -> Evidence:
    held: dict[str, Any] = {name: math.inf if value is None else value for name, value in weighed.items()}
    return Evidence(**held)


def learnt(outs: Sequence[Path]) -> dict[str, Any]:
    """The content of ``calibration.json``, learnt from the examinations in ``outs``.

    Raises:
        InputError: no examination, or too few findings.
    """
    trials = [trial for out in outs for trial in trials_of(out)]
    if len(trials) < _FEWEST:
        problem = f"hold {len(trials)} findings, at least {_FEWEST} are needed"
        raise InputError(", ".join(str(out) for out in outs), problem, "give more examinations")
    known = {"format": FORMAT, "examinations": [_provenance(out) for out in outs], **fitted(trials)}
    return {**known, "off on other cases": round(off_on_others(trials), 3)}


def off_on_others(trials: Sequence[Trial]) -> float:
    """Calibration error where the findings of each case are as sure as a map makes them that the other cases taught."""
    pairs = []
    for case in sorted({trial.case for trial in trials}):
        content = fitted([trial for trial in trials if trial.case != case])
        found = Calibration(content["offset"], content["weights"], content["effects"])
        pairs += [(found.probability(t.effect, t.evidence), t.right) for t in trials if t.case == case]
    return calibration_error(pairs)


def off_in_use(outs: Sequence[Path]) -> tuple[float, float]:
    """Calibration error of the map in use on the findings of all examinations together, and what chance alone would make.

    It means something where the map was learnt from none of them.

    Raises:
        InputError: no examination.
    """
    pairs = [(calibration().probability(t.effect, t.evidence), t.right) for out in outs for t in trials_of(out)]
    return calibration_error(pairs), error_by_chance([said for said, _ in pairs])


def _provenance(out: Path) -> dict[str, Any]:
    """Where the trials of a folder come from."""
    injections = len(list(told_in(out)))
    if injections:
        return {"injections": injections, **json.loads((out / "examined.json").read_text(encoding="utf-8"))}
    orders = json.loads((out / "plan.json").read_text(encoding="utf-8"))
    diagnosed = sum((case_folder(out, order["number"]) / "report.json").exists() for order in orders)
    return {"cases": diagnosed, "variant": orders[0]["variant"], "sha256": published(out)}


def fitted(trials: Sequence[Trial]) -> dict[str, Any]:
    """Offset, weights and what is added per effect, as plain data, with the number of findings and of right ones."""
    measures = [measures_of(trial.evidence) for trial in trials]
    names, effects = list(measures[0]), sorted({trial.effect for trial in trials})
    table = np.array([[each[name] for name in names] for each in measures])
    own = np.array([[trial.effect == effect for effect in effects] for trial in trials], dtype=np.float64)
    right = np.array([trial.right for trial in trials], dtype=np.float64)
    columns = np.hstack([np.ones((len(trials), 1)), table, own])
    spread = np.concatenate([[np.inf], np.full(len(names), _WEIGHT), np.full(len(effects), _EFFECT)])

    def cost(weights: Array) -> tuple[float, Array]:
        odds = columns @ weights
        value = float(np.sum(np.logaddexp(0.0, odds) - right * odds) + 0.5 * np.sum((weights / spread) ** 2))
        return value, columns.T @ (1.0 / (1.0 + np.exp(-odds)) - right) + weights / spread**2

    bounds = [(None, None), *[(0.0, None)] * len(names), *[(None, None)] * len(effects)]
    found = minimize(cost, np.zeros(columns.shape[1]), jac=True, bounds=bounds, method="L-BFGS-B").x
    weights, added = found[1 : 1 + len(names)], found[1 + len(names) :]
    return {
        "findings": len(trials),
        "right": int(np.sum(right)),
        "offset": round(float(found[0]), 4),
        "weights": {name: round(float(value), 4) for name, value in zip(names, weights, strict=True)},
        "effects": {name: round(float(value), 4) for name, value in zip(effects, added, strict=True)},
    }
