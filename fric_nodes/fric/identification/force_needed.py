"""A force that never changes identifies nothing, and is refused before a fit.

The equation of motion is linear in its forces: sum_i theta_i phi_i(q, v, a) = u. With u = 0 throughout, theta = 0 solves it
whatever moved the joint, and every multiple of a solution is one too. With u = c the constant terms take all of c: the offset,
or Coulomb friction of a motion in one direction, and the rest is 0 again. Most often such a force is not one that acted: a
controller without an effort interface publishes 0. It is of use where a parameter that multiplies a force is known and held,
and to methods that need no force at all (free oscillations).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model import Model
from ..record import Record
from .result import IdentificationError

__all__ = ["require_force"]

# Of the largest value: steps that rounding makes in a signal that was scaled from one number (a few units in the last place).
_ROUNDING = 8.0 * float(np.finfo(np.float64).eps)


def require_force(records: Sequence[Record], structure: Model | None = None, held: Sequence[str] = ()) -> None:
    """Refuse recordings whose force never changes, all of them taken together.

    Args:
        records: to be fitted.
        structure: model to be fitted; None where nothing is held.
        held: names of its parameters that keep their values.

    Raises:
        IdentificationError: the force never changes, and no held parameter gives the size of the others.
    """
    efforts = [record.effort[record.mask] for record in records]
    joined = np.concatenate(efforts) if efforts else np.empty(0)
    if not joined.size or float(np.ptp(joined)) > _ROUNDING * float(np.max(np.abs(joined))):
        return
    known = () if structure is None else structure.parameters()
    if any(each.name in held and each.declaration.linear and each.value != 0.0 for each in known):
        return
    source = records[0].source if len(records) == 1 else ", ".join(record.source for record in records)
    raise IdentificationError(
        source,
        f"the effort is {joined[0]:.6g} {records[0].units.force} throughout, so that it determines no parameter",
        "record the effort, the motor current or the force command, or name its topic: --topic force_command=NAME",
    )
