"""Static maps: friction over velocity, load and displacement from experiments that each show one of them.

In every recording the method looks for what is there: settled parts at constant velocity (friction curve, or friction over
load where several loads were recorded), reversals (pre-sliding), starts after rests (break-away), and, with a signal
``acceleration``, stick-slip. Which terms the friction curve has is the method's own finding (:mod:`.static_maps.curve`); the
terms given with the structure are only its plant's company and are replaced. A pre-sliding law is put into the model with the
bristle stiffness sigma_0 = ln(10) g/d_b that reaches 90 % of a reversal's change of force 2 g at the break-away distance d_b
(LuGre without damping at constant level g: F = g (1 - 2 exp(-sigma_0 d/g))).

A signal ``normal_load`` is a load; a signal ``pressure`` is one too, and pushes the joint through an area that several
pressures show (:mod:`.static_maps.load`). The mass leaves no trace in static maps and is held.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...model import Model, Term, term
from ...record import Array, Record
from ..free_parameters import FreeParameters
from ..result import IdentificationError, Method, Options, Score
from ..static_maps.break_away import BreakAway, break_aways, onsets
from ..static_maps.curve import Choice, Curve, Points, choose
from ..static_maps.load import Line, LoadLaw, MeanForce, area_of, load_law
from ..static_maps.parts import Motion, Part, condensed, find_parts, motion_of
from ..static_maps.presliding import Compliance, Presliding, Reversal, reversals, rig_compliance, serial_mean, summary
from ..static_maps.result import StaticMap
from ..static_maps.stick_slip import StickSlip, slips, stick_slip
from ..static_maps.verdict import messages_of, status_of
from ..static_maps.weighted import as_normal
from ..verdict import warnings_of

__all__ = ["METHOD", "curve_terms", "fit", "settled_means", "static_map"]

_FEWEST_SAMPLES = 50
_SAME_SPEED = 0.1
_MANY_PARTS = 6
_OTHER_LOAD = 0.2  # of the largest
_LOADS = ("normal_load", "pressure")


@dataclass(frozen=True, eq=False)
class _Look:
    """What was found in one recording; ``force`` is the effort less what the load pushes with."""

    record: Record
    motion: Motion
    load: Array | None
    force: Array
    parts: list[Part]
    notes: list[str]

    @property
    def mean_load(self) -> float:
        """Mean of the load while it moves."""
        if self.load is None:
            return float("nan")
        if self.parts:
            return float(np.mean([part.load for part in self.parts]))
        return (
            float(np.mean(self.load[self.motion.direction != 0.0]))
            if np.any(self.motion.direction)
            else float(self.load.mean())
        )


def _checked(records: Sequence[Record]) -> str:
    """Name of the load signal that all recordings have, or nothing; what is no use is refused."""
    for record in records:
        if record.n_samples < _FEWEST_SAMPLES:
            problem = f"only {record.n_samples} samples: too short for a static map"
            raise IdentificationError(record.source, problem, f"record at least {_FEWEST_SAMPLES} samples of settled motion")
        if np.ptp(record.position) == 0.0:
            raise IdentificationError(record.source, "the joint doesn't move", "record motion at constant velocities")
        if np.ptp(record.effort) == 0.0:
            problem = f"the force is {record.effort[0]:.4g} {record.units.force} throughout (saturated, or not recorded)"
            raise IdentificationError(record.source, problem, "record the force that drives the joint, below its limit")
    return next((name for name in _LOADS if all(name in record.extra for record in records)), "")


def _look(record: Record, load_name: str, area: float, options: Options) -> _Look:
    load = np.asarray(record.extra[load_name], dtype=np.float64) if load_name else None
    force = record.effort if load is None or area == 0.0 else record.effort - area * load
    motion = motion_of(record, options.rest_velocity)
    parts, notes = find_parts(replace(record, effort=force), motion, load)
    if not parts and not notes:
        slow = float(np.mean(np.abs(motion.velocity) < 0.5 * np.mean(np.abs(motion.velocity))))
        one_way = abs(float(np.mean(np.sign(motion.mean)))) > 0.9
        why = "the joint sticks and slips" if one_way and slow > 0.1 else "the velocity isn't held long enough"
        notes = [f"{record.source}: no settled part ({why})"]
    return _Look(record, motion, load, force, parts, notes)


def _means(looks: Sequence[_Look], area: float) -> list[MeanForce]:
    """Means over the settled parts of each recording, direction and speed."""
    found = []
    for look in looks:
        for sign in (1.0, -1.0):
            own = sorted((part for part in look.parts if part.direction == sign), key=lambda part: abs(part.velocity))
            groups: list[list[Part]] = []
            for part in own:
                if groups and abs(part.velocity) <= (1.0 + _SAME_SPEED) * abs(groups[-1][0].velocity):
                    groups[-1].append(part)
                else:
                    groups.append([part])
            found += [_mean(look, sorted(group, key=lambda part: part.first), area) for group in groups]
    return found


def _mean(look: _Look, group: list[Part], area: float) -> MeanForce:
    force = np.array([part.force for part in group])
    within = float(np.sqrt(np.mean(np.array([part.error for part in group]) ** 2) / len(group)))
    mean, between = serial_mean(force)
    # A few parts may agree by chance better than they are known; many say themselves how well.
    error = between if len(group) >= _MANY_PARTS else max(within, between) if len(group) >= 3 else within
    load = float(np.mean([part.load for part in group]))
    thrust = area * load if area else 0.0
    drift = 0.0
    if len(group) >= 4:
        slope, left = np.polyfit(np.arange(force.shape[0]), force, 1, full=True)[:2]
        rest = math.sqrt(float(left[0]) / max(force.shape[0] - 2, 1)) if left.size else 0.0
        change = float(slope[0]) * (force.shape[0] - 1)
        drift = change if abs(change) > 4.0 * rest else 0.0
    velocity = float(np.mean([part.velocity for part in group]))
    return MeanForce(look.record.source, velocity, (mean + thrust, error), load, len(group), drift, thrust)


def _require_both_directions(looks: Sequence[_Look], means: Sequence[MeanForce]) -> None:
    source = looks[0].record.source
    if not means:
        why = next((note for look in looks for note in look.notes), "none was found")
        raise IdentificationError(
            source,
            f"no settled part at constant velocity ({why})",
            "hold each velocity until the force settles, and then longer",
        )
    if len({mean.direction for mean in means}) < 2:
        way = "forward" if means[0].direction > 0 else "backward"
        raise IdentificationError(
            source,
            f"settled motion {way} only: friction can't be told from a bias force such as gravity",
            "record the same velocities in the other direction",
        )


def _values(choice: Choice | None, loads: LoadLaw | None) -> tuple[list[Term], dict[str, tuple[float, int]], Array]:
    """Terms, where in the covariance each of their parameters stands (with its value), and that covariance."""
    if loads is not None and loads.line is not None:
        line = loads.line
        nominal = float(np.mean([point.load for point in loads.points]))
        level = line.intercept[0] + line.slope[0] * nominal
        assert loads.bias is not None
        bias = float(loads.bias.values[0])
        share = line.slope[0] * nominal / level
        # level = F_0 + mu N_0 and share = mu N_0 / level, from the covariance of F_0 and mu.
        slope = np.array([[1.0, nominal], [-share / level, nominal * (1.0 - share) / level]])
        own = np.array([[line.intercept[1] ** 2, line.covariance], [line.covariance, line.slope[1] ** 2]])
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = slope @ own @ slope.T * as_normal(line.freedom) ** 2
        covariance[2, 2] = float(loads.bias.covariance[0, 0]) * as_normal(loads.bias.freedom) ** 2
        terms = [term("coulomb", force=max(level, 0.0)), term("load_dependence", coefficient=share), term("bias", force=bias)]
        return (
            terms,
            {"coulomb.force": (level, 0), "load_dependence.coefficient": (share, 1), "bias.force": (bias, 2)},
            covariance,
        )
    if choice is None:
        return [], {}, np.zeros((0, 0))
    best = choice.best
    terms = curve_terms(best)
    by_name = dict(zip(best.candidate.names, best.values.tolist(), strict=True))
    wide = as_normal(best.freedom) * choice.widening
    return terms, {name: (value, k) for k, (name, value) in enumerate(by_name.items())}, best.covariance * np.outer(wide, wide)


def curve_terms(curve: Curve) -> list[Term]:
    """The terms of a model that has the curve's force at constant speeds."""
    grouped: dict[str, dict[str, float]] = {}
    for name, value in zip(curve.candidate.names, curve.values.tolist(), strict=True):
        effect, parameter = name.split(".")
        grouped.setdefault(effect, {})[parameter] = value
    laws = {"stribeck": curve.candidate.stribeck}
    return [term(effect, laws.get(effect, ""), **given) for effect, given in grouped.items()]


