"""What recordings can tell about a model, stated before a fit: plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..record import Array

__all__ = ["Finding", "Foreseen"]


@dataclass(frozen=True)
class Finding:
    """One thing that recordings can't tell.

    Attributes:
        kind: ``unseen``, ``coupled`` or ``instrument``.
        parameters: whom it concerns.
        message: what, why, and what to record instead.
        serious: False for what every recording of this kind leaves open.
        experiment: excitation that would help, ``kind`` and ``settings``; None where none was found.
    """

    kind: str
    parameters: tuple[str, ...]
    message: str
    serious: bool = True
    experiment: Mapping[str, Any] | None = None


@dataclass(frozen=True, eq=False)
class Foreseen:
    """What recordings can tell about a structure; arrays of shape ``(n_parameters,)``.

    Attributes:
        names: of the parameters.
        values: at which the sensitivities were taken.
        alone: standard error expected if all others were known, in SI.
        together: standard error expected, in SI; infinite where nothing is known.
        condition: largest condition index.
        motion: what the recordings hold, one sentence.
        findings: in the order of their weight.
    """

    names: tuple[str, ...]
    values: Array
    alone: Array
    together: Array
    condition: float
    motion: str
    findings: tuple[Finding, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before a fit."""
        return tuple(finding.message for finding in self.findings if finding.serious)

    def summary(self) -> dict[str, Any]:
        """As JSON."""

        def number(value: float) -> float | None:
            return float(value) if math.isfinite(value) else None

        return {
            "condition": number(self.condition),
            "motion": self.motion,
            "parameters": {
                name: {
                    "at": float(self.values[k]),
                    "std_alone": number(float(self.alone[k])),
                    "std_expected": number(float(self.together[k])),
                }
                for k, name in enumerate(self.names)
            },
            "findings": [
                {
                    "kind": finding.kind,
                    "parameters": list(finding.parameters),
                    "message": finding.message,
                    "serious": finding.serious,
                    "experiment": finding.experiment,
                }
                for finding in self.findings
            ],
        }
