"""Parameters of a model from recordings."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..files import write_text
from ..identification.choice import method_for
from ..identification.result import Identification, Method, Options, Score
from ..identification.uncertainty import Uncertainty, assess
from ..identification.workflow import Fitted, Progress, identified, silent
from ..method_settings import parsed, set_values
from ..model import Model
from ..model_file import write_model
from ..report.kind import page_of
from ..threads import linear_algebra_in_one
from .reading import records_of
from .structure import ModelLike, to_fit

if TYPE_CHECKING:
    import pandas as pd

    from .reading import Source

__all__ = ["Identified", "identify"]


@dataclass(frozen=True, eq=False)
class Identified:
    """A model identified from recordings.

    Attributes:
        fitted: the result of the fit, and what it was found from.
        intervals: intervals of the parameters where they were asked for, or None.
    """

    fitted: Fitted
    intervals: Uncertainty | None = None

    @property
    def result(self) -> Identification:
        """All that the fit gave: covariance, scores, warnings, notes."""
        return self.fitted.result

    @property
    def model(self) -> Model:
        """The model with the values found and their standard errors."""
        return self.result.model

    @property
    def parameters(self) -> pd.DataFrame:
        """A table with one row per parameter: ``value``, ``standard_error``, ``unit`` and whether it was ``fitted``."""
        import pandas as pd

        rows = self.to_dict()["parameters"]
        table = pd.DataFrame.from_dict(rows, orient="index").rename(columns={"std": "standard_error"})
        return table.astype({"value": float, "standard_error": float})

    def __getitem__(self, name: str) -> float:
        """The value of the parameter ``name``, such as ``coulomb.force``."""
        return self.model.value(name)

    def summary(self) -> str:
        """Values with standard errors, how well they fit, and what to know before they are trusted."""
        result, units = self.result, self.model.units
        names = [parameter.name for parameter in self.model.parameters()]
        wide = max(len(name) for name in names)
        lines = []
        for p in self.model.parameters():
            error = self.model.standard_errors.get(p.name)
            text = "held" if p.name not in result.fitted else "not known" if error is None else f"+- {error:.2g}"
            lines.append(f"{p.name:<{wide}}  {p.value:>11.6g} {text:<12} {p.declaration.unit(units)}")
        for name, score in (("fitted recordings", result.train), ("recordings kept apart", result.validation)):
            if score is not None:
                lines.append(f"{name}: relative force error {score.relative_force_error_percent:.2f} %, NOE {score.noe:.4g} %")
        lines += [f"- {line}" for line in (*result.notes, *result.warnings)]
        return "\n".join([*lines, f"status: {result.status}"])

    def to_dict(self) -> dict[str, Any]:
        """The JSON object that ``fric identify --json`` prints; numbers that aren't known are None."""
        found = summary_of(self.result, self.fitted.options)
        if self.intervals is not None:
            found["uncertainty"] = uncertainty_json(self.intervals)
        return found

    def report(self, path: str | Path | None = None) -> str:
        """The report as one HTML page, written to ``path`` where one is given."""
        page = page_of(self.result, self.fitted.train, self.fitted.validation, self.fitted.options)
        if path is not None:
            write_text(Path(path), page)
        return page

    def save(self, folder: str | Path) -> list[Path]:
        """Write model.yaml, identification.json, report.html and what the method gives besides; all are made before the first.

        Returns:
            The files written.
        """
        out = Path(folder)
        texts = {"identification.json": json.dumps(self.to_dict(), indent=2) + "\n", **self.result.attachments}
        page = self.report()
        write_model(self.model, out / "model.yaml")
        for name, text in texts.items():
            write_text(out / name, text)
        write_text(out / "report.html", page)
        return [out / name for name in ("model.yaml", *texts, "report.html")]


