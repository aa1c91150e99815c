"""Identification: parameters from recordings, with standard errors that account for correlated residuals.

Every method is one file with a constant ``METHOD`` and the same contract: ``fit(structure, records, options) ->
Identification``.
"""

from __future__ import annotations

from ..registry import discover
from .result import Method

__all__ = ["METHODS"]

METHODS: dict[str, Method] = {method.id: method for method in discover(f"{__name__}.methods", "METHOD", Method)}
"""Every method by its id."""
