"""The experiment without any middleware, on an axis integrated here: what it finds, what it chooses, when it cuts the force."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from fric.experiment.choice import Bounds, next_setting
from fric.experiment.conductor import AUTO, Conductor, Outcome, Waiting
from fric.experiment.knowledge import Knowledge
from fric.experiment.motion import REST, Cut, Drive, ExperimentError, Law, Limits, Quiet, Sample, SwingWatch
from fric.experiment.runs import FORCED, FREE, Placing, Setting, Timing, decay
from fric.experiment.settings import NUMBERS, bounds_of

H = 0.002
TIMING = Timing(place=0.5, settle=2.0, quiet=0.2, oscillation=6.0, periods=8)


@dataclass
class Axis:
    """m q'' = u - k q - c q' - F_C sgn(q'), small symmetric steps, at rest exactly; the force acts from sample to sample."""

    mass: float
    viscous: float
    stiffness: float
    coulomb: float
    position: float = 0.0
    velocity: float = 0.0
    effort: float = 0.0
    step: float = H / 8

    def advance(self, force: float) -> None:
        q, v, h = self.position, self.velocity, self.step
        for _ in range(8):
            # Half a step of drift before and after the kick: of second order, so that the steps add no damping.
            q += 0.5 * h * v
            pull = force - self.stiffness * q - self.viscous * v
            if v == 0.0 and abs(pull) <= self.coulomb:
                continue
            direction = math.copysign(1.0, v if v != 0.0 else pull)
            new = v + h * (pull - direction * self.coulomb) / self.mass
            v = 0.0 if v != 0.0 and new * v < 0.0 else new
            q += 0.5 * h * v
        self.position, self.velocity, self.effort = q, v, force

    def sample(self, number: int, rng: np.random.Generator, noise: float) -> Sample:
        return Sample(number * H, round(self.position / 1e-5) * 1e-5, self.effort + noise * float(rng.standard_normal()))


def _now(work: Callable[[], object]) -> Future[object]:
    done: Future[object] = Future()
    done.set_result(work())
    return done


def conduct(axis: Axis, bounds: Bounds, kind: str = FREE, **options: object) -> tuple[Outcome, list[float], list[str]]:
    said: list[str] = []
    conductor = Conductor(bounds, TIMING, kind, _now, said.append, **options)  # type: ignore[arg-type]
    rng, law, forces = np.random.default_rng(1), Law(bounds.limits.force, 0.001), []
    sample = axis.sample(0, rng, 0.01)
    motion = conductor.conduct(sample)
    drive = next(motion)
    for number in range(1, 200_000):
        try:
            while isinstance(drive, Waiting):
                drive = motion.send(sample)
            force = law.force(drive, sample)
            conductor.note(sample, force)
            forces.append(force)
            axis.advance(force)
            sample = axis.sample(number, rng, 0.01)
            drive = motion.send(sample)
        except StopIteration as end:
            return end.value, forces, said
    pytest.fail("the experiment doesn't end")


LIMITS = Limits(force=20.0, travel=0.3)
BOUNDS = Bounds(LIMITS, 0.15, (0.0, 120.0), 0.0, (4.0, 20.0), H, fewest=3, most=8)
SPRUNG = Axis(mass=0.8, viscous=0.35, stiffness=60.0, coulomb=0.4)


def test_a_sprung_axis_within_the_goals() -> None:
    """Inertia and stiffness within 1 %, damping within 2 % (de Marchi's automated P-varied runs: inertia 8.4 % off)."""
    outcome, forces, _ = conduct(replace(SPRUNG), BOUNDS)
    known = outcome.knowledge
    assert outcome.end.reached
    assert known.spring
    for found in (known.oscillation, known.best):
        assert found is not None
        assert found.model.value("mass") == pytest.approx(0.8, rel=0.01)
        assert found.model.value("stiffness.stiffness") == pytest.approx(60.0, rel=0.01)
        assert found.model.value("viscous.coefficient") == pytest.approx(0.35, rel=0.02)
    gains = [run.setting.proportional for run in known.runs]
    assert gains[0] == 0.0
    assert max(gains) > 60.0
    assert max(abs(force) for force in forces) <= LIMITS.force
    acting = known.runs[gains.index(max(gains))].gains
    # The sampled feedback is half a sample late: as much damping is taken away.
    assert acting[1] == pytest.approx(-0.5 * H * max(gains), rel=0.1)


def test_friction_that_allows_no_oscillation_is_said_and_forced_runs_take_over() -> None:
    slide = Axis(mass=0.8, viscous=30.0, stiffness=0.0, coulomb=4.0)
    bounds = replace(BOUNDS, proportional=(20.0, 150.0), frequency=(15.0, 60.0), deflection=0.04, fewest=4, most=8)
    outcome, _, said = conduct(replace(slide), bounds, kind=FREE)
    assert outcome.end.sticks
    assert "forced" in outcome.end.reason
    outcome, _, said = conduct(replace(slide), replace(bounds, limits=Limits(60.0, 0.3)), kind=AUTO)
    assert any("going on with forced runs" in line for line in said)
    assert {run.setting.kind for run in outcome.knowledge.runs} == {FREE, FORCED}
    model = outcome.knowledge.oscillation.model  # type: ignore[union-attr]
    assert model.value("mass") == pytest.approx(0.8, rel=0.02)
    # The runs rest at their turns: what is left open there is in the standard error, which says so.
    error = model.standard_errors["viscous.coefficient"]
    assert model.value("viscous.coefficient") == pytest.approx(30.0, abs=3.0 * error)
    assert error < 0.3
    assert not outcome.knowledge.spring


def test_an_unstable_gain_is_cut_and_less_is_tried() -> None:
    """A drive that is 16 ms late takes P times that of damping away, which nobody knows before the first run."""
    outcome, forces, said = conduct(_Late(0.8, 0.35, 60.0, 0.4), replace(BOUNDS, proportional=(10.0, 120.0), first=110.0))
    cuts = [line for line in said if "the force is cut" in line]
    assert 1 <= len(cuts) <= 2
    assert all("unstable" in cut or "travel" in cut for cut in cuts)
    assert forces[-1] == 0.0
    settings = [run.setting.proportional for run in outcome.knowledge.runs]
    assert settings[0] == 110.0
    assert max(settings[1:]) <= 55.0
    assert outcome.knowledge.usable


@dataclass
class _Late(Axis):
    """The force acts eight samples late."""

    waiting: list[float] = field(default_factory=lambda: [0.0] * 8)

    def advance(self, force: float) -> None:
        self.waiting.append(force)
        super().advance(self.waiting.pop(0))


def test_a_release_with_a_driving_feedback_is_cut_at_its_first_growth() -> None:
    axis, law = replace(SPRUNG), Law(20.0, 0.001)
    rng = np.random.default_rng(0)
    sample = axis.sample(0, rng, 0.0)
    run = decay(sample, 0.0, Setting(FREE, 0.0, -2.0, 0.1), Placing(60.0, 10.0), LIMITS, TIMING)

    def go(drive: Drive, sample: Sample) -> None:
        for number in range(1, 20_000):
            axis.advance(law.force(drive, sample))
            sample = axis.sample(number, rng, 0.0)
            drive = run.send(sample)

    with pytest.raises(Cut, match="unstable"):
        go(next(run), sample)
    assert abs(axis.position) < 1.3 * 0.1


def test_effort_that_is_not_measured_is_what_was_commanded() -> None:
    outcome, _, _ = conduct(_Silent(0.8, 0.35, 60.0, 0.4), BOUNDS)
    record = outcome.knowledge.runs[0].record
    assert record.effort_hold == "following"
    assert any("commanded" in note for note in record.notes)
    assert outcome.knowledge.best is outcome.knowledge.oscillation
    assert outcome.knowledge.best.model.value("mass") == pytest.approx(0.8, rel=0.01)  # type: ignore[union-attr]


class _Silent(Axis):
    def sample(self, number: int, rng: np.random.Generator, noise: float) -> Sample:
        return super().sample(number, rng, noise)._replace(effort=math.nan)


def test_a_drive_that_does_not_follow_is_noticed() -> None:
    outcome, _, _ = conduct(_Deaf(0.8, 0.35, 60.0, 0.4), replace(BOUNDS, proportional=(40.0, 120.0), most=3))
    assert any("did not follow" in run.problem for run in outcome.knowledge.runs)


class _Deaf(Axis):
    """Gives no force for a tenth of a second, once in a while."""

    n = 0

    def advance(self, force: float) -> None:
        self.n += 1
        super().advance(0.0 if self.n % 400 < 50 else force)


def test_the_first_setting_and_the_limit_of_the_force() -> None:
    first = next_setting(replace(BOUNDS, proportional=(400.0, 900.0)), Knowledge())
    assert isinstance(first, Setting)
    assert first.proportional == 400.0
    assert first.proportional * first.deflection <= LIMITS.force


def test_the_law_is_limited_and_starts_without_velocity() -> None:
    law = Law(1.0, 0.0)
    assert law.force(Drive(5.0, 1.0, 0.0), Sample(0.0, 0.0, 0.0)) == 1.0
    assert law.saturated == 1
    assert law.force(Drive(0.0, 0.0, 0.5), Sample(0.1, 0.1, 0.0)) == pytest.approx(-0.5)
    assert law.force(REST, Sample(0.2, 0.3, 0.0)) == 0.0


def test_quiet_waits_for_its_whole_duration() -> None:
    quiet = Quiet(0.5, 0.1)
    seen = [quiet.see(Sample(0.1 * k, 0.0 if k < 3 else 1.0, 0.0)) for k in range(12)]
    assert seen == [False] * 8 + [True] * 4


@pytest.mark.parametrize("growth", [1.0, 1.3])
def test_a_swing_is_judged_by_its_own_side(growth: float) -> None:
    """The other direction's peaks are smaller where friction is asymmetric: no growth."""
    watch, sizes = SwingWatch(1.0, 1.15, 0.0), (0.5, -0.3, 0.5, -0.3 * growth, 0.5, -0.3)
    path = np.concatenate([np.linspace(a, b, 20) for a, b in zip((1.0, *sizes[:-1]), sizes, strict=True)])

    def go() -> None:
        for position in path:
            watch.see(float(position))

    if growth == 1.0:
        go()
    else:
        with pytest.raises(Cut, match="grows"):
            go()


def test_bounds_that_leave_nothing() -> None:
    values = {n.name: n.default for n in NUMBERS}
    assert bounds_of(values, H, 4, 12).limits.force == values["force_limit"]
    with pytest.raises(ExperimentError, match="proportional_low"):
        bounds_of(values | {"proportional_low": 2e4}, H, 4, 12)
    with pytest.raises(ExperimentError, match="fewest_runs"):
        bounds_of(values, H, 13, 12)
