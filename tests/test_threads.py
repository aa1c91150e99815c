"""One thread where processes share the cores, as many as there are otherwise."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fric.errors import InputError
from fric.threads import alone, keep_linear_algebra_in_one, linear_algebra_in_one, mapped, n_threads
from threadpoolctl import threadpool_info


def of_linear_algebra(info: list[dict[str, Any]]) -> list[int]:
    return [int(each["num_threads"]) for each in info if each["user_api"] == "blas"]


def test_what_the_environment_asks_for_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FRIC_THREADS", "3")
    assert n_threads() == 3
    monkeypatch.delenv("FRIC_THREADS")
    assert 1 <= n_threads() <= max(os.cpu_count() or 1, 1)


@pytest.mark.parametrize("nonsense", ["many", "0", "-2", "1.5", "²"])
def test_what_is_no_number_of_threads_is_refused(nonsense: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FRIC_THREADS", nonsense)
    with pytest.raises(InputError, match=r"FRIC_THREADS: .* is no number of threads"):
        n_threads()


@pytest.mark.parametrize("threads", [1, 3])
def test_results_keep_their_order_and_what_a_thread_raises_arrives(threads: int) -> None:
    assert mapped(lambda number: number**2, range(50), threads) == [number**2 for number in range(50)]
    with pytest.raises(ZeroDivisionError):
        mapped(lambda number: 1 / number, range(-3, 3), threads)


def test_what_runs_in_a_thread_may_share_its_work_out_again() -> None:
    """With threads of the same pool it would wait for itself."""
    assert mapped(lambda n: sum(mapped(lambda k: k * n, range(4), 2)), range(20), 2) == [6 * n for n in range(20)]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_forked_process_has_threads_of_its_own() -> None:
    assert mapped(abs, [-1, -2], 2) == [1, 2]
    with ProcessPoolExecutor(1, multiprocessing.get_context("fork")) as pool:
        assert pool.submit(mapped, abs, [-3, -4], 2).result(timeout=20.0) == [3, 4]


def test_linear_algebra_gets_its_threads_back() -> None:
    before = of_linear_algebra(threadpool_info())
    assert before
    with linear_algebra_in_one():
        assert set(of_linear_algebra(threadpool_info())) == {1}
    assert of_linear_algebra(threadpool_info()) == before


def test_a_process_among_others_uses_one_thread() -> None:
    # numpy may be loaded before or after that: a variable of the environment would come too late where it is before.
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=alone) as pool:
        assert pool.submit(np.linalg.norm, np.ones(3)).result() == pytest.approx(np.sqrt(3.0))
        assert pool.submit(n_threads).result() == 1
        assert set(of_linear_algebra(pool.submit(threadpool_info).result())) == {1}


def test_a_process_keeps_linear_algebra_in_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=keep_linear_algebra_in_one) as pool:
        assert pool.submit(np.linalg.norm, np.ones(3)).result() == pytest.approx(np.sqrt(3.0))
        assert pool.submit(n_threads).result() == n_threads()  # those that follow recordings are others
        assert set(of_linear_algebra(pool.submit(threadpool_info).result())) == {1}


def test_who_says_how_many_threads_linear_algebra_has_gets_them(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=keep_linear_algebra_in_one) as pool:
        assert pool.submit(os.getenv, "OPENBLAS_NUM_THREADS").result() == "2"
        assert pool.submit(os.getenv, "OMP_NUM_THREADS").result() is None


_PARENT = """
import multiprocessing, os, sys, time
from concurrent.futures import ProcessPoolExecutor
from fric.threads import alone

if __name__ == "__main__":
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn"), initializer=alone) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        time.sleep(600.0)
"""


def test_processes_of_a_pool_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(_PARENT)
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        parent.send_signal(signal.SIGKILL)
        deadline = time.monotonic() + 20.0
        while _runs(child) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not _runs(child)


def _runs(pid: int) -> bool:
    """True while a process runs: one that has ended may wait for whoever inherits it to take notice."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False
