"""What the identifier publishes: the estimate as a message, and when it is good enough for a model."""

from __future__ import annotations

from fric.identification.online import Estimate
from fric.model import Model

from fric_interfaces.msg import FrictionEstimate

from .convert import set_stamp

__all__ = ["estimate_to_message", "well_determined"]

_FORCE_SHARE = 0.05  # of the largest force


def well_determined(estimate: Estimate, structure: Model) -> bool:
    """True when every parameter is known well enough to compensate with.

    A force that is truly zero never becomes certain in relation to itself, so forces are also measured against the largest one.
    """
    dimension = {p.name: p.declaration.dimension for p in structure.parameters()}
    forces = [abs(value) for name, value in zip(estimate.names, estimate.values, strict=True) if dimension[name] == "F"]
    limit = _FORCE_SHARE * max(forces, default=0.0)
    known = zip(estimate.names, estimate.standard_errors, estimate.excited, strict=True)
    return all(bool(excited) or (dimension[name] == "F" and bool(error < limit)) for name, error, excited in known)


def estimate_to_message(estimate: Estimate, structure: Model, joint: str, stamp: int) -> FrictionEstimate:
    """The estimate of ``joint`` as a message; ``stamp`` [ns] is that of the newest sample."""
    message = FrictionEstimate(joint=joint)
    set_stamp(message.header.stamp, stamp)
    message.header.frame_id = joint
    message.names = list(estimate.names)
    message.units = [structure.unit(name) for name in estimate.names]
    message.values = estimate.values.tolist()
    message.standard_errors = estimate.standard_errors.tolist()
    message.covariance = estimate.covariance.ravel().tolist()
    message.excited = estimate.excited.tolist()
    message.residual_rms = float(estimate.residual_rms)
    message.samples_used = estimate.samples_used
    message.samples_rejected = estimate.samples_rejected
    message.state = int(estimate.state)
    message.status = estimate.status
    return message
