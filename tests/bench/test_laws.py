"""The C loops of ``fric bench laws`` and what the benchmark makes of them; the motion that both come to is not timed here."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fric.bench.benchmarks import laws
from fric.bench.compiled_c import FOLDER, compile_loop, compiler
from fric.errors import InputError
from fric.model import term

BY_LAW = {case.law: replace(case, n_steps=3000) for case in laws.CASES}


@pytest.mark.parametrize("law", ["STRIBECK", "ACCEL_HYSTERESIS", "LAG", "LUGRE", "GMS"])
def test_both_come_to_the_same_motion(law: str, tmp_path: Path) -> None:
    case = BY_LAW[law]
    mine, other = laws.ours(case), laws.theirs(case, tmp_path)
    assert mine() > 0.0
    assert other() > 0.0
    assert laws.difference(mine, other) <= 1e-12
    np.testing.assert_allclose(mine.friction, other.friction, rtol=1e-9, atol=1e-9)
    assert np.ptp(mine.motion[:, 0]) > 1e-3
    assert mine.motion[:, 1].min() < 0.0 < mine.motion[:, 1].max()
    first = mine.motion.copy()
    mine()
    assert np.array_equal(first, mine.motion), "a run starts from rest each time"


@pytest.mark.parametrize("law", BY_LAW)
def test_every_c_text_compiles_without_a_warning(law: str) -> None:
    case = BY_LAW[law]
    quiet = ["-Wno-unused-parameter", "-Wno-unused-function"]
    command = [str(compiler()), "-fsyntax-only", "-Wall", "-Wextra", "-Werror", *quiet, f"-D{law}", str(FOLDER / case.source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_coulomb_and_viscous_friction_in_c_follow_their_closed_form(tmp_path: Path) -> None:
    # u - F_C = 2 on a mass of 1.2 with 10 v: v tends to 0.2 with the time constant 0.12.
    run = compile_loop("algebraic.c", "COULOMB_VISCOUS", tmp_path)
    n, h = 400, 1e-3
    motion, friction, applied = np.zeros((n, 2)), np.zeros(n), np.zeros(n)
    run(np.array([1.2, 4.0, 10.0]), np.full(n, 6.0), h, 1.0, 0.0, np.zeros(2), np.zeros(0), motion, friction, applied)
    t = h * np.arange(1, n + 1)
    np.testing.assert_allclose(motion[:, 1], 0.2 * (1.0 - np.exp(-t / 0.12)), rtol=2e-5)
    assert np.all(friction == 4.0)
    assert np.all(applied == 6.0)


def test_a_ratio_of_different_equations_is_refused(tmp_path: Path) -> None:
    # Hess and Soom's curve under the name of static friction.
    case = replace(BY_LAW["HESS_SOOM"], law="ASYMMETRY")
    (figure,) = laws.measure(case, tmp_path, turns=1)
    assert figure.reached is False
    assert "motion" in figure.name


def test_the_ratio_is_that_of_the_times(tmp_path: Path) -> None:
    mine, other, ratio = laws.measure(BY_LAW["HESS_SOOM"], tmp_path, turns=2)
    assert (mine.unit, other.unit, ratio.unit) == ("ns", "ns", "1")
    assert ratio.value == pytest.approx(other.value / mine.value)
    assert ratio.goal == ">= 0.8"


def test_without_a_compiler_it_says_so_and_gives_its_own_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setattr(laws, "CASES", (BY_LAW["HESS_SOOM"],))
    missing, step = laws.run()
    assert missing.value == 0.0
    assert "compiler" in missing.name
    assert step.unit == "ns"
    assert step.reached is None


def test_a_text_that_does_not_compile_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"algebraic\.c: .* failed"):
        compile_loop("algebraic.c", "NO_SUCH_LAW", tmp_path)


def test_the_laws_with_a_goal() -> None:
    with_goal = {case.law for case in laws.CASES if case.goal}
    assert {"LUGRE", "GMS", "COULOMB_VISCOUS", "STRIBECK", "HESS_SOOM", "STATIC", "QUADRATIC", "ASYMMETRY"} <= with_goal
    assert term("presliding", "gms", stiffness=1.0, attraction=1.0).values[3] == 10.0, "M is 10 unless it is given"
