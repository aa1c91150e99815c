"""A tensor-product controller in one call: vertices, linear matrix inequalities, proof.

1. Free gains: the largest margin in X and gains together. Without a margin there is no quadratic Lyapunov function with the
   asked decay rate, and the refusal names the vertex pair that weighs most and what would help.
2. Gains of the plant's common states are made the same at every vertex: gains for this X, then X for these gains, in turn until
   both conditions leave a margin. This is a local search; it may miss a solution, never claims a wrong one.
3. :mod:`.certificate` proves decay rate and input bound for the numbers as they are used.

The guarantee: in continuous time, the state x within the ellipsoid V <= 1, and S(p) within the polytope, V falls at least
with exp(-2 alpha t) and the command keeps its limit. Friction slower than the slowest velocity counts as viscous in it: a
body that sticks is outside of what is proved, and a simulation has to show what it does then.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...record import Array
from .certificate import Certificate, certify
from .inequalities import Problem, Solution, for_gains, for_lyapunov, for_lyapunov_and_gains
from .polytope import Polytope
from .quasi_lpv import TensorProductControlError

__all__ = ["Requirements", "TensorProductController", "design"]

_ROUNDS = 6  # numerical: of making gains common
_LEFT = 1e-9  # numerical: of the command's limit, left at the ellipsoid's edge for the proof


@dataclass(frozen=True)
class Requirements:
    """What a closed loop is to do.

    Attributes:
        decay: rate at which the state is to fall at least [1/s].
        limit: largest command, of the plant's command [F] or [1].
        region: radius of the ball that the guaranteed ellipsoid must hold, of the states over their domain [1]. A larger one
            asks for smaller gains.
        solver: of cvxpy: ``CLARABEL``, or ``CVXOPT`` where it is installed. SCS, of first order, doesn't get as far as a proof
            with the rates that friction has.
    """

    decay: float
    limit: float
    region: float = 1e-3
    solver: str = "CLARABEL"

    def __post_init__(self) -> None:
        where = "tensor-product design"
        for name, value in (("decay", self.decay), ("limit", self.limit), ("region", self.region)):
            if not 0.0 < value < math.inf:
                raise TensorProductControlError(where, f"{name} is {value}", "give a finite number greater than 0")
        if self.region >= 1.0:
            raise TensorProductControlError(where, f"region is {self.region}", "give less than 1, the whole domain")


@dataclass(frozen=True, eq=False)
class TensorProductController:
    """A design and its proof.

    Attributes:
        states: names.
        domain: largest magnitude of each state, ``(n,)``.
        limit: largest command.
        input_unit: dimension of the command, ``F`` or ``1``.
        units: of position and force, as text.
        tables: name, grid ``(n_k,)`` and weights ``(n_k, I_k)`` of each scheduled parameter.
        a: scaled A at the vertices, ``(r, n_variants, n, n)``.
        b: scaled B, ``(r, n_variants, n)``.
        gains: scaled, ``(r, n)``.
        p: of V = x' P x, scaled, ``(n, n)``.
        decay: that was asked for [1/s].
        certificate: what was proved.
    """

    states: tuple[str, ...]
    domain: Array
    limit: float
    input_unit: str
    units: tuple[str, str]
    tables: tuple[tuple[str, Array, Array], ...]
    a: Array
    b: Array
    gains: Array
    p: Array
    decay: float
    certificate: Certificate

    @property
    def physical_gains(self) -> Array:
        """Command per state in their own units, ``(r, n)``."""
        return np.asarray(self.gains * self.limit / self.domain)

    @property
    def semi_axes(self) -> Array:
        """Largest magnitude of each state within the guaranteed ellipsoid, ``(n,)``."""
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(self.p))) * self.domain)

    def eigenvalues(self) -> Array:
        """Of the closed loop at each vertex with its own gain, ``(r, n_variants, n)`` [1/s]."""
        closed = self.a + np.einsum("rha,rb->rhab", self.b, self.gains)
        return np.asarray(np.linalg.eigvals(closed))

    def summary(self) -> str:
        """The design in a few lines."""
        x, f = self.units
        dimensions = {"integral": f"{x} s", "error": x, "velocity": f"{x}/s", "force": f}
        r, variants, n = self.b.shape
        reach = ", ".join(
            f"{name} {value:.3g} {dimensions[name]}" for name, value in zip(self.states, self.semi_axes, strict=True)
        )
        bound = "proved" if self.certificate.input_bound else "not proved"
        unit = f if self.input_unit == "F" else "of full opening"
        lines = [
            f"tensor-product controller: {r} vertices, {variants} variant(s) of each, {n} states ({', '.join(self.states)})",
            f"decay rate: {self.certificate.decay:.4g} 1/s proved, {self.decay:.4g} 1/s asked for",
            f"command within {self.limit:g} {unit} there: {bound}",
            f"guaranteed from within an ellipsoid that reaches to: {reach}",
            f"scheduled by: {', '.join(table[0] for table in self.tables)}",
        ]
        return "\n".join(lines)


def _scaled(held: Polytope, requirements: Requirements) -> Problem:
    domain = held.plant.domain
    a = held.a * domain / domain[:, None]
    b = held.b * requirements.limit / domain
    return Problem(a, b, requirements.decay, requirements.region, held.plant.common, requirements.solver)


def design(held: Polytope, requirements: Requirements) -> TensorProductController:
    """The controller of the largest margin that :mod:`.certificate` can prove.

    Args:
        held: vertices of the plant.
        requirements: of the closed loop.

    Raises:
        TensorProductControlError: there is none, with the vertex pair and what to relax; or cvxpy is missing.
    """
    problem = _scaled(held, requirements)
    found = for_lyapunov_and_gains(problem)
    if not found.margin > 0.0:
        raise _refusal(held, requirements, found)
    if problem.common:
        found = _made_common(held, requirements, problem, found)
    p = _lyapunov_matrix(found)
    certificate = certify(problem.a, problem.b, found.k, p)
    if certificate.decay < requirements.decay or not certificate.input_bound:
        least = f"decay rate {certificate.decay:.3g} 1/s, least at {_pair_name(held, certificate.pair)}"
        raise TensorProductControlError(
            "tensor-product design",
            f"{requirements.solver}'s answer can't be proved ({least})",
            "try another solver, or lower the decay rate a little",
        )
    plant = held.plant
    return TensorProductController(
        plant.states, plant.domain, requirements.limit, plant.input_unit, (plant.units.position, plant.units.force),
        held.weight_tables, problem.a, problem.b, found.k, p, requirements.decay, certificate,
    )  # fmt: skip


def _lyapunov_matrix(found: Solution) -> Array:
    """P, with the ellipsoid V <= 1 no larger than domain and command allow, whatever the solver's tolerance was."""
    x = 0.5 * (found.x + found.x.T)
    if not float(np.linalg.eigvalsh(x)[0]) > 0.0:
        return x  # which the certificate refuses
    largest = max(float(np.linalg.eigvalsh(x)[-1]), float(np.max(np.einsum("ra,ab,rb->r", found.k, x, found.k))))
    p = np.linalg.inv(x) * max(1.0, largest) * (1.0 + _LEFT)
    return np.asarray(0.5 * (p + p.T))


