"""The compiled parts of the Kalman filters: points around the mean, their mean and square root, and the correction.

The state is ``(theta, x, z, u)``: parameters first, then the plant's states and those of the slip dynamics, and the force
that acts over the interval. The covariance is kept as a lower triangular square root S, P = S S'. With the parameters
first, the upper left block of S is the root of their own covariance, and the first entries of the measured row of S are the
part of the innovation that the parameters explain: with a = S[y, :n_theta] and s^2 the innovation's variance, r = a'a / s^2
is the squared multiple correlation of the innovation with the parameters, and (1 - r) the factor by which the determinant
of their covariance shrinks.

Roots are made triangular by Householder reflections from the right, so that a covariance is never formed, can't lose its
symmetry, and can't become indefinite. A parameter that is held keeps value and variance while the rest is corrected as it
should be (Schmidt 1966): its row of the gain is zero, and the correction is of Joseph's form, which holds for any gain.
"""

from __future__ import annotations

import math
from typing import Any

from ...engine.kernel import kernel, loop

__all__ = ["collapse", "correct", "scatter"]


@loop
def scatter(
    mean: Any, root: Any, width: float, change: float, base: Any, index: Any, is_log: Any, lower: Any, upper: Any,
    points: Any, values: Any, forces: Any, states: Any, slips: Any, memories: Any,
) -> None:  # fmt: skip
    """Points around the mean: itself, and one on either side along each column of the root; the force may have changed.

    Args:
        mean: shape ``(n,)``.
        root: shape ``(n, n)``.
        width: distance of the points [standard deviations].
        change: of the force from one interval to the next, standard deviation [F].
        base: all values of the model, shape ``(n_parameters,)``.
        index: which of them are estimated, shape ``(n_theta,)``.
        is_log: not 0 where the state is the logarithm of the value.
        lower: bounds of the values.
        upper: bounds of the values.
        points: written, shape ``(2 n + 1, n)``.
        values: written, all values of the model at each point, shape ``(2 n + 1, n_parameters)``.
        forces: written, shape ``(2 n + 1,)``.
        states: written, the plant's, shape ``(2 n + 1, n_x)``.
        slips: written, shape ``(2 n + 1, n_z)``.
        memories: the first point's goes to all, shape ``(2 n + 1, n_memory)``.
    """
    n = mean.shape[0]
    n_theta, n_x, n_z = index.shape[0], states.shape[1], slips.shape[1]
    # The force is the last state: a change that comes from nothing else only enters its own corner.
    root[n - 1, n - 1] = math.sqrt(root[n - 1, n - 1] ** 2 + change * change)
    for i in range(points.shape[0]):
        for k in range(n):
            points[i, k] = mean[k]
        if i > 0:
            for k in range(memories.shape[1]):
                memories[i, k] = memories[0, k]
    for j in range(n):
        for k in range(j, n):
            points[1 + j, k] += width * root[k, j]
            points[1 + n + j, k] -= width * root[k, j]
    for i in range(points.shape[0]):
        forces[i] = points[i, n - 1]
        for k in range(base.shape[0]):
            values[i, k] = base[k]
        for k in range(n_theta):
            value = points[i, k]
            if is_log[k] != 0.0:
                value = math.exp(min(max(value, -700.0), 700.0))
            values[i, index[k]] = min(max(value, lower[k]), upper[k])
        for k in range(n_x):
            states[i, k] = points[i, n_theta + k]
        for k in range(n_z):
            slips[i, k] = points[i, n_theta + n_x + k]


