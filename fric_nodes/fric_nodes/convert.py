"""Between messages and the core's numbers: stamps, joint states, models."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from builtin_interfaces.msg import Time
from fric.effects import by_name
from fric.model import Model, ModelError, Term, build_model
from fric.parameter import Parameter
from fric.plants import PLANTS
from fric.record import Units
from sensor_msgs.msg import JointState

from fric_interfaces.msg import FrictionEstimate, FrictionModel, FrictionParameter, FrictionTerm

if TYPE_CHECKING:
    from fric.identification.online.estimate import Estimate  # takes a while to import, and most nodes need none of it

__all__ = [
    "JointSample",
    "MessageError",
    "estimate_to_message",
    "from_seconds",
    "joint_sample",
    "model_from_message",
    "model_to_message",
    "nanoseconds",
    "set_stamp",
]

_SECOND = 1_000_000_000


class MessageError(ValueError):
    """A message that can't be used; the text says why."""


class JointSample(NamedTuple):
    """One joint's part of a joint state; velocity and effort are NaN when the message has none."""

    stamp: int
    position: float
    velocity: float
    effort: float


def nanoseconds(stamp: Time) -> int:
    """A stamp as whole nanoseconds."""
    return int(stamp.sec) * _SECOND + int(stamp.nanosec)


def set_stamp(stamp: Time, time: int) -> None:
    """Write ``time`` [ns] into ``stamp``."""
    stamp.sec, stamp.nanosec = divmod(time, _SECOND)


def from_seconds(seconds: float) -> int:
    """Seconds as whole nanoseconds, rounded."""
    return round(seconds * _SECOND)


def joint_sample(message: JointState, joint: str) -> JointSample:
    """The part of ``message`` that belongs to ``joint``.

    Raises:
        MessageError: the joint isn't there, has no position, or a value is not finite.
    """
    names = message.name
    try:
        at = names.index(joint)
    except ValueError:
        raise MessageError(f"no joint '{joint}' among {', '.join(names) or 'none'}") from None
    if at >= len(message.position):
        raise MessageError(f"joint '{joint}' has no position")
    position = message.position[at]
    velocity = message.velocity[at] if at < len(message.velocity) else math.nan
    effort = message.effort[at] if at < len(message.effort) else math.nan
    if not math.isfinite(position):
        raise MessageError(f"position of joint '{joint}' is {position}")
    if math.isinf(velocity) or math.isinf(effort):
        raise MessageError(f"velocity or effort of joint '{joint}' is infinite")
    return JointSample(nanoseconds(message.header.stamp), position, velocity, effort)


def model_to_message(model: Model, stamp: int) -> FrictionModel:
    """``model`` as a message, made at ``stamp`` [ns]."""
    message = FrictionModel(format="fric-model/1", joint=model.joint)
    set_stamp(message.header.stamp, stamp)
    message.header.frame_id = model.joint
    message.position_unit, message.force_unit = model.units.position, model.units.force
    message.provenance = "; ".join(f"{key}: {text}" for key, text in model.provenance.items())

    def entry(effect: str, law: str, prefix: str, declared: tuple[Parameter, ...], values: tuple[float, ...]) -> FrictionTerm:
        listed = []
        for declaration, value in zip(declared, values, strict=True):
            error = model.standard_errors.get(prefix + declaration.name)
            listed.append(
                FrictionParameter(
                    name=declaration.name,
                    unit=declaration.unit(model.units),
                    value=value,
                    standard_error=math.nan if error is None else error,
                    identified=error is not None,
                )
            )
        return FrictionTerm(effect=effect, law=law, parameters=listed)

    message.plant = entry(model.plant.id, "", "", model.plant.parameters, model.plant_values)
    message.terms = [
        entry(held.effect.id, held.effect.law, f"{prefix}.", held.effect.parameters, held.values)
        for prefix, held in zip(model.prefixes, model.terms, strict=True)
    ]
    return message


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


def model_from_message(message: FrictionModel) -> Model:
    """The model in ``message``.

    Raises:
        ModelError: unknown plant or effect, or a value that its declaration refuses.
    """
    plant = PLANTS.get(message.plant.effect)
    if plant is None:
        raise ModelError("model message", f"unknown plant '{message.plant.effect}'", f"use one of {', '.join(PLANTS)}")
    terms = []
    errors: dict[str, float] = {}
    plant_values = _values("plant", plant.parameters, message.plant, errors, "")
    seen: dict[str, int] = {}
    for entry in message.terms:
        effect = by_name(entry.effect, entry.law)
        if effect is None:
            raise ModelError(
                "model message", f"unknown effect '{entry.effect}' '{entry.law}'", "use the effects of fric-model/1"
            )
        seen[effect.id] = seen.get(effect.id, 0) + 1
        prefix = effect.id if seen[effect.id] == 1 else f"{effect.id}#{seen[effect.id]}"
        terms.append(Term(effect, tuple(_values(effect.id, effect.parameters, entry, errors, f"{prefix}.").values())))
    rest: dict[str, Any] = {"provenance": {"message": message.provenance}} if message.provenance else {}
    return build_model(
        plant.id, plant_values, terms, joint=message.joint, units=Units(message.position_unit, message.force_unit),
        standard_errors=errors, **rest,
    )  # fmt: skip


def _values(
    what: str, declared: tuple[Parameter, ...], entry: FrictionTerm, errors: dict[str, float], prefix: str
) -> dict[str, float]:
    given = {parameter.name: parameter for parameter in entry.parameters}
    values = {}
    for declaration in declared:
        parameter = given.pop(declaration.name, None)
        value = declaration.default if parameter is None else parameter.value
        refusal = "is missing" if value is None else declaration.refusal(value)
        if refusal is not None or value is None:
            raise ModelError("model message", f"{what}: {declaration.name} {refusal}", f"give {declaration.doc}")
        values[declaration.name] = float(value)
        if parameter is not None and parameter.identified and math.isfinite(parameter.standard_error):
            errors[prefix + declaration.name] = parameter.standard_error
    if given:
        raise ModelError("model message", f"{what}: unknown parameter '{min(given)}'", "leave it out")
    return values