@linear_algebra_in_one()
def identify(
    train: Source | Iterable[Source],
    model: ModelLike = "coulomb,viscous,bias",
    *,
    validate: Source | Iterable[Source] = (),
    method: str | None = None,
    uncertainty: str = "",
    progress: Progress = silent,
    **settings: Any,
) -> Identified:
    """Find the parameters of a model from recordings, with standard errors.

    Args:
        train: recordings of one joint: records, paths or tables, one or several; see :func:`fric.read`.
        model: what to fit: effects (``"coulomb,viscous,stribeck"``), a model whose values are the start, or its file.
        validate: recordings kept apart from the fit, to score it.
        method: id of the method (``fric model methods``); None for the usual one of this model.
        uncertainty: intervals by ``sandwich``, ``bootstrap`` or ``profile``; empty: standard errors only.
        progress: told what is going on, a line at a time; ``print`` will do.
        settings: of the fit, such as ``cutoff=50.0`` [Hz] or ``held=("mass",)``; see :class:`fric.method_settings.Options`. One
            that the method doesn't use is refused.

    Raises:
        InputError: the recordings can't be used or don't determine the model; the message says what to do.

    Example:
        >>> import numpy as np
        >>> t = np.arange(0.0, 10.0, 1e-3)
        >>> q = 0.02 * np.sin(2.0 * np.pi * 0.7 * t) + 0.01 * np.sin(2.0 * np.pi * 2.3 * t)
        >>> v, a = np.gradient(q, t), np.gradient(np.gradient(q, t), t)
        >>> u = 2.0 * a + 5.0 * np.sign(v) + 12.0 * v
        >>> found = identify(Record.from_arrays(t, q, u, effort_hold="linear"), "coulomb,viscous")
        >>> round(found["coulomb.force"], 1)
        5.0
    """
    records, kept_apart = records_of(train), records_of(validate)
    if not records:
        raise InputError("identify", "no recording is given", "give one to fit")
    structure = to_fit(model, records[0].joint, records[0].units)
    options = _options(method_for(method, structure), settings)
    fitted = identified(structure, records, kept_apart, method, options, progress)
    intervals = None
    if uncertainty:
        progress(f"finding intervals by {uncertainty}")
        intervals = assess(fitted.result, list(fitted.train), options, uncertainty)
    return Identified(fitted, intervals)


def _options(method: Method, settings: Mapping[str, Any]) -> Options:
    known = [each.name for each in fields(method.settings)]
    unknown = sorted(set(settings) - set(known))
    if unknown:
        raise InputError("identify", f"no setting is called {', '.join(unknown)}", f"use one of {', '.join(known)}")
    return method.settings(**{name: parsed(name, value, method.settings) for name, value in settings.items()})


def _score(score: Score | None) -> dict[str, float | None] | None:
    """A score; what a method has no figure for is null."""
    return None if score is None else {name: value if math.isfinite(value) else None for name, value in asdict(score).items()}


def summary_of(result: Identification, options: Options) -> dict[str, Any]:
    """The JSON object of an identification."""
    return {
        "parameters": {
            p.name: {
                "value": p.value,
                "std": result.model.standard_errors.get(p.name) if p.name in result.fitted else None,
                "unit": p.declaration.unit(result.model.units),
                "fitted": p.name in result.fitted,
            }
            for p in result.model.parameters()
        },
        "method": result.method,
        "settings": set_values(options),
        "train": _score(result.train),
        "validation": _score(result.validation),
        "correlation": {
            "parameters": list(result.fitted),
            "matrix": [[None if math.isnan(value) else value for value in row] for row in result.correlation.tolist()],
        },
        "status": result.status,
        "warnings": list(result.warnings),
        "notes": list(result.notes),
        "checks": [finding.as_json() for finding in result.checks],
        "identifiability": None if result.foreseen is None else result.foreseen.summary(),
    }


def uncertainty_json(found: Uncertainty) -> dict[str, Any]:
    """Intervals by parameter; null where there is no limit, or no second recording."""

    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "kind": found.kind,
        "probability": found.probability,
        "parameters": {
            name: {
                "std": number(float(found.standard_errors[k])),
                "lower": number(float(found.lower[k])),
                "upper": number(float(found.upper[k])),
                "std_over_restarts": number(float(found.restarts[k])),
                "std_over_recordings": number(float(found.recordings[k])),
            }
            for k, name in enumerate(found.names)
        },
        "notes": list(found.notes),
    }
