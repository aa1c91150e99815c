"""Recursive least squares that forget faster by a factor, which is a setting of its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fric.identification.online import Estimator, EstimatorKind, OnlineIdentifier, OnlineOptions
from fric.method_settings import Setting
from fric.model import Model


@dataclass(frozen=True)
class Settings(OnlineOptions):
    hurry: Annotated[float, Setting("Factor by which it forgets faster", positive=True)] = 2.0


def begin(structure: Model, options: OnlineOptions, hold: str) -> Estimator:
    assert isinstance(options, Settings)
    return OnlineIdentifier(structure, options.forgetting_time / options.hurry, options)


ESTIMATOR = EstimatorKind("hasty", "hasty least squares", begin, ("forgetting_time",), Settings)
