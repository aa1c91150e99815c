"""What is compiled ahead is what a diagnosis asks for, and a second process finds it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from fric import compiling
from fric.compiling import compiled_beside, parts
from fric.effects import EFFECTS
from fric.engine.compile import CacheFolder

# What a track calls, with its own kinds of arguments; then which loops and terms it had to compile for that.
SCRIPT = """
import sys
import numba.core.event
import numpy as np
from fric.compiling import parts
for part in parts():
    if part.name.startswith("rigid axis, dry friction") or part.name in ("Coulomb friction", "viscous friction"):
        part.compiled()

class Listener(numba.core.event.Listener):
    def on_start(self, event): pass
    def on_end(self, event):
        function = event.data["dispatcher"].py_func
        if (sys.modules[function.__module__].__doc__ or "").startswith("Linked"):
            print(function.__name__)

numba.core.event.register("numba:compile", Listener())
from fric.diagnosis.track import Track
from fric.diagnosis.twin import twins
from fric.model import build_model, term
from fric.record import Record
from fric.simulation import simulate
h = 1e-3
model = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0), term("viscous", coefficient=20.0)])
effort = 18.0 * np.sin(8.0 * h * np.arange(3000))
made = simulate(model, effort, h, fused=True)  # not what is asked for here
track = Track.of([Record(h * np.arange(3000), made.position[:3000], effort)], 100.0, model)
track.residual(model), track.needed(model), twins(track, model, 1), track._followed(model, None)
"""


def test_the_parts_are_all_effects_and_every_loop_of_the_rigid_axis() -> None:
    names = [part.name for part in parts()]
    assert {effect.title for effect in EFFECTS.values()} <= set(names)
    assert sum("pre-sliding: pursue" in name for name in names) == 3


def test_a_diagnosis_finds_what_was_compiled_ahead(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env={**os.environ, "FRIC_CACHE_DIR": str(tmp_path)}, capture_output=True, text=True,
        timeout=200, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


def test_a_second_process_compiles_beside_the_first_and_ends_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "cache_folder", lambda: CacheFolder(tmp_path, kept=True))
    monkeypatch.setenv("FRIC_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)  # a user's own goes before it
    began = time.monotonic()
    with compiled_beside():
        while not list(tmp_path.rglob("*.nbi")) and time.monotonic() < began + 60.0:
            time.sleep(0.1)
    assert list(tmp_path.rglob("*.nbi"))
    files = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    time.sleep(0.5)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == files


def test_nothing_runs_beside_where_all_is_compiled_or_nothing_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*arguments: object, **named: object) -> None:
        raise AssertionError("a process was started")

    monkeypatch.setattr(compiling.subprocess, "Popen", refused)
    for kept in (False, True):
        monkeypatch.setattr(compiling, "cache_folder", lambda kept=kept: CacheFolder(tmp_path, kept=kept))
        stamp = compiling._stamp()
        assert (stamp is None) is not kept
        if stamp is not None:
            stamp.touch()
        with compiled_beside():
            pass
