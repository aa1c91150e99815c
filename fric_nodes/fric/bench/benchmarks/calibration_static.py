"""Coverage of the intervals of static maps, over 200 simulated experiments of each kind.

What is measured is known in closed form and shares nothing with the method's laws: a ladder of velocities with the ripple of a
screw, correlated noise and a scatter from run to run; strokes under three loads behind a rig that gives way, on bristles whose
reach differs a little from reversal to reversal; a piston whose pressure pushes it; starts after rests; slips. Every signal is
rounded to the steps of its sensor, and every experiment has its own noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy import stats
from scipy.signal import lfilter

from ...figure import Figure
from ...identification.methods.static_map import static_map
from ...identification.result import Options
from ...identification.start import start_model
from ...identification.static_maps.result import StaticMap
from ...record import Array, Record, Units
from ..benchmark import Benchmark
from ..trials import SEEDS, Finding, count, figures_of, of_model, over_interval

__all__ = ["BENCHMARK", "CURVE", "TRIALS", "ladder", "mapped"]

_SPEEDS = np.geomspace(0.002, 0.2, 11)
CURVE = {"coulomb.force": 5.0, "viscous.coefficient": 12.0, "bias.force": 0.7}
"""Friction of the ladder: [N], [N s/m], [N]."""
_SURPLUS = {"stribeck.force": 1.2, "stribeck.velocity": 0.01}
_RUN_TO_RUN = 0.08  # [N]
_LEVELS = (2.0, 4.0, 6.0)  # friction under three loads [N]
_PER_LOAD = 50.0  # [N] of load for one of friction
_REACH = 40e-6  # of the contact, the same under every load [m]
_RIG = 2.5e5  # [N/m]
_STROKES = 24
_PRESSURES = (1e5, 3e5, 5e5, 7e5)  # [Pa]
_AREA, _DRY, _PER_PRESSURE = 5e-4, 3.0, 4e-6  # [m^2], [N], [N/Pa]
_MASS, _RISING, _FALLING, _WET, _BREAK_AWAY = 0.5, 3.0, 2.6, 2.0, 3.0  # [kg], [N], [N], [N s/m], [N]


def _coloured(rng: np.random.Generator, n: int, size: float, rho: float = 0.9) -> Array:
    white = rng.standard_normal(n + 200)
    return np.asarray(size * math.sqrt(1.0 - rho**2) * lfilter([1.0], [1.0, -rho], white)[200:], dtype=np.float64)


def _rounded(values: Array, step: float) -> Array:
    return np.round(values / step) * step


def mapped(records: list[Record], mass: float = 1.0) -> StaticMap:
    """The static map of ``records``."""
    return static_map(start_model(["coulomb"], "axis", Units()).with_value("mass", mass), records, Options())


def _by_freedom(found: tuple[float, float], truth: float, freedom: int) -> tuple[float, float]:
    """From a value with its standard error, with the quantile that the map's table takes."""
    return over_interval(found[0], truth, float(stats.t.ppf(0.95, max(freedom, 1))) * found[1])


def ladder(rng: np.random.Generator, surplus: float) -> list[Record]:
    """Runs at constant velocities in both directions, with ``surplus`` [N] of Stribeck force."""
    records = []
    for velocity in np.concatenate([_SPEEDS, -_SPEEDS]).tolist():
        n = 600
        time: Array = 0.005 * np.arange(n, dtype=np.float64)
        position = velocity * time
        level = CURVE["coulomb.force"] + surplus * math.exp(-((velocity / _SURPLUS["stribeck.velocity"]) ** 2))
        curve = math.copysign(level, velocity) + CURVE["viscous.coefficient"] * velocity + CURVE["bias.force"]
        ripple = 0.3 * np.sin(2.0 * np.pi * position / 0.004 + rng.uniform(0.0, 2.0 * np.pi))
        force = curve + ripple + _coloured(rng, n, 0.25) + _RUN_TO_RUN * rng.standard_normal()
        records.append(Record(time, _rounded(position, 1e-6), _rounded(force, 0.01), source=f"{velocity:g}"))
    return records


def plain_ladder(seed: int) -> Finding:
    """Coulomb, viscous and bias force from a ladder without Stribeck effect."""
    return of_model(mapped(ladder(np.random.default_rng(seed), 0.0)), CURVE)


def stribeck_ladder(seed: int) -> Finding:
    """A ladder with Stribeck effect; where none is found its parameters count as missed."""
    found = mapped(ladder(np.random.default_rng(seed), _SURPLUS["stribeck.force"]))
    assert found.choice is not None
    if found.choice.best.candidate.stribeck:
        return of_model(found, CURVE | _SURPLUS)
    return dict.fromkeys((*CURVE, *_SURPLUS), (math.nan, math.nan))


