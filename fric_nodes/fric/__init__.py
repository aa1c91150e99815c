"""Friction of mechanical axes: recorded, simulated, identified and diagnosed; on arrays and recordings, without ROS.

A task is one call, and its result explains itself::

    import fric

    record = fric.read("bags/slide")
    found = fric.identify(record, "coulomb,viscous,bias", validate="bags/slide_2")
    print(found.summary())
    found.report("report.html")

    diagnosis = fric.diagnose(record, found.model, validate="bags/slide_2")
    print(diagnosis.summary())

Recordings may be bags, files of other programs, pandas tables or plain arrays (:meth:`Record.from_arrays`). Whatever can't be
used raises :class:`InputError`, whose message says what is wrong and what to do.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from .errors import InputError
    from .facade.comparing import Compared, compare
    from .facade.diagnosing import Diagnosed, diagnose
    from .facade.identifying import Identified, identify
    from .facade.plotting import plot
    from .facade.reading import read
    from .facade.simulating import simulate
    from .model import Model, build_model, term
    from .model_file import read_model, write_model
    from .record import Record, Units

__all__ = [
    "Compared",
    "Diagnosed",
    "Identified",
    "InputError",
    "Model",
    "Record",
    "Units",
    "__version__",
    "build_model",
    "compare",
    "diagnose",
    "identify",
    "plot",
    "read",
    "read_model",
    "simulate",
    "term",
    "write_model",
]

_HOMES = {
    "Compared": "facade.comparing",
    "Diagnosed": "facade.diagnosing",
    "Identified": "facade.identifying",
    "InputError": "errors",
    "Model": "model",
    "Record": "record",
    "Units": "record",
    "build_model": "model",
    "compare": "facade.comparing",
    "diagnose": "facade.diagnosing",
    "identify": "facade.identifying",
    "plot": "facade.plotting",
    "read": "facade.reading",
    "read_model": "model_file",
    "simulate": "facade.simulating",
    "term": "model",
    "write_model": "model_file",
}


def __getattr__(name: str) -> object:
    """What is asked for first is imported then: ``import fric`` alone loads no numpy, and compiles nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'fric' has no attribute '{name}'")
    found = getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