def _made_common(held: Polytope, requirements: Requirements, problem: Problem, found: Solution) -> Solution:
    """Gains of common states the same at every vertex."""
    best: Solution | None = None
    for _ in range(_ROUNDS):
        gains = for_gains(problem, found.x)
        if gains.margin > 0.0:
            best = gains
            break
        found = for_lyapunov(problem, gains.k)
    if best is None:
        raise _refusal(held, requirements, gains, f" with the same gain of {_names(held)} everywhere")
    # The ellipsoid of the first X was made for other gains.
    improved = for_lyapunov(problem, best.k)
    return improved if improved.margin > 0.0 else best


def _names(held: Polytope) -> str:
    return " and ".join(held.plant.states[k] for k in held.plant.common)


def _pair_name(held: Polytope, at: tuple[int, int, int]) -> str:
    i, j = sorted(at[:2])
    if i == j:
        return f"vertex {held.vertex_name(i)}"
    return f"the vertex pair {held.vertex_name(i)} and {held.vertex_name(j)}"


def _refusal(held: Polytope, requirements: Requirements, found: Solution, beside: str = "") -> TensorProductControlError:
    remedies = []
    for text, changed in (
        (f"the decay rate to {requirements.decay / 2:.3g} 1/s", replace(requirements, decay=requirements.decay / 2)),
        (f"the limit to {requirements.limit * 2:.3g}", replace(requirements, limit=requirements.limit * 2)),
        (f"the region to {requirements.region / 4:.3g}", replace(requirements, region=requirements.region / 4)),
    ):
        problem = _scaled(held, changed)
        try:
            margin = for_lyapunov_and_gains(problem).margin
        except TensorProductControlError:
            continue
        if margin > 0.0:
            remedies.append(text)
    speed = next(table[1] for table in held.weight_tables if table[0] == "velocity")
    slowest = float(np.min(np.abs(speed)))
    remedy = f"relax {' or '.join(remedies)}" if remedies else "relax the decay rate further"
    remedy += f", or raise the slowest velocity above {slowest:.3g}"
    what = f"no gains reach the decay rate {requirements.decay:g} 1/s{beside}; {_pair_name(held, found.worst)} limits it most"
    return TensorProductControlError("tensor-product design", what, remedy)
