"""The section that a report shows of the checks."""

from __future__ import annotations

from fric.instrument import Finding
from fric.report.checks import checks_rows, checks_section, checks_sentence

LATE = Finding("delay", "fault", "the effort comes late", 0.01, "s", (0.009, 0.011), "one clock", recording=1)
FINE = Finding("delay", "ok", "together", 0.0, "s", recording=0)
ODD = Finding("offset", "warning", "a <constant> force", 3.0, "N", remedy="zero it", recording=0)


def test_faults_come_first_and_say_what_to_do() -> None:
    rows = checks_rows([FINE, ODD, LATE], ["a", "b"])
    assert [row[1] for row in rows] == ["FAULT", "warning", "in order"]
    assert rows[0][2:] == ("b", "0.01 s (0.009 to 0.011)", "the effort comes late", "one clock")


def test_the_sentence() -> None:
    assert "delay between force and motion" in checks_sentence([FINE, LATE])
    assert checks_sentence([FINE]) == "No fault of the recordings was found."
    assert "Warnings: " in checks_sentence([FINE, ODD])


def test_text_is_escaped() -> None:
    html = "".join(checks_section([ODD], ["a"]).blocks)
    assert "a &lt;constant&gt; force" in html
    assert "<constant>" not in html
