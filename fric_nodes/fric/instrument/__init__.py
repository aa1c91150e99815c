"""The instrument before the physics: what is wrong with a recording itself, found before anything is fitted to it.

One check per file, found by being here; a new one is one new module with a constant ``CHECK``. ``inspect`` runs them all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..model import Model
from ..record import Record
from ..registry import discover
from .check import Check, Correction, Evidence, Finding

__all__ = ["CHECKS", "Correction", "Evidence", "Finding", "faults", "inspect"]

CHECKS: dict[str, Check] = {check.id: check for check in discover(f"{__name__}.checks", "CHECK", Check)}
"""Every check by its id."""


def inspect(
    records: Sequence[Record], model: Model | None = None, settings: Mapping[str, float] | None = None
) -> tuple[Finding, ...]:
    """What every check finds, in the order of the checks and then of the recordings.

    Args:
        records: recordings of one joint.
        model: nominal model whose values are taken as right, for units and for friction that a drive compensates; None: not
            judged.
        settings: known numbers: ``gear_ratio`` [1].
    """
    evidence = Evidence(tuple(records), model, dict(settings or {}))
    return tuple(finding for check in CHECKS.values() for finding in check.run(evidence))


def faults(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Those with the verdict ``fault``."""
    return tuple(finding for finding in findings if finding.verdict == "fault")
