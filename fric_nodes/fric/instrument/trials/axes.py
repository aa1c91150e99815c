"""Axes as a laboratory has them, moved as one would, and recorded: the clean recordings that faults are put into.

Each seed draws an axis (its mass, its friction, its scale), how it is moved, its controller, its encoder, its noise and its
rate. The truth is integrated with several times as many steps as a simulation takes. Controllers are PD laws that read the
position as the encoder gives it, and have the gain margin that a servo is given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import expm

from ...excitation import EXCITATIONS
from ...excitation_kind import Points
from ...model import Model, Term, build_model, term
from ...record import Array, Record, Units
from ...simulation import Simulator, substeps

__all__ = ["AXES", "CLEAN_ONLY", "MOTIONS", "Raw", "Rig", "draw_rig", "record_of", "run_rig"]

_FINER = 2
_SOFTER = 0.9  # step of the search for a bandwidth that the sample time allows; numerical
_GAIN_MARGIN = 2.0  # 6 dB, the usual least margin of a servo loop

AXES = ("rigid", "stribeck", "bristles", "two masses")
"""Axes that faults are put into."""

CLEAN_ONLY = ("backlash", "spring")
"""Further axes, for clean recordings."""

MOTIONS: dict[str, tuple[str, dict[str, float]]] = {
    "multisine": ("reference", {"duration": 12.0, "frequency_low": 0.2, "frequency_high": 4.0}),
    "chirp": ("reference", {"duration": 12.0, "frequency_high": 8.0}),
    "point_to_point": ("reference", {"moves": 14, "decades": 1.0}),
    "steps": ("reference", {"speed_low": 0.01, "speed_high": 0.2, "speeds": 5}),
    "reversals": ("reference", {"speed_low": 0.02, "speed_high": 0.2, "speeds": 4, "acceleration": 3.0}),
    "velocity_ladder": ("reference", {"speed_low": 0.005, "speed_high": 0.1, "speeds": 5, "measure": 0.6}),
    "ramps": ("reference", {"speed_low": 0.01, "speed_high": 0.1, "speeds": 4}),
    "slow_triangles": ("reference", {"speed": 0.004, "amplitude": 0.004, "reversals": 8}),
    "stick_slip_ramp": ("reference", {"rate_low": 0.002, "rate_high": 0.005, "peak": 0.02}),
    "graded_rests": ("reference", {"rest_high": 1.0, "rests": 3, "repeats": 1}),
    "force": ("force", {"duration": 12.0, "frequency_low": 0.3, "frequency_high": 5.0, "amplitude": 1.0, "speed": 1e3}),
    "free_decay": ("force", {"force_high": 1.0, "force_low": 0.6, "decay_time": 3.0}),
}
"""Excitation's output and values, by the name of the motion; forces are in units of what the axis needs."""

_SLOW = ("velocity_ladder", "slow_triangles", "graded_rests", "steps", "reversals", "ramps")

ACTIVE = ("multisine", "chirp", "point_to_point", "force")
"""Motions with enough acceleration to show delays."""


@dataclass(frozen=True, eq=False)
class Rig:
    """An axis, what moves it and what measures it.

    Attributes:
        truth: the axis.
        nominal: mass and friction as its maker would state them.
        axis: its kind.
        motion: what moves it.
        wanted: reference, or force as positions of it, at the samples.
        force_driven: True when ``wanted`` is a force.
        gains: P [F/x] and D [F s/x].
        sample_time: [s].
        resolution: of the encoder [x].
        force_noise: standard deviation [F].
        hold: of the record's effort.
        force_limit: of the drive [F].
        wall: position beyond which the axis can't go [x].
        scale: factors of position and force when it is recorded.
    """

    truth: Model
    nominal: Model
    axis: str
    motion: str
    wanted: Points
    force_driven: bool
    gains: tuple[float, float]
    sample_time: float
    resolution: float
    force_noise: float
    hold: str
    force_limit: float = math.inf
    wall: float = math.inf
    scale: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True, eq=False)
class Raw:
    """What really happened; each of shape ``(n_samples,)``: position and velocity at the samples, force until the next one."""

    position: Array
    velocity: Array
    force: Array


