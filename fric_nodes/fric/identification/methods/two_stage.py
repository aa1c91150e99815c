"""Two-stage identification: thresholds of Maxwell springs by a search, everything else inside it by linear least squares.

The search is that of :mod:`.dnlrx.fit` (Amthor et al. 2008, section 3.1) and gives a DNLRX, an inverse model of filters that
holds at one sample time. A controller or a simulation needs a mechanism, so with the thresholds found the mechanism that Eq.
8 starts from is solved for as well:

    u = m a + sum_j c_j r_j(x, v) + sum_i k_i delta_i,   c_j linear parameters of the force terms (viscous, bias, ...),

see :mod:`.dnlrx.mechanism`. It is the model of the result: springs and thresholds become the stiffnesses and limits of the
term ``presliding/maxwell_slip``, and the force at which all springs slide, sum k_i Delta_i, the Coulomb level. So it runs in
plant and compensator; the DNLRX stands beside it.

The structure says which force terms to fit, and, where it holds ``presliding/maxwell_slip``, how many springs; without, their
number is chosen on held-out samples, and springs that the mechanism doesn't need are taken out of it again.

When it can be trusted, on an axis that is made of springs (``fric bench calibration-two-stage``): springs, thresholds and
Coulomb level at any pace of the motion; mass and viscous coefficient as far as their force stands out of what is left
unexplained, which their standard errors say, and where it doesn't, a warning. Where friction is a smooth curve that a few
springs only follow closely, what they leave isn't noise, and no interval covers what it puts into mass and viscous
coefficient. Sliding friction that weakens with speed (Stribeck) isn't in this structure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effect import Place
from ...friction.dnlrx_file import dnlrx_to_text
from ...method_settings import FILTER
from ...model import Model, Term, term
from ...record import Record
from ..conclusion import standard_errors
from ..dnlrx.fit import DnlrxFit, fit_prepared, name
from ..dnlrx.mechanism import Mechanism, find_mechanism, without_surplus
from ..dnlrx.samples import Prepared, prepare
from ..free_parameters import FreeParameters
from ..result import Identification, IdentificationError, Method, Options
from ..scoring import score
from ..verdict import warnings_of

__all__ = ["METHOD", "TwoStageIdentification", "fit"]

_NO_MASS = 2.0 * float(np.finfo(np.float64).tiny)  # its lower bound
_REPLACED = {"coulomb", "presliding/maxwell_slip"}
_USUAL_ORDER = 3


@dataclass(frozen=True, eq=False)
class TwoStageIdentification(Identification):
    """As every result, and the DNLRX.

    Attributes:
        dnlrx: the identified DNLRX.
    """

    dnlrx: DnlrxFit | None = None

    @property
    def attachments(self) -> Mapping[str, str]:
        """Files to write beside ``model.yaml``: their text by name."""
        assert self.dnlrx is not None
        return {"dnlrx.yaml": dnlrx_to_text(self.dnlrx.model, self.model.units)}

    def remarks_on(self, validation: Sequence[Record]) -> tuple[str, ...]:
        """What else is to be said about recordings that the fit has not seen."""
        assert self.dnlrx is not None
        noe = self.dnlrx.validate(validation)
        return (f"validation: DNLRX {name(self.dnlrx.model.order)}, NOE {noe:.4g} % of all samples after the longest stroke",)


def fit(structure: Model, records: Sequence[Record], options: Options) -> Identification:
    """Fit a DNLRX to ``records``, and ``structure`` with its springs.

    Raises:
        IdentificationError: the recordings can't determine it, or the structure holds what this method can't fit.
    """
    source = records[0].source
    base, n_springs = _without_friction(structure, source)
    _refuse(options, source)
    prepared = prepare(records, options)
    if n_springs is None:
        dnlrx = fit_prepared(prepared, None, options)
    else:
        dnlrx = fit_prepared(prepared, (n_springs, 0, _USUAL_ORDER), options)
    if float(dnlrx.model.deformation_filter.sum()) <= 0.0:
        raise IdentificationError(
            source,
            "the force doesn't rise with the deformation of any spring",
            "check that effort and position have the same sign, or whether the joint has pre-sliding friction at all",
        )
    return _mechanism(base, structure, prepared, dnlrx, records, options)


def _without_friction(structure: Model, source: str) -> tuple[Model, int | None]:
    """The structure less what the search replaces, and the number of springs that it asks for.

    Raises:
        IdentificationError: other plants or terms.
    """
    if structure.plant.id != "rigid" or structure.plant.parameters[0].name != "mass" or structure.has_command_path:
        raise IdentificationError(source, "two-stage fits a rigid axis under its force", "use the method output-error")
    n_springs = None
    kept: list[Term] = []
    for held in structure.terms:
        if held.effect.key == "presliding/maxwell_slip":
            pairs = zip(held.values[::2], held.values[1::2], strict=True)
            n_springs = sum(stiffness > 0.0 and limit > 0.0 for stiffness, limit in pairs)
        elif held.effect.key not in _REPLACED:
            kept.append(held)
    strange = [held.effect.key for held in kept if held.effect.place is not Place.FORCE]
    if strange:
        raise IdentificationError(
            source,
            f"two-stage can't fit {', '.join(strange)}",
            "leave them out (--terms viscous,bias): friction is found as springs that slide",
        )
    return structure.with_terms(kept), n_springs


def _refuse(options: Options, source: str) -> None:
    held = [each for each in options.held if each.split(".")[0] in ("coulomb", "presliding")]
    if held or options.freed:
        raise IdentificationError(
            source,
            f"two-stage can't hold or free {', '.join([*held, *options.freed])}",
            "hold only the mass and parameters of force terms",
        )


def _mechanism(
    base: Model, structure: Model, prepared: Prepared, dnlrx: DnlrxFit, records: Sequence[Record], options: Options
) -> Identification:
    """The mechanism with the springs of ``dnlrx``."""
    free = FreeParameters.of(base, Options(held=options.held))
    free = free.without({held for held, linear in zip(free.names, free.linear, strict=True) if not linear})
    found = find_mechanism(base, free, prepared, dnlrx.model.thresholds)
    if found is not None and dnlrx.trials:
        found = without_surplus(base, free, prepared, found)
    if found is None or ("mass" in free.names and found.linear[free.names.index("mass")] <= _NO_MASS):
        raise IdentificationError(
            records[0].source,
            "no mass and springs explain the force",
            "check that effort and position have the same sign, and excite faster motion",
        )
    values = base.values
    values[free.index] = found.linear
    elements = {f"stiffness_{k}": float(value) for k, value in enumerate(found.stiffness, start=1)}
    elements |= {f"limit_{k}": float(value) for k, value in enumerate(found.thresholds, start=1)}
    friction = (
        term("coulomb", force=float(found.stiffness @ found.thresholds)),
        term("presliding", "maxwell_slip", **elements),
    )
    model = base.with_values(values)
    model = model.with_terms([*model.terms, *friction])
    return _result(replace(model, joint=structure.joint), free.names, found, dnlrx, records, options)


def _result(
    model: Model,
    linear: tuple[str, ...],
    found: Mechanism,
    dnlrx: DnlrxFit,
    records: Sequence[Record],
    options: Options,
) -> Identification:
    """The result, its covariance in the order of the model's parameters; ``linear`` are the names of the force terms' own."""
    springs = range(1, found.stiffness.shape[0] + 1)
    limits = tuple(f"presliding.limit_{k}" for k in springs)
    names = (*linear, *(f"presliding.stiffness_{k}" for k in springs), *limits, "coulomb.force")
    free = FreeParameters.of(model, Options(freed=limits))
    free = free.without({each for each in free.names if each not in names})
    order = [names.index(each) for each in free.names]
    covariance = found.covariance[np.ix_(order, order)]
    model = model.with_values(model.values, standard_errors(free, covariance))
    warnings, status = warnings_of(model, free, covariance)
    warnings += [f"{linear[k]} leaves no trace in this recording and is zero" for k in found.undetermined]
    if found.buried:
        buried = ", ".join(linear[k] for k in found.buried)
        warnings.append(
            f"{buried}: its force isn't clearly larger than the residual of the springs, so that its "
            "value may be off by more than its standard error"
        )
        status = f"converged; springs and Coulomb level are found, {buried} can't be relied on: record faster motion as well"
    if found.thresholds[-1] > 0.999 * dnlrx.prepared.highest:
        warnings.append(f"the largest threshold lies on its bound ({dnlrx.prepared.highest:.3g}): record longer strokes")
    fine = dnlrx.status.startswith("converged; every threshold")
    notes = [
        f"DNLRX {name(dnlrx.model.order)}: NOE {dnlrx.noe:.4g} % of all samples after the longest stroke, "
        f"{dnlrx.found.evaluations} trials on every {dnlrx.decimation}th sample"
    ]
    if found.stiffness.shape[0] < dnlrx.model.order[0]:
        notes.append(
            f"{found.stiffness.shape[0]} of its {dnlrx.model.order[0]} springs are in the mechanism: the others only compensate"
            " for the filter, or have no effect"
        )
    if dnlrx.trials:
        tried = ", ".join(f"{name(trial.order)} {trial.held_out_noe:.3g} %" for trial in dnlrx.trials)
        notes.append(f"orders tried, NOE on held-out samples: {tried}")
    return TwoStageIdentification(
        model=model,
        fitted=free.names,
        covariance=covariance,
        method=METHOD.id,
        status=status if fine else dnlrx.status,
        warnings=(*warnings, *dnlrx.warnings),
        notes=(*dnlrx.prepared.notes, *notes),
        train=score(model, records, options),
        dnlrx=dnlrx,
    )


METHOD = Method(
    id="two-stage",
    title="two-stage search for a DNLRX",
    needs="strokes of graded amplitude from the sensor's noise to sliding, the longest first; position and force at one rate",
    source="Amthor et al. 2008; Rizos and Fassois 2005",
    fit=fit,
    uses=(*FILTER, "held"),
)
