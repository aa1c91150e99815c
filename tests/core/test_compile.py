"""Compiled loops: cached on disk, usable where nothing can be written, and built from what the model is made of."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from fric.engine.compile import loops_for
from fric.model import Model, build_model, term

SCRIPT = """
import sys, time
import numpy as np
from fric.model import build_model, term
from fric.simulation import Predictor, simulate
model = build_model("rigid", {"mass": 1.2}, [term("coulomb", force=4.0)])
start = time.perf_counter()
motion = simulate(model, np.full(100, 9.0), 1e-3, fused=True)
Predictor(model, fused=True).run(np.zeros(2), np.zeros(2), np.ones(2), np.zeros(2), 1e-3)
took = time.perf_counter() - start
(module,) = [module for name, module in sys.modules.items() if name.startswith("fric_assembled")]
stats = [module.simulate.stats, module.predict.stats]
hits, misses = (sum(sum(getattr(each, name).values()) for each in stats) for name in ("cache_hits", "cache_misses"))
print(hits, misses, took, motion.velocity[-1])
"""


def environment(**changes: str) -> dict[str, str]:
    return {**os.environ, **changes}


def run(**changes: str) -> tuple[int, int, float, float]:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", SCRIPT],
        env=environment(**changes),
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    hits, misses, took, velocity = done.stdout.split()
    return int(hits), int(misses), float(took), float(velocity)


def stamps(folder: Path) -> dict[str, int]:
    return {str(path): path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


def test_the_second_process_compiles_nothing(tmp_path: Path) -> None:
    hits, misses, first, velocity = run(FRIC_CACHE_DIR=str(tmp_path))
    assert (hits, misses) == (0, 2)
    files = stamps(tmp_path)
    assert files
    hits, misses, second, again = run(FRIC_CACHE_DIR=str(tmp_path))
    assert (hits, misses) == (2, 0)
    assert again == velocity
    assert stamps(tmp_path) == files
    assert second < 0.7 * first


def test_where_nothing_can_be_written_it_works_and_leaves_nothing(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    below = str(blocked / "below")
    _, misses, _, velocity = run(FRIC_CACHE_DIR=below, XDG_CACHE_HOME=below, HOME=below, TMPDIR=str(scratch))
    assert misses == 2
    assert abs(velocity - 0.099 * (9.0 - 4.0) / 1.2) < 1e-12
    assert list(scratch.iterdir()) == []


def test_two_processes_may_start_at_once_in_an_empty_cache(tmp_path: Path) -> None:
    both = [
        subprocess.Popen(
            [sys.executable, "-c", SCRIPT],
            env=environment(FRIC_CACHE_DIR=str(tmp_path)),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(2)
    ]
    answers = [process.communicate(timeout=100) for process in both]
    assert [process.returncode for process in both] == [0, 0], answers
    assert answers[0][0].split()[-1] == answers[1][0].split()[-1]


def model(*names: str) -> Model:
    known = {
        "coulomb": term("coulomb", force=4.0),
        "viscous": term("viscous", coefficient=10.0),
        "bias": term("bias", force=0.5),
    }
    return build_model("rigid", {"mass": 1.2}, [known[name] for name in names])


def test_one_structure_is_compiled_once_whatever_its_values() -> None:
    assert model("coulomb").loops is model("coulomb").with_value("mass", 3.0).loops
    assert model("coulomb").loops is not model("bias").loops


def test_parameters_reach_the_term_they_belong_to() -> None:
    # Terms at the same place in both orders: values must follow.
    for names in (("viscous", "bias"), ("bias", "viscous")):
        held = model(*names)
        loops = loops_for(held.plant, [each.effect for each in held.terms])
        effort, friction = np.empty(1), np.empty(1)
        one = np.ones(1)
        loops.predict(held.values, one, one, one, one, 1e-3, one, 0.0 * one, np.zeros(0), np.zeros(0), effort, friction)
        assert effort[0] == 1.2 * 1.0 + 10.0 * 1.0 + 0.5
        assert friction[0] == 0.0
