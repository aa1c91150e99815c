"""An axis simulated here, whose recording the tests write in every way that programs do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from fric.bagio import import_recording
from fric.identification import METHODS
from fric.identification.result import Options
from fric.model import build_model, term
from fric.record import Record

TRUE = {"mass": 2.0, "coulomb.force": 5.0, "viscous.coefficient": 12.0}


class Run(NamedTuple):
    """A recording: time [s], position [m], force [N], each held from its stamp on."""

    t: Any
    q: Any
    u: Any


def simulated(duration: float = 10.0, rate: float = 1000.0, loop: float = 1000.0, seed: int = 0) -> Run:
    """A mass of 2 kg with Coulomb (5 N) and viscous friction (12 N s/m) under a controller that runs at ``loop`` [Hz]."""
    random = np.random.default_rng(seed)
    fine = 10  # steps of integration a sample
    h, n = 1.0 / rate / fine, int(duration * rate)
    phases = random.uniform(0.0, 2 * np.pi, 5)
    frequencies = np.array([0.31, 0.73, 1.37, 2.9, 5.3])
    amplitudes = np.array([60.0, 40.0, 20.0, 8.0, 3.0]) * 1e-3
    x = v = u = 0.0
    t, q, force = np.arange(n) / rate, np.empty(n), np.empty(n)
    every = round(rate / loop)
    wanted = (amplitudes * np.sin(2 * np.pi * np.outer(t, frequencies) + phases)).sum(axis=1)
    wanted -= wanted[0]
    speed = np.gradient(wanted, t)
    for k in range(n):
        if k % every == 0:
            u = 900.0 * (wanted[k] - x) + 80.0 * (speed[k] - v)
        q[k], force[k] = x, u
        for _ in range(fine):
            free = v + h / 2.0 * (u - 12.0 * v)
            v = np.sign(free) * max(abs(free) - h * 2.5, 0.0)
            x += h * v
    return Run(t, np.round(q, 7), np.round(force, 4))


@pytest.fixture(scope="session")
def simulate() -> Callable[..., Run]:
    """Other recordings of the axis."""
    return simulated


@pytest.fixture(scope="session")
def run() -> Run:
    """Ten seconds at 1 kHz."""
    return simulated()


@pytest.fixture
def fitted() -> Callable[[Record], None]:
    """Assert that a record gives the parameters of the axis within 1 %, or three standard errors."""

    def check(record: Record) -> None:
        model = build_model("rigid", {"mass": 1.0}, [term("coulomb", force=1.0), term("viscous", coefficient=1.0)])
        found = METHODS["inverse-dynamics"].fit(model, [record], Options()).model
        for name, value in TRUE.items():
            assert abs(found.value(name) - value) <= max(0.01 * value, 3.0 * found.standard_errors[name]), (
                name,
                found.value(name),
            )

    return check


@pytest.fixture
def imported(tmp_path: Path) -> Callable[..., Record]:
    """Write a file and import it, by the columns t, q and u unless told otherwise."""

    def read(content: str | bytes, name: str = "run.csv", repair: bool = False, **changed: Any) -> Record:
        file = tmp_path / name
        file.write_bytes(content.encode() if isinstance(content, str) else content)
        mapping = {
            "time": {"from": "t", "unit": "s"},
            "position": {"from": "q", "unit": "m"},
            "effort": {"from": "u", "unit": "N"},
            "effort_hold": "following",
        }
        return import_recording(file, {**mapping, **changed}, repair=repair)

    return read
