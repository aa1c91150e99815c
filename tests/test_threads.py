"""One thread where processes share the cores, as many as there are otherwise."""

from __future__ import annotations

import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pytest
from fric_nodes.threads import alone, linear_algebra_in_one, n_threads
from threadpoolctl import threadpool_info


def of_linear_algebra(info: list[dict[str, Any]]) -> list[int]:
    return [int(each["num_threads"]) for each in info if each["user_api"] == "blas"]


def test_what_the_environment_asks_for_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FRIC_THREADS", "3")
    assert n_threads() == 3
    for nonsense in ("", "many", "0", "-2"):
        monkeypatch.setenv("FRIC_THREADS", nonsense)
        assert 1 <= n_threads() <= max(os.cpu_count() or 1, 1)


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
