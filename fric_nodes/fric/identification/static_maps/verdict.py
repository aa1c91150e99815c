"""What a user must know about static maps before trusting them, and what to record next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .break_away import BreakAway
from .curve import Choice
from .load import LoadLaw, MeanForce
from .presliding import Compliance, Presliding
from .result import StaticMap
from .smoothness import structure_of

__all__ = ["messages_of", "status_of", "stribeck_sentence"]

_FEW_SPEEDS = 4
_FEW_POINTS = 8  # fewer can be exchanged in too few ways


def stribeck_sentence(choice: Choice) -> str:
    """What was found about the Stribeck effect, in one sentence."""
    if not np.isfinite(choice.p_value):
        return "Whether friction decreases with speed can't be tested: that needs at least four speeds in both directions"
    chance = f"F = {choice.f_value:.3g}, probability by chance {choice.p_value:.2g}"
    if choice.best.candidate.stribeck:
        return f"Friction decreases with speed before it increases (Stribeck): {chance}"
    if choice.rival is None:
        return f"No Stribeck effect: no decrease of friction with speed fits better than none ({chance})"
    return f"No Stribeck effect: the decrease of friction with speed isn't significant or isn't worth its parameters ({chance})"


def messages_of(
    means: Sequence[MeanForce],
    choice: Choice | None,
    loads: LoadLaw | None,
    compliance: Compliance | None,
    presliding: Sequence[Presliding],
    break_away: Sequence[BreakAway],
    load_name: str,
) -> list[str]:
    """Warnings, the weightiest first."""
    said = []
    if choice is not None:
        said.append(stribeck_sentence(choice))
        said += _shape_message(means, choice)
        speeds = [abs(mean.velocity) for mean in means]
        if choice.best.candidate.stribeck and choice.best.values[-1] < 1.2 * min(speeds):
            said.append("the Stribeck velocity lies at the slowest speed: the level at rest is extrapolated")
        if max(speeds) < 1.1 * min(speeds):
            said.append("all settled parts have one speed: viscous and Stribeck friction can't be told from the Coulomb level")
    said += _load_messages(means, loads, load_name)
    drifting = [mean for mean in means if mean.drift]
    if drifting:
        worst = max(drifting, key=lambda mean: abs(mean.drift))
        said.append(
            f"the force drifts within {len(drifting)} of {len(means)} speeds and directions, most by {worst.drift:+.3g} from"
            f" the first settled part to the last of {worst.source}: running in or warming up; run the machine in before"
        )
    if compliance is not None:
        said.append(compliance.text)
        if not compliance.told_apart:
            said.append("presliding.stiffness in the model is that of contact and rig in series")
    if any(each.coarse for each in presliding):
        said.append("reversals are sampled too coarsely at the beginning of motion: the initial stiffness is a lower bound")
    coarse = [start for start in break_away if start.resolution > 0.2 * abs(start.force[0])]
    if coarse:
        hardest = max(coarse, key=lambda start: start.resolution)
        said.append(
            f"at {len(coarse)} of {len(break_away)} break-aways the force changes by up to {2.0 * hardest.resolution:.2g} from"
            f" one sample to the next ({hardest.source}): hardly known; sample faster, or raise the force more slowly"
        )
    return said


def _shape_message(means: Sequence[MeanForce], choice: Choice) -> list[str]:
    """That the points hang on the speed in another way than the curve, and where; they don't scatter then."""
    if len(means) < _FEW_POINTS or choice.best.scatter == 0.0:
        return []
    velocity = np.array([mean.velocity for mean in means])
    left = np.array([mean.friction for mean in means]) - choice.best.force(velocity)
    found = structure_of(velocity, left, np.array([mean.force[1] for mean in means]))
    if not found.why:
        return []
    return [
        f"{found.why}, which scatter does in 1 of 100 cases: friction depends on the speed in a way that no curve here has, "
        f"most of it from {found.low:.3g} to {found.high:.3g}; use the points there, and record more speeds"
    ]


def _load_messages(means: Sequence[MeanForce], loads: LoadLaw | None, load_name: str) -> list[str]:
    if loads is None or not loads.points:
        return []
    said = []
    apart = [abs(mean.load) for mean in means]
    if load_name == "pressure" and loads.area[0] == 0.0 and np.ptp(apart) > 0.005 * np.max(apart):
        said.append(
            "the pressure isn't the same in both directions, and fewer than three pressures don't show the area through which"
            " it pushes: the friction contains a part of it"
        )
    if loads.line is not None:
        forward = [point.speeds[0] for point in loads.points]
        backward = [point.speeds[1] for point in loads.points]
        for way, speeds in (("forward", forward), ("backward", backward)):
            if max(speeds) > 1.2 * min(speeds):
                said.append(
                    f"the speed {way} goes from {max(speeds):.3g} to {min(speeds):.3g} along the loads: the effect of the "
                    "load can't be told from that of the speed; hold one speed"
                )
        middle = float(np.median([point.interval()[1] - point.friction[0] for point in loads.points]))
        if loads.line.scatter > middle:
            said.append("friction isn't linear in the load: between the loads use the table rather than the model's line")
        if load_name == "pressure":
            said.append(
                "in the model the pressure [Pa] is the normal_load; the force of the pressure on the piston isn't part of it"
            )
            low, high = _interval(loads)
            said.append(
                f"the pressure pushes through an area of {1e6 * loads.area[0]:.4g} mm^2 (95 %: {1e6 * low:.4g} to "
                f"{1e6 * high:.4g}), found from the mean of both directions; its force is taken off"
            )
    return said


def _interval(loads: LoadLaw) -> tuple[float, float]:
    from scipy import stats

    half = float(stats.t.ppf(0.975, max(loads.area_freedom, 1))) * loads.area[1]
    return loads.area[0] - half, loads.area[0] + half


def status_of(found: StaticMap, fallback: str) -> str:
    """The status sentence, with the next experiment."""
    if not found.means:
        return "stick-slip only: branches over velocity; for a friction curve record constant velocities in both directions"
    speeds = np.sort([abs(mean.velocity) for mean in found.means])
    n_speeds = 1 + int(np.sum(np.diff(np.log(speeds)) > 0.1))
    if found.several_loads:
        head, wanted = "mapped over load", []
    else:
        head = f"mapped over {n_speeds} speed(s)"
        wanted = (
            [f"at least six speeds in both directions, from {0.01 * speeds[-1]:.2g} to above {speeds[-1]:.2g}"]
            if n_speeds < _FEW_SPEEDS
            else []
        )
    if found.compliance is not None and not found.compliance.told_apart:
        wanted.append(
            "the reversals sampled faster and more of them, so that rig and contact can be told apart"
            if np.isfinite(found.compliance.misfit)
            else "the reversals under two more loads, so that rig and contact can be told apart"
        )
    sticking = [note for note in found.notes if "sticks and slips" in note]
    if sticking and not wanted:
        return f"{head}; it sticks and slips below {speeds[0]:.3g}: for slower motion use a stiffer drive. {fallback}"
    if wanted:
        return f"{head}. Next, record {'; and '.join(wanted)}"
    return f"{head}. {fallback}"
