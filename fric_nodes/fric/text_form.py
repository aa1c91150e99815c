"""What the text forms of models share (YAML): load, check, say the line of what is wrong, write.

Each form has its entries, as pydantic models, and an error of its own; how YAML is read and a finding told is the same for all.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import YAMLError

from .errors import InputError
from .parameter import Parameter
from .record import Units

__all__ = [
    "STRICT", "Number", "Positive", "UnitsEntry", "dumped", "field_of", "line_of", "loaded", "row", "text_of", "units_entry",
    "validated",
]  # fmt: skip

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
"""No key that isn't known, no number that isn't one."""

Number = Annotated[float, Field(strict=True)]
Positive = Annotated[float, Field(strict=True, gt=0.0)]
Entry = TypeVar("Entry", bound=BaseModel)


class UnitsEntry(BaseModel):
    """Units of positions and forces."""

    model_config = STRICT
    position: Literal["m", "rad"]
    force: str = Field(min_length=1)


def text_of(path: str | os.PathLike[str], form: str, refusal: type[InputError]) -> str:
    """The text in the file ``path``.

    Raises:
        InputError: as ``refusal``: there is none, or it can't be read.
    """
    try:
        return Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise refusal(path, "no such file", f"give the path of a {form} file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise refusal(path, f"cannot be read ({error})", f"give the path of a {form} text file") from None


def loaded(text: str, source: str, what: str, form: str, refusal: type[InputError]) -> Any:
    """The tree of ``text``, which is to be ``what`` (with its article); ``source`` names it in messages.

    Raises:
        InputError: as ``refusal``: it isn't YAML, or no mapping.
    """
    try:
        tree = YAML(typ="rt").load(text)
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f", line {mark.line + 1}" if mark is not None else ""
        problem = str(getattr(error, "problem", None) or "is not YAML")
        raise refusal(f"{source}{line}", problem, "correct the YAML") from None
    if not isinstance(tree, Mapping):
        raise refusal(source, f"is not {what}", f"start it with 'format: {form}'")
    return tree


def validated(
    kind: type[Entry],
    raw: Any,
    tree: Any,
    source: str,
    refusal: type[InputError],
    at: tuple[str | int, ...] = (),
    missing: Callable[[Sequence[int | str]], str] = lambda _: "add it",
) -> Entry:
    """``raw``, which stands in ``tree`` at ``at``, as ``kind``.

    Args:
        kind: of entry.
        raw: what is to be one.
        tree: of the whole file.
        source: names it in messages.
        refusal: the error.
        at: where ``raw`` stands.
        missing: what to do about a missing key, by its place in ``raw``.

    Raises:
        InputError: as ``refusal``, with the first thing that is wrong and its line.
    """
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        # A misspelt key shows as one unknown and one missing: the unknown one says more.
        first = min(error.errors(), key=lambda found: found["type"] != "extra_forbidden")
        location = (*at, *first["loc"])
        name = ".".join(str(part) for part in location) or "file"
        problem, remedy = {
            "extra_forbidden": (f"unknown key '{name}'", f"use only {', '.join(kind.model_fields)}"),
            "missing": (f"'{name}' is missing", missing(first["loc"])),
        }.get(first["type"], (f"'{name}' is {first['input']!r}", f"{first['msg'][0].lower()}{first['msg'][1:]}"))
        raise refusal(f"{source}, line {line_of(tree, location)}", problem, remedy) from None


def line_of(tree: Any, location: Sequence[str | int]) -> int:
    """Line of the file, counted from 1, at which the entry at ``location``, or the nearest one around it, stands."""
    line = 1
    for key in location:
        try:
            at = tree.lc.item(key) if isinstance(key, int) else tree.lc.key(key)
            line = int(at[0]) + 1
            tree = tree[key]
        except (KeyError, IndexError, TypeError, AttributeError):
            break
    return line


def row(values: Iterable[float]) -> CommentedSeq:
    """Numbers on one line, with all their digits."""
    held = CommentedSeq(float(value) for value in values)
    held.fa.set_flow_style()
    return held


def units_entry(units: Units) -> CommentedMap:
    """``units`` on one line."""
    held = CommentedMap({"position": units.position, "force": units.force})
    held.fa.set_flow_style()
    return held


def dumped(root: CommentedMap) -> str:
    """``root`` as text."""
    yaml = YAML(typ="rt")
    yaml.default_flow_style = False
    yaml.width = 120
    stream = StringIO()
    yaml.dump(root, stream)
    return stream.getvalue()


def field_of(parameter: Parameter) -> tuple[Any, Any]:
    """Type and constraints of a declared parameter, for a pydantic model of a file."""
    bounds: dict[str, Any] = {}
    if parameter.positive:
        bounds["gt"] = max(parameter.lower, 0.0)
    elif parameter.lower > -float("inf"):
        bounds["ge"] = parameter.lower
    if parameter.upper < float("inf"):
        bounds["le"] = parameter.upper
    default = ... if parameter.default is None else parameter.default
    # Strict, so that neither a truth value nor a quoted number passes for one; the schema says the same.
    return float, Field(
        default, strict=True, description=f"{parameter.symbol} [{parameter.dimension}]: {parameter.doc}", **bounds
    )
