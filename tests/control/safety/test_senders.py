"""Two senders are told from one that is unpunctual, and from one that is silent."""

from __future__ import annotations

import numpy as np
import pytest
from fric.control.safety.senders import SenderWatch

PERIOD = 2_000_000  # [ns]


def sampled(watch: SenderWatch, at: int, senders: int) -> bool:
    """Whether more than one is at work when the sample at ``at`` [periods] is over."""
    watch.tick(at * PERIOD)
    return watch.sample(senders)


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
        if sampled(watch, k, known):
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
        assert not sampled(watch, k, 2)


def held_up(random: np.random.Generator, share: float, samples: int) -> list[int]:
    """Ticks of a process that is held up for two to ten of them now and then, a ``share`` of them; those are left out."""
    ticks, now = [], 0
    for _ in range(samples):
        now += int(random.integers(2, 11)) if random.random() < share else 1
        ticks.append(now)
    return ticks


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("share", [0.01, 0.1])
@pytest.mark.parametrize("by_clock", [True, False])
def test_one_sender_is_one_where_samples_are_left_out(by_clock: bool, share: float, seed: int) -> None:
    """It sends by a clock of its own, or answers the samples that there are."""
    watch, before = SenderWatch(), 0
    for tick in held_up(np.random.default_rng(seed), share, 5000):
        for _ in range(tick - before if by_clock else 1):
            watch.command()
        assert not sampled(watch, tick, 1 if before < 200 else 2)
        before = tick


@pytest.mark.parametrize("seed", range(5))
def test_how_far_apart_samples_are_is_known_though_the_first_ones_were_late(seed: int) -> None:
    """A third of the first 20 come late, before anybody has to command; then two in each hundred do."""
    random, watch, before = np.random.default_rng(seed), SenderWatch(), 0
    for tick in held_up(random, 0.33, 20):
        watch.tick(tick * PERIOD)
        before = tick
    watch.begin()
    for tick in before + np.array(held_up(random, 0.02, 2000)):
        for _ in range(tick - before):
            watch.command()
        assert not sampled(watch, int(tick), 2)
        before = tick


@pytest.mark.parametrize("by_clock", [True, False])
def test_a_second_sender_is_found_where_samples_are_left_out(by_clock: bool) -> None:
    """One sample in a hundred comes late, two to ten at once: both send by clocks of their own, or answer the samples."""
    watch, before = SenderWatch(), 0
    for k, tick in enumerate(held_up(np.random.default_rng(3), 0.01, 2000)):
        for _ in range((tick - before if by_clock else 1) * (1 if k < 1000 else 2)):
            watch.command()
        found = sampled(watch, tick, 2)
        assert not (found and k < 1000)
        if found:
            assert k < 1070
            return
        before = tick
    pytest.fail("the second sender isn't found")


def test_a_second_sender_is_found_at_once_after_a_pause() -> None:
    """Nobody commanded for ten seconds."""
    watch = SenderWatch()
    for k in range(500):
        watch.command()
        assert not sampled(watch, k, 2)
    watch.begin()
    for k in range(5500, 5506):
        watch.command()
        watch.command()
        if sampled(watch, k, 2):
            return
    pytest.fail("the second sender isn't found")


def test_a_second_sender_is_found_beside_one_that_loses_commands() -> None:
    """Each tenth is lost for good: the second one gets no more time than it takes to send what a queue holds."""
    watch = SenderWatch()
    for k in range(1000):
        if k % 10:
            watch.command()
        assert not sampled(watch, k, 2)
    for k in range(1000, 1070):
        for _ in range(2 if k % 10 else 1):
            watch.command()
        if sampled(watch, k, 2):
            return
    pytest.fail("the second sender isn't found")


@pytest.mark.parametrize(("rate", "within"), [(1.0, 20), (0.2, 100), (0.05, 1000)])
def test_a_second_sender_is_found(rate: float, within: int) -> None:
    found = found_after([1.0, rate], 2)
    assert found is not None
    assert found < within


def test_it_is_over_when_the_second_one_has_left() -> None:
    watch = SenderWatch()
    for k in range(100):
        watch.command()
        watch.command()
        sampled(watch, k, 2)
    assert watch.many
    for k in range(100, 700):
        watch.command()
        sampled(watch, k, 2)
    assert not watch.many
