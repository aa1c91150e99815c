from __future__ import annotations

import math

from fric.signals.sample_pairs import EffortPairing, Sample

NOTHING = math.nan


def feed(pairing: EffortPairing, efforts: list[float], before: int = 10**9) -> list[tuple[int, float]]:
    """Samples k = 0, 1, ... with stamp 10 k, received at 10 k, and what becomes of them: stamp and effort."""
    for k, effort in enumerate(efforts):
        pairing.state(Sample(10 * k, 10 * k, float(k), effort))
    return [(sample.time, sample.effort) for sample in pairing.ready(before)]


def test_the_effort_of_the_joint_state_by_its_meaning() -> None:
    # At 10, the intervals beside the stamp carry the efforts of the samples 0 and 10, or of 10 and 20.
    assert feed(EffortPairing("following"), [1.0, 2.0, 4.0]) == [(10, 1.5), (20, 3.0)]
    assert feed(EffortPairing("preceding"), [1.0, 2.0, 4.0]) == [(0, 1.5), (10, 3.0)]
    assert feed(EffortPairing("linear"), [1.0, 2.0, 4.0]) == [(0, 1.0), (10, 2.0), (20, 4.0)]


def test_position_stays_with_its_stamp() -> None:
    pairing = EffortPairing("preceding")
    for k in range(3):
        pairing.state(Sample(10 * k, 10 * k, 100.0 + k, float(k)))
    assert [(sample.time, sample.position) for sample in pairing.ready(99)] == [(0, 100.0), (10, 101.0)]


def test_a_retransmission_is_left_out() -> None:
    pairing = EffortPairing("following")
    for time in (0, 10, 10, 10, 20):
        pairing.state(Sample(time, time, 0.0, 1.0))
    pairing.ready(99)
    pairing.state(Sample(20, 99, 0.0, 1.0))
    pairing.state(Sample(30, 99, 0.0, 1.0))
    assert [sample.time for sample in pairing.ready(99)] == [30]


def test_after_a_restart_no_effort_is_carried_across() -> None:
    pairing = EffortPairing("preceding")
    for time, effort in ((50, 1.0), (60, 2.0), (0, 3.0), (10, 4.0)):
        pairing.state(Sample(time, time, 0.0, effort))
    assert [(sample.time, sample.effort) for sample in pairing.ready(99)] == [(50, 1.5), (0, 3.5)]


def test_a_stamped_command_belongs_to_its_state_however_late_it_comes() -> None:
    pairing = EffortPairing("preceding")
    assert not pairing.lacks_effort
    pairing.command(7.0, received=3, stamp=0)
    pairing.command(8.0, received=4, stamp=10)
    assert feed(pairing, [NOTHING] * 6) == [(10, 7.5)]
    assert pairing.lacks_effort
    # The command for stamp 20 was lost: neither that sample nor the next has both neighbours.
    for stamp, force in ((30, 9.0), (40, 10.0)):
        pairing.command(force, received=900, stamp=stamp)
    assert [(sample.time, sample.effort) for sample in pairing.ready(999)] == [(40, 9.5)]


def test_an_unstamped_command_is_held_until_the_next() -> None:
    pairing = EffortPairing("following")
    for received, force in ((5, 1.0), (15, 2.0), (18, 3.0)):
        pairing.command(force, received, None)
    # Before the first command nothing is known; commands received after 25 may be missing yet.
    assert feed(pairing, [NOTHING] * 4, before=25) == [(20, 2.0)]
    assert [(sample.time, sample.effort) for sample in pairing.ready(31)] == [(30, 3.0)]