def settled_means(records: Sequence[Record], options: Options) -> tuple[list[MeanForce], list[str]]:
    """Mean forces of the settled parts of each record, and sentences on what looked like one and is none.

    Args:
        records: recordings of one machine under one load.
        options: the velocity of rest, where it isn't to be found.
    """
    looks = [_look(record, "", 0.0, options) for record in records]
    return _means(looks, 0.0), condensed(note for look in looks for note in look.notes)


def _bristles(found: Sequence[Presliding], compliance: Compliance | None) -> tuple[float, float] | None:
    """sigma_0 and its standard error, from the contact's own distance where the rig could be told from it."""
    if not found:
        return None
    change = float(np.mean([each.change[0] for each in found]))
    if compliance is not None and compliance.told_apart and compliance.distance[0] > 0:
        distance, error = compliance.distance
        error *= as_normal(compliance.freedom)
    else:
        distance = float(np.mean([each.distance[0] for each in found]))
        error = float(np.sqrt(np.nansum([each.distance[1] ** 2 for each in found]))) / len(found)
        if len(found) > 1:  # by direction or recording it differs by more than within them
            error = max(error, float(np.std([each.distance[0] for each in found], ddof=1)) / math.sqrt(len(found)))
    sigma = math.log(10.0) * 0.5 * change / distance
    return sigma, sigma * error / distance


