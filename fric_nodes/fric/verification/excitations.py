"""Every excitation of the catalogue: limits, continuity, rest at both ends, and what is particular to it; with its picture."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from ..excitation import EXCITATIONS
from ..excitation.graded_rests import Strokes
from ..excitation.parametric_oscillation import Oscillation
from ..excitation.prbs import maximum_length_sequence
from ..excitation.velocity_ladder import Ladder
from ..excitation_kind import Excitation, Points, Trajectory
from ..figure import Figure
from ..model import build_model, term
from ..record import Array
from ..report.figures import Curve, stacked
from ..simulation import Simulator
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_STEP = 5e-4  # [s] of the feedback
_MASS, _VISCOUS, _COULOMB = 2.0, 35.0, 1.0  # of the axis that the feedback works on
_LIMITS = {
    "position": ("amplitude", "travel", "peak", "height", "force_high"),
    "velocity": ("speed", "speed_high"),
    "acceleration": ("acceleration",),
}


def _values(kind: Excitation) -> dict[str, float]:
    return {parameter.name: float(parameter.default or 0.0) for parameter in kind.parameters}


def _recording(folder: Path) -> Path:
    """A motion to be played, which begins and ends in full speed."""
    t = np.arange(0.0, 6.0, 0.01)
    file = folder / "motion.csv"
    columns = np.stack([t, 0.02 * np.sin(3.0 * t) + 0.005 * np.sin(11.0 * t)], axis=1)
    np.savetxt(file, columns, delimiter=",", header="time,reference", comments="")
    return file


def _planned() -> dict[str, Trajectory]:
    motions = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, kind in EXCITATIONS.items():
            if kind.plan is not None:
                texts = {text.name: text.default for text in kind.texts}
                if "file" in texts:
                    texts["file"] = str(_recording(Path(folder)))
                part = kind.part(_values(kind), texts, np.random.default_rng(1))
                assert not hasattr(part, "force")
                motions[name] = part
    return motions


def _use_of_limits(kind: Excitation, points: Points) -> float:
    """Largest share of a limit among its parameters that the motion uses; 0 where it has none."""
    given = _values(kind)
    if kind.id == "ramp_and_steps":
        given = {"height": given["midpoint"] + given["height"]}  # its steps are above and below the midpoint
    shares = [
        float(np.max(np.abs(signal))) / given[limit]
        for signal, (_, limits) in zip(points, _LIMITS.items(), strict=True)
        for limit in limits
        if limit in given
    ]
    return max(shares, default=0.0)


def _derivative_error(motion: Trajectory) -> float:
    """Largest deviation of velocity and acceleration from central differences, over their ranges, at random times."""
    t = np.random.default_rng(0).uniform(1e-3, motion.duration - 1e-3, 3000)
    h = 1e-5
    before, here, after = (motion.at(t + shift) for shift in (-h, 0.0, h))
    pairs = ((before.position, after.position, here.velocity), (before.velocity, after.velocity, here.acceleration))
    return max(float(np.max(np.abs((b - a) / (2.0 * h) - d)) / np.max(np.abs(d))) for a, b, d in pairs)


def _common(motions: dict[str, Trajectory]) -> list[Figure]:
    figures = []
    jumps, ends, used, errors = {}, {}, {}, {}
    for name, motion in motions.items():
        t = np.linspace(0.0, motion.duration, 200_001)
        points = motion.at(t)
        largest = float(np.max(np.abs(points.acceleration)))
        jumps[name] = float(np.max(np.abs(np.diff(points.velocity)))) / (largest * float(t[1]))
        ends[name] = max(float(np.max(np.abs(signal[[0, -1]]))) / float(np.max(np.abs(signal))) for signal in points)
        used[name] = _use_of_limits(EXCITATIONS[name], points)
        errors[name] = _derivative_error(motion)
    for what, found, goal in (
        ("largest share of a limit of its own that is used", used, "<= 1.0001"),
        ("velocity and acceleration off the differences of position and velocity", errors, "<= 0.005"),
        ("change of velocity in a step over what the largest acceleration allows", jumps, "<= 1.05"),
        ("position, velocity or acceleration at the ends", ends, "<= 1e-09"),
    ):
        worst = max(found, key=lambda name: found[name])
        figures.append(Figure(f"{what}: worst of {len(found)} ({worst})", found[worst], "1", goal))
    return figures


def _particular(motions: dict[str, Trajectory]) -> list[Figure]:
    figures = []
    worst = 0.0
    for stages in range(2, 17):
        signs = 1.0 - 2.0 * maximum_length_sequence(stages, 1)
        correlation = np.fft.ifft(np.abs(np.fft.fft(signs)) ** 2).real
        worst = max(worst, float(np.max(np.abs(correlation[1:] + 1.0))))
    figures.append(Figure("prbs: autocorrelation off -1 at any shift, 2 to 16 stages", worst, "1", "<= 1e-06"))
    triangles = motions["slow_triangles"]
    _, v, _ = triangles.at(np.linspace(0.0, triangles.duration, 200_001))
    turns = int(np.count_nonzero(np.diff(np.sign(v[np.abs(v) > 1e-12]))))
    wanted = int(_values(EXCITATIONS["slow_triangles"])["reversals"])
    figures.append(Figure("slow_triangles: reversals more or fewer than asked for", abs(turns - wanted), "", "== 0"))
    ladder = motions["velocity_ladder"]
    assert isinstance(ladder, Ladder)
    off = 0.0
    for rung in ladder.rungs:
        points = ladder.at(np.linspace(rung.first, rung.last, 100))
        off = max(off, float(np.max(np.abs(points.velocity / rung.velocity - 1.0))))
    figures.append(Figure("velocity_ladder: velocity off its value in the settled parts", off, "1", "<= 1e-12"))
    strokes = motions["graded_rests"]
    assert isinstance(strokes, Strokes)
    moved = max(float(np.ptp(strokes.at(np.linspace(end - length, end - 1e-9, 50)).position)) for length, end in strokes.rests)
    figures.append(Figure("graded_rests: motion during the rests", moved, "m", "== 0"))
    loops = motions["presliding_loops"]
    t = np.linspace(0.0, loops.duration, 200_001)
    largest = float(np.max(np.abs(loops.at(t).position)))
    off = abs(largest / _values(EXCITATIONS["presliding_loops"])["amplitude"] - 1.0)
    figures.append(Figure("presliding_loops: turning point off its amplitude", off, "1", "<= 1e-06"))
    decay = motions["free_decay"]
    values = _values(EXCITATIONS["free_decay"])
    released = values["rise_time"] + values["hold"] + values["release_time"]
    after = decay.at(np.linspace(released, released + values["decay_time"] - 1e-9, 1000)).position
    figures.append(Figure("free_decay: force after the release", float(np.max(np.abs(after))), "N", "== 0"))
    return figures


def _oscillation() -> tuple[list[Figure], tuple[go.Figure, str]]:
    """An axis whose own damping is taken away almost entirely: its mass from the frequencies under two position gains."""
    kind = EXCITATIONS["parametric_oscillation"]
    values = {**_values(kind), "gains": 2.0, "filter_time": 0.0, "damping": -33.0}
    assert kind.answer is not None
    feedback = kind.answer(values)
    assert isinstance(feedback, Oscillation)
    terms = [term("viscous", coefficient=_VISCOUS), term("coulomb", force=_COULOMB)]
    simulator = Simulator(build_model("rigid", {"mass": _MASS}, terms))
    n = round(feedback.duration / _STEP)
    position, force = np.empty(n), np.empty(n)
    for k in range(n):
        position[k] = simulator.position
        force[k] = feedback.force(k * _STEP, position[k])
        simulator.step(force[k], _STEP)
    time = _STEP * np.arange(n, dtype=np.float64)
    squares = []
    for number in range(2):
        first = number * feedback.cycle + feedback.release
        squares.append(_squared_frequency(position[(time >= first) & (time < first + 1.2)]))
    mass = (feedback.stiffness[1] - feedback.stiffness[0]) / (squares[1] - squares[0])
    # The half sample of the difference quotient and that of the held force make D act like the mass -D h.
    expected = _MASS - values["damping"] * _STEP
    figures = [
        Figure(
            "parametric_oscillation: mass off the one put in, from the squares of two frequencies",
            abs(mass / expected - 1.0),
            "1",
            "<= 0.01",
        ),
        Figure("the same without adding what sampling does to it", abs(mass / _MASS - 1.0), "1"),
    ]
    alone = _VISCOUS / (2.0 * math.sqrt(feedback.stiffness[0] * _MASS))
    panels = [("position [m]", [Curve("q", time, position, "after")]), ("force [N]", [Curve("u", time, force, "before")])]
    caption = (
        f"parametric_oscillation: an axis of {_MASS:g} kg with {_VISCOUS:g} N s/m (damping ratio {alone:.2f} under the lower"
        f" gain) and {_COULOMB:g} N of Coulomb friction, let go from both sides under two position gains."
    )
    return figures, (stacked(panels, "time [s]", 180), caption)


def _squared_frequency(q: Array) -> float:
    """Squared natural frequency [1/s^2] from peak to peak: half a period between turning points, whatever the friction."""
    v = np.diff(q)
    at = np.flatnonzero(v[:-1] * v[1:] < 0.0)
    exact = at + v[at] / (v[at] - v[at + 1])
    spans = np.abs(np.diff(q[at + 1]))
    decay = -float(np.polyfit(np.arange(spans.size), np.log(spans), 1)[0])
    half = float(np.mean(np.diff(exact))) * _STEP
    return (math.pi / half) ** 2 + (decay / half) ** 2


def _plot(name: str, motion: Trajectory) -> tuple[go.Figure, str]:
    kind = EXCITATIONS[name]
    t = np.linspace(0.0, motion.duration, 40_001)
    points = motion.at(t)
    force = "reference" not in kind.outputs
    labels = ("force [N]",) if force else ("position [m]", "velocity [m/s]")
    panels = [
        (label, [Curve(label.split()[0], t, y, colour)])
        for label, y, colour in zip(labels, points, ("after", "before"), strict=False)
    ]
    return stacked(panels, "time [s]", 150), f"{name}: {kind.title}. It shows {kind.shows}."


def run() -> Evidence:
    """Plan all with their default values and look at every sample."""
    motions = _planned()
    figures, plot = _oscillation()
    notes = [
        "A limit is a parameter such as amplitude, speed or acceleration. Without one (ramp_and_steps: position only) nothing"
        " is held against the motion. Sharp corners and jumps are options (corner_time, edge_time or release_time of 0), not"
        " the default.",
        "Published as a force, the same curves are forces [N or N m], and velocities their rates.",
    ]
    plots = [_plot(name, motion) for name, motion in motions.items()]
    return Evidence([*_common(motions), *_particular(motions), *figures], [*plots, plot], notes)


VERIFICATION = Verification(
    id="excitations",
    title="Excitations: limits kept, derivatives consistent, rest at both ends",
    source="difference quotients; autocorrelation of maximum-length sequences (Golomb 1967); de Marchi 1998 (mass)",
    run=run,
)
