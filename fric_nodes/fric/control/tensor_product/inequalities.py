"""The linear matrix inequalities of parallel distributed compensation, as semidefinite programs.

For x' = sum_i sum_j w_i w_j (A_i + B_i K_j) x let V = x' P x, X = P^-1 and, with the decay rate alpha,

    Q_ij = (A_i + B_i K_j) X + X (A_i + B_i K_j)' + 2 alpha X.

V falls at least as exp(-2 alpha t) when sum_i sum_j w_i w_j Q_ij < 0, for which it is enough that (Tuan et al. 2001, Theorem
2.2)

    Q_ii < 0   and   2/(r-1) Q_ii + Q_ij + Q_ji < 0   for all i != j.

Every variant of the parameters that aren't scheduled has these conditions with its own A_i, B_i and the same K_j.
The command stays within 1 (per unit) in the ellipsoid V <= 1 when [X, M_j'; M_j, 1] >= 0, M_j = K_j X. X <= 1 keeps the
ellipsoid in the domain of the states, and X >= region^2 makes it hold a ball of that radius.

Not feasibility but the margin is asked for: the largest t with all conditions at most -t. As X <= 1, V then falls with the rate
alpha + t/2. Three programs are linear: in (X, M) with free gains, in K for given P, where gains of some states may be made
common to all vertices, and in X for given K. All are in states over their domain and commands over their limit.
Source: Tuan, Apkarian, Narikiyo, Yamamoto, IEEE Trans. Fuzzy Systems 9 (2001) 324; Tanaka and Wang, Fuzzy Control Systems
Design and Analysis, 2001, chapter 3; Boyd et al., Linear Matrix Inequalities in System and Control Theory, 1994, chapters 5
and 7.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...record import Array
from .quasi_lpv import TensorProductControlError

__all__ = ["Problem", "Solution", "for_gains", "for_lyapunov", "for_lyapunov_and_gains", "pairs"]

_LARGEST = 1e6  # numerical: bound of the margin [1/s], so that a program is never unbounded


@dataclass(frozen=True, eq=False)
class Problem:
    """Scaled vertices, and what is asked of the closed loop.

    Attributes:
        a: ``(r, n_variants, n, n)``.
        b: ``(r, n_variants, n)``.
        decay: alpha [1/s].
        region: radius of the ball that the ellipsoid must hold [1].
        common: numbers of the states whose gain is the same at every vertex.
        solver: of cvxpy, an interior-point method: ``CLARABEL``, or ``CVXOPT`` where it is installed.
    """

    a: Array
    b: Array
    decay: float
    region: float
    common: tuple[int, ...]
    solver: str

    @property
    def shape(self) -> tuple[int, int, int]:
        """Vertices r, variants, states n."""
        r, variants, n = self.b.shape
        return r, variants, n


@dataclass(frozen=True, eq=False)
class Solution:
    """What a program gave.

    Attributes:
        margin: t [1/s].
        x: X, ``(n, n)``.
        k: gains, ``(r, n)``.
        worst: the vertex pair whose condition weighs most on the margin, and the variant.
    """

    margin: float
    x: Array
    k: Array
    worst: tuple[int, int, int]


def pairs(r: int) -> list[tuple[int, int]]:
    """All conditions by vertex pair, (i, i) for those of one vertex."""
    return [(i, j) for i in range(r) for j in range(r)]


def relaxed(q: Callable[[int, int], Array], i: int, j: int, r: int) -> Array:
    """The condition of the pair (i, j) from Q_ij."""
    return q(i, j) if i == j else 2.0 / (r - 1) * q(i, i) + q(i, j) + q(j, i)


def _symmetric_basis(n: int) -> Array:
    """Of symmetric matrices, ``(n(n+1)/2, n, n)``."""
    basis = []
    for i in range(n):
        for j in range(i, n):
            e = np.zeros((n, n))
            e[i, j] = e[j, i] = 1.0
            basis.append(e)
    return np.array(basis)


def _he(matrices: Array) -> Array:
    return matrices + np.swapaxes(matrices, -1, -2)


def _solve(solver: str, blocks: Sequence[Array], n_unknowns: int, order: Sequence[tuple[int, int, int]]) -> tuple[Array, Any]:
    """Largest z_last under ``C_0 + sum_k z_k C_k <= 0`` for each block ``(1 + n_unknowns, m, m)``.

    Returns:
        z, and the (i, j, variant) of ``order``, which names the first blocks, with the largest multiplier.
    """
    cp = _cvxpy()
    z = cp.Variable(n_unknowns)
    constraints = [z[n_unknowns - 1] <= _LARGEST]
    for block in blocks:
        m = block.shape[1]
        # A congruence with a diagonal matrix changes no sign; friction's rate makes rows that are 10^4 times others'.
        rows = np.sqrt(np.max(np.abs(block), axis=(0, 2)))
        flat = (block / (rows * rows[:, None])).reshape(1 + n_unknowns, m * m)
        constraints.append(cp.reshape(flat[1:].T @ z + flat[0], (m, m), order="C") << 0)
    program = cp.Problem(cp.Maximize(z[n_unknowns - 1]), constraints)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # an inaccurate answer is found by the certificate
        try:
            program.solve(solver=solver)
        except cp.error.SolverError as error:
            problem = f"{solver} gives up ({str(error).splitlines()[0]})"
            raise TensorProductControlError(
                "linear matrix inequalities", problem, "try another solver or other scales"
            ) from None
    if z.value is None:
        problem = f"{solver} finds no answer ({program.status})"
        raise TensorProductControlError("linear matrix inequalities", problem, "lower the region or the decay rate")
    weights = []
    for k in range(len(order)):
        # Weights of the margin, which is the last unknown: multiplier times its coefficient.
        dual = constraints[1 + k].dual_value
        rows = np.max(np.abs(blocks[k]), axis=(0, 2))
        weights.append(0.0 if dual is None else float(np.sum(np.diag(np.atleast_2d(dual)) / rows)))
    return np.asarray(z.value), order[int(np.argmax(weights))]


def _cvxpy() -> Any:
    try:
        import cvxpy
    except ImportError:
        raise TensorProductControlError(
            "tensor-product design", "cvxpy is not installed", "install it with pip install 'fric[control]'"
        ) from None
    return cvxpy


def _conditions(
    problem: Problem, q: Callable[[int, int, int], Array], n_unknowns: int
) -> tuple[list[Array], list[tuple[int, int, int]]]:
    """The condition of each pair and variant, ``(1 + n_unknowns, n, n)``; the margin t is the last unknown."""
    r, variants, n = problem.shape
    blocks, order = [], []
    for h in range(variants):
        for i, j in pairs(r):
            block = relaxed(lambda i, j, h=h: q(i, j, h), i, j, r).copy()  # type: ignore[misc]
            block[n_unknowns] += np.eye(n)
            blocks.append(block)
            order.append((i, j, h))
    return blocks, order


def _bounds_of_x(problem: Problem, basis: Array, n_unknowns: int) -> list[Array]:
    n = basis.shape[1]
    low, high = np.zeros((1 + n_unknowns, n, n)), np.zeros((1 + n_unknowns, n, n))
    high[0], low[0] = -np.eye(n), problem.region**2 * np.eye(n)
    high[1 : 1 + len(basis)], low[1 : 1 + len(basis)] = basis, -basis
    return [low, high]


def for_lyapunov_and_gains(problem: Problem) -> Solution:
    """Margin, X and gains together, every gain free."""
    r, _, n = problem.shape
    basis = _symmetric_basis(n)
    nx = len(basis)
    n_unknowns = nx + r * n + 1

    def q(i: int, j: int, h: int) -> Array:
        block = np.zeros((1 + n_unknowns, n, n))
        block[1 : 1 + nx] = _he(problem.a[i, h] @ basis) + 2.0 * problem.decay * basis
        block[1 + nx + j * n : 1 + nx + (j + 1) * n] = _he(np.einsum("a,kb->kab", problem.b[i, h], np.eye(n)))
        return block

    blocks, order = _conditions(problem, q, n_unknowns)
    blocks += _bounds_of_x(problem, basis, n_unknowns)
    for j in range(r):
        limit = np.zeros((1 + n_unknowns, n + 1, n + 1))
        limit[0, n, n] = -1.0
        limit[1 : 1 + nx, :n, :n] = -basis
        for k in range(n):
            limit[1 + nx + j * n + k, k, n] = limit[1 + nx + j * n + k, n, k] = -1.0
        blocks.append(limit)
    z, worst = _solve(problem.solver, blocks, n_unknowns, order)
    x = np.tensordot(z[:nx], basis, axes=1)
    gains = np.asarray(np.linalg.solve(x, z[nx:-1].reshape(r, n).T).T, dtype=np.float64)
    return Solution(float(z[-1]), x, gains, worst)


def for_gains(problem: Problem, x: Array) -> Solution:
    """Margin and gains for a given X; gains of common states are one unknown each. The margin is that of V itself."""
    r, _, n = problem.shape
    values, vectors = np.linalg.eigh(x)
    if values[0] <= 0.0:
        problem_text = f"{problem.solver}'s X isn't positive definite (smallest eigenvalue {values[0]:.2g})"
        raise TensorProductControlError("linear matrix inequalities", problem_text, "try another solver or a larger region")
    root, inverse = (vectors * values**power @ vectors.T for power in (0.5, -0.5))
    free = [k for k in range(n) if k not in problem.common]
    n_unknowns = len(problem.common) + r * len(free) + 1

    def gain(j: int) -> Array:
        """Unknowns to gains times root: ``(n_unknowns, n)``."""
        chosen = np.zeros((n_unknowns, n))
        for at, k in enumerate(problem.common):
            chosen[at, k] = 1.0
        for at, k in enumerate(free):
            chosen[len(problem.common) + j * len(free) + at, k] = 1.0
        return np.asarray(chosen @ root)

    def q(i: int, j: int, h: int) -> Array:
        block = np.zeros((1 + n_unknowns, n, n))
        block[0] = _he(inverse @ problem.a[i, h] @ root) + 2.0 * problem.decay * np.eye(n)
        block[1:] = _he(np.einsum("a,kb->kab", inverse @ problem.b[i, h], gain(j)))
        return block

    blocks, order = _conditions(problem, q, n_unknowns)
    for j in range(r):
        limit = np.zeros((1 + n_unknowns, n + 1, n + 1))
        limit[0] = -np.eye(n + 1)
        limit[1:, :n, n] = limit[1:, n, :n] = -gain(j)
        blocks.append(limit)
    z, worst = _solve(problem.solver, blocks, n_unknowns, order)
    return Solution(float(z[-1]), x, np.stack([z @ gain(j) @ inverse for j in range(r)]), worst)


def for_lyapunov(problem: Problem, k: Array) -> Solution:
    """Margin and X for given gains ``(r, n)``."""
    r, _, n = problem.shape
    basis = _symmetric_basis(n)
    n_unknowns = len(basis) + 1

    def q(i: int, j: int, h: int) -> Array:
        block = np.zeros((1 + n_unknowns, n, n))
        closed = problem.a[i, h] + np.outer(problem.b[i, h], k[j])
        block[1 : 1 + len(basis)] = _he(closed @ basis) + 2.0 * problem.decay * basis
        return block

    blocks, order = _conditions(problem, q, n_unknowns)
    blocks += _bounds_of_x(problem, basis, n_unknowns)
    for j in range(r):
        limit = np.zeros((1 + n_unknowns, n + 1, n + 1))
        limit[0, n, n] = -1.0
        limit[1 : 1 + len(basis), :n, :n] = -basis
        limit[1 : 1 + len(basis), :n, n] = limit[1 : 1 + len(basis), n, :n] = -(basis @ k[j])
        blocks.append(limit)
    z, worst = _solve(problem.solver, blocks, n_unknowns, order)
    return Solution(float(z[-1]), np.tensordot(z[:-1], basis, axes=1), k, worst)
