"""What an online estimator is to the catalogue: how it is begun, and which settings it takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated

from ...method_settings import Options, Setting, declarations, own_settings
from ...model import Model
from .estimate import Estimator

__all__ = ["EstimatorKind", "OnlineOptions"]


@dataclass(frozen=True)
class OnlineOptions(Options):
    """Settings of an online estimator: those of a fit, and how long information counts.

    Attributes:
        forgetting_time: in time of informative motion [s]; infinite: for ever.
    """

    forgetting_time: Annotated[float, Setting("How long informative motion counts", "s", lower=0.1)] = 60.0


@dataclass(frozen=True, eq=False)
class EstimatorKind:
    """One online estimator.

    Attributes:
        id: name among the parameters of the node ``identifier``.
        title: name in a sentence.
        begin: a new estimator of a structure whose values are the start, with options, and with how a sample's force relates to
            the intervals beside it (``following``, ``preceding`` or ``linear``).
        uses: names of the settings of :class:`OnlineOptions` that it honours; another one that is given is refused.
        settings: type of its options: the common ones, or a dataclass derived from them with settings of its own.
    """

    id: str
    title: str
    begin: Callable[[Model, OnlineOptions, str], Estimator] = field(repr=False)
    uses: tuple[str, ...] = ()
    settings: type[OnlineOptions] = OnlineOptions

    def __post_init__(self) -> None:
        unknown = [name for name in self.uses if name not in declarations(OnlineOptions)]
        if unknown:
            raise TypeError(f"estimator '{self.id}' uses settings that are not declared: {', '.join(unknown)}")

    @property
    def own(self) -> tuple[str, ...]:
        """Names of the settings that no other estimator has."""
        return own_settings(self.settings, OnlineOptions)