def ladder_levels(seed: int) -> Finding:
    """The force itself at four speeds, from the curve that was chosen."""
    found = mapped(ladder(np.random.default_rng(seed), _SURPLUS["stribeck.force"]))
    assert found.choice is not None
    at = np.array([0.004, 0.02, 0.06, 0.18])
    level = CURVE["coulomb.force"] + _SURPLUS["stribeck.force"] * np.exp(-((at / _SURPLUS["stribeck.velocity"]) ** 2))
    truth = level + CURVE["viscous.coefficient"] * at + CURVE["bias.force"]
    best = found.choice.best
    rows = zip(at.tolist(), best.force(at).tolist(), truth.tolist(), best.half_width(at, 0.9).tolist(), strict=True)
    return {f"level at {1e3 * v:g} mm/s": over_interval(f, t, w) for v, f, t, w in rows}


def _strokes(rng: np.random.Generator, level: float, load: float) -> Record:
    """Triangular strokes, measured behind the rig; the way is that of the contact plus F/k_r."""
    stroke, step, speed = 600e-6, 1e-3, 200e-6
    n = round(stroke / speed / step)
    d = speed * step * np.arange(n)
    ways, forces = [], []
    for k in range(_STROKES):
        reach = _REACH * (1.0 + 0.05 * rng.standard_normal())
        own = np.concatenate([[0.0], np.geomspace(1e-9, stroke, 4000)])
        change = 2.0 * level * (1.0 - np.exp(-math.log(10.0) * own / reach))
        force = np.interp(d, own + change / _RIG, change) - level
        ways.append(stroke - d if k % 2 else d)
        forces.append(-force if k % 2 else force)
    effort = np.concatenate(forces) + _coloured(rng, _STROKES * n, 0.02, 0.5)
    time: Array = step * np.arange(effort.shape[0], dtype=np.float64)
    position = np.concatenate(ways) + 2e-8 * rng.standard_normal(effort.shape[0])
    extra = {"normal_load": np.full(effort.shape[0], load)}
    return Record(time, _rounded(position, 2e-8), _rounded(effort, 1e-3), extra=extra, source=f"load {load:g}")


def strokes(seed: int) -> Finding:
    """Pre-sliding under three loads: distances, ways to half, rig, friction per load, and what the model takes of it."""
    rng = np.random.default_rng(seed)
    found = mapped([_strokes(rng, level, _PER_LOAD * level) for level in _LEVELS])
    assert found.loads is not None
    assert found.loads.line is not None
    assert found.compliance is not None
    result = {}
    for each in found.presliding:
        level = each.load / _PER_LOAD
        name = f"{each.load:g} N, {'forward' if each.direction > 0 else 'backward'}"
        whole = _REACH + 0.9 * 2.0 * level / _RIG
        half = _REACH * math.log(2.0) / math.log(10.0) + level / _RIG
        result[f"break-away distance, {name}"] = _by_freedom(each.distance, whole, each.n - 1)
        result[f"way to half, {name}"] = _by_freedom(each.half, half, each.n - 1)
    rig, line = found.compliance, found.loads.line
    result["rig's compliance"] = _by_freedom(rig.compliance, 1.0 / _RIG, rig.freedom)
    result["contact's own distance"] = _by_freedom(rig.distance, _REACH, rig.freedom)
    result["friction per load"] = _by_freedom(line.slope, 1.0 / _PER_LOAD, line.freedom)
    middle = float(np.mean(_LEVELS))
    sigma = math.log(10.0) * middle / _REACH
    return result | of_model(found, {"coulomb.force": middle, "bias.force": 0.0, "presliding.stiffness": sigma})


def _piston(rng: np.random.Generator, pressure: float) -> tuple[Record, float]:
    """Strokes to and fro, and their dry friction [N]; the regulator lags: the pressure is higher while the piston goes in."""
    step, speed, half = 0.01, 0.02, 200
    sign = np.repeat(np.where(np.arange(16) % 2 == 0, 1.0, -1.0), half)
    position = np.cumsum(sign) * speed * step
    held = pressure + 1e3 * sign + 200.0 * rng.standard_normal(sign.shape[0])
    dry = _DRY + _PER_PRESSURE * pressure + 0.05 * rng.standard_normal()
    since = np.tile(np.arange(half), 16) * speed * step
    friction = sign * dry * (1.0 - 2.0 * np.exp(-since / 1e-4))
    force = _AREA * held + friction + _coloured(rng, sign.shape[0], 0.3)
    time: Array = step * np.arange(sign.shape[0], dtype=np.float64)
    extra = {"pressure": held}
    return Record(time, _rounded(position, 1e-6), _rounded(force, 0.02), extra=extra, source=f"{pressure:g} Pa"), dry


def pressures(seed: int) -> Finding:
    """Friction against pressure, and the area through which it pushes."""
    rng = np.random.default_rng(seed)
    experiments = [_piston(rng, pressure) for pressure in _PRESSURES]
    found = mapped([record for record, _ in experiments])
    assert found.loads is not None
    assert found.loads.line is not None
    line = found.loads.line
    result = {
        "area": _by_freedom(found.loads.area, _AREA, found.loads.area_freedom),
        "friction without pressure": _by_freedom(line.intercept, _DRY, line.freedom),
        "friction per pressure": _by_freedom(line.slope, _PER_PRESSURE, line.freedom),
    }
    for point, (_, dry) in zip(found.loads.points, experiments, strict=True):
        low, high = point.interval(0.9)
        name = f"friction at {1e-5 * point.load:.0f} bar"
        result[name] = over_interval(point.friction[0], dry, 0.5 * (high - low))
    return result


