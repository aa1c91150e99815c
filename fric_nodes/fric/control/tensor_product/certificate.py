"""Proof of a design in exact arithmetic, whatever the accuracy of the solver that found it.

With P and the gains as they are used, and Q_ij = P (A_i + B_i K_j) + (A_i + B_i K_j)' P + 2 alpha P, it is shown that

    P > 0,   -Q_ii > 0,   -(2/(r-1) Q_ii + Q_ij + Q_ji) > 0,   P - K_j' K_j >= 0 (the command within 1 while V <= 1).

Every floating-point number is a fraction with a power of two below. Sums and products of fractions are exact, and a symmetric
matrix is positive definite when all pivots of its factorisation L D L' are positive (Sylvester). So "yes" is a proof for these
vertices and numbers; no rounding is left in it. The decay rate that is proved is searched for from the eigenvalues, a little
below what they say, and then proved.
Source: Golub and Van Loan, Matrix Computations, 2013, section 4.1 (L D L'); inequalities as in :mod:`.inequalities`.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from ...record import Array
from .inequalities import pairs, relaxed

__all__ = ["Certificate", "certify", "decay_of", "is_positive_definite"]

Matrix = list[list[Fraction]]

_STEPS = 1e-9, 1e-6, 1e-4, 1e-2  # numerical: shares of the rate's magnitude by which the eigenvalues' answer is lowered


@dataclass(frozen=True)
class Certificate:
    """What was proved.

    Attributes:
        decay: rate with which V's root falls at least [1/s]; negative: none was proved.
        input_bound: whether the command keeps its limit in the ellipsoid V <= 1.
        pair: the vertex pair (i, j) and the variant that leave the least.
    """

    decay: float
    input_bound: bool
    pair: tuple[int, int, int]


def _exact(values: Array) -> Matrix:
    return [[Fraction(float(value)) for value in row] for row in np.atleast_2d(values)]


def is_positive_definite(matrix: Matrix) -> bool:
    """Whether a symmetric matrix of fractions is, by the pivots of L D L'."""
    rows = [list(row) for row in matrix]
    n = len(rows)
    for k in range(n):
        if rows[k][k] <= 0:
            return False
        for i in range(k + 1, n):
            share = rows[i][k] / rows[k][k]
            if share:
                for j in range(k + 1, i + 1):
                    rows[i][j] -= share * rows[j][k]
                    rows[j][i] = rows[i][j]
    return True


def _lyapunov(p: Matrix, closed: Matrix, alpha: Fraction) -> Matrix:
    """P A + A' P + 2 alpha P."""
    n = len(p)
    pa = [[sum((p[i][k] * closed[k][j] for k in range(n)), Fraction(0)) for j in range(n)] for i in range(n)]
    return [[pa[i][j] + pa[j][i] + 2 * alpha * p[i][j] for j in range(n)] for i in range(n)]


def _combined(parts: list[tuple[Fraction, Matrix]]) -> Matrix:
    n = len(parts[0][1])
    return [[-sum((share * part[i][j] for share, part in parts), Fraction(0)) for j in range(n)] for i in range(n)]


def _proved(p: Matrix, closed: dict[tuple[int, int], Matrix], alpha: float, r: int) -> bool:
    """Whether all pairs of one variant have the decay rate ``alpha``."""
    rate = Fraction(alpha)
    q = {key: _lyapunov(p, matrix, rate) for key, matrix in closed.items()}
    for i, j in pairs(r):
        parts = [(Fraction(1), q[i, i])]
        if i != j:
            parts = [(Fraction(2, r - 1), q[i, i]), (Fraction(1), q[i, j]), (Fraction(1), q[j, i])]
        if not is_positive_definite(_combined(parts)):
            return False
    return True


def _closed(a: Array, b: Array, k: Array) -> dict[tuple[int, int], Matrix]:
    """A_i + B_i K_j of one variant, exactly."""
    exact_a, exact_b, exact_k = [_exact(each) for each in a], _exact(b), _exact(k)
    n = a.shape[1]
    return {
        (i, j): [[exact_a[i][row][c] + exact_b[i][row] * exact_k[j][c] for c in range(n)] for row in range(n)]
        for i, j in pairs(a.shape[0])
    }


def decay_of(a: Array, b: Array, k: Array, p: Array) -> tuple[float, tuple[int, int, int]]:
    """The decay rate [1/s] by eigenvalues in floating point, and the pair (i, j) and variant that leave the least.

    Args:
        a: ``(r, n_variants, n, n)``.
        b: ``(r, n_variants, n)``.
        k: gains ``(r, n)``.
        p: of V, ``(n, n)``.
    """
    values, vectors = np.linalg.eigh(p)
    if values[0] <= 0.0:
        return -np.inf, (0, 0, 0)
    root, inverse = (vectors * values**power @ vectors.T for power in (0.5, -0.5))
    r, variants = b.shape[:2]
    least, at = np.inf, (0, 0, 0)
    for h in range(variants):

        def q(i: int, j: int, h: int = h) -> Array:
            closed = root @ (a[i, h] + np.outer(b[i, h], k[j])) @ inverse
            return np.asarray(closed + closed.T)

        for i, j in pairs(r):
            # The pair's matrices add up to 2/(r-1) + 2 times Q, one vertex's to 1; a rate adds 2 alpha to each Q.
            count = 1.0 if i == j else 2.0 / (r - 1) + 2.0
            rate = -float(np.linalg.eigvalsh(relaxed(q, i, j, r))[-1]) / (2.0 * count)
            if rate < least:
                least, at = rate, (i, j, h)
    return least, at


def certify(a: Array, b: Array, k: Array, p: Array) -> Certificate:
    """What can be proved of the gains ``k`` and V = x' P x; arguments as of :func:`decay_of`, per unit."""
    rate, pair = decay_of(a, b, k, p)
    exact = _exact(0.5 * (p + p.T))
    if not np.isfinite(rate) or not is_positive_definite(exact):
        return Certificate(-np.inf, False, pair)
    n = p.shape[0]
    bounded = all(
        is_positive_definite([[exact[i][j] - row[i] * row[j] for j in range(n)] for i in range(n)]) for row in _exact(k)
    )
    closed = [_closed(a[:, h], b[:, h], k) for h in range(b.shape[1])]
    for step in _STEPS:
        lower = rate - step * max(abs(rate), 1.0)
        if all(_proved(exact, each, lower, b.shape[0]) for each in closed):
            return Certificate(lower, bounded, pair)
    return Certificate(-np.inf, bounded, pair)
