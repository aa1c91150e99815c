"""The generator ``mujoco``: the axis as a mechanism of MuJoCo, stepped by MuJoCo.

What MuJoCo has is its own: masses on slide joints, dry friction as a joint's ``frictionloss`` (a soft constraint, Todorov
2014), ``damping``, play as a loose joint between motor and load whose ``range`` is the gap, a shaft or an appendage as the
``stiffness`` and ``damping`` of such a joint, soft stops as a tendon that is slack over the gap (``springlength``). What it
doesn't have is written anew in :mod:`.mujoco_loop`: a level that changes is a ``frictionloss`` that is set before each step,
all else a force on the joint.

Steps are 0.1 ms at the most, of MuJoCo's semi-implicit Euler method with implicit damping. Its dry friction creeps where a
body should stick: with an impedance d = 0.9999 (the largest) and a time constant of two steps h, a push that alone would
accelerate the body by a makes it creep at about (1 - d) a h, which is 1e-8 a in SI; a test measures that. That is less than a
step of the encoder over any rest of a recording.

The recorded force is the command's mean from its sample to the next, as of a drive that averages its current.

Emanuel Todorov, "Convex and analytically-invertible dynamics with contacts and constraints", ICRA 2014.
"""

from __future__ import annotations

import ctypes
import math
from pathlib import Path
from typing import Any

import numpy as np

from ....errors import InputError
from ..course import Course, Run
from ..physics import Physics
from .controllers import CONTINUOUS, Controller
from .generator import ANY, Generator, Honoured

__all__ = ["MUJOCO", "mechanism"]

_LONGEST = 1e-4  # [s]
_HARDEST = 0.9999  # impedance of a constraint: MuJoCo's limit
# Damping ratio of an end of the gap: of the speed of an impact at most a quarter over its square is given back, and what a step
# went too far is made up for within milliseconds.
_PLASTIC = 4.0
_USUAL: tuple[float, ...] = (0.0,)
_FIRST = (0.0, 1.0)
_EVERY = (
    *("mass", "load_share", "coulomb", "viscous", "bias", "stribeck", "stribeck_velocity", "asymmetry", "asymmetry_viscous"),
    *("acceleration", "acceleration_velocity", "drag", "drag_velocity", "shear", "shear_velocity", "displacement"),
    *("presliding_damping", "lag_time", "dwell", "dwell_time", "dwell_length", "load", "temperature", "temperature_viscous"),
    *("spot", "spot_position", "spot_width", "wave_cosine", "wave_sine", "wave_period", "drift", "drift_time"),
    *("ripple_cosine", "ripple_sine", "ripple_period", "stiffness", "stiffness_position", "cubic", "cubic_position"),
    *("gap", "stop_stiffness", "stop_damping", "shaft", "shaft_damping"),
    *("appendage", "appendage_frequency", "appendage_damping", "limit", "dead_zone", "delay", "actuator_time"),
    *("payload", "payload_time", "heat", "heat_time", "heat_force", "dip", "cable", "cable_play", "cable_position", "dirt"),
    *("floor", "floor_frequency", "gear", "gain_ripple", "gain_ripple_period", "fading"),
    *("thixotropy", "thixotropy_time", "thixotropy_shear", "eccentricity", "eccentricity_period"),
)
# ``gear_driven`` acts in another form alone.
HONOURED: Honoured = {
    **dict.fromkeys(_EVERY, ANY),
    **{"gear_driven": ANY, "gear_form": _USUAL, "dwell_form": _FIRST},
    **{"presliding": _FIRST, "lag": _FIRST, "actuator": _FIRST},
}
"""What this generator honours; forms of a law but the usual one are left out."""


def _ready() -> None:
    try:
        import mujoco  # noqa: F401
    except ImportError:
        raise InputError("--variant mujoco", "the package mujoco is not installed", "pip install 'fric[peers]'") from None