def _slips(rng: np.random.Generator) -> Record:
    """Forty slips forward, each with friction of its own by one per cent."""
    step, slip, rest, top = 1e-4, 0.06, 0.2, 0.08
    one, wait = np.arange(round(slip / step)) * step, round(rest / step)
    v_slip, a_slip = top * np.sin(np.pi * one / slip) ** 2, top * np.pi / slip * np.sin(2.0 * np.pi * one / slip)
    forces = []
    for _ in range(40):
        own = 1.0 + 0.01 * rng.standard_normal()
        ramp = np.linspace(_FALLING, own * _BREAK_AWAY, wait)
        forces += [ramp, own * np.where(a_slip >= 0.0, _RISING, _FALLING) + _WET * v_slip + _MASS * a_slip]
    velocity = np.tile(np.concatenate([np.zeros(wait), v_slip]), 40)
    n = velocity.shape[0]
    acceleration = np.tile(np.concatenate([np.zeros(wait), a_slip]), 40) + 0.05 + 0.03 * rng.standard_normal(n)
    force = np.concatenate(forces) + 0.01 * rng.standard_normal(n)
    time: Array = step * np.arange(n, dtype=np.float64)
    extra = {"acceleration": _rounded(acceleration, 1e-3)}
    return Record(time, _rounded(step * np.cumsum(velocity), 1e-7), _rounded(force, 1e-3), extra=extra, source="stick-slip")


def stick_slip(seed: int) -> Finding:
    """Branches over velocity, their difference, and the break-away force."""
    branch = mapped([_slips(np.random.default_rng(seed))], _MASS).slips[0]
    freedom = branch.n - 1
    result = {}
    for k in (2, 7, 11):
        v = float(branch.speed[k])
        for name, value, error, level in (
            ("speeding up", branch.rising, branch.rising_error, _RISING),
            ("slowing down", branch.falling, branch.falling_error, _FALLING),
        ):
            pair = (float(value[k]), float(error[k]))
            result[f"{name} at level {k}"] = _by_freedom(pair, level + _WET * v, freedom)
    result["difference of the branches"] = _by_freedom(branch.loop, _RISING - _FALLING, freedom)
    result["break-away of the slips"] = _by_freedom(branch.break_away, _BREAK_AWAY, freedom)
    return result


def _starts(rng: np.random.Generator) -> Record:
    """Rests, a force that rises slowly up to a break-away of its own, and a run at constant speed, to and fro in turn."""
    step, speed = 1e-3, 0.01
    n_run = 600
    positions, forces = [np.zeros(300)], [np.zeros(300)]
    for k in range(20):
        sign = -1.0 if k % 2 else 1.0
        top = _BREAK_AWAY * (1.0 + 0.03 * rng.standard_normal())
        ramp = np.arange(rng.uniform(0.0, 1e-3), top, 2.0 * step)
        here = positions[-1][-1]
        since = step * np.arange(1, n_run + 1)
        way = speed * (since - 0.01 * (1.0 - np.exp(-since / 0.01)))
        positions += [np.full(ramp.shape[0], here), here + sign * way, np.full(200, here + sign * way[-1])]
        forces += [sign * ramp, sign * (_FALLING + (top - _FALLING) * np.exp(-since / 0.01)), np.zeros(200)]
    position, force = np.concatenate(positions), np.concatenate(forces)
    n = position.shape[0]
    position = position + 2e-8 * rng.standard_normal(n)
    time: Array = step * np.arange(n, dtype=np.float64)
    return Record(time, _rounded(position, 1e-7), _rounded(force + 0.005 * rng.standard_normal(n), 1e-3), source="starts")


def starts(seed: int) -> Finding:
    """Break-away forces after rests."""
    found = mapped([_starts(np.random.default_rng(seed))])
    return {
        f"break-away force {'forward' if each.direction > 0 else 'backward'}": _by_freedom(
            (abs(each.force[0]), each.force[1]), _BREAK_AWAY, each.n - 1
        )
        for each in found.break_away
    }


TRIALS: dict[str, Callable[[int], Finding]] = {
    "ladder": plain_ladder,
    "ladder with Stribeck effect": stribeck_ladder,
    "curve of that ladder": ladder_levels,
    "strokes under three loads": strokes,
    "piston under four pressures": pressures,
    "starts after rests": starts,
    "stick-slip": stick_slip,
}
"""One experiment each."""


def run(seeds: Sequence[int] = SEEDS) -> list[Figure]:
    """Coverage, bias and spread per experiment and quantity."""
    figures = []
    for title, trial in TRIALS.items():
        figures += figures_of(title, *count(trial, seeds))
    return figures


BENCHMARK = Benchmark("calibration-static", "coverage of the intervals of static maps", run, long=True)
