"""Tensor-product friction directly from measured data (Model D): a table of damping between constant vertices, without a law.

Velocity, acceleration and friction of every sample (:mod:`.tensor_products.samples`) are averaged over cells of speed,
speeding up and slowing down apart where they differ; how many cells, and what differs, is decided by samples that were held
out (:mod:`.tensor_products.choice`). The grid points with their intervals are the map; the tensor-product transformation
makes vertices and weights of it (:mod:`fric.friction.tensor_product`), which are written to ``tensor_product.yaml``.

The model of the result is the law of effects nearest to the map (:mod:`.tensor_products.law`), so that it runs in plant and
compensator; how much worse than the map it is, is said. The mass, with which inertia is taken off the force, is held.

Source: Szell, Secs. 2 and 5 (Model D).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...friction.tensor_product import TensorProductFriction, from_points
from ...friction.tensor_product_file import tensor_product_to_text
from ...method_settings import FILTER
from ...model import Model
from ...record import Array, Record
from ..free_parameters import FreeParameters
from ..result import Identification, IdentificationError, Method, Options, Score
from ..tensor_products.choice import Branch, Trial, branches_of, choose
from ..tensor_products.law import Law, law_through
from ..tensor_products.samples import Samples, samples_of
from ..verdict import warnings_of

__all__ = ["METHOD", "TensorProductIdentification", "fit"]

_ROUGH = 1.5  # of the map's error on held-out samples: a law that is worse is said to be
_FEW_BLOCKS = 5


@dataclass(frozen=True, eq=False)
class TensorProductIdentification(Identification):
    """As every result, and the map.

    Attributes:
        law: tensor-product friction.
        branches: its grid points with intervals.
        chosen: how the grid was made.
        trials: every candidate, best first.
        samples: what it was made from.
    """

    law: TensorProductFriction | None = None
    branches: tuple[Branch, ...] = ()
    chosen: Trial | None = None
    trials: tuple[Trial, ...] = ()
    samples: Samples | None = None

    @property
    def attachments(self) -> Mapping[str, str]:
        """Vertices and weights, and the grid points as a table."""
        assert self.law is not None
        return {
            "tensor_product.yaml": tensor_product_to_text(self.law, self.model.units),
            "tensor_product.csv": _table(self.branches),
        }

    def remarks_on(self, validation: Sequence[Record]) -> tuple[str, ...]:
        """How map and model predict the friction of recordings that the fit has not seen."""
        assert self.law is not None
        other = samples_of(validation, self.law.mass, Options())
        unit = self.model.units.force
        rows = [
            f"{name} {_rms(other.friction - predicted):.3g} {unit}"
            for name, predicted in (("the map", _by_map(self.law, other)), ("model.yaml", _by_model(self.model, other)))
        ]
        spread = _rms(other.friction - float(np.mean(other.friction)))
        return (f"validation: friction is off by {' and '.join(rows)}, of {spread:.3g} {unit} (root mean squares)",)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _by_map(law: TensorProductFriction, samples: Samples) -> Array:
    return law.force(samples.velocity, samples.speeding_up)


def _by_model(model: Model, samples: Samples) -> Array:
    """Friction of ``model`` at the samples [F], shape ``(n,)``."""
    from ...simulation import predict_force

    none = np.zeros_like(samples.velocity)
    bare = model.with_terms(())
    pair = (predict_force(each, none, none, samples.velocity, samples.acceleration, 1e-3) for each in (model, bare))
    whole, inertia = pair
    return np.asarray(whole - inertia)


def _table(branches: Sequence[Branch]) -> str:
    """The grid points as CSV."""
    rows = ["branch,direction,speed,friction,standard_error,low,high,blocks"]
    for branch in branches:
        name = {True: "speeding up", False: "slowing down", None: "both"}[branch.speeding_up]
        side = {1.0: "forward", -1.0: "backward", 0.0: "both"}[branch.side]
        half = branch.half_width()
        for v, f, e, h, n in zip(branch.speed, branch.force, branch.error, half, branch.blocks, strict=True):
            numbers = ",".join(f"{x:.8g}" if np.isfinite(x) else "" for x in (v, f, e, f - h, f + h))
            rows.append(f"{name},{side},{numbers},{int(n)}")
    return "\n".join(rows) + "\n"


def _law_of(branches: Sequence[Branch], mass: float) -> TensorProductFriction:
    """Tensor-product friction through the grid points."""
    curves = []
    for up in (True, False):
        own = [branch for branch in branches if branch.speeding_up in (up, None)]
        ahead, back = (next(b for b in own if b.side in (side, 0.0)) for side in (1.0, -1.0))
        velocity = np.concatenate([-back.speed[::-1], ahead.speed])
        curves.append((velocity, np.concatenate([-back.force[::-1], ahead.force])))
    return from_points(curves[0], curves[1], mass)


def _refuse(structure: Model, records: Sequence[Record], options: Options) -> None:
    ignored = [f"--{name}" for name, given in (("hold", options.held), ("free", options.freed)) if given]
    if ignored:
        raise IdentificationError(
            " and ".join(ignored), "tensor-product has no terms to hold or free", "leave it out, or use another method"
        )
    if structure.plant.id != "rigid" or structure.has_command_path:
        raise IdentificationError(records[0].source, "tensor-product fits a rigid axis under its force", "use output-error")
    for record in records:
        if np.ptp(record.effort) == 0.0:
            raise IdentificationError(
                record.source, "the force doesn't change", "record the force (effort) that drives the joint"
            )


def fit(structure: Model, records: Sequence[Record], options: Options) -> Identification:
    """Fit tensor-product friction to ``records``; the mass of ``structure`` is held and its terms are replaced.

    Raises:
        IdentificationError: the recordings can't show it, or the structure is of another kind.
    """
    _refuse(structure, records, options)
    mass = structure.plant.inertia(*structure.plant_values)
    samples = samples_of(records, mass, options)
    largest = float(np.max(np.abs(samples.velocity)))
    try:
        chosen, trials = choose(samples, largest)
    except ValueError:
        raise IdentificationError(
            records[0].source,
            "speeding up and slowing down don't each cover two cells of speed",
            "record motion that speeds up from rest and slows down to it",
        ) from None
    branches = branches_of(samples, chosen.candidate, largest)
    assert branches is not None
    table = _law_of(branches, mass)
    through = law_through(branches)
    model = replace(structure.with_terms(through.terms), standard_errors={})
    free = FreeParameters.of(model, Options())
    free = free.without({name for name in free.names if name not in through.names} | {structure.plant.parameters[0].name})
    order = [through.names.index(name) for name in free.names]
    covariance = through.covariance[np.ix_(order, order)]
    errors = {name: math.sqrt(v) for name, v in zip(free.names, np.diag(covariance).tolist(), strict=True) if v >= 0.0}
    model = model.with_values(model.values, errors)
    warnings, _ = warnings_of(model, free, covariance)
    said = _messages(samples, chosen, branches, (table, model), through)
    return TensorProductIdentification(
        model=model,
        fitted=free.names,
        covariance=covariance,
        method=METHOD.id,
        status=_status(chosen, branches),
        warnings=(*said[0], *warnings),
        notes=tuple(said[1]),
        train=_score(samples, _by_model(model, samples), mass),
        law=table,
        branches=tuple(branches),
        chosen=chosen,
        trials=trials,
        samples=samples,
    )


def _score(samples: Samples, predicted: Array, mass: float) -> Score:
    """Of the force that drives the joint at the samples; there is no free run of what is cut into slips."""
    force = samples.friction + mass * samples.acceleration
    off = samples.friction - predicted
    spread = force - float(np.mean(force))
    return Score(
        noe=100.0 * float(off @ off) / float(spread @ spread),
        relative_force_error_percent=100.0 * float(np.linalg.norm(off) / np.linalg.norm(force)),
        force_rmse=_rms(off),
        position_rmse=float("nan"),
        n_samples=int(force.shape[0]),
    )


def _messages(
    samples: Samples,
    chosen: Trial,
    branches: Sequence[Branch],
    found: tuple[TensorProductFriction, Model],
    through: Law,
) -> tuple[list[str], list[str]]:
    """Warnings and notes."""
    table, model = found
    x, f = model.units.position, model.units.force
    innermost = min(float(branch.speed[0]) for branch in branches)
    held = model.plant.parameters[0].name
    warnings = [
        f"{held} is held at {model.value(held):g}, and inertia taken off the force with it: give the right one (--model)"
    ]
    one_way = np.all(samples.velocity > 0) or np.all(samples.velocity < 0)
    if one_way:
        warnings.append(
            "every motion is in one direction: friction is taken to be the same in the other, and any bias is part of it"
        )
    if not chosen.candidate.hysteresis and not samples.measured:
        warnings.append(
            "no difference between speeding up and slowing down is found. With the acceleration from the position a small one"
            " would not be found: measure it (signal acceleration)"
        )
    by_map, by_model = (_rms(samples.friction - each) for each in (_by_map(table, samples), _by_model(model, samples)))
    if by_model > _ROUGH * by_map or through.misfit > 3.0:
        warnings.append(
            f"the law in model.yaml is off by {by_model:.3g} {f}, the map by {by_map:.3g} {f} (root mean squares), and passes"
            f" the grid points by {through.misfit:.2g} of their standard errors: the map holds more than its terms"
        )
    few = sum(int(np.sum(~np.isfinite(branch.error))) for branch in branches)
    notes = [
        f"map: {chosen.candidate.text}, {chosen.n_points} grid points; {chosen.error:.3g} {f} off held-out samples",
        f"{100.0 * samples.left_out:.0f} % of the moving samples left out: slower than {samples.least_speed:.2g} {x}/s or"
        f" with less than {samples.least_acceleration:.2g} {x}/s^2, where noise dominates the speed or the branch",
        f"below {innermost:.2g} {x}/s friction is held at its value there",
    ]
    if few:
        notes.append(f"{few} grid points have samples of one stretch of motion only: they have no interval")
    return warnings, notes


def _status(chosen: Trial, branches: Sequence[Branch]) -> str:
    head = f"mapped in {chosen.candidate.text}"
    blocks = float(np.median(np.concatenate([branch.blocks for branch in branches])))
    wide = [branch for branch in branches if np.nanmedian(branch.half_width() / np.abs(branch.force)) > 0.2]
    if blocks < _FEW_BLOCKS:
        return f"{head}; only {blocks:.0f} slips or strokes are behind a grid point: record more for intervals to rely on"
    if wide:
        return f"{head}; the intervals are wider than 20 %: record more slips or strokes"
    return f"{head}; check it on a recording of its own (--validate)"


METHOD = Method(
    id="tensor-product",
    title="tensor-product friction from data",
    needs="motion that speeds up from rest and slows down to it, best stick-slip with its acceleration measured; a known mass",
    source="Szell, Secs. 2 and 5 (Model D)",
    fit=fit,
    uses=FILTER,
)
