"""One simulated axis beside MuJoCo on one core: a slide joint with damping and dry friction, the same mass, force and step.

MuJoCo is led in two ways. ``mujoco.rollout`` runs all samples in C++, with one thread; the usual loop in Python calls
``mj_step`` for every sample. Contact and energy, which the axis doesn't have, are switched off. MuJoCo's dry friction is a
constraint with some softness: it creeps where fric's sticks, so that the motions agree in the large and not to the last digits;
how far they lie apart stands beside the ratio.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ...figure import Figure
from ...model import build_model, term
from ...record import Array
from ...simulation import simulate
from ..peer import Pair, Peer

__all__ = ["PEER", "apart"]

_GOAL = ">= 50"
_STEP = 1e-3  # [s]
_N_STEPS = 20_000
_MASS, _COULOMB, _VISCOUS = 1.2, 4.0, 10.0
_XML = f"""
<mujoco>
  <option timestep="{_STEP}" gravity="0 0 0"><flag contact="disable" energy="disable"/></option>
  <worldbody><body>
    <joint name="axis" type="slide" axis="1 0 0" damping="{_VISCOUS}" frictionloss="{_COULOMB}"/>
    <geom type="sphere" size="0.05" mass="{_MASS}"/>
  </body></worldbody>
  <actuator><motor joint="axis"/></actuator>
</mujoco>
"""


def _effort() -> Array:
    return np.asarray(12.0 * np.sin(np.arange(_N_STEPS) * 4.4e-3))


def _fric() -> tuple[float, Array]:
    """Time [s] and positions [m]."""
    model = build_model("rigid", {"mass": _MASS}, [term("coulomb", force=_COULOMB), term("viscous", coefficient=_VISCOUS)])
    effort = _effort()
    begun = time.perf_counter()
    motion = simulate(model, effort, _STEP, n_substeps=1, fused=True)
    return time.perf_counter() - begun, motion.position


def _rollout() -> tuple[float, Array]:
    import mujoco
    from mujoco import rollout

    model = mujoco.MjModel.from_xml_string(_XML)
    data, effort = mujoco.MjData(model), _effort()[:, None]
    start = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    begun = time.perf_counter()
    states, _ = rollout.rollout(model, data, start, effort)
    # A state is the time, the position and the velocity.
    return time.perf_counter() - begun, np.asarray(states[0, :, 1])


def _loop() -> tuple[float, Array]:
    import mujoco

    model = mujoco.MjModel.from_xml_string(_XML)
    data, effort, position = mujoco.MjData(model), _effort().tolist(), np.zeros(_N_STEPS)
    control, at = data.ctrl, data.qpos
    begun = time.perf_counter()
    for k, force in enumerate(effort):
        control[0] = force
        mujoco.mj_step(model, data)
        position[k] = at[0]
    return time.perf_counter() - begun, position


def apart() -> list[Figure]:
    """Largest distance of the two motions; a sample of fric's is the state before its force acts, and MuJoCo's that after."""
    mine, other = _fric()[1], _rollout()[1]
    off = float(np.max(np.abs(mine[1:] - other[:-1])) / np.ptp(mine))
    return [Figure("largest distance of the two motions, of the range", off, "1")]


def _timed(run: Callable[[], tuple[float, Array]]) -> Callable[[], float]:
    return lambda: run()[0]


def prepare(_: Path) -> Sequence[Pair]:
    """Against the loop in C++, and against that in Python."""
    name = f"one simulated axis, {_N_STEPS:,} samples, against MuJoCo"
    return (
        Pair(f"{name} (rollout, one thread)", _timed(_fric), _timed(_rollout), _GOAL, needs="mujoco", even=True, beside=apart),
        Pair(f"{name} (mj_step from Python)", _timed(_fric), _timed(_loop), _GOAL, needs="mujoco", even=True),
    )


PEER = Peer("mujoco", prepare)
