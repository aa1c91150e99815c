"""The mapping of ``fric import``: where each signal of a file comes from, its unit, and a factor.

.. code-block:: yaml

    joint: axis
    time:     {from: t, unit: s}
    position: {from: qm, unit: m}
    effort:   {from: vir, scale: gtau, unit: N}

A signal is ``value = column * scale + offset`` in ``unit``, and is then converted to SI.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from ..importers.errors import ImportingError
from ..importers.table import closest

__all__ = ["ImportMap", "PeriodMap", "SignalMap", "load_mapping"]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class PeriodMap(_Strict):
    """Time of samples that were taken at a constant rate and have no column for it."""

    period: float = Field(gt=0)
    unit: str


class SignalMap(_Strict):
    """Where a signal comes from.

    Attributes:
        source: name of the column or variable, or number of the column from 0 (``from`` in YAML).
        unit: unit of ``column * scale + offset``.
        scale: a factor, or the name of a scalar variable of the file; negative to turn the sign.
        offset: added after the factor [unit].
        file: another file, relative to the folder of the main one.
        minus: a signal that is taken away from it, such as the force of a pressure from all that a load cell measures.
        time: its own time, where it was not sampled together with the others; on the same clock as the time of the mapping,
            or, given as a period, from the same start.
    """

    source: str | int = Field(alias="from")
    unit: str
    scale: float | str = 1.0
    offset: float = 0.0
    file: str | None = None
    minus: SignalMap | None = None
    time: SignalMap | PeriodMap | None = None


class ImportMap(_Strict):
    """What ``fric import`` makes of a file; every field but the signals has a default.

    Attributes:
        joint: name of the joint in the bag.
        time, position, effort, velocity, reference, normal_load, temperature: the signals. Without a position, the velocity is
            integrated.
        extra: further signals by name.
        delimiter, decimal, skip_rows, header: how to read a text file; found out when not given.
        effort_hold: see :class:`~fric.record.Record`; ``mean``, over the sample before, is ``preceding``.
    """

    joint: str = "axis"
    time: SignalMap | PeriodMap
    effort: SignalMap
    position: SignalMap | None = None
    velocity: SignalMap | None = None
    reference: SignalMap | None = None
    normal_load: SignalMap | None = None
    temperature: SignalMap | None = None
    extra: dict[str, SignalMap] = Field(default_factory=dict)
    delimiter: str | None = None
    decimal: Literal[".", ","] | None = None
    skip_rows: int | None = Field(default=None, ge=0)
    header: bool | None = None
    effort_hold: Literal["following", "preceding", "mean", "linear", "unknown"] = "unknown"

    @model_validator(mode="after")
    def _moves(self) -> ImportMap:
        if self.position is None and self.velocity is None:
            raise ValueError("a position or a velocity is needed")
        return self


def load_mapping(mapping: ImportMap | Mapping[str, Any] | str | Path) -> ImportMap:
    """A mapping from a YAML file, a dictionary, or as it is.

    Raises:
        ImportingError: not readable, not YAML, or it does not fit, with the line.
    """
    if isinstance(mapping, ImportMap):
        return mapping
    if isinstance(mapping, Mapping):
        return _validated(mapping, "mapping")
    path = Path(mapping)
    try:
        content = YAML(typ="rt").load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ImportingError(path, f"mapping cannot be read ({error})", "give a YAML file") from error
    except MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}: " if error.problem_mark else ""
        raise ImportingError(path, f"{line}not YAML ({error.problem})", "correct the mapping") from error
    except YAMLError as error:
        raise ImportingError(path, f"not YAML ({error})", "correct the mapping") from error
    if not isinstance(content, Mapping):
        raise ImportingError(path, "holds no mapping", "start from: time, position, effort, each {from: NAME, unit: UNIT}")
    return _validated(content, path)


def _validated(content: Mapping[str, Any], where: object) -> ImportMap:
    try:
        return ImportMap.model_validate(content)
    except ValidationError as error:
        # A union reports each of its branches; the deepest finding is the one about what was meant.
        findings = error.errors()
        finding = next((item for item in findings if item["type"] == "extra_forbidden"), findings[0])
        keys = [part for part in finding["loc"] if part not in {"SignalMap", "PeriodMap"}]
        time = _time_of(content, finding["loc"])
        if time is not None:
            meant = "PeriodMap" if "period" in time else "SignalMap"
            finding = next((item for item in findings if meant in item["loc"]), finding)
            keys = [part for part in finding["loc"] if part not in {"SignalMap", "PeriodMap"}]
        line = _line(content, keys)
        at = f"line {line}: " if line else ""
        raise ImportingError(where, f"{at}{_problem(finding, keys)}", _remedy(finding, keys)) from error


def _time_of(content: Mapping[str, Any], place: Sequence[object]) -> Mapping[str, Any] | None:
    """The entry of a time, of the mapping or of one of its signals, that a finding is about."""
    inner: Any = content
    for part in place:
        inner = inner.get(part) if isinstance(inner, Mapping) else None
        if part == "time":
            return inner if isinstance(inner, Mapping) else None
    return None


def _line(content: Any, keys: Sequence[object]) -> int | None:
    """Line of a key in the YAML it was read from."""
    line: int | None = None
    for key in keys:
        position = getattr(content, "lc", None)
        if position is None or not isinstance(content, Mapping) or key not in content:
            break
        line = int(position.key(key)[0]) + 1
        content = content[key]
    return line


def _allowed(keys: Sequence[object]) -> list[str]:
    """Keys that are allowed beside the last of ``keys``."""
    if len(keys) == 1:
        return list(ImportMap.model_fields)
    if "time" in keys[:-1]:
        return ["from", "unit", "scale", "offset", "file", "period"]
    return ["from", "unit", "scale", "offset", "file", "minus", "time"]


def _problem(finding: Any, keys: Sequence[object]) -> str:
    name = ".".join(map(str, keys))
    if finding["type"] == "extra_forbidden":
        return f"unknown key '{name}'{closest(str(keys[-1]), _allowed(keys))}"
    if finding["type"] == "missing":
        return f"key '{name}' is missing"
    message = str(finding["msg"]).removeprefix("Value error, ")
    return f"{name}: {message}" if name else message


def _remedy(finding: Any, keys: Sequence[object]) -> str:
    if finding["type"] == "extra_forbidden":
        return f"allowed here: {', '.join(_allowed(keys))}"
    if finding["type"] == "missing":
        return "add it, as in position: {from: NAME, unit: m}"
    return "correct the mapping"
