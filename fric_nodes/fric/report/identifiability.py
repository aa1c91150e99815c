"""The section on what was known before a fit: how well each parameter shows, which hang together, what to record instead."""

from __future__ import annotations

import numpy as np

from ..identification.foreseen import Foreseen
from .numbers import significant
from .page import Section, bullets, paragraph, table

__all__ = ["identifiability_section"]


def identifiability_section(found: Foreseen, units: dict[str, str]) -> Section:
    """The section.

    Args:
        found: what was foreseen.
        units: unit of each parameter.
    """
    rows = []
    for k, name in enumerate(found.names):
        alone, together = float(found.alone[k]), float(found.together[k])
        ratio = together / alone if alone > 0.0 and np.isfinite(together) else np.inf
        rows.append(
            (
                name,
                significant(float(found.values[k])),
                significant(alone, 2),
                significant(together, 2),
                f"{ratio:.3g}" if np.isfinite(ratio) and ratio < 1e4 else "unbounded",
                units[name],
            )
        )
    head = ("parameter", "value", "standard error if the others were known", "expected standard error", "ratio", "unit")
    index = (
        f"largest condition index {found.condition:.3g}"
        if found.condition < 1e6
        else "some combinations are not determined at all"
    )
    blocks = [paragraph(f"{found.motion}; {index}."), table(head, rows, text_columns=(0, 5))]
    serious = [finding.message for finding in found.findings if finding.serious]
    others = [finding.message for finding in found.findings if not finding.serious]
    blocks.append(
        bullets(serious) if serious else paragraph("The recordings determine every parameter, each apart from the others.")
    )
    blocks += [paragraph(message[0].upper() + message[1:] + ".", "note") for message in others]
    return Section("What the recordings can tell, found before the fit", tuple(blocks))
