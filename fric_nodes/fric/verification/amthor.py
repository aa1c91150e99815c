"""Two-stage identification of a DNLRX on a simulated guideway: the figures of Amthor et al. 2008, sections 3.2 and 4."""

from __future__ import annotations

import time

import numpy as np
import plotly.graph_objects as go
from scipy.optimize import least_squares

from ..figure import Figure
from ..friction.dnlrx import DnlrxModel
from ..identification.dnlrx.cost import Cost
from ..identification.dnlrx.fit import DECIMATION, DnlrxFit, fit_prepared, name
from ..identification.dnlrx.linear import rows_of, solve
from ..identification.dnlrx.samples import Prepared, fractional_noe, prepare
from ..identification.dnlrx.search import search
from ..identification.result import Options
from ..identification.scoring import force_along
from ..model import Model, build_model, term
from ..record import Array
from ..report.figures import Curve, scatter_and_curves, stacked
from .amthor_guideway import graded_strokes, recorded, wandering
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_ORDERS = ((5, 3, 3), (5, 0, 3), (10, 0, 3))
_COMPARED = (5, 0, 3)
_THIN = 6  # of the recording on which the search runs with and without decimation
_LOST = 0.01  # points of NOE


def _fits(train: Prepared, other: Prepared, fast: Prepared) -> tuple[dict[str, DnlrxFit], list[Figure]]:
    """Each order on the identification set, and its NOE there and elsewhere."""
    fits, figures = {}, []
    for order in _ORDERS:
        fit = fit_prepared(train, order)
        fits[name(order)] = fit
        figures += [
            Figure(f"DNLRX {name(order)}: NOE on the identification set", fit.noe, "%", "<= 0.083"),
            Figure(f"DNLRX {name(order)}: NOE on the validation set", other.noe(fit.model), "%", "<= 1.33"),
        ]
    best = fits[name(_ORDERS[-1])].model
    figures.append(Figure(f"DNLRX {name(_ORDERS[-1])}: NOE at speeds at which friction weakens", fast.noe(best), "%"))
    return fits, figures


def _thinned(graded: Array) -> Prepared:
    return prepare([recorded(graded, 1, keep=_THIN)], Options())


def _decimation(train: Prepared) -> list[Figure]:
    """The same search over every sample and over every hundredth, both to their ends."""
    found, spent, noe = {}, {}, {}
    for every in (DECIMATION, 1):
        cost = Cost(train.parts, _COMPARED, rows_of(train.parts, _COMPARED, every))
        cost(np.linspace(train.lowest, train.highest, _COMPARED[0]))
        start = time.process_time()
        found[every] = search(cost, train.lowest, train.highest)
        spent[every] = (time.process_time() - start) / found[every].evaluations
        noe[every] = train.noe(solve(train, found[every].thresholds, _COMPARED, rows_of(train.parts, _COMPARED)).model)
    return [
        Figure(
            f"search over every sample, {name(_COMPARED)}: time of a trial over every 100th's",
            spent[1] / spent[100],
            "1",
            ">= 30",
        ),
        Figure("time of the whole search, every sample", spent[1] * found[1].evaluations, "s"),
        Figure("time of the whole search, every 100th sample", spent[100] * found[100].evaluations, "s"),
        Figure("NOE over all samples, searched over every sample", noe[1], "%"),
        Figure("NOE lost by the search over every 100th", noe[100] - noe[1], "points", f"<= {_LOST}"),
    ]


def _lugre_model() -> Model:
    return build_model(
        "rigid",
        {"mass": 0.6},
        [
            term("coulomb", force=0.7),
            term("viscous", coefficient=0.0),
            term("presliding", "lugre", stiffness=3e5, damping=0.0),
        ],
    )


def _along(model: Model, prepared: Prepared, every: int = 1) -> tuple[list[Array], list[Array]]:
    """Measured force and that of ``model``, part by part."""
    predicted = [force_along(model, part.stretch)[part.first :][: part.position.shape[0] : every] for part in prepared.parts]
    return [part.force[::every] for part in prepared.parts], predicted


