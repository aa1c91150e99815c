"""What only the recordings held back show: a place where no other recording went."""

from __future__ import annotations

import numpy as np
from fric.diagnosis.fitting import refit
from fric.diagnosis.held_back import OnlyThere, only_there
from fric.diagnosis.track import Track
from fric.model import Model, term
from fric.record import Record
from fric.simulation import simulate

from .small_axis import NOMINAL, STEP, with_terms


def moved(machine: Model, amplitude: float, seed: int, seconds: float = 4.0, wobble: float = 9.0) -> Record:
    """The machine to and fro under a force of that ``amplitude`` and a ``wobble`` on it [N]."""
    time = STEP * np.arange(round(seconds / STEP))
    effort = amplitude * np.sin(5.0 * time) + wobble * np.sin(17.0 * time)
    position = simulate(machine, effort, STEP, n_substeps=4).position
    noise = 1e-7 * np.random.default_rng(seed).standard_normal(time.size)
    return Record(time, position + noise, effort, effort_hold="following", source=f"run {seed}")


def found(machine: Model, train: float, validation: float, wobble: float = 9.0) -> OnlyThere | None:
    """With recordings learnt from under the force ``train`` and others held back under ``validation`` [N]."""
    first, other = moved(machine, train, 1, wobble=wobble), moved(machine, validation, 2)
    begin = refit(Track.of([first], 140.0, NOMINAL), NOMINAL).fit.model
    return only_there([first], [other], Track.of([other], 140.0, begin), begin)


def test_a_bump_where_only_the_recordings_held_back_went_is_there() -> None:
    """Those learnt from stay within 0.12 m."""
    near, far = moved(NOMINAL, 10.0, 1), moved(NOMINAL, 25.0, 2)
    assert np.max(near.position) < 0.15 < np.max(far.position)
    cable = with_terms(term("position_dependence", "local", amplitude=1.5, position=0.2, width=0.01))
    there = found(cable, 10.0, 25.0)
    assert there is not None
    assert there.best is not None
    assert there.best.column.term.effect.id == "position_dependence"
    assert there.noe > 0.01
    assert 0.0 < there.likely.share <= 1.0


def test_where_nothing_is_missing_nothing_is_there() -> None:
    assert found(NOMINAL, 10.0, 25.0) is None


def test_a_value_that_the_others_hardly_told_is_no_physics() -> None:
    """Given 20 N s/m, of which slow motion tells little: fitted to all recordings together it is what it is."""
    machine = NOMINAL.with_value("viscous.coefficient", 24.0)
    slow, fast = moved(machine, 6.0, 1, wobble=0.0), moved(machine, 25.0, 2)
    held = Track.of([fast], 140.0, NOMINAL)
    assert float(np.sum(held.residual(NOMINAL) ** 2)) > 100.0 * float(np.sum(held.residual(machine) ** 2))
    assert only_there([slow], [fast], held, NOMINAL) is None


def test_the_share_of_the_force_is_what_stays_when_all_recordings_are_fitted_together() -> None:
    """In percent of the force about its mean: a pull of 6 N all the way, of which the nominal model takes nothing."""
    pulled = with_terms(term("bias", force=6.0))
    first, other = moved(NOMINAL, 18.0, 1), moved(pulled, 18.0, 2)
    held = Track.of([other], 140.0, NOMINAL)
    there = only_there([first], [other], held, NOMINAL)
    assert there is not None
    # The residual at the refitted values is at most 6 N, and at least half of it stays.
    effort = other.effort - np.mean(other.effort)
    whole = 100.0 * 36.0 / float(np.mean(effort**2))
    assert 0.25 * whole < there.noe < 1.3 * whole
