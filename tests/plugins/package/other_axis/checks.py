"""A check that is always content."""

from __future__ import annotations

from fric.instrument.check import Check, Evidence, Finding


def _run(evidence: Evidence) -> list[Finding]:
    return [Finding("named", "ok", f"{len(evidence.records)} recording(s) have a name")]


CHECK = Check("named", "has a name", "other", _run)