def _score(means: Sequence[MeanForce], predicted: Array) -> Score:
    """Of the means; there is no motion to run freely."""
    force = np.array([mean.friction for mean in means])
    left = force - predicted
    spread = float(np.sum((force - np.mean(force)) ** 2))
    return Score(
        noe=100.0 * float(left @ left) / spread if spread else float("nan"),
        relative_force_error_percent=100.0 * float(np.linalg.norm(left) / np.linalg.norm(force)),
        force_rmse=float(np.sqrt(np.mean(left**2))),
        position_rmse=float("nan"),
        n_samples=len(means),
    )


@dataclass(frozen=True, eq=False)
class _Found:
    means: list[MeanForce]
    choice: Choice | None
    loads: LoadLaw | None
    presliding: list[Presliding]
    turned: list[tuple[Reversal, ...]]
    compliance: Compliance | None
    break_away: list[BreakAway]
    slips: list[StickSlip]


def _maps(looks: Sequence[_Look], load_name: str, area: Line | None, mass: float) -> _Found:
    """All maps that the recordings show."""
    units = looks[0].record.units
    means = _means(looks, area.slope[0] if area is not None else 0.0)
    stick: list[StickSlip] = []
    for look in looks:
        if "acceleration" in look.record.extra:
            stick += stick_slip(slips(look.record.time, look.record.extra["acceleration"], look.force, mass))
    if not (stick and not means):
        _require_both_directions(looks, means)
    loads = load_law(means, area) if load_name and means else None
    several = loads is not None and loads.line is not None
    level = np.array([mean.load for mean in means])
    if load_name and means and not several and np.ptp(level) > _OTHER_LOAD * np.max(np.abs(level)):
        raise IdentificationError(
            looks[0].record.source,
            f"loads from {np.min(level):.3g} to {np.max(level):.3g}, but not three of them in both directions",
            "give recordings under one load, or under three and more",
        )
    choice = None
    if means and not several:
        arrays = (np.array(v) for v in zip(*((m.velocity, m.friction, m.force[1]) for m in means), strict=True))
        choice = choose(Points(*arrays))
    turned = [tuple(reversals(look.record, look.motion, look.parts, look.force)) for look in looks]
    gentle = [s for look, own in zip(looks, turned, strict=True) for s in summary(look.record, look.mean_load, own)]
    compliance = rig_compliance(gentle, units.position, units.force) if gentle else None
    starts = [
        start
        for look in looks
        for start in break_aways(look.record, look.mean_load, onsets(look.record, look.motion, look.parts, look.force))
    ]
    return _Found(means, choice, loads, gentle, turned, compliance, starts, stick)


