"""What the monitor publishes: a mismatch as a message, and the state of its watch in words."""

from __future__ import annotations

from fric.diagnosis.suspects import Suspects
from fric.diagnosis.watch import Phase, Watch
from fric.model import Model

from fric_interfaces.msg import Mismatch

from .convert import set_stamp

__all__ = ["mismatch_message", "watch_report"]


def mismatch_message(watch: Watch, found: Suspects | None, model: Model, joint: str, stamp: int) -> Mismatch:
    """The state of ``watch`` at ``stamp`` [ns], with the component that changed where it was ``found``."""
    message = Mismatch(joint=joint, detected=watch.phase is Phase.DETECTED)
    set_stamp(message.header.stamp, stamp)
    message.header.frame_id = joint
    if message.detected and found is not None:
        message.component, message.effect, message.runner_up = found.component, found.effect, found.runner_up
        message.confidence, message.share_of_mismatch, message.regime = found.confidence, found.share, found.regime
        what = "a change of what the model has" if found.known else "not in the model"
        message.detail = (
            f"{found.strength:.3g} {model.units.force} missing on average over {found.duration:.1f} s; "
            f"{found.component or 'no component'} ({100 * found.component_confidence:.0f} % sure): {found.effect}, {what}"
        )
    elif message.detected:
        ratio = max(watch.ratio)
        message.detail = f"{ratio:.3g} times the energy of the floor is missing; floor learnt from {watch.learnt:.0f} s"
    else:
        message.detail = "the model explains the machine as it did at the beginning"
    return message


def watch_report(watch: Watch, model: Model) -> dict[str, object]:
    """The state of ``watch``, by name."""
    return {
        "phase": watch.phase.value,
        "floor learnt from [s of motion]": f"{watch.learnt:.1f}",
        f"floor, root mean square [{model.units.force}]": ", ".join(f"{each:.3g}" for each in watch.floor),
        "energy over floor": ", ".join(f"{each:.3g}" for each in watch.ratio),
        "sum over threshold": ", ".join(f"{test.sum / test.threshold:.2f}" for test in watch.tests),
    }
