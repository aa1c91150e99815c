"""The plug-in of ``ros2 doctor``: declared in both builds, and with the interface that it asks for."""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
import sys
import types
from pathlib import Path

import pytest
from fric_nodes.installation import Item

from fric_nodes import ros2_doctor

ROOT = Path(__file__).resolve().parents[2]
GROUPS = {"ros2doctor.checks": "InstallationCheck", "ros2doctor.report": "InstallationReport"}


class _Result:
    """The part of ros2doctor.api.Result that a check may use."""

    def __init__(self) -> None:
        self.error = self.warning = 0

    def add_error(self) -> None:
        self.error += 1

    def add_warning(self) -> None:
        self.warning += 1


class _Report:
    """The part of ros2doctor.api.Report that a report may use."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.items: list[tuple[str, str]] = []

    def add_to_report(self, item_name: str, item_info: str) -> None:
        self.items.append((item_name, item_info))


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What the check prints; of ros2doctor itself where it is installed, else with a stand-in that has its interface."""
    lines: list[str] = []
    if importlib.util.find_spec("ros2doctor") is None:
        api, words = types.ModuleType("ros2doctor.api"), types.ModuleType("ros2doctor.api.format")
        api.Result, api.Report = _Result, _Report  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "ros2doctor", types.ModuleType("ros2doctor"))
        monkeypatch.setitem(sys.modules, "ros2doctor.api", api)
        monkeypatch.setitem(sys.modules, "ros2doctor.api.format", words)
    words = importlib.import_module("ros2doctor.api.format")
    for name in ("doctor_error", "doctor_warn"):
        monkeypatch.setattr(words, name, lines.append, raising=False)
    return lines


@pytest.mark.parametrize("group", GROUPS)
def test_the_entry_points_lead_to_the_classes(group: str) -> None:
    found = {each.value for each in importlib.metadata.distribution("fric").entry_points if each.group == group}
    assert found == {f"fric_nodes.ros2_doctor:{GROUPS[group]}"}
    for build in ("pyproject.toml", "fric_nodes/setup.py"):
        text = (ROOT / build).read_text(encoding="utf-8")
        assert group in text
        assert f"fric_nodes.ros2_doctor:{GROUPS[group]}" in text
    assert hasattr(ros2_doctor, GROUPS[group])


def test_faults_and_warnings_are_counted_and_said(said: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    items = [Item("one", "ok", "good"), Item("two", "warning", "bad", "do this"), Item("three", "fault", "worse")]
    monkeypatch.setattr(ros2_doctor, "examine", lambda: items)
    check, report = ros2_doctor.InstallationCheck(), ros2_doctor.InstallationReport()
    result = check.check()
    assert (result.error, result.warning) == (1, 1)
    assert said == ["fric, two: bad; do this", "fric, three: worse"]
    assert check.category() == report.category() == "fric"
    assert report.report().items == [("one", "ok: good"), ("two", "warning: bad"), ("three", "fault: worse")]


def test_of_this_installation(said: list[str]) -> None:
    assert ros2_doctor.InstallationCheck().check().error == 0, said
    assert "middleware" in [name for name, _ in ros2_doctor.InstallationReport().report().items]
