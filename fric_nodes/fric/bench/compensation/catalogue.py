"""Axes of the comparison: a slide, a guideway on nanometres, a geared axis with load, a servo joint, a pneumatic cylinder."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...control.autotune import Timing
from ...control.trial import Reference, point_to_point, sine
from ...model import Model, build_model, term
from ...record import Units
from .axes import BenchAxis
from .cylinder import Cylinder

__all__ = ["AXES"]


def _graded(largest: float, smallest: float, grades: int, speed: float, move: float) -> Callable[[float], Reference]:
    """To and fro with amplitudes that fall from ``largest`` to ``smallest`` [x], with inner loops on the way."""
    points = [0.0]
    for a in np.geomspace(largest, smallest, grades).tolist():
        points += [a, -a, -0.4 * a, -0.8 * a, 0.5 * a, 0.1 * a, a, -a]
    return lambda period: point_to_point(period, [*points, 0.0], move, 0.0, speed)


def _quick(amplitude: float, move: float) -> Callable[[float], Reference]:
    """Thirty moves to and fro, so quick that inertia shows beside friction."""
    points = [0.0, *(amplitude * (1.0 - 0.02 * k) * (-1.0) ** k for k in range(30)), 0.0]
    return lambda period: point_to_point(period, points, move, 0.25 * move)


_SLIDE = build_model(
    "rigid",
    {"mass": 95.0},
    [
        term("coulomb", force=20.0),
        term("stribeck", force=3.0, velocity=4e-3),
        term("presliding", "gms", stiffness=3e6, attraction=400.0, damping=1200.0),
        term("viscous", coefficient=205.0),
        term("bias", force=3.0),
    ],
)
_GUIDEWAY = build_model(
    "rigid",
    {"mass": 0.6},
    [
        term("coulomb", force=0.6),
        term("stribeck", force=0.15, velocity=2e-3),
        term("presliding", "gms", stiffness=6e5, attraction=30.0, damping=60.0),
        term("viscous", coefficient=2.0),
        term("actuator_lag", time=1e-4),
    ],
)
_GEARED = build_model(
    "two_mass",
    {"motor_mass": 2.0, "load_mass": 5.0, "motor_coulomb": 2.0, "motor_viscous": 10.0},
    [
        term("backlash", gap=5e-5),
        term("compliance", stiffness=3e6, damping=400.0),
        term("coulomb", force=12.0),
        term("stribeck", force=2.0, velocity=5e-3),
        term("viscous", coefficient=40.0),
    ],
)
_JOINT = build_model(
    "rigid",
    {"mass": 0.8},
    [
        term("coulomb", force=4.0),
        term("stribeck", force=2.0, velocity=0.05),
        term("presliding", "lugre", stiffness=4e3, damping=8.0),
        term("viscous", coefficient=3.0),
        term("bias", force=6.0),
        term("ripple", cosine=0.4, period=0.126),
    ],
    units=Units("rad", "N m"),
)
_CYLINDER = build_model(
    "pneumatic",
    {"mass": 1.5},
    [
        term("coulomb", force=2.447),
        term("accel_hysteresis", force=1.253, velocity=0.019),
        term("viscous", coefficient=15.0),
    ],
)
_SHEET = (
    "stroke",
    "area",
    "heat_ratio",
    "gas_constant",
    "temperature",
    "exhaust_pressure",
    "supply_overlap",
    "exhaust_overlap",
)


def _cylinder(axis: BenchAxis, truth: Model, seed: int) -> Cylinder:
    timing = axis.timing
    return Cylinder(truth, axis.nominal, timing.resolution, axis.force_noise, timing.force_limit, seed)


def _moves(far: float, near: float, move: float, rest: float) -> Callable[[float], Reference]:
    """A long move, a long one back, and a short one, each with a rest."""
    return lambda period: point_to_point(period, [0.0, far, 0.3 * far, 0.3 * far + near], move, rest)


AXES: dict[str, BenchAxis] = {
    axis.id: axis
    for axis in (
        BenchAxis(
            "slide",
            "slide of the size of EMPS, 1 kHz, encoder of 0.1 um, one sample of delay",
            _SLIDE,
            Timing(1e-3, 1e-3, 1e-7, 200.0),
            _graded(0.05, 3e-6, 8, 0.12, 0.1),
            lambda period: sine(period, 0.02, 0.5, 6.0),
            force_noise=0.2,
            rest=_moves(0.02, 1e-4, 0.4, 1.5),
            tolerance=1e-6,
        ),
        BenchAxis(
            "guideway",
            "guideway in pre-sliding, 6.25 kHz, interferometer of 0.1 nm with noise, 370 nm at 1 Hz",
            _GUIDEWAY,
            Timing(1.6e-4, 0.0, 1e-10, 10.0),
            _graded(3e-5, 3e-8, 7, 2e-4, 0.08),
            lambda period: sine(period, 3.7e-7, 1.0, 3.0),
            readings=4,
            position_noise=1e-10,
            force_noise=2e-4,
            quick=_quick(5e-4, 0.03),
            rest=_moves(2e-5, 1e-7, 0.2, 0.4),
            tolerance=2e-9,
        ),
        BenchAxis(
            "geared",
            "motor and load behind a gear with 50 um of backlash and compliance, 1 kHz, encoder of 1 um at the motor",
            _GEARED,
            Timing(1e-3, 0.0, 1e-6, 150.0),
            _graded(0.05, 2e-3, 6, 0.12, 0.15),
            lambda period: sine(period, 0.02, 0.5, 6.0),
            force_noise=0.2,
            springs=0,
            rest=_moves(0.02, 1e-3, 0.4, 1.5),
            tolerance=1e-5,
        ),
        BenchAxis(
            "joint",
            "servo joint with an arm's weight and ripple, 1 kHz, encoder of 17 bits, one sample of delay; in rad and N m",
            _JOINT,
            Timing(1e-3, 1e-3, 4.8e-5, 60.0),
            _graded(0.5, 4e-4, 7, 1.2, 0.12),
            lambda period: sine(period, 0.3, 0.5, 6.0),
            force_noise=0.1,
            rest=_moves(0.3, 5e-3, 0.4, 1.5),
            tolerance=5e-4,
        ),
        BenchAxis(
            "cylinder",
            "pneumatic cylinder with a carriage of 1.5 kg and a force controller on its pressures, 1 kHz, encoder of 1 um",
            _CYLINDER,
            Timing(1e-3, 5e-3, 1e-6, 60.0),
            _graded(0.03, 2e-3, 6, 0.12, 0.3),
            lambda period: sine(period, 0.02, 0.5, 6.0),
            force_noise=0.1,
            springs=0,
            rest=_moves(0.02, 1e-3, 0.4, 1.5),
            tolerance=5e-5,
            lag=5e-3,
            fixed=_SHEET,
            made=_cylinder,
        ),
    )
}
"""Every axis by its id."""
