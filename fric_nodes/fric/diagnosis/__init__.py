"""Diagnosis: where a simulation and a recording differ, what physics is missing, and how sure that is."""

from __future__ import annotations

from .diagnose import DiagnosisError, diagnose, refit_noe
from .result import Diagnosis

__all__ = ["Diagnosis", "DiagnosisError", "diagnose", "refit_noe"]
