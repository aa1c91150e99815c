"""Plug-in of ``ros2 doctor``: what ``fric doctor`` finds out about the installation, as one of its checks and in its report.

``ros2 doctor`` finds the classes by the entry points ``ros2doctor.checks`` and ``ros2doctor.report``. It is imported when it
calls them, and needed for nothing else.
"""

from __future__ import annotations

import importlib
from typing import Any

from .installation import Item, examine

__all__ = ["InstallationCheck", "InstallationReport"]

_CATEGORY = "fric"


class InstallationCheck:
    """Has the interface of ``ros2doctor.api.DoctorCheck``."""

    def category(self) -> str:
        """Links the check to its report."""
        return _CATEGORY

    def check(self) -> Any:
        """A ``ros2doctor.api.Result`` with the faults and warnings of the installation, each of which is printed, too."""
        api, words = (importlib.import_module(f"ros2doctor.api{name}") for name in ("", ".format"))
        result = api.Result()
        for item in examine():
            if item.state == "fault":
                result.add_error()
                words.doctor_error(_text(item))
            elif item.state == "warning":
                result.add_warning()
                words.doctor_warn(_text(item))
        return result


class InstallationReport:
    """Has the interface of ``ros2doctor.api.DoctorReport``."""

    def category(self) -> str:
        """Links the report to its check."""
        return _CATEGORY

    def report(self) -> Any:
        """A ``ros2doctor.api.Report`` with everything that was looked at."""
        report = importlib.import_module("ros2doctor.api").Report("FRIC INSTALLATION")
        for item in examine():
            report.add_to_report(item.name, f"{item.state}: {item.detail}")
        return report


def _text(item: Item) -> str:
    return f"fric, {item.name}: {item.detail}" + (f"; {item.remedy}" if item.remedy else "")
