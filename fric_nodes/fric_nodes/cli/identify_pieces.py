"""``fric identify --pieces``: a recording that doesn't fit into memory, identified piece by piece."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from fric.errors import InputError

from .options import Reading, progress
from .printed import console, plain_table
from .results import Record as ResultRecord
from .results import Results

if TYPE_CHECKING:
    from fric.identification.piecewise import Combined, Piecewise
    from fric.identification.result import Method, Options
    from fric.model import Model
    from fric.record import Record

__all__ = ["identify_pieces", "refuse_too_large"]

_RECORD = ResultRecord("result.json", ("parameters", "method", "pieces"))
_FILES = ("model.yaml", "pieces.csv", "report.html")


def identify_pieces(
    path: Path,
    seconds: float,
    reading: Reading,
    results: Results,
    structure: Callable[[Record], Model],
    method: Callable[[Model], Method],
    options: Callable[[Method], Options],
) -> None:
    """Identify a recording piece by piece, and write model.yaml, pieces.csv, result.json and report.html.

    Raises:
        InputError: the recording can't be read, or no piece of it identified.
    """
    from fric.bagio.pieces import pieces
    from fric.identification.piecewise import identified_piecewise
    from fric.model_file import model_to_text
    from fric.report.pieces import pieces_report

    results = results.claimed(_RECORD, _FILES)
    read = pieces(
        path,
        seconds,
        joint=reading.joint,
        topics=reading.topic_names(),
        time=reading.clock,
        repair=reading.repair,
        start=reading.start,
        end=reading.end,
    )
    found = identified_piecewise(read, structure, method, options, progress)
    summary = _summary(found, seconds)
    texts = {
        "model.yaml": model_to_text(found.model),
        "pieces.csv": _table(found),
        "report.html": pieces_report(found, path.name),
        _RECORD.name: json.dumps(summary, indent=2) + "\n",
    }
    results.write(_RECORD, texts)
    if results.as_json:
        typer.echo(json.dumps(summary))
    else:
        _print(found, results.out)


def refuse_too_large(paths: list[Path], reading: Reading) -> None:
    """Refuse recordings that don't fit into memory, in place of being ended by the system halfway.

    Raises:
        InputError: one of them does not fit.
    """
    from fric.bagio.memory import available, needed

    room = available()
    for path in paths:
        want = 0 if room is None else needed(path, reading.topic_names(), room)
        if room is not None and want > room:
            problem = f"needs about {want / 1e9:.2g} GB of memory, and {room / 1e9:.2g} GB are free"
            raise InputError(path, problem, "identify it piece by piece: --pieces 600")


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _summary(found: Piecewise, seconds: float) -> dict[str, Any]:
    def entry(each: Combined) -> dict[str, Any]:
        return {
            "value": each.value,
            "std": _number(each.error),
            "unit": each.unit,
            "interval": [_number(each.value - each.half), _number(each.value + each.half)],
            "scatter": _number(each.scatter),
            "drift_per_hour": _number(each.drift),
            "drift_interval": [_number(each.drift - each.drift_half), _number(each.drift + each.drift_half)],
            "pieces": each.pieces,
        }

    refused = [{"begin": row.begin, "end": row.end, "why": row.refused} for row in found.rows if row.refused]
    return {
        "parameters": {each.name: entry(each) for each in found.combined},
        "method": found.method,
        "pieces": {"seconds": seconds, "all": len(found.rows), "used": len(found.used), "refused": refused},
        "notes": list(found.notes),
    }


def _table(found: Piecewise) -> str:
    """One row for each piece: times [s], each parameter and the ends of its 95 % interval, and the status."""
    text = io.StringIO()
    names = [each.name for each in found.combined]
    head = [f"{name}{what}" for name in names for what in ("", " low", " high")]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["begin [s]", "end [s]", *head, "status"])
    for row in found.rows:
        cells = []
        for name in names:
            value, half = row.values.get(name, math.nan), row.half(name)
            cells += [f"{x:.9g}" if math.isfinite(x) else "" for x in (value, value - half, value + half)]
        status = f"refused: {row.refused}" if row.refused else "used"
        writer.writerow([f"{row.begin:.9g}", f"{row.end:.9g}", *cells, status])
    return text.getvalue()


def _print(found: Piecewise, out: Path) -> None:
    shell = console()
    numeric = ("value", "from", "to", "scatter", "drift per hour", "from", "to")
    shown = plain_table(("parameter", *numeric, "unit"), numeric)
    for each in found.combined:
        numbers = (each.scatter, each.drift, each.drift - each.drift_half, each.drift + each.drift_half)
        ends = (each.value - each.half, each.value + each.half)
        texts = [
            *(f"{x:.6g}" if math.isfinite(x) else "-" for x in ends),
            *(f"{x:.2g}" if math.isfinite(x) else "-" for x in numbers),
        ]
        shown.add_row(each.name, f"{each.value:.6g}", *texts, each.unit)
    shell.print(f"{len(found.used)} of {len(found.rows)} pieces, {found.method}; 95 % intervals")
    shell.print(shown)
    for line in found.notes:
        shell.print(f"- {line}")
    shell.print(f"written: {out / 'model.yaml'}, {', '.join((*_FILES[1:], _RECORD.name))}")
