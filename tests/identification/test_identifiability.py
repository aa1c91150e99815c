"""What can't be told from a recording is named before the fit; the recordings are closed formulas, written out here."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from fric.effects import EFFECTS
from fric.errors import InputError
from fric.excitation import EXCITATIONS
from fric.identification import METHODS
from fric.identification.free_parameters import FreeParameters
from fric.identification.identifiability import Foreseen, foresee
from fric.identification.result import Options
from fric.identification.start import start_model
from fric.model import Model, build_model, term
from fric.record import Record, Units
from numpy.typing import NDArray

Array = NDArray[np.float64]
MASS, COULOMB, VISCOUS, BIAS = 2.0, 10.0, 35.0, 0.6
TIME = np.arange(0.0, 8.0, 1e-3)


def friction(velocity: Array) -> Array:
    """Force that opposes the motion."""
    return COULOMB * np.sign(velocity) + VISCOUS * velocity + BIAS


def recording(
    *tones: tuple[float, float],
    drift: float = 0.0,
    law: Callable[[Array], Array] = friction,
    spring: float = 0.0,
    units: Units = Units(),  # noqa: B008
    noise: float = 0.2,
    seed: int = 1,
) -> Record:
    """A sum of sines of (amplitude, frequency) on top of a constant velocity, and the force that it takes."""
    rng = np.random.default_rng(seed)
    q, v, a = drift * TIME, np.full_like(TIME, drift), np.zeros_like(TIME)
    for number, (amplitude, frequency) in enumerate(tones):
        w = 2.0 * math.pi * frequency
        q = q + amplitude * np.sin(w * TIME + number)
        v = v + amplitude * w * np.cos(w * TIME + number)
        a = a - amplitude * w**2 * np.sin(w * TIME + number)
    force = MASS * a + law(v) + spring * q + noise * rng.standard_normal(TIME.shape)
    return Record(TIME, q + 1e-8 * rng.standard_normal(TIME.shape), force, units=units, source="slide")


RICH = ((0.03, 0.5), (0.01, 1.7), (0.003, 4.0))


def asked(record: Record, *terms: str, experiments: bool = False, predicts: str = "force") -> Foreseen:
    return foresee(start_model(terms, "axis", record.units), [record], Options(), predicts, experiments)


def named(found: Foreseen, kind: str) -> list[set[str]]:
    """The parameters of each serious finding of a kind."""
    return [set(finding.parameters) for finding in found.findings if finding.kind == kind and finding.serious]


@pytest.mark.parametrize("predicts", ["force", "position"])
def test_rich_motion_raises_no_warning(predicts: str) -> None:
    found = asked(recording(*RICH), "coulomb", "viscous", "bias", predicts=predicts)
    assert found.warnings == ()
    assert found.condition < 10.0


def test_the_errors_foreseen_are_those_of_the_fits() -> None:
    structure = start_model(("coulomb", "viscous", "bias"), "axis", Units())
    found = asked(recording(*RICH), "coulomb", "viscous", "bias")
    fits = [METHODS["inverse-dynamics"].fit(structure, [recording(*RICH, seed=seed)], Options()).model for seed in range(40)]
    spread = np.array([np.std([fit.value(name) for fit in fits], ddof=1) for name in found.names])
    # One recording's residuals tell their own long-run variance to no better than this.
    assert np.all((found.together / spread > 0.6) & (found.together / spread < 2.0)), found.together / spread
    said = np.array([np.median([fit.standard_errors[name] for fit in fits]) for name in found.names])
    np.testing.assert_allclose(found.together, said, rtol=0.4)


@pytest.mark.parametrize("predicts", ["force", "position"])
def test_one_speed_couples_coulomb_and_viscous_friction(predicts: str) -> None:
    # A triangle whose corners are rounded: one speed elsewhere.
    phase, edge = TIME % 1.0, 0.015
    shape = np.clip(np.minimum(np.minimum(phase, np.abs(phase - 0.5)), 1.0 - phase) / edge, 0.0, 1.0)
    v = 0.05 * np.where(phase < 0.5, 1.0, -1.0) * np.sin(0.5 * math.pi * shape)
    q = np.cumsum(v) * 1e-3
    force = MASS * np.gradient(v, 1e-3) + friction(v) + 0.2 * np.random.default_rng(1).standard_normal(TIME.shape)
    found = asked(Record(TIME, q, force, source="slide"), "coulomb", "viscous", "bias", experiments=True, predicts=predicts)
    finding = next(each for each in found.findings if each.kind == "coupled")
    assert set(finding.parameters) == {"coulomb.force", "viscous.coefficient"}
    assert found.motion.startswith("The joint moves always at about 0.05")
    assert finding.experiment is not None
    kind = EXCITATIONS[finding.experiment["kind"]]
    motion = kind.part(finding.experiment["settings"], {}, np.random.default_rng(0))
    speed = np.abs(motion.at(np.linspace(0.0, motion.duration, 2000)).velocity)  # type: ignore[union-attr]
    # Whatever it is, it has to bring other speeds.
    moving = speed[speed > 0.0]
    assert np.mean(np.abs(moving - 0.05) > 0.01) > 0.5


def test_one_direction_couples_coulomb_friction_and_bias() -> None:
    one_way = recording((0.01, 1.0), drift=0.1)
    found = asked(one_way, "coulomb", "viscous", "bias")
    assert {"coulomb.force", "bias.force"} in named(found, "coupled")
    assert "one direction" in found.warnings[0]
    # Without a bias in the model, an offset of the force goes into the Coulomb level unnoticed.
    without = asked(one_way, "coulomb", "viscous")
    assert {"coulomb.force"} in named(without, "instrument")
    assert not named(asked(recording(*RICH), "coulomb", "viscous"), "instrument")


def test_a_force_in_amperes_says_what_an_error_of_its_scale_does() -> None:
    record = recording(*RICH, units=Units("m", "A"))
    found = asked(record, "coulomb", "viscous", "bias")
    finding = next(each for each in found.findings if each.kind == "instrument")
    assert finding.serious
    assert {"mass", "coulomb.force", "viscous.coefficient"} <= set(finding.parameters)
    assert "mass by +1 %" in finding.message
    # As it is: one percent more force, one percent more of everything.
    structure = start_model(("coulomb", "viscous", "bias"), "axis", record.units)
    scaled = Record(record.time, record.position, 1.01 * record.effort, units=record.units)
    one, other = (METHODS["inverse-dynamics"].fit(structure, [each], Options()).model.values for each in (record, scaled))
    np.testing.assert_allclose(other / one, 1.01, rtol=1e-4)
    # In newtons it is a note, since nothing says that the scale is wrong.
    assert not named(asked(recording(*RICH), "coulomb", "viscous", "bias"), "instrument")


def test_a_held_mass_makes_the_scale_of_the_force_visible() -> None:
    record = recording(*RICH, units=Units("m", "A"))
    structure = start_model(("coulomb", "viscous", "bias"), "axis", record.units).with_value("mass", MASS)
    found = foresee(structure, [record], Options(held=("mass",)), "force", False)
    assert not any("scale of the force" in finding.message for finding in found.findings)


def test_one_frequency_couples_mass_and_spring_and_hides_a_delay_in_the_damping() -> None:
    stiffness = 400.0
    one = recording((0.03, 0.8), law=lambda v: VISCOUS * v, spring=stiffness)
    found = asked(one, "viscous", "stiffness")
    assert {"mass", "stiffness.stiffness"} in named(found, "coupled")
    delays = [each for each in found.findings if "delay" in each.message and each.kind == "instrument"]
    assert len(delays) == 1
    assert "viscous.coefficient" in delays[0].parameters
    # u(t - T) of one frequency w: the part in phase with the position, k - m w^2, turns into -T (k - m w^2) v.
    w = 2.0 * math.pi * 0.8
    expected = -1e-3 * (stiffness - MASS * w**2) / VISCOUS
    said = delays[0].message.split("viscous.coefficient by ")[1].split(" %")[0]
    assert 0.01 * float(said) == pytest.approx(expected, rel=0.1)
    # Several frequencies tell all of it apart.
    several = asked(recording(*RICH, law=lambda v: VISCOUS * v, spring=stiffness), "viscous", "stiffness")
    assert not any({"mass", "stiffness.stiffness"} <= group for group in named(several, "coupled"))
    assert not any("delay" in each.message for each in several.findings)


def test_bristles_without_small_reversals_are_named() -> None:
    found = asked(recording((0.05, 1.0), (0.02, 2.3)), "coulomb", "viscous", "presliding")
    concerned = set().union(*named(found, "unseen"), *named(found, "coupled"))
    assert "presliding.stiffness" in concerned or "presliding.damping" in concerned


def test_a_stribeck_velocity_without_slow_motion_is_named() -> None:
    def law(velocity: Array) -> Array:
        return friction(velocity) + 4.0 * np.exp(-((velocity / 5e-4) ** 2)) * np.sign(velocity)

    quick = asked(recording((0.05, 1.0), (0.02, 2.3), law=law), "coulomb", "viscous", "stribeck")
    concerned = set().union(*named(quick, "unseen"), *named(quick, "coupled"))
    assert "stribeck.velocity" in concerned


def test_every_statement_is_made_without_naming_an_effect() -> None:
    import inspect

    from fric.identification import identifiability

    source = inspect.getsource(identifiability)
    for effect in EFFECTS.values():
        assert f'"{effect.id}' not in source
        assert f"'{effect.id}'" not in source


def _axis() -> Model:
    return build_model("rigid", {"mass": 2.0}, [term("coulomb", force=10.0), term("stribeck", force=4.0, velocity=0.01)])


def test_bounds_are_narrowed_and_refused_where_they_leave_nothing() -> None:
    free = FreeParameters.of(_axis(), Options(bounds=(("stribeck.velocity", 0.002, 0.05), ("mass", -1.0, 3.0))))
    k = free.names.index("stribeck.velocity")
    assert (free.lower[k], free.upper[k]) == (0.002, 0.05)
    assert free.lower[free.names.index("mass")] > 0.0
    assert free.upper[free.names.index("mass")] == 3.0
    with pytest.raises(InputError, match="leaves nothing"):
        FreeParameters.of(_axis(), Options(bounds=(("coulomb.force", -3.0, -1.0),)))
    with pytest.raises(InputError, match="no parameter 'glue'"):
        FreeParameters.of(_axis(), Options(bounds=(("glue", 0.0, 1.0),)))


def test_a_fit_keeps_the_bounds() -> None:
    record = recording(*RICH)
    structure = start_model(("coulomb", "viscous", "bias"), "axis", Units())
    bounded = METHODS["inverse-dynamics"].fit(structure, [record], Options(bounds=(("viscous.coefficient", 0.0, 20.0),)))
    assert bounded.model.value("viscous.coefficient") <= 20.0
    free = METHODS["inverse-dynamics"].fit(structure, [record], Options())
    assert free.model.value("viscous.coefficient") == pytest.approx(VISCOUS, rel=0.02)
