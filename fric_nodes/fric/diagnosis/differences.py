"""What is told of recordings that contradict each other: plain data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

__all__ = ["Contradiction", "Told"]


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
        others_agree: whether the values in the other recordings are one but for their errors.
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
    others_agree: bool = True

    @property
    def phrase(self) -> str:
        """Values and difference in words; where the others differ, too, all values."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        if not self.others_agree:
            each = [f"{value:.4g}(± {std:.1g}){unit} in {source}" for source, value, std in self.values]
            return f"{self.parameter} is {', '.join(each[:-1])} and {each[-1]}"
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
            "others_agree": self.others_agree,
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
