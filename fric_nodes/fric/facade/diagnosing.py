"""What physics a model leaves out of what recordings show."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from ..diagnosis import diagnose as _diagnose
from ..diagnosis.blocks import in_blocks
from ..diagnosis.result import Diagnosis, Finding
from ..errors import InputError
from ..files import write_text
from ..identification.force_needed import require_force
from ..identification.screen import screened
from ..identification.workflow import Progress, silent
from ..model import Model
from ..model_file import model_to_text
from ..record import Record
from ..report.kind import page_of
from .reading import records_of
from .structure import ModelLike, model_from

if TYPE_CHECKING:
    from .reading import Source

__all__ = ["Diagnosed", "diagnose"]


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A verdict on a model.

    Attributes:
        result: all that was found.
        train: the recordings learnt from.
        validation: the recordings held back.
    """

    result: Diagnosis
    train: tuple[Record, ...]
    validation: tuple[Record, ...]

    @property
    def findings(self) -> Sequence[Finding]:
        """The effects that are missing, the largest first; empty when the model describes the recordings."""
        return self.result.findings

    @property
    def components(self) -> pd.DataFrame:
        """A table with one row per component of the machine: ``presence``, ``evidence_nats``, ``force_rms``, best ``law``."""
        rows = [
            {
                "component": each.component,
                "place": each.place,
                "presence": each.presence,
                "evidence_nats": each.evidence,
                "force_rms": each.force,
                "law": each.laws[0].effect if each.laws else "",
                "explained": each.laws[0].explained if each.laws else float("nan"),
            }
            for each in self.result.components
        ]
        return pd.DataFrame(rows)

    @property
    def model(self) -> Model:
        """The nominal model with the missing effects added and all values refitted."""
        return self.result.model

    @property
    def prediction(self) -> pd.DataFrame:
        """Forces on the recordings held back: measured, and by the nominal, the refitted and the augmented model [F]."""
        parts = []
        for p in self.result.prediction:
            columns = {
                "time": p.time,
                "force_measured": p.force_measured,
                "force_nominal": p.force_nominal,
                "force_refit": p.force_refit,
                "force_augmented": p.force_augmented,
            }
            part = pd.DataFrame(columns)
            if len(self.result.prediction) > 1:
                part["recording"] = p.source
            parts.append(part)
        return pd.concat(parts)

    def summary(self) -> str:
        """The verdict, the evidence for each finding, and what to record next."""
        found = self.result
        faults = [check for check in found.checks if check.verdict == "fault"]
        lines = [
            found.sentence,
            found.force_errors_in_words,
            *(f"- {each.evidence}; {each.component}; {each.where.regime}" for each in found.findings),
            *(f"- {each.sentence(found.given.units.force)}" for each in found.components if each.is_there),
            found.limits_in_words,
            *(f"- instrument: {check.detail}; {check.remedy}" for check in faults),
            *(f"- {note}" for note in found.notes),
            f"next: {found.next_experiment}",
        ]
        return "\n".join(line for line in lines if line)

    def to_dict(self) -> dict[str, Any]:
        """The contents of report.json (``fric-report/1``)."""
        return self.result.report()

    def report(self, path: str | Path | None = None) -> str:
        """The report as one HTML page, written to ``path`` where one is given."""
        page = page_of(self.result, self.train, self.validation)
        if path is not None:
            write_text(Path(path), page)
        return page

    def files(self) -> dict[str, str]:
        """Contents of report.html, model.yaml, prediction.csv and report.json, by name."""
        return {
            "report.html": self.report(),
            "model.yaml": model_to_text(self.model),
            "prediction.csv": self.prediction.to_csv(index=False, float_format="%.9g"),
            "report.json": json.dumps(self.to_dict(), indent=2) + "\n",
        }

    def save(self, folder: str | Path) -> list[Path]:
        """Write :meth:`files` into ``folder``, all made before the first is written, and return their paths."""
        texts = {Path(folder) / name: text for name, text in self.files().items()}
        for path, text in texts.items():
            write_text(path, text)
        return list(texts)


def diagnose(
    train: Source | Iterable[Source],
    model: ModelLike,
    *,
    validate: Source | Iterable[Source] = (),
    blocks: int | None = None,
    progress: Progress = silent,
    at_most: float | None = None,
) -> Diagnosed:
    """Find what physics a model leaves out, and show how the fit improves on recordings that nothing was learnt from.

    Args:
        train: recordings of one joint to learn from: records, paths or tables, one or several; see :func:`fric.read`.
        model: the model in question: a model, its file, or effects as for :func:`fric.identify`.
        validate: recordings held back.
        blocks: instead of ``validate``: cut each recording into so many blocks and hold every other one back.
        progress: told what is going on, a line at a time.
        at_most: time after which no further effects are looked for [s]; None: the search ends by itself, and comes to the
            same each time.

    Raises:
        InputError: the recordings can't be used; neither or both of ``validate`` and ``blocks`` are given.
    """
    records, held_back = records_of(train), records_of(validate)
    if not records:
        raise InputError("diagnose", "no recording is given", "give one to learn from")
    if bool(held_back) == (blocks is not None):
        raise InputError("--validate", "is needed, or --blocks, and not both", "hold a recording back, or blocks: --blocks 6")
    nominal = model_from(model, records[0].joint, records[0].units)
    records, held_back = [screened(each) for each in records], [screened(each) for each in held_back]
    require_force(records)
    if blocks is not None:
        records, held_back = in_blocks(records, blocks)
    return Diagnosed(_diagnose(records, held_back, nominal, progress, at_most), tuple(records), tuple(held_back))
