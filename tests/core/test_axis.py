"""The simulated axis with its drive and sensors, against hand calculation."""

from __future__ import annotations

import numpy as np
import pytest
from fric.axis import SimulatedAxis
from fric.model import Model, build_model, term
from fric.plants import PLANTS
from fric.simulation import Simulator

FREE = build_model("rigid", {"mass": 2.0}, [])


def test_moves_as_a_free_mass_and_reports_the_encoder_s_steps() -> None:
    axis = SimulatedAxis(FREE, resolution=1e-4)
    axis.advance(4.0, 0.1)
    axis.advance(4.0, 0.1)
    measured = axis.measure()
    # a = 2 m/s^2 for 0.2 s: 0.04 m
    assert axis.position == pytest.approx(0.04, rel=1e-9)
    assert measured.position == pytest.approx(0.04, abs=5.1e-5)
    assert measured.position / 1e-4 == pytest.approx(round(measured.position / 1e-4), abs=1e-9)
    assert measured.velocity == pytest.approx(0.2, abs=1e-3)


def test_effort_is_the_mean_force_that_acted_since_the_last_measurement() -> None:
    axis = SimulatedAxis(FREE, force_limit=5.0)
    axis.measure()
    axis.advance(2.0, 0.003)
    axis.advance(-50.0, 0.001)
    assert axis.measure().effort == pytest.approx((2.0 * 3 - 5.0) / 4)
    assert axis.saturated == 1


def test_noise_has_the_size_asked_for_and_follows_the_seed() -> None:
    def efforts(seed: int) -> np.ndarray:
        axis = SimulatedAxis(FREE, force_noise=0.3, seed=seed)
        values = []
        for _ in range(4000):
            axis.advance(0.0, 1e-3)
            values.append(axis.measure().effort)
        return np.array(values)

    first = efforts(1)
    assert first.std() == pytest.approx(0.3, rel=0.05)
    assert first.mean() == pytest.approx(0.0, abs=0.03)
    assert np.array_equal(first, efforts(1))
    assert not np.array_equal(first, efforts(2))


def test_position_noise_is_that_of_a_reading_and_readings_average_it() -> None:
    heavy = build_model("rigid", {"mass": 1e9}, [])

    def positions(readings: int, seed: int = 1) -> np.ndarray:
        axis = SimulatedAxis(heavy, position_noise=2e-9, readings=readings, seed=seed)
        values = []
        for _ in range(4000):
            axis.advance(0.0, 1e-4)
            values.append(axis.measure().position)
        return np.array(values)

    assert positions(1).std() == pytest.approx(2e-9, rel=0.05)
    assert positions(4).std() == pytest.approx(1e-9, rel=0.05)
    assert abs(positions(4).mean()) < 1e-10
    assert np.array_equal(positions(4), positions(4))
    assert not np.array_equal(positions(4), positions(4, seed=2))


def test_readings_are_spread_over_the_sample_the_newest_at_its_end() -> None:
    axis = SimulatedAxis(FREE, readings=4)
    axis.advance(4.0, 0.1)
    # q = t^2 at t = 25, 50, 75 and 100 ms.
    assert axis.measure().position == pytest.approx(np.mean(np.array([0.025, 0.05, 0.075, 0.1]) ** 2), rel=1e-9)
    assert axis.position == pytest.approx(0.01, rel=1e-9)
    # At constant velocity the mean lags by (n - 1)/(2 n) of the time between two measurements.
    axis.advance(0.0, 0.1)
    measured = axis.measure()
    assert measured.position == pytest.approx(axis.position - 0.2 * 0.1 * 3.0 / 8.0, rel=1e-9)


def test_readings_change_neither_motion_nor_effort() -> None:
    model = build_model("rigid", {"mass": 2.0}, [term("viscous", coefficient=20.0)])
    one, many = SimulatedAxis(model), SimulatedAxis(model, readings=5)
    for force in (3.0, 3.0, -4.0, 0.0, 6.0):
        for axis in (one, many):
            axis.advance(force, 0.002)
        first, other = one.measure(), many.measure()
        assert many.position == pytest.approx(one.position, rel=5e-3)  # both of second order
        assert other.effort == pytest.approx(first.effort, rel=1e-9)


def test_effort_is_what_comes_out_of_the_command_path() -> None:
    axis = SimulatedAxis(build_model("rigid", {"mass": 2.0}, [term("actuator_lag", time=0.01)]))
    axis.advance(5.0, 0.01)
    # Mean of 5 (1 - exp(-t/T)) over one time constant.
    assert axis.measure().effort == pytest.approx(5.0 * np.exp(-1.0), rel=1e-9)


def _quarter_car() -> Model:
    from fric.model_file import read_model
    from fric.shared_files import config_file

    return read_model(config_file("quarter_car_conventional.yaml"))


@pytest.mark.parametrize("readings", [1, 4])
def test_effort_of_a_command_that_is_no_force_is_the_force_on_the_contact(readings: int) -> None:
    axis = SimulatedAxis(_quarter_car(), readings=readings)
    twin = Simulator(_quarter_car())
    assert axis.signals()[0] == pytest.approx(0.0, abs=1e-9)

    def suspension() -> float:
        x_b, v_b, x_w, v_w = twin.states[:4]
        return float(2.89e4 * (x_w - x_b) + 260.0 * (v_w - v_b))

    for k in range(100):
        axis.advance(0.05, 0.002)
        forces = [suspension()]
        for _ in range(readings):
            twin.run(np.array([0.05]), 0.002 / readings)
            forces.append(suspension())
        mean = float(np.mean(forces[1:]) - 0.5 * (forces[-1] - forces[0]) / readings)
        assert axis.measure().effort == pytest.approx(mean, rel=1e-9, abs=1e-9), k
    assert mean > 1.0
    named = dict(zip(axis.signal_names, axis.signals(), strict=True))
    assert named["wheel_position"] == twin.states[2]
    assert set(named) == {signal.name for signal in PLANTS["quarter_car"].signals}


def test_effort_of_a_quarter_car_is_the_impulse_of_its_body() -> None:
    axis = SimulatedAxis(_quarter_car())
    impulse = 0.0
    for _ in range(200):
        axis.advance(0.05, 0.001)
        impulse += axis.measure().effort * 0.001
    twin = Simulator(_quarter_car())
    states, _ = twin.run(np.full(200, 0.05), 0.001)
    assert impulse == pytest.approx(240.0 * states[-1, 1], rel=1e-3)