def _model_of(structure: Model, found: _Found, load_name: str) -> tuple[Model, FreeParameters, Array]:
    """The model with its values and standard errors, its fitted parameters and their covariance."""
    terms, where, covariance = _values(found.choice, found.loads)
    bristles = _bristles(found.presliding, found.compliance)
    if bristles is not None and terms:
        terms.append(term("presliding", "lugre", stiffness=bristles[0]))
        where["presliding.stiffness"] = (bristles[0], covariance.shape[0])
        whole = np.zeros((covariance.shape[0] + 1,) * 2)
        whole[:-1, :-1], whole[-1, -1] = covariance, bristles[1] ** 2
        covariance = whole
    nominal = dict(structure.nominal)
    if found.loads is not None and found.loads.line is not None:
        nominal["normal_load"] = float(np.mean([point.load for point in found.loads.points]))
    elif load_name == "normal_load" and found.means:
        nominal["normal_load"] = float(np.mean([mean.load for mean in found.means]))
    else:
        nominal.pop("normal_load", None)
    model = replace(structure.with_terms(terms), nominal=nominal)
    free = FreeParameters.of(model, Options())
    free = free.without({name for name in free.names if name not in where})
    order = [where[name][1] for name in free.names]
    covariance = covariance[np.ix_(order, order)]
    errors = {name: math.sqrt(v) for name, v in zip(free.names, np.diag(covariance).tolist(), strict=True) if v >= 0}
    return model.with_values(model.values, errors), free, covariance


def _predicted(model: Model, found: _Found) -> Array:
    """Mean forces as the curve, or the line over the load, has them, shape ``(n_means,)``."""
    if found.choice is not None:
        return found.choice.best.force(np.array([mean.velocity for mean in found.means]))
    assert found.loads is not None
    assert found.loads.line is not None
    level = found.loads.line.at(np.array([mean.load for mean in found.means]))[0]
    return model.value("bias.force") + np.array([mean.direction for mean in found.means]) * level


def _looks(records: Sequence[Record], load_name: str, options: Options) -> tuple[list[_Look], Line | None]:
    """What is in every recording, and the area through which a pressure pushes."""
    looks = [_look(record, load_name, 0.0, options) for record in records]
    area: Line | None = None
    if load_name == "pressure":
        # The transient of the pressure after a reversal hides where the friction has settled: once more without it.
        for _ in range(2):
            area = area_of(_means(looks, area.slope[0] if area is not None else 0.0))
            if area is None:
                break
            looks = [_look(record, load_name, area.slope[0], options) for record in records]
    return looks, area


def static_map(structure: Model, records: Sequence[Record], options: Options) -> StaticMap:
    """The static maps of ``records``, and the model that they give.

    Args:
        structure: its plant (the mass is held) and joint.
        records: recordings of one machine.
        options: the velocity of rest, where it isn't to be found.

    Raises:
        IdentificationError: too short, in one direction only, without a settled part, or saturated.
    """
    ignored = [f"--{name}" for name, given in (("hold", options.held), ("free", options.freed)) if given]
    if ignored:
        remedy = "leave it out, or use another method"
        raise IdentificationError(
            " and ".join(ignored), "static-map chooses the terms and fits all of their parameters", remedy
        )
    load_name = _checked(records)
    looks, area = _looks(records, load_name, options)
    found = _maps(looks, load_name, area, structure.plant.inertia(*structure.plant_values))
    model, free, covariance = _model_of(structure, found, load_name)
    more, settled_status = warnings_of(model, free, covariance)
    warnings = messages_of(
        found.means, found.choice, found.loads, found.compliance, found.presliding, found.break_away, load_name
    )
    result = StaticMap(
        model=model,
        fitted=free.names,
        covariance=covariance,
        method=METHOD.id,
        status="",
        train=_score(found.means, _predicted(model, found)) if found.means else Score(*(float("nan"),) * 4, 0),
        warnings=(*warnings, *more),
        notes=tuple(
            dict.fromkeys(
                [
                    f"{structure.plant.parameters[0].name} is held: static maps don't determine it",
                    *(note for look in looks for note in (*condensed(look.record.notes), *look.notes)),
                ]
            )
        ),
        means=tuple(found.means),
        choice=found.choice,
        loads=found.loads,
        load_unit={"normal_load": "N", "pressure": "Pa"}.get(load_name, ""),
        presliding=tuple(found.presliding),
        reversals=tuple(found.turned),
        compliance=found.compliance,
        break_away=tuple(found.break_away),
        slips=tuple(found.slips),
        sources=tuple(record.source for record in records),
    )
    return replace(result, status=status_of(result, settled_status))


def fit(structure: Model, records: Sequence[Record], options: Options) -> StaticMap:
    """See :func:`static_map`."""
    return static_map(structure, records, options)


METHOD = Method(
    id="static-map",
    title="static maps",
    needs="constant velocities in both directions, from the slowest that runs smoothly; reversals, best at several loads",
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994; Szell, Sec. 4.2",
    fit=fit,
    uses=("rest_velocity",),
)
