"""A contact that a rig leads: the force is measured at the contact itself, so that no inertia is in it.

So do tribometers, seals in a testing machine, and drives at constant speed. Its friction hangs on the motion alone, which the
rig gives; nothing has to move by itself to tell it. To be run as a plant it gets a body, whose mass is no property of the
machine and which no fit moves.
"""

from __future__ import annotations

from typing import Any

from ..engine.kernel import kernel
from ..parameter import Parameter
from ..plant import Plant
from . import rigid

__all__ = ["PLANT"]


@kernel
def drive(p: Any, q: float, v: float, a: float) -> float:
    return -0.0  # what the compiler leaves out of a sum


_BODY = Parameter(
    "mass", "m", "F s^2/x", "of the body that moves when it is run as a plant; not in a measured force",
    default=1.0, positive=True, shape=True,
)  # fmt: skip

PLANT = Plant(
    id="contact",
    title="contact led by a rig",
    equation="u = F(q, v, t) + F_contact along a given motion; run as a plant, m dv/dt = u - F(q, v, t) - F_contact",
    source="Newton; as the rigid axis, its force measured behind the mass",
    parameters=(_BODY,),
    states=rigid.PLANT.states,
    functions=(*rigid.PLANT.functions[:-1], drive),
    inertia=rigid.PLANT.inertia,
    led=True,
)
