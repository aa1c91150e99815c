"""Experiment design: the next excitation, within limits, that most reduces the worst uncertainty of a model's parameters.

``limits`` holds the limits of the machine, ``settings`` the settings to try, ``trial`` evaluates one excitation, ``search``
finds the best, ``proposal`` starts from a fit and writes the result down.
"""

from __future__ import annotations

from .limits import DesignError, Limits, Rig, rig_of
from .proposal import Proposal, problem_for, propose

__all__ = ["DesignError", "Limits", "Proposal", "Rig", "problem_for", "propose", "rig_of"]
