"""Two senders are told from one that is unpunctual, and from one that is silent."""

from __future__ import annotations

import numpy as np
import pytest
from fric.control.safety.senders import SenderWatch


def found_after(rates: list[float], known: int, samples: int = 5000, seed: int = 0) -> int | None:
    """Sample at which more than one sender is found; ``rates`` are commands per sample, the first one unpunctual."""
    random, watch = np.random.default_rng(seed), SenderWatch()
    late = 0
    for k in range(samples):
        # Now and then an answer is late, and comes with the next one.
        hold = random.random() < 0.2
        for _ in range(0 if hold else late + 1):
            watch.command()
        late = late + 1 if hold else 0
        for rate in rates[1:]:
            if random.random() < rate:
                watch.command()
        if watch.sample(known):
            return k
    return None


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("known", [1, 2])
def test_one_unpunctual_sender_is_one(known: int, seed: int) -> None:
    assert found_after([1.0], known, seed=seed) is None


def test_one_sender_that_falls_behind_and_catches_up_is_one() -> None:
    """Its answers come later and later, up to 15 samples, over a hundred samples, and then in time again within twenty."""
    watch = SenderWatch()
    behind = np.concatenate([np.linspace(0.0, 15.0, 100), np.linspace(15.0, 0.0, 20), np.zeros(50)]).astype(int)
    for k in range(1, len(behind)):
        for _ in range(1 + behind[k - 1] - behind[k]):
            watch.command()
        assert not watch.sample(2)


def test_a_second_sender_is_found_beside_one_that_loses_commands() -> None:
    """Each tenth is lost for good: the second one gets no more time than it takes to send what a queue holds."""
    watch = SenderWatch()
    for k in range(1000):
        if k % 10:
            watch.command()
        assert not watch.sample(2)
    for k in range(1000, 1070):
        for _ in range(2 if k % 10 else 1):
            watch.command()
        if watch.sample(2):
            return
    pytest.fail("the second sender isn't found")


@pytest.mark.parametrize(("rate", "within"), [(1.0, 20), (0.2, 100), (0.05, 1000)])
def test_a_second_sender_is_found(rate: float, within: int) -> None:
    found = found_after([1.0, rate], 2)
    assert found is not None
    assert found < within


def test_it_is_over_when_the_second_one_has_left() -> None:
    watch = SenderWatch()
    for _ in range(100):
        watch.command()
        watch.command()
        watch.sample(2)
    assert watch.many
    for _ in range(600):
        watch.command()
        watch.sample(2)
    assert not watch.many