def mechanism(physics: Physics, step: float) -> str:
    """The axis as MuJoCo's XML, with a ``step`` [s]."""
    p, second = physics.using(physics.named()), ""  # plain numbers, as they are to be written
    soft, plastic = f"{2.0 * step!r} 1", f"{2.0 * step!r} {_PLASTIC!r}"
    hard = f"{_HARDEST} {_HARDEST} 1e-3 0.5 1"
    body = p.mass * p.load_share if p.load_share > 0.0 else p.mass
    tendon = ""
    if p.load_share > 0.0:
        loose = f'stiffness="{p.shaft!r}" damping="{p.shaft_damping!r}"' if p.shaft > 0.0 else ""
        half = 0.5 * p.gap
        if p.stop_stiffness > 0.0:
            tendon = (
                f'<tendon><fixed springlength="{-half!r} {half!r}" stiffness="{p.stop_stiffness!r}">'
                '<joint joint="second" coef="1"/></fixed></tendon>'
            )
        elif p.gap > 0.0:
            loose = f'limited="true" range="{-half!r} {half!r}" solreflimit="{plastic}" solimplimit="{hard}"'
        second = _body("second", p.mass * (1.0 - p.load_share), loose, "")
    elif p.appendage > 0.0:
        rate = 2.0 * math.pi * p.appendage_frequency
        hung = (
            f'stiffness="{p.appendage * rate**2!r}" damping="{2.0 * p.appendage_damping * rate * p.appendage!r}" springref="0"'
        )
        second = _body("second", p.appendage, hung, "")
    rubbing = f'damping="{p.viscous!r}" frictionloss="{p.coulomb!r}" solreffriction="{soft}" solimpfriction="{hard}"'
    return f"""
<mujoco>
  <compiler autolimits="true"/>
  <option timestep="{step!r}" gravity="0 0 0" integrator="Euler" solver="Newton" tolerance="1e-12" jacobian="dense">
    <flag contact="disable" energy="disable" sensor="disable" actuation="disable"/>
  </option>
  <worldbody>{_body("first", body, rubbing, second)}</worldbody>
  {tendon}
</mujoco>
"""


def _body(name: str, mass: float, joint: str, inside: str) -> str:
    return (
        f'<body><joint name="{name}" type="slide" axis="1 0 0" {joint}/>'
        f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>{inside}</body>'
    )


def lead(physics: Physics, controller: Controller, course: Course, resolution: float, sample_time: float) -> Run:
    """What happens to ``physics`` under ``controller`` on ``course``; see :class:`.generator.Generator`.

    Raises:
        InputError: mujoco isn't installed, or the axis has numbers that this generator doesn't honour.
    """
    MUJOCO.ready()
    MUJOCO.check(physics)
    import mujoco

    from .mujoco_loop import run

    per = math.ceil(sample_time / _LONGEST)
    step = sample_time / per
    model = mujoco.MjModel.from_xml_string(mechanism(physics, step))
    data = mujoco.MjData(model)
    n = course.reference.shape[0]
    out = np.zeros((5, n))
    gains = np.array(
        [controller.stiffness, controller.damping, controller.integral, controller.smoothing, controller.largest, resolution]
    )
    data.qpos[0] = course.reference[0]
    every = 0.0 if controller.kind == CONTINUOUS else 1.0 / controller.rate
    line = np.zeros(round(physics.delay / step) + 1)
    run(
        _step_of(mujoco), model._address, data._address, _numbers(physics), gains, every, line, step, per,
        data.qpos, data.qvel, data.qfrc_applied, model.dof_frictionloss, model.dof_damping, model.body_mass, model.dof_M0,
        course.reference, course.feedforward, course.load, course.warmer, course.windows, course.noise, out,
    )  # fmt: skip
    return Run(*out)


def _numbers(physics: Physics) -> Any:
    """What the loop uses, as one record."""
    names = [name for name in HONOURED if not name.startswith("gear_")]
    return np.array([tuple(float(getattr(physics, name)) for name in names)], dtype=[(name, "f8") for name in names])[0]


def _step_of(mujoco: Any) -> Any:
    """``mj_step`` as compiled code can call it: the Python package's call would take longer than the step."""
    from .mujoco_loop import Foreign

    found = sorted(Path(mujoco.__file__).parent.glob("libmujoco*"))
    if not found:
        raise InputError("--variant mujoco", "the package mujoco has no library of that name", "pip install 'mujoco>=3.3'")
    return Foreign(ctypes.CDLL(str(found[0])).mj_step)


MUJOCO = Generator(
    "mujoco", HONOURED, lead, _ready, apart=(("gap", "shaft"), ("load_share", "appendage"))
)  # fmt: skip
"""Led by MuJoCo."""
