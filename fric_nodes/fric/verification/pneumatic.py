"""The pneumatic cylinder: its limit cycle, its air, and the four friction models of Szell's Table 1.

Table 1 compares what four models make of the pressure difference that was measured over one stick-slip. The recordings of the
paper aren't published, so the truth here is a stick-slip whose friction is none of the four, integrated by another method from
equations typed a second time, with the noise of sensors on it (:mod:`.pneumatic_reference`). Models A and B run in the rigid
plant, C and D by :meth:`TensorProductFriction.simulate`. Twenty experiments of ten recordings each, so that no figure hangs on
a single noise; Model D is made from the ten recordings of its experiment.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from scipy.ndimage import uniform_filter1d

from ..figure import Figure
from ..friction.tensor_product import TensorProductFriction, from_data, from_model, velocity_grid
from ..model import Model, build_model, term
from ..model_file import read_model
from ..record import Array
from ..report.figures import Curve, scatter_and_curves, stacked
from ..shared_files import config_file
from ..simulation import Motion, Simulator, simulate
from . import pneumatic_reference as reference
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_COMMAND = 0.0208  # of the valve; makes slips of the paper's speed
_COULOMB, _STATIC, _VISCOUS, _STRIBECK = (reference.FRICTION[name] for name in ("F_C", "F_S", "F_v", "v_s"))
_STEP = 2e-4  # [s], of the recordings
_TABLE_1 = {"A": (24.04, 14.54), "B": (2.654, 5.372), "C": (2.661, 5.340), "D": (2.736, 7.013)}  # [%]
_COLOURS = {"A": "before", "B": "reference", "C": "after", "D": "second"}

Run = Callable[[Array], Motion]


def _limit_cycle(model: Model) -> tuple[list[Figure], list[tuple[go.Figure, str]]]:
    """Six seconds under a constant command, sampled so finely that break-away is seen to 0.1 %."""
    step = 1e-4
    simulator = Simulator(model, position=0.002)
    states, _ = simulator.run(np.full(60_000, _COMMAND), step)
    t = step * np.arange(1.0, states.shape[0] + 1)
    v = states[:, 1]
    force = model.value("area") * (states[:, 2] - states[:, 3])
    starts = np.flatnonzero((v[1:] > 0.0) & (v[:-1] == 0.0))
    stops = np.flatnonzero((v[1:] == 0.0) & (v[:-1] > 0.0)) + 1
    stops = stops[stops > starts[0]]
    starts = starts[: stops.shape[0]]
    sticks = [states[b : a + 1, 0] for b, a in zip(stops[:-1], starts[1:], strict=True)]
    peaks = np.array([np.max(v[a:b]) for a, b in zip(starts, stops, strict=True)])
    change = np.max(np.abs(np.diff(peaks[-10:]))) / peaks[-1]
    periods = step * np.diff(starts)
    figures = [
        Figure("slips in 6 s under a constant command", float(starts.shape[0]), "", ">= 20"),
        Figure("break-away force off F_S, worst slip", float(np.max(np.abs(force[starts] / _STATIC - 1.0))), "1", "<= 0.01"),
        Figure("motion of the piston between slips", float(max(np.ptp(each) for each in sticks)), "m", "== 0"),
        Figure("reversals of the piston", float(np.sum(v < 0.0)), "", "== 0"),
        Figure("last ten slips: change of the peak velocity from one to the next", float(change), "1", "<= 0.02"),
        Figure("last slip: peak velocity (Table 1's range: 0.0340)", float(peaks[-1]), "m/s"),
        Figure(
            "last slip: range of the acceleration (Table 1's: 3.99)", float(np.ptp(np.diff(v[starts[-1] :]))) / step, "m/s^2"
        ),
        Figure("last slip: period", float(periods[-1]), "s"),
    ]
    return figures, _cycle_plots(model, t, states, force, int(starts[-1]), int(stops[-1]))


def _cycle_plots(model: Model, t: Array, states: Array, force: Array, start: int, stop: int) -> list[tuple[go.Figure, str]]:
    """Pictures of all slips, and of the one from sample ``start`` to ``stop``."""
    v = states[:, 1]
    last = slice(start - 200, stop + 200)
    one, a = t[last] - t[start], np.gradient(v, t)
    friction = force - model.value("mass") * a
    return [
        (
            stacked(
                [
                    ("A (p_a - p_b) [N]", [Curve("excitation", t, force, "after")]),
                    ("position [mm]", [Curve("piston", t, 1e3 * states[:, 0], "true")]),
                ],
                "time [s]",
            ),
            "Stick-slip under a constant command, as Fig. 5: the force rises to F_S, and falls as the piston slips.",
        ),
        (
            stacked(
                [
                    ("force [N]", [Curve("excitation", one, force[last], "after")]),
                    ("acceleration [m/s²]", [Curve("piston", one, a[last], "true")]),
                    ("velocity [m/s]", [Curve("piston", one, v[last], "true")]),
                ],
                "time since break-away [s]",
                180,
            ),
            "The last slip, as Figs. 6 to 8.",
        ),
        (
            scatter_and_curves(
                None, [Curve("last slip", v[start:stop], friction[start:stop], "after")],
                "velocity [m/s]", "friction [N]", 340,
            ),
            "Friction over velocity in the last slip, as Figs. 9 and 13: above while speeding up, below while slowing down.",
        ),
    ]  # fmt: skip


def _air() -> list[Figure]:
    """The gas in the plant: against Radau's method, the closed gas spring, and the speed of the calculation."""
    values = {
        parameter.name: parameter.default for parameter in read_model(config_file("pneumatic_model.yaml")).plant.parameters
    }
    model = build_model("pneumatic", values, [term("viscous", coefficient=20.0)])  # type: ignore[arg-type]
    step, n = 1e-3, 900
    jumps = (0.3, 0.6)
    wanted = np.array([0.035, -0.05, 0.0])

    def command(t: float) -> float:
        return float(wanted[np.searchsorted(jumps, t)])

    simulator = Simulator(model, position=0.03)
    start = simulator.states.copy()
    mine = np.vstack([start, simulator.run(np.repeat(wanted, n // 3), step)[0]])
    theirs = reference.free_motion(start, step * np.arange(n + 1.0), command, jumps, 20.0)
    off = float(np.max(np.max(np.abs(mine - theirs), axis=0) / np.ptp(theirs, axis=0)))

    spring = Simulator(build_model("pneumatic", values), position=0.04, velocity=1e-4)  # type: ignore[arg-type]
    fine = 1e-4
    states, _ = spring.run(np.zeros(50_000), fine)
    x, v, p_a, p_b = states.T
    down = np.flatnonzero((v[1:] <= 0.0) & (v[:-1] > 0.0))
    turns = fine * (down + v[down] / (v[down] - v[down + 1]))
    frequency = 2 * np.pi * (turns.shape[0] - 1) / (turns[-1] - turns[0])
    area, dead = reference.AREA, reference.DEAD
    volume_a, volume_b = dead + area * x, dead + area * (reference.STROKE - x)
    closed = np.sqrt(1.4 * reference.EXHAUST * area**2 * (1 / (dead + area * 0.04) + 1 / (dead + area * 0.06)) / reference.MASS)
    entropy = np.concatenate([p_a * volume_a**1.4, p_b * volume_b**1.4]).reshape(2, -1)
    kinetic, stored = 0.5 * reference.MASS * v**2, (p_a * volume_a + p_b * volume_b) / 0.4
    energy = kinetic + stored  # with one area on both sides the air outside does no work

    sliding = read_model(config_file("pneumatic_model.yaml"))
    spent = []
    for _ in range(3):
        run = Simulator(sliding, position=0.002)
        before = clock.perf_counter()
        run.run(np.full(6000, _COMMAND), 1e-3)
        spent.append(clock.perf_counter() - before)
    return [
        Figure("without dry friction: largest deviation of any state from Radau's method", off, "of its range", "<= 0.0001"),
        Figure("closed valve: frequency off the gas spring's", float(abs(frequency / closed - 1.0)), "1", "<= 0.0001"),
        Figure(
            "closed valve: change of p V^kappa over 5 s", float(np.max(np.abs(entropy / entropy[:, :1] - 1))), "1", "<= 1e-9"
        ),
        Figure(
            "closed valve: change of the energy over the kinetic energy",
            float(np.ptp(energy) / np.max(kinetic)),
            "1",
            "<= 0.01",
        ),
        Figure("simulated time over computing time at 1 kHz", 6.0 / min(spent), "1", ">= 20"),
    ]


def _models() -> dict[str, Run]:
    """What each of the models A to C makes of a force."""
    dry = [term("coulomb", force=_COULOMB), term("viscous", coefficient=_VISCOUS)]
    surplus = _STATIC - _COULOMB
    a = build_model("rigid", {"mass": reference.MASS}, [*dry, term("stribeck", "hess_soom", force=surplus, velocity=_STRIBECK)])
    b = build_model("rigid", {"mass": reference.MASS}, [*dry, term("accel_hysteresis", force=surplus, velocity=_STRIBECK)])
    c = from_model(b, velocity_grid(0.05, 1000))
    return {
        "A": lambda force: simulate(a, force, _STEP, hold="linear"),
        "B": lambda force: simulate(b, force, _STEP, hold="linear"),
        "C": _run_of(c),
    }


def _run_of(law: TensorProductFriction) -> Run:
    return lambda force: law.simulate(force, _STEP, hold="linear")


def _model_d(slips: Sequence[reference.Slip]) -> TensorProductFriction:
    """From recordings. The branch is decided by a mean of the acceleration over 6 ms; nothing else is filtered."""
    return from_data(
        np.concatenate([slip.velocity for slip in slips]),
        np.concatenate([uniform_filter1d(slip.acceleration, 31) for slip in slips]),
        np.concatenate([slip.friction for slip in slips]),
        reference.MASS,
        largest=0.05,
        size=250,
        least_speed=5e-4,
        least_acceleration=0.15,
    )


def _deviations(run: Run, slip: reference.Slip) -> tuple[float, float]:
    """Root mean square of the deviations of acceleration [m/s^2] and velocity [m/s] from the recording."""
    velocity = run(slip.force).velocity
    off = np.gradient(velocity, _STEP) - slip.acceleration
    return float(np.sqrt(np.mean(off**2))), float(np.sqrt(np.mean((velocity - slip.velocity) ** 2)))


def _table_1() -> tuple[list[Figure], list[tuple[go.Figure, str]], list[str]]:
    truth = reference.stick_slip(0.02, _COMMAND, _STEP, rest=0.025)
    runs = _models()
    found: dict[str, list[Array]] = {name: [] for name in _TABLE_1}
    alone = []
    shown: Mapping[str, Run] = {}
    for experiment in range(1, 21):
        random = np.random.default_rng(experiment)
        slips = [truth.recorded(random) for _ in range(10)]
        d = _model_d(slips)
        here = {**runs, "D": _run_of(d)}
        for name, run in here.items():
            found[name].append(np.array([_deviations(run, slip) for slip in slips]))
        alone.append(found["A"][-1][0, 0] / _deviations(_run_of(_model_d(slips[:1])), slips[0])[0])
        if not shown:
            shown, first, table = here, slips[0], d
    rms = {name: np.sqrt(np.mean(np.concatenate(each) ** 2, axis=0)) for name, each in found.items()}
    each_d = [
        float(np.sqrt(np.mean(a[:, 0] ** 2) / np.mean(d[:, 0] ** 2))) for a, d in zip(found["A"], found["D"], strict=True)
    ]
    ranges = np.ptp(truth.acceleration), np.ptp(truth.velocity)
    figures = []
    for name, printed in _TABLE_1.items():
        for k, (quantity, unit) in enumerate((("acceleration", "m/s^2"), ("velocity", "m/s"))):
            share = 100 * rms[name][k] / ranges[k]
            figures.append(Figure(f"Model {name}: RMSD of the {quantity}", float(rms[name][k]), unit))
            figures.append(Figure(f"Model {name}: the same, Table 1 has {printed[k]}", float(share), "% of the range"))
    for name in "BCD":
        ratio = float(rms["A"][0] / rms[name][0])
        printed_ratio = _TABLE_1["A"][0] / _TABLE_1[name][0]
        figures.append(Figure(f"acceleration: RMSD of A over {name}'s, Table 1 has {printed_ratio:.2f}", ratio, "1", ">= 8"))
        figures.append(Figure(f"the same, no more than about ten times: A over {name}", ratio, "1", "<= 12"))
        figures.append(Figure(f"velocity: RMSD of A over {name}'s", float(rms["A"][1] / rms[name][1]), "1", ">= 2"))
    figures += [
        Figure("acceleration: RMSD of C off B's", float(abs(rms["C"][0] / rms["B"][0] - 1)), "1", "<= 0.01"),
        Figure("A over D in the least favourable of the 20 experiments", min(each_d), "1"),
        Figure("A over D in the most favourable", max(each_d), "1"),
        Figure("experiments with A over D of at least 8", float(np.mean(np.array(each_d) >= 8.0)), "1"),
        Figure("A over D with Model D from one recording, median", float(np.median(alone)), "1"),
        Figure("Model D: first vertices, speeding up over slowing down (F_S/F_C = 1.512)", _ratio(table), "1"),
    ]
    lengths = {rest: _a_over_b(runs, reference.stick_slip(0.02, _COMMAND, _STEP, rest)) for rest in (0.005, 0.05)}
    figures += [Figure(f"A over B with rests of {1e3 * rest:.0f} ms", ratio, "1") for rest, ratio in lengths.items()]
    figures.append(Figure("A over B without sensor noise", _a_over_b(runs, truth, noise=False), "1"))
    notes = [
        f"Chosen: sensor noise of {reference.ACCELERATION_NOISE} m/s² and {1e3 * reference.FORCE_NOISE:.0f} mN, so that Model"
        " B is off by the share of the range that Table 1 gives it, and rests of 25 ms on each side of the slip. Both bear"
        " on the ratios, as the figures with other rests and without noise say; Model A's mistake doesn't.",
        "The parameters of Models A to C are those of the truth, as if identified without error.",
        "Model D leaves out samples below 0.5 mm/s and below 0.15 m/s², where noise decides on F/v and on the branch. Its"
        " result hangs on the noise at the lowest speeds, where falling friction makes the motion unstable: from experiment to"
        f" experiment it is {min(each_d):.1f} to {max(each_d):.1f} times better than Model A. Its limits and its intervals"
        " (250 instead of the paper's 1000) were found by trial. From a single recording, as in Table 1, it does worse.",
    ]
    return figures, _pictures(first, shown, table), notes


def _a_over_b(runs: Mapping[str, Run], truth: reference.Slip, noise: bool = True) -> float:
    """Ratio of the RMSD of the acceleration over ten recordings of ``truth``, or over ``truth`` itself."""
    random = np.random.default_rng(1)
    slips = [truth.recorded(random) for _ in range(10)] if noise else [truth]
    squares = [np.mean([_deviations(runs[name], slip)[0] ** 2 for slip in slips]) for name in "AB"]
    return float(np.sqrt(squares[0] / squares[1]))


def _ratio(law: TensorProductFriction) -> float:
    return float(law.speeding_up.vertices[0, 0, 0] / law.slowing_down.vertices[0, 0, 0])


def _pictures(slip: reference.Slip, runs: Mapping[str, Run], table: TensorProductFriction) -> list[tuple[go.Figure, str]]:
    accelerations = [Curve("measured-like", slip.time, slip.acceleration, "measured", width=1.0)]
    velocities = [Curve("measured-like", slip.time, slip.velocity, "measured", width=1.0)]
    for name, run in runs.items():
        v = run(slip.force).velocity
        dash = "dot" if name == "C" else "solid"
        accelerations.append(Curve(f"Model {name}", slip.time, np.gradient(v, _STEP), _COLOURS[name], dash))
        velocities.append(Curve(f"Model {name}", slip.time, v, _COLOURS[name], dash))
    v = np.linspace(5e-5, 0.032, 600)
    law = [
        Curve("Model D, speeding up", v, table.force(v), "second"),
        Curve("Model D, slowing down", v, table.force(v, False), "second", "dot"),
    ]
    moving = slip.velocity > 5e-4
    return [
        (
            stacked([("acceleration [m/s²]", accelerations), ("velocity [m/s]", velocities)], "time [s]", 300),
            "Four models under the recorded pressure difference, as Figs. 20 to 27: A stops too early and too hard.",
        ),
        (
            scatter_and_curves(
                ("one recording", slip.velocity[moving], slip.friction[moving]), law, "velocity [m/s]", "friction [N]", 360
            ),
            "Model D and one of the ten recordings that it was made from, as Fig. 19.",
        ),
    ]


def _run() -> Evidence:
    cycle, plots = _limit_cycle(read_model(config_file("pneumatic_model.yaml")))
    table, pictures, notes = _table_1()
    notes = [
        *notes,
        "Eq. 11 with the paper's values rises up to 2.2 mm/s before it falls (F_v outweighs the Stribeck effect there)."
        " A command that asks for less makes the piston creep on, whatever the break-away force is; it slips from 0.0207.",
        "Eqs. 19 and 20 are printed without the factor kappa that Eqs. 13 and 14 give; with it the closed valve is the"
        " gas spring above.",
    ]
    return Evidence([*cycle, *_air(), *table], [*plots, *pictures], notes)


VERIFICATION = Verification(
    id="pneumatic",
    title="Pneumatic cylinder: stick-slip, its air, and four friction models",
    source="Szell, Eqs. 11-23, Figs. 5-9, 19-27, Table 1; the equations integrated by Radau's method; the closed gas spring",
    run=_run,
)