def _lugre(train: Prepared) -> Model:
    """A LuGre model fitted to the same samples, all of its parameters, from several stiffnesses."""
    structure = _lugre_model()
    scale = np.array([0.6, 0.7, 3e5, 100.0, 10.0])  # mass, Coulomb, bristles' stiffness and damping, viscous

    fitted = ("mass", "coulomb.force", "presliding.stiffness", "presliding.damping", "viscous.coefficient")
    order = [structure.names.index(each) for each in fitted]

    def placed(point: Array) -> Model:
        values = structure.values
        values[order] = np.exp(point) * scale
        return structure.with_values(values)

    def residual(point: Array) -> Array:
        measured, predicted = _along(placed(point), train, 20)
        return np.concatenate(measured) - np.concatenate(predicted)

    best = None
    for stiffness in (1e5, 3e5, 9e5):
        start = np.log(np.array([1.0, 1.0, stiffness / 3e5, 0.3, 0.3]))
        answer = least_squares(residual, start, bounds=(start - 6.0, start + 6.0), diff_step=1e-4, max_nfev=40)
        if best is None or answer.cost < best.cost:
            best = answer
    assert best is not None
    return placed(np.asarray(best.x))


def _jumps(model: DnlrxModel, other: Prepared) -> tuple[Array, Array, float, float]:
    """Force predicted and measured on the validation set, and the largest change per sample of each, of the range."""
    part = other.parts[0]
    predicted, measured = part.predicted(model), part.force[model.first_predicted :]
    reach = float(np.ptp(measured))
    return (
        predicted,
        measured,
        float(np.max(np.abs(np.diff(predicted)))) / reach,
        float(np.max(np.abs(np.diff(measured)))) / reach,
    )


def _steps(fits: dict[str, DnlrxFit], other: Prepared) -> tuple[list[Figure], tuple[go.Figure, str]]:
    """Figs. 8 and 9 of the paper."""
    shown, jump = {}, {}
    for order in ("(5,3,3)", "(10,0,3)"):
        shown[order], measured, jump[order], itself = _jumps(fits[order].model, other)
    figures = [Figure("largest change of the measured force per sample, of its range", itself, "1")]
    figures += [Figure(f"largest change of the force per sample, {order}, of the range", jump[order], "1") for order in shown]
    figures += [
        Figure("the same of (5,3,3) over that of the measured force: it steps", jump["(5,3,3)"] / itself, "1", ">= 3"),
        Figure("the same of (10,0,3) over that of the measured force: it doesn't", jump["(10,0,3)"] / itself, "1", "<= 1.5"),
    ]
    at = int(np.argmax(np.abs(np.diff(shown["(5,3,3)"]))))
    around = slice(max(at - 200, 0), at + 200)
    t = np.asarray(1e3 * other.sample_time * np.arange(measured.shape[0])[around], dtype=np.float64)
    t -= t[0]
    plot = stacked(
        [
            (
                "force [N]",
                [Curve("measured", t, measured[around], "measured", width=2.4), Curve(order, t, shown[order][around], colour)],
            )
            for order, colour in (("(5,3,3)", "before"), ("(10,0,3)", "after"))
        ],
        "time [ms]",
    )
    return figures, (
        plot,
        "As the paper's Figs. 8 and 9, around the largest step of (5,3,3) on the validation set. Where a spring begins to "
        "slide or sticks again, its second filter takes the force of a damper away or gives it back within three samples.",
    )


def _course(prepared: Prepared, fit: DnlrxFit, text: str) -> tuple[go.Figure, str]:
    """Figs. 5 and 6 of the paper: displacement, force measured and predicted, and their difference."""
    part = prepared.parts[0]
    first = fit.model.first_predicted
    t = prepared.sample_time * np.arange(first, part.position.shape[0], dtype=np.float64)
    predicted, measured = part.predicted(fit.model), part.force[first:]
    plot = stacked(
        [
            ("displacement [µm]", [Curve("displacement", t, 1e6 * part.position[first:], "reference")]),
            ("force [N]", [Curve("measured", t, measured, "measured", width=2.2), Curve("predicted", t, predicted, "after")]),
            ("difference [mN]", [Curve("measured minus predicted", t, 1e3 * (measured - predicted), "before")]),
        ],
        "time since t_sl [s]",
    )
    return plot, text


