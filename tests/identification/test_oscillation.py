"""Free oscillations: pendulums led by an integrator that knows nothing of the closed form, recorded as an encoder would."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fric.identification import METHODS
from fric.identification.methods.hilbert import hilbert
from fric.identification.methods.log_decrement import log_decrement, textbook
from fric.identification.methods.wavelet_ridge import wavelet_ridge
from fric.identification.oscillation.motion import Natural, chain, leading_position, plain_motion
from fric.identification.oscillation.peaks import find_peaks
from fric.identification.oscillation.recording import Oscillation, find_oscillation, turning_points
from fric.identification.oscillation.result import FreeOscillation
from fric.identification.result import IdentificationError, Options
from fric.identification.start import start_model
from fric.model import Model
from fric.record import Record, Units
from fric.verification.free_oscillation_reference import PENDULUMS, Pendulum, recorded, swing
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Analysis = Callable[[Oscillation], FreeOscillation]
ANALYSES: dict[str, Analysis] = {"log-decrement": log_decrement, "hilbert": hilbert, "wavelet": wavelet_ridge}
UNITS = Units("rad", "N m")
MASS = 0.0116


def structure(*terms: str) -> Model:
    model = start_model(terms or ("stiffness", "viscous", "coulomb", "asymmetry"), "axis", UNITS)
    return model.with_value("mass", MASS)


@pytest.mark.parametrize("name", PENDULUMS)
def test_the_closed_form_is_the_motion(name: str) -> None:
    pendulum = PENDULUMS[name]
    natural = Natural.of(pendulum.values)
    motion = swing(pendulum, 1.5)
    time = np.linspace(0.0, motion.stop, 2001)
    direction = leading_position(natural, 1.5)
    assert direction == -1
    assert np.max(np.abs(plain_motion(natural, time, 0.0, 1.5, direction) - motion.position(time))) < 1e-9
    times, positions = chain(natural, 0.0, 1.5, direction, 6)
    assert motion.position(times) == pytest.approx(positions, abs=1e-9)


def test_the_recursion_of_the_thesis_gives_its_parameters_back() -> None:
    """The printed ratios of measured peaks, with the signs derived: exact on exact peaks."""
    pendulum = PENDULUMS["#1"]
    _, x = chain(Natural.of(pendulum.values), 0.0, 1.5, -1, 7)
    backward = -(x[5] - x[3]) / (x[4] - x[2])
    forward = -(x[4] - x[2]) / (x[3] - x[1])
    ratio = [-np.log(q) / np.pi for q in (forward, backward)]
    zeta = [b / np.sqrt(1.0 + b**2) for b in ratio]
    assert np.mean(zeta) == pytest.approx(pendulum.damping, rel=1e-9)
    assert 0.5 * (zeta[0] - zeta[1]) == pytest.approx(pendulum.damping_difference, rel=1e-9)
    up = (x[4] + x[3] * forward) / (1.0 + forward)
    down = (x[5] + x[4] * backward) / (1.0 + backward)
    assert -0.5 * (up - down) == pytest.approx(pendulum.offset, rel=1e-9)
    assert -0.5 * (up + down) == pytest.approx(pendulum.offset_difference, rel=1e-9)


def test_the_textbook_estimate_is_exact_on_exact_peaks() -> None:
    pendulum = PENDULUMS["#4"]
    times, positions = chain(Natural.of(pendulum.values), 0.3, -1.2, 1, 8)
    assert textbook(times, positions, 1).values == pytest.approx(pendulum.values, rel=1e-4)


@pytest.mark.parametrize("method", ANALYSES)
@pytest.mark.parametrize("name", PENDULUMS)
def test_natural_parameters_come_back(method: str, name: str) -> None:
    pendulum = PENDULUMS[name]
    motion = swing(pendulum, 1.5)
    results = [ANALYSES[method](find_oscillation(recorded(motion, seed))) for seed in range(7)]
    error = np.median([np.abs(each.natural.values / pendulum.values - 1.0) for each in results], axis=0)
    goals = {"frequency": 0.003, "damping": 0.02, "damping_difference": 0.05, "offset": 0.002, "offset_difference": 0.005}
    assert np.all(error <= np.array(list(goals.values()))), dict(zip(goals, error.tolist(), strict=True))
    # Not within the goals by luck: the errors are what the standard errors say.
    scaled = [(each.natural.values - pendulum.values) / each.standard_errors.values for each in results]
    assert np.sqrt(np.mean(np.square(scaled))) < 2.0
    assert all(each.status.startswith("converged") for each in results)


@pytest.mark.parametrize(("method", "seeds"), [("log-decrement", 40), ("hilbert", 25), ("wavelet", 25)])
def test_intervals_cover(method: str, seeds: int) -> None:
    pendulum = PENDULUMS["#3"]
    motion = swing(pendulum, 1.5)
    inside = []
    for seed in range(100, 100 + seeds):
        found = ANALYSES[method](find_oscillation(recorded(motion, seed)))
        inside.append(np.abs(found.natural.values - pendulum.values) <= 1.645 * found.standard_errors.values)
    assert 0.8 <= np.mean(inside) <= 0.98


@pytest.mark.parametrize("method", ANALYSES)
@pytest.mark.parametrize("start", [1.5, -1.5])
def test_either_side_and_no_friction_difference(method: str, start: float) -> None:
    pendulum = Pendulum(20.0, 0.03, 0.0, 0.02, 0.0)
    found = find_oscillation(recorded(swing(pendulum, start), 3))
    result = ANALYSES[method](found)
    assert found.direction == (1 if start > 0 else -1)
    assert result.natural.damping == pytest.approx(0.03, rel=0.01)
    assert result.natural.offset == pytest.approx(0.02, rel=0.01)
    assert abs(result.natural.offset_difference) < 4.0 * result.standard_errors.offset_difference


@pytest.mark.parametrize("method", ANALYSES)
def test_what_is_not_asked_for_is_zero(method: str) -> None:
    pendulum = Pendulum(20.0, 0.03, 0.0, 0.0, 0.0)
    found = find_oscillation(recorded(_decay(pendulum, 1.0, 6.0), 1))
    analyse = {"log-decrement": log_decrement, "hilbert": hilbert, "wavelet": wavelet_ridge}[method]
    asked = np.array([True, True, False, False, True])
    result = analyse(found, asked)
    assert result.natural.offset == 0.0
    assert result.natural.damping_difference == 0.0
    assert result.natural.damping == pytest.approx(0.03, rel=0.002)
    assert result.natural.frequency == pytest.approx(20.0, rel=1e-4)
    assert result.standard_errors.offset == 0.0


def _decay(pendulum: Pendulum, start: float, duration: float) -> object:
    """A viscous decay in closed form, cut off while it still swings."""
    w, z = pendulum.frequency, pendulum.damping
    damped = w * np.sqrt(1.0 - z**2)

    def position(time: Array) -> Array:
        t = np.maximum(time, 0.0)
        return start * np.exp(-z * w * t) * (np.cos(damped * t) + z * w / damped * np.sin(damped * t))

    return type("Decay", (), {"position": staticmethod(position), "stop": duration - 1.1})


def test_peaks_are_better_than_largest_samples() -> None:
    pendulum = PENDULUMS["#2"]
    motion = swing(pendulum, 1.5)
    offsets = []
    for seed in range(10):
        found = find_oscillation(recorded(motion, seed, step=0.0))
        peaks = find_peaks(found, Natural.of(pendulum.values))
        _, true = chain(Natural.of(pendulum.values), 0.0, 1.5, -1, peaks.time.shape[0] + 1)
        off = peaks.position - true[1:]
        offsets.append(off / np.sqrt(peaks.covariance[:, 1, 1]))
        raw = found.position[found.turns] - true[1:]
        assert np.sqrt(np.mean(off**2)) < 0.5 * np.sqrt(np.mean(raw**2))
    # Independent and of the size that is claimed.
    assert 0.7 < np.std(offsets) < 1.3


def test_turning_points_need_more_than_the_threshold() -> None:
    x = np.array([0.0, 1.0, 3.0, 2.9, 3.1, 1.0, -2.0, -1.9, -2.1, 0.0, 1.5, 1.45, 1.5])
    assert turning_points(x, 0.5).tolist() == [4, 8]
    assert turning_points(np.linspace(0.0, 1.0, 10), 0.01).size == 0
    # Held at first: the release is no reversal.
    assert turning_points(np.array([1.0, 1.0, 1.0, 0.0, -1.0, 0.0, 0.5]), 0.3).tolist() == [4]


# ---- recordings that can't be analysed -------------------------------------------------------------------------------


def _free(pendulum: Pendulum, start: float = 1.5, seed: int = 0, **how: float) -> Record:
    return recorded(swing(pendulum, start), seed, **how)


def _refusal(record: Record, mass: float | None = None) -> str:
    with pytest.raises(IdentificationError) as caught:
        find_oscillation(record, None, mass)
    return str(caught.value)


def test_too_few_half_cycles() -> None:
    line = _refusal(_free(PENDULUMS["#1"], 0.7))
    assert "too few half cycles" in line
    assert "larger deflection" in line


def test_it_sticks_at_once() -> None:
    assert "sticks at once" in _refusal(_free(PENDULUMS["#1"], 0.2))


def test_it_is_overdamped() -> None:
    time = 1e-3 * np.arange(3000)
    slow, quick = 2.0, 30.0
    position = (quick * np.exp(-slow * time) - slow * np.exp(-quick * time)) / (quick - slow)
    line = _refusal(Record(time, position + 1e-4 * np.random.default_rng(1).standard_normal(3000), np.zeros(3000)))
    assert "overdamped" in line
    assert "proportional feedback" in line


def test_it_does_not_move() -> None:
    noise = 1e-4 * np.random.default_rng(1).standard_normal(3000)
    assert "does not move" in _refusal(Record(1e-3 * np.arange(3000), noise, np.zeros(3000)))


def test_it_is_clipped() -> None:
    record = _free(PENDULUMS["#3"])
    line = _refusal(replace(record, position=np.clip(record.position, -1.1, 2.0)))
    assert "clipped" in line
    assert "-1.1" in line


def test_it_is_sampled_too_slowly() -> None:
    line = _refusal(_free(PENDULUMS["#3"], rate=18.0))
    assert "sampled too slowly" in line
    assert "Hz or faster" in line


def test_a_force_still_acts() -> None:
    record = _free(PENDULUMS["#3"])
    stiffness = MASS * PENDULUMS["#3"].frequency ** 2
    push = 0.1 * stiffness * np.sin(2.3 * record.time)
    line = _refusal(replace(record, effort=push), MASS)
    assert "force still acts" in line
    # Noise of the force sensor of the same size is none.
    noise = 0.1 * stiffness * np.random.default_rng(2).standard_normal(record.n_samples)
    assert find_oscillation(replace(record, effort=noise), None, MASS).turns.size >= 5


def test_the_hold_before_the_release_is_left_out() -> None:
    record = _free(PENDULUMS["#3"])
    effort = np.where(record.time < 0.3, 0.5, 0.0)
    found = find_oscillation(replace(record, effort=effort), None, MASS)
    assert found.time[0] == pytest.approx(0.3, abs=2e-3)
    assert any("until the driving force has ended" in note for note in found.notes)
    assert log_decrement(found).natural.frequency == pytest.approx(PENDULUMS["#3"].frequency, rel=1e-4)


def test_a_stiffening_spring_shows_in_the_misfit() -> None:
    answer = solve_ivp(
        lambda t, y: [y[1], -40.0 * y[0] - 20.0 * y[0] ** 3 - 0.3 * y[1]], (0.0, 8.0), [1.0, 0.0], rtol=1e-10, atol=1e-12,
        t_eval=np.arange(0.0, 8.0, 1e-3),
    )  # fmt: skip
    noise = 5e-4 * np.random.default_rng(1).standard_normal(8000)
    result = log_decrement(find_oscillation(Record(answer.t, answer.y[0] + noise, np.zeros(8000))))
    assert result.misfit > 5.0
    assert "larger than noise" in result.status or "not to be relied on" in result.status
    # The backbone is that of a Duffing spring: w^2 = 40 + (3/4) 20 A^2.
    curves = hilbert(find_oscillation(Record(answer.t, answer.y[0] + noise, np.zeros(8000)))).curves
    assert curves.frequency == pytest.approx(np.sqrt(40.0 + 15.0 * curves.amplitude**2), rel=0.015)
    assert np.ptp(curves.amplitude) > 0.3


# ---- as methods of an identification ---------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ANALYSES)
def test_a_model_from_a_release(method: str) -> None:
    p = PENDULUMS["#1"]
    result = METHODS[method].fit(structure(), [_free(p)], Options())
    spring = MASS * p.frequency**2
    truth = {
        "stiffness.stiffness": spring,
        "viscous.coefficient": 2.0 * MASS * p.frequency * p.damping,
        "asymmetry.coefficient": 2.0 * MASS * p.frequency * p.damping_difference,
        "coulomb.force": spring * p.offset,
        "asymmetry.force": spring * p.offset_difference,
    }
    assert set(result.fitted) == set(truth)
    for name, value in truth.items():
        assert result.model.value(name) == pytest.approx(value, rel=0.03 if name == "asymmetry.coefficient" else 0.005)
        error = result.model.standard_errors[name]
        assert abs(result.model.value(name) - value) < 4.0 * error
        assert error < 0.02 * value
    assert result.model.value("mass") == MASS
    assert any("mass is held" in warning for warning in result.warnings)
    assert result.train.position_rmse < 0.001
    assert result.train.relative_force_error_percent < 5.0


@pytest.mark.parametrize("method", ANALYSES)
def test_a_slow_recording_will_do(method: str) -> None:
    """50 samples a second are 23 in a half cycle."""
    p = PENDULUMS["#3"]
    result = METHODS[method].fit(structure(), [_free(p, rate=50.0)], Options())
    spring = MASS * p.frequency**2
    for name, value in (("stiffness.stiffness", spring), ("coulomb.force", spring * p.offset)):
        off = result.model.value(name) - value
        assert abs(off) < 4.0 * result.model.standard_errors[name]
        assert abs(off) < 0.01 * value


def test_a_constant_force_goes_to_the_bias_where_there_is_one() -> None:
    p = PENDULUMS["#1"]
    with_bias = METHODS["log-decrement"].fit(
        structure("stiffness", "viscous", "coulomb", "asymmetry", "bias"), [_free(p)], Options()
    )
    expected = MASS * p.frequency**2 * p.offset_difference
    assert with_bias.model.value("bias.force") == pytest.approx(expected, rel=0.01)
    assert "asymmetry.force" not in with_bias.fitted
    without = METHODS["log-decrement"].fit(structure("stiffness", "viscous", "coulomb"), [_free(p)], Options())
    assert any("add the term bias" in warning for warning in without.warnings)


def test_a_spring_that_is_relaxed_elsewhere() -> None:
    p = PENDULUMS["#1"]
    record = _free(p)
    moved = replace(record, position=record.position + 0.25)
    model = structure("stiffness", "viscous", "coulomb", "asymmetry", "bias").with_value("stiffness.position", 0.25)
    result = METHODS["log-decrement"].fit(model, [moved], Options())
    assert result.model.value("bias.force") == pytest.approx(MASS * p.frequency**2 * p.offset_difference, rel=0.05)


def test_a_feedback_in_the_recorded_force_is_taken_off() -> None:
    p = PENDULUMS["#2"]
    record = _free(p)
    spring = MASS * p.frequency**2
    clean = swing(p, 1.5)
    rng = np.random.default_rng(0)
    shifted = clean.position(record.time - 0.3 - rng.uniform(0.0, 1e-3))
    effort = -0.8 * spring * shifted + 0.03
    result = METHODS["log-decrement"].fit(structure(), [replace(record, effort=effort)], Options())
    assert result.model.value("stiffness.stiffness") == pytest.approx(0.2 * spring, rel=0.005)
    given = METHODS["log-decrement"].fit(structure(), [record], Options(gains=((0.8 * spring, 0.0),)))
    assert given.model.value("stiffness.stiffness") == pytest.approx(0.2 * spring, rel=0.002)
    assert given.train.position_rmse < 0.2
    # What a constant part of the force does is known, and isn't friction.
    base = MASS * p.frequency**2 * p.offset_difference
    assert result.model.value("asymmetry.force") == pytest.approx(base + 0.03, rel=0.01)


def test_several_releases_are_weighted_together() -> None:
    p = PENDULUMS["#1"]
    one = METHODS["log-decrement"].fit(structure(), [_free(p)], Options())
    records = [replace(_free(p, 1.5 + 0.1 * k, seed=k), source=f"release {k}") for k in range(4)]
    four = METHODS["log-decrement"].fit(structure(), records, Options())
    assert four.model.standard_errors["coulomb.force"] < 0.7 * one.model.standard_errors["coulomb.force"]
    other = replace(_free(replace(p, offset=0.06)), source="oiled")
    apart = METHODS["log-decrement"].fit(structure(), [records[0], other], Options())
    assert any("something changes from one to the next" in warning for warning in apart.warnings)
    assert apart.model.standard_errors["coulomb.force"] > 3.0 * one.model.standard_errors["coulomb.force"]


@pytest.mark.parametrize(
    ("terms", "gains", "says"),
    [
        (("viscous", "coulomb"), (), "has no spring"),
        (("stiffness", "coulomb", "stribeck"), (), "can't be fitted with stribeck"),
        (("stiffness",), ((1.0, 0.0), (2.0, 0.0)), "2 feedback gain(s) for 1 recording(s)"),
    ],
)
def test_a_structure_that_does_not_fit_is_refused(
    terms: tuple[str, ...], gains: tuple[tuple[float, float], ...], says: str
) -> None:
    with pytest.raises(IdentificationError) as caught:
        METHODS["log-decrement"].fit(structure(*terms), [_free(PENDULUMS["#1"])], Options(gains=gains))
    assert says in str(caught.value)


def test_held_parameters_stay() -> None:
    model = structure().with_value("viscous.coefficient", 0.123)
    result = METHODS["log-decrement"].fit(model, [_free(PENDULUMS["#1"])], Options(held=("viscous.coefficient",)))
    assert result.model.value("viscous.coefficient") == 0.123
    assert "viscous.coefficient" not in result.fitted
    assert result.covariance.shape == (4, 4)