@loop
def collapse(
    points: Any,
    states: Any,
    slips: Any,
    n_theta: int,
    width: float,
    unscented: bool,
    floor: Any,
    mean: Any,
    work: Any,
    root: Any,
) -> None:
    """Mean and root of what has become of the points.

    Extended: the mean point, and the slopes between the points on either side. Unscented: weighted mean and deviations, with
    the weights of the scaled transform; that of the middle is kept from going below zero in the covariance.

    Args:
        points: from :func:`scatter`; their states are taken from ``states`` and ``slips``.
        states: shape ``(2 n + 1, n_x)``.
        slips: shape ``(2 n + 1, n_z)``.
        n_theta: number of parameters.
        width: of the points.
        unscented: which of the two.
        floor: standard deviation that a step adds to each state, shape ``(n,)``.
        mean: written, shape ``(n,)``.
        work: work space, shape ``(n, 3 n + 5)``.
        root: written, shape ``(n, n)``.
    """
    n, n_x, n_z = mean.shape[0], states.shape[1], slips.shape[1]
    m = points.shape[0]
    for i in range(m):
        for k in range(n_x):
            points[i, n_theta + k] = states[i, k]
        for k in range(n_z):
            points[i, n_theta + n_x + k] = slips[i, k]
    columns = 0
    if unscented:
        spread = width * width
        weight = 0.5 / spread
        middle = 1.0 - (m - 1) * weight
        # Of the scaled transform with alpha^2 = width^2/n and beta = 2.
        middle_square = math.sqrt(max(middle + 3.0 - spread / n, 0.0))
        side = math.sqrt(weight)
        for k in range(n):
            total = 0.0
            for i in range(1, m):
                total += points[i, k] - points[0, k]
            mean[k] = points[0, k] + weight * total
            for i in range(1, m):
                work[k, i - 1] = side * (points[i, k] - mean[k])
            work[k, m - 1] = middle_square * (points[0, k] - mean[k])
        columns = m
    else:
        half = 0.5 / width
        for k in range(n):
            mean[k] = points[0, k]
            for j in range(n):
                work[k, j] = half * (points[1 + j, k] - points[1 + n + j, k])
                # Of a slope that isn't constant, s + c x: the variance of c x^2/2 comes to c^2/2.
                work[k, n + j] = (
                    2.0 * math.sqrt(2.0) * half * half * (points[1 + j, k] - 2.0 * points[0, k] + points[1 + n + j, k])
                )
        columns = 2 * n
    for j in range(n_theta, n - 1):
        for k in range(n):
            work[k, columns] = floor[j] if k == j else 0.0
        columns += 1
    triangular(work, columns, root)


@kernel
def triangular(work: Any, columns: int, root: Any) -> None:
    """Lower triangular root of ``work work'``, of whose columns the first ``columns`` count; ``work`` is used up."""
    n = root.shape[0]
    for i in range(n):
        size = 0.0
        for j in range(i, columns):
            size += work[i, j] * work[i, j]
        size = math.sqrt(size)
        for j in range(i, n):
            root[i, j] = 0.0
        if size > 0.0:
            alpha = -size if work[i, i] > 0.0 else size
            head = work[i, i] - alpha
            square = size * size - work[i, i] * work[i, i] + head * head
            for k in range(i + 1, n):
                dot = work[k, i] * head
                for j in range(i + 1, columns):
                    dot += work[k, j] * work[i, j]
                dot *= 2.0 / square
                work[k, i] -= dot * head
                for j in range(i + 1, columns):
                    work[k, j] -= dot * work[i, j]
            root[i, i] = size
            # The reflection may turn the sign of the whole column.
            sign = 1.0 if alpha > 0.0 else -1.0
            for k in range(i + 1, n):
                root[k, i] = sign * work[k, i]
        else:
            for k in range(i + 1, n):
                root[k, i] = work[k, i]