def _terms(axis: str, coulomb: float, viscous: float, random: np.random.Generator) -> list[Term]:
    terms = [term("coulomb", force=coulomb), term("viscous", coefficient=viscous)]
    terms.append(term("bias", force=float(random.uniform(-0.1, 0.1)) * coulomb))
    if axis in {"stribeck", "backlash"}:
        terms.append(term("stribeck", force=float(random.uniform(0.2, 0.5)) * coulomb, velocity=0.01))
    if axis == "bristles":
        terms.append(term("presliding", stiffness=coulomb / float(random.uniform(5e-6, 3e-5)), damping=200.0))
    return terms


def _axis(axis: str, random: np.random.Generator) -> tuple[Model, float, float, float]:
    """The axis, its mass, Coulomb friction and viscous coefficient."""
    mass, coulomb, viscous = (float(random.uniform(*limits)) for limits in ((1.0, 4.0), (4.0, 12.0), (5.0, 30.0)))
    terms = _terms(axis, coulomb, viscous, random)
    if axis == "two masses":
        share = float(random.uniform(0.3, 0.6))
        reduced = mass * share * (1.0 - share)
        rate = 2.0 * np.pi * float(random.uniform(25.0, 60.0))
        link = term("compliance", stiffness=reduced * rate**2, damping=0.04 * reduced * rate)
        return build_model("rigid", {"mass": mass, "load_share": share}, [*terms, link]), mass, coulomb, viscous
    if axis == "backlash":
        terms += [term("backlash", gap=2e-4), term("compliance", stiffness=mass * 3e4, damping=mass * 20.0)]
    if axis == "spring":
        coulomb, viscous = 0.1 * coulomb, 0.1 * viscous
        stiffness = mass * (2.0 * np.pi * float(random.uniform(1.5, 4.0))) ** 2
        terms = [
            term("coulomb", force=coulomb), term("viscous", coefficient=viscous),
            term("stiffness", stiffness=stiffness, position=0.0),
        ]  # fmt: skip
    return build_model("rigid", {"mass": mass}, terms), mass, coulomb, viscous


def draw_rig(seed: int, axis: str, motion: str, *, scaled: bool = True) -> Rig:
    """The rig that belongs to ``seed``."""
    random = np.random.default_rng(seed)
    axis = "spring" if motion == "free_decay" else axis
    truth, mass, coulomb, viscous = _axis(axis, random)
    output, values = MOTIONS[motion]
    excitation = EXCITATIONS[motion if motion != "force" else "multisine"]
    given = {p.name: float(p.default or 0.0) for p in excitation.parameters} | values
    plan = excitation.part(given, {text.name: text.default for text in excitation.texts}, random)
    sample_time = float(random.choice([1e-3, 2e-3, 2.5e-3]))
    assert hasattr(plan, "at")
    wanted: Points = plan.at(sample_time * np.arange(int(plan.duration / sample_time), dtype=np.float64))
    if output == "force":
        # Of a free decay, what deflects the spring by some centimetres; otherwise several times its friction.
        size = 0.03 * truth.value("stiffness.stiffness") if "stiffness.stiffness" in truth.names else 3.0 * coulomb
        wanted = Points(*(size * part for part in wanted))
    stiffness, damping = _gains(motion, mass, coulomb, float(np.ptp(wanted.position)), random)
    while output == "reference" and not _settles(truth, (stiffness, damping), sample_time):
        stiffness, damping = _SOFTER**2 * stiffness, _SOFTER * damping
    nominal = build_model("rigid", {"mass": mass}, [term("coulomb", force=coulomb), term("viscous", coefficient=viscous)])
    scale = (float(random.choice([1.0, 10.0])), float(random.choice([1.0, 0.02, 30.0]))) if scaled else (1.0, 1.0)
    return Rig(
        truth, nominal, axis, motion, wanted, output == "force", (stiffness, damping), sample_time,
        resolution=float(random.choice([5e-7, 2e-6])), force_noise=float(random.uniform(0.005, 0.03)) * coulomb,
        hold=str(random.choice(["following", "linear"])), scale=scale,
    )  # fmt: skip


def _gains(motion: str, mass: float, coulomb: float, travel: float, random: np.random.Generator) -> tuple[float, float]:
    """P and D of the controller; stiff enough for friction not to hold it up for more than a little of its way."""
    rate = 2.0 * np.pi * float(random.uniform(4.0, 8.0)) * (3.0 if motion in _SLOW else 1.0)
    stiffness = max(mass * rate**2, (15.0 * coulomb / travel) if motion in _SLOW else 0.0)
    if motion == "stick_slip_ramp":
        # Pulled by a spring that gives way by a quarter of the pull.
        stiffness = 2.0 * coulomb / (0.25 * MOTIONS[motion][1]["peak"])
    return stiffness, 1.4 * math.sqrt(mass * stiffness)


