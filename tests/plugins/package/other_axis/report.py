"""The page of a result of this package."""

from __future__ import annotations

from fric.report.kind import Report


class Own:
    """A result."""


REPORT = Report(Own, lambda found, train, validation, options: "<html>its own page</html>")