def _loops(other: Prepared, fit: DnlrxFit, lugre: Model) -> tuple[go.Figure, str]:
    """Two seconds of minor loops, by DNLRX and LuGre."""
    part = other.parts[0]
    first = fit.model.first_predicted
    window = slice(round(6.0 / other.sample_time), round(8.5 / other.sample_time))
    x = 1e6 * part.position[first:][window]
    bristle = _along(lugre, other)[1][0][first:][window]
    curves = [
        Curve("measured", x, part.force[first:][window], "measured", width=3.0),
        Curve("LuGre", x, bristle, "before"),
        Curve(f"DNLRX {name(fit.model.order)}", x, part.predicted(fit.model)[window], "after"),
    ]
    plot = scatter_and_curves(None, curves, "displacement [µm]", "force [N]")
    return plot, (
        "Minor loops of the validation set. A bristle remembers one number only: after a small loop it doesn't come back to "
        "the curve that it left, and it drifts."
    )


def _run() -> Evidence:
    graded = graded_strokes()
    train = prepare([recorded(graded, 1)], Options())
    other = prepare([recorded(wandering(5), 2)], Options())
    fast = prepare([recorded(wandering(7, largest=4e-4, speed=6e-3, turns=60), 3)], Options())
    fits, figures = _fits(train, other, fast)
    lugre = _lugre(train)
    figures += [
        Figure("LuGre on the same samples: NOE on the identification set", fractional_noe(*_along(lugre, train)), "%"),
        Figure("LuGre on the same samples: NOE on the validation set", fractional_noe(*_along(lugre, other)), "%"),
    ]
    figures += _decimation(_thinned(graded))
    stepping, steps_plot = _steps(fits, other)
    figures += stepping
    shown = fits["(10,0,3)"]
    plots = [
        _course(train, shown, "Identification set from t_sl on, strokes of 30 µm to 30 nm and back, as Fig. 5; (10,0,3)."),
        _course(
            other,
            shown,
            "Validation set, as Fig. 6: moves of random length and direction, 40 nm to 40 µm, after one long stroke; (10,0,3).",
        ),
        steps_plot,
        _loops(other, shown, lugre),
    ]
    notes = [
        "The guideway is simulated: mass, amplifier, PID controller, 150 elements with Stribeck curve and lag, by an "
        "integrator of its own; interferometer with 0.1 nm of noise and steps, 0.2 mN of force noise; 6.25 kHz, low-pass of "
        "50 Hz. The paper's NOE are of a real one, with drift, cables and friction that changes with the place, which is not "
        "here: that the goals are met by far says that the method finds what there is, not that a real axis would be as close.",
        "Orders are (M, n_delta, n), see the verification dnlrx.",
        "Decimation is compared at 1.04 kHz, where the search over every sample takes seconds. A trial's time is divided by "
        "evaluations, so that a search that stops earlier doesn't count as faster.",
        "The spikes of the difference are where the body turns or breaks away within a few periods of the low-pass, which "
        "can't be interchanged with Eq. 11. The mechanism that two-stage puts into model.yaml is refined without that error.",
        "Decimation loses about as much as the NOE itself is here (0.005 points): as in the paper, the loss is one of points.",
        "A DNLRX has no Stribeck curve. At some mm/s friction falls by a fifth here, and the NOE without a goal shows that "
        "it can't follow.",
        "Eq. 15 is said to specify lambda, but only sums from it: taken as the first sample with all its past. Deformations "
        "are led over all samples; only the sum of Eq. 15 runs over every hundredth.",
    ]
    return Evidence(figures, plots, notes)


VERIFICATION = Verification(
    id="amthor",
    title="Two-stage identification of a guideway from nanometres to sliding",
    source="Amthor et al. 2008, section 3.1, Eqs. 15-19, section 3.2, Figs. 5, 6, 8, 9",
    run=_run,
)