def _settles(truth: Model, gains: tuple[float, float], h: float) -> bool:
    """Whether the loop has its gain margin without friction: P and D of the last two samples, held over ``h`` [s].

    The loop's state is that of the masses and the position at the sample before. With a transmission that gives way the drive
    moves the motor's mass alone at once, so that a damping which suits the whole mass can make the motor vibrate.
    """
    mass = truth.value("mass")
    if "compliance.stiffness" in truth.names:
        share = truth.value("load_share")
        masses = mass * np.array([1.0 - share, share])
        link = np.array([[1.0, -1.0], [-1.0, 1.0]])
        spring, loss = (truth.value(f"compliance.{name}") * link for name in ("stiffness", "damping"))
    else:
        masses, spring, loss = np.array([mass]), np.zeros((1, 1)), np.zeros((1, 1))
    n = masses.size
    # Positions, velocities, and the force as a state that stays.
    flow = np.zeros((2 * n + 1, 2 * n + 1))
    flow[:n, n : 2 * n] = np.eye(n)
    flow[n : 2 * n, :n], flow[n : 2 * n, n : 2 * n] = -spring / masses[:, None], -loss / masses[:, None]
    flow[n, -1] = 1.0 / masses[0]
    step = expm(flow * h)
    p, d = (_GAIN_MARGIN * gain for gain in gains)
    loop = np.zeros((2 * n + 1, 2 * n + 1))
    loop[: 2 * n, : 2 * n] = step[: 2 * n, : 2 * n]
    loop[: 2 * n, 0] -= (p + d / h) * step[: 2 * n, -1]
    loop[: 2 * n, -1] = d / h * step[: 2 * n, -1]
    loop[-1, 0] = 1.0
    return bool(np.max(np.abs(np.linalg.eigvals(loop))) < 1.0)


def run_rig(rig: Rig) -> Raw:
    """Let it move; the controller sees what the encoder says."""
    h, (p, d) = rig.sample_time, rig.gains
    n_substeps = _FINER * substeps(rig.truth, h)
    simulator = Simulator(rig.truth)
    n = rig.wanted.position.shape[0]
    position, velocity, force = np.empty(n), np.empty(n), np.empty(n)
    target, speed = rig.wanted.position.tolist(), rig.wanted.velocity.tolist()
    # An axis that nothing holds must not drift away under a force: a weak spring of the drive's own.
    hold = 0.0 if rig.motion == "free_decay" else 0.02 * p
    given = np.empty(1)
    before = 0.0
    for k in range(n):
        position[k], velocity[k] = simulator.position, simulator.velocity
        seen = round(position[k] / rig.resolution) * rig.resolution
        pull = p * (target[k] - seen) + d * (speed[k] - (seen - before) / h)
        wish = target[k] - hold * seen if rig.force_driven else pull
        before = seen
        given[0] = force[k] = min(max(wish, -rig.force_limit), rig.force_limit)
        simulator.run(given, h, n_substeps)
        if simulator.position > rig.wall:
            at, rate = rig.truth.plant.encoder
            simulator.states[at], simulator.states[rate] = rig.wall, min(-0.1 * simulator.states[rate], 0.0)
    return Raw(position, velocity, force)


def record_of(rig: Rig, raw: Raw, seed: int) -> Record:
    """What the instruments say of it, in the rig's own units."""
    random = np.random.default_rng([seed, 1])
    n, (length, size) = raw.position.shape[0], rig.scale
    effort = raw.force + rig.force_noise * random.standard_normal(n)
    return Record(
        time=rig.sample_time * np.arange(n, dtype=np.float64),
        position=length * np.round(raw.position / rig.resolution) * rig.resolution,
        effort=size * effort,
        reference=None if rig.force_driven else length * rig.wanted.position,
        effort_hold=rig.hold,
        units=Units() if length == 1.0 else Units("rad", "N m"),
        source=f"{rig.axis}, {rig.motion}, seed {seed}",
    )


def scaled_nominal(rig: Rig) -> Model:
    """The nominal model in the units of the record."""
    length, size = rig.scale
    factors = {"mass": size / length, "coulomb.force": size, "viscous.coefficient": size / length}
    values = np.array([factors[name] * rig.nominal.value(name) for name in rig.nominal.names])
    return replace(rig.nominal.with_values(values), units=Units() if length == 1.0 else Units("rad", "N m"))