@loop
def correct(
    mean: Any, root: Any, seen: int, rate: int, duration: float, n_theta: int, y: float, noise: float, limit: float,
    held: Any, forgotten: float, most: Any, information: Any, fade: float, smooth: Any, fresh: float, work: Any, gain: Any,
    out: Any,
) -> None:  # fmt: skip
    """Correct mean and root, in place, by one measured state.

    Args:
        mean: shape ``(n,)``.
        root: shape ``(n, n)``.
        seen: which state is measured.
        rate: which state is its rate; below 0: it has none.
        duration: of the interval [s].
        n_theta: number of parameters.
        y: its measured value.
        noise: its standard deviation.
        limit: of an innovation [standard deviations]. A position beyond it is put down to a kick within the interval, a force
            is heard up to it.
        held: not 0 for each parameter that keeps value and variance.
        forgotten: share of the information along the sample's direction that it pushes out; never more than it brings.
        most: largest standard deviation of each parameter.
        information: on the parameters, of late, shape ``(n_theta, n_theta)``; faded by ``fade`` and led on.
        fade: share of it that is left after this sample.
        smooth: what samples tell, smoothed, since noise tells now this and now that, shape ``(n_theta,)``; led on.
        fresh: share of this sample in it.
        work: work space, shape ``(n, 3 n + 5)``.
        gain: work space, shape ``(n,)``.
        out: written: innovation, its standard deviation, share r of it that the parameters explain.
    """
    n = mean.shape[0]
    variance = noise * noise
    for j in range(seen + 1):
        variance += root[seen, j] * root[seen, j]
    deviation = math.sqrt(variance)
    innovation = y - mean[seen]
    out[0], out[1] = innovation, deviation
    if rate >= 0 and abs(innovation) > limit * deviation:
        for k in range(n):
            for j in range(n):
                work[k, j] = root[k, j]
            work[k, n] = 0.0
        work[seen, n] = innovation
        work[rate, n] = 2.0 * innovation / duration
        triangular(work, n + 1, root)
        variance += innovation * innovation
        deviation = math.sqrt(variance)
    explained = 0.0
    for j in range(n_theta):
        explained += root[seen, j] * root[seen, j]
    share = min(explained / variance, 1.0 - 1e-12)
    for k in range(n):
        total = 0.0
        for j in range(min(k, seen) + 1):
            total += root[k, j] * root[seen, j]
        gain[k] = total / variance
    # What the sample tells about the parameters: phi = S^-T a, back substitution.
    for k in range(n_theta - 1, -1, -1):
        total = root[seen, k]
        for j in range(k + 1, n_theta):
            total -= root[j, k] * work[j, 0]
        work[k, 0] = total / root[k, k] if root[k, k] > 0.0 else 0.0
    for k in range(n_theta):
        smooth[k] += fresh * (work[k, 0] / math.sqrt(variance * (1.0 - share)) - smooth[k])
    for k in range(n_theta):
        for j in range(n_theta):
            information[k, j] = fade * information[k, j] + smooth[k] * smooth[j]
    for k in range(n_theta):
        if held[k] != 0.0:
            gain[k] = 0.0
    heard = min(max(innovation, -limit * deviation), limit * deviation)
    for k in range(n):
        mean[k] += gain[k] * (heard if k < n_theta else innovation)
    for k in range(n):
        for j in range(n):
            work[k, j] = root[k, j] - gain[k] * root[seen, j]
        work[k, n] = gain[k] * noise
    # Forgetting: of the information zeta that comes in, the part that replaces old information doesn't count.
    zeta = share / (1.0 - share)
    kept = 1.0 - forgotten - forgotten / zeta if zeta > forgotten else 0.0
    kept = max(kept, 0.0)
    back = math.sqrt(max(1.0 - (1.0 + zeta) * kept / (1.0 + kept * zeta), 0.0)) * deviation if forgotten > 0.0 else 0.0
    for k in range(n):
        work[k, n + 1] = back * gain[k] if k < n_theta else 0.0
    triangular(work, n + 2, root)
    for k in range(n_theta):
        square = 0.0
        for j in range(k + 1):
            square += root[k, j] * root[k, j]
        if square > most[k] * most[k]:
            for j in range(k + 1):
                root[k, j] *= most[k] / math.sqrt(square)
    out[2] = share
