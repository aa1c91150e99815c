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

__all__ = ["carry", "collapse", "correct", "scatter", "tell"]


@loop
def scatter(
    mean: Any, root: Any, width: float, force: float, noise: float, shift: Any, narrow: Any, base: Any, index: Any, is_log: Any,
    lower: Any, upper: Any, points: Any, values: Any, forces: Any, states: Any, slips: Any, memories: Any,
) -> None:  # fmt: skip
    """Points around the mean: itself, and one on either side along each column of the root; the force is another each time.

    They may lie around another point, what later samples tell about the beginning of the interval, along the columns of a root
    of what that leaves unknown.

    Args:
        mean: shape ``(n,)``.
        root: shape ``(n, n)``.
        width: distance of the points [standard deviations].
        force: recorded over the interval, the last state [F].
        noise: its standard deviation [F].
        shift: to that point, along the columns of the root, shape ``(n,)``.
        narrow: the other root is the root times this, shape ``(n, n)``.
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
    # What acted over earlier intervals is in the motion, and says nothing about what acts over this one.
    mean[n - 1] = force
    for k in range(n - 1):
        root[n - 1, k] = 0.0
    root[n - 1, n - 1] = noise
    for k in range(n):
        middle = mean[k]
        for j in range(k + 1):
            middle += root[k, j] * shift[j]
        points[0, k] = middle
        for j in range(n):
            step = 0.0
            for i in range(k + 1):
                step += root[k, i] * narrow[i, j]
            points[1 + j, k] = middle + width * step
            points[1 + n + j, k] = middle - width * step
    for i in range(points.shape[0]):
        if i > 0:
            for k in range(memories.shape[1]):
                memories[i, k] = memories[0, k]
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
    points: Any, states: Any, slips: Any, n_theta: int, width: float, unscented: bool, shift: Any, widen: Any, columns: Any,
    floor: Any, mean: Any, work: Any, root: Any,
) -> None:  # fmt: skip
    """Mean and root of what has become of the points, led back from the other point to the mean.

    The mean is that of the middle point. The point around which they lie is an estimate already, which scatters around what
    was: what a curved model makes of that scatter is in the innovations, and to put it into the mean too would count it twice.
    What the slopes leave out is noise: for the extended filter the curvature at the middle, for the unscented one the points'
    own deviation with their weights.

    Args:
        points: from :func:`scatter`; their states are taken from ``states`` and ``slips``.
        states: shape ``(2 n + 1, n_x)``.
        slips: shape ``(2 n + 1, n_z)``.
        n_theta: number of parameters.
        width: of the points.
        unscented: which of the two.
        shift: as in :func:`scatter`.
        widen: inverse of ``narrow`` there.
        columns: written, what the columns of the root have become, ``(n, n)``.
        floor: standard deviation that a step adds to each state, shape ``(n,)``.
        mean: written, shape ``(n,)``.
        work: work space, shape ``(n, 3 n + 5)``.
        root: written, shape ``(n, n)``.
    """
    n, n_x, n_z = mean.shape[0], states.shape[1], slips.shape[1]
    for i in range(points.shape[0]):
        for k in range(n_x):
            points[i, n_theta + k] = states[i, k]
        for k in range(n_z):
            points[i, n_theta + n_x + k] = slips[i, k]
    half = 0.5 / width
    # Of a slope that isn't constant, s + c x: the variance of c x^2/2 comes to c^2/2.
    bend = half if unscented else 2.0 * math.sqrt(2.0) * half * half
    for k in range(n):
        back = 0.0
        for j in range(n):
            work[k, n + j] = bend * (points[1 + j, k] - 2.0 * points[0, k] + points[1 + n + j, k])
            slope = 0.0
            for i in range(n):
                slope += half * (points[1 + i, k] - points[1 + n + i, k]) * widen[i, j]
            work[k, j] = columns[k, j] = slope
            back += slope * shift[j]
        mean[k] = points[0, k] - back
    n_columns = 2 * n
    for j in range(n_theta, n - 1):
        for k in range(n):
            work[k, n_columns] = floor[j] if k == j else 0.0
        n_columns += 1
    triangular(work, n_columns, root)


@loop
def tell(
    mean: Any, root: Any, seen: int, y: float, noise: float, limit: float, columns: Any, shift: Any, narrow: Any, widen: Any,
    work: Any,
) -> bool:  # fmt: skip
    """Information of the measured state at the end of an interval about its beginning, and mean and root at its end with that.

    Args:
        mean: predicted, shape ``(n,)``; corrected in place, as is the root.
        root: shape ``(n, n)``.
        seen: which state is measured.
        y: its measured value.
        noise: its standard deviation.
        limit: of an innovation [standard deviations]; beyond it nothing is said, and False handed back.
        columns: what the columns of the root at the beginning have become, shape ``(n, n)``; corrected in place.
        shift: led on, as in :func:`scatter`.
        narrow: led on, as in :func:`scatter`.
        widen: led on, as in :func:`collapse`.
        work: work space, shape ``(n, 3 n + 5)``.
    """
    n = mean.shape[0]
    variance = noise * noise
    for j in range(seen + 1):
        variance += root[seen, j] * root[seen, j]
    deviation = math.sqrt(variance)
    innovation = (y - mean[seen]) / deviation
    if abs(innovation) > limit:
        return False
    at = n + 1
    for j in range(n):
        work[j, at] = columns[seen, j] / deviation
    for k in range(n):
        gain = 0.0
        for j in range(min(k, seen) + 1):
            gain += root[k, j] * root[seen, j]
        gain /= deviation
        mean[k] += gain * innovation
        for j in range(n):
            columns[k, j] -= gain * work[j, at]
            work[k, j] = root[k, j] - gain / deviation * root[seen, j]
        work[k, n] = gain / deviation * noise
    triangular(work, n + 1, root)
    told(innovation, shift, narrow, widen, work)
    return True


@loop
def carry(columns: Any, begun: Any, later: Any, work: Any) -> None:
    """What has become of the columns of an earlier root at the end of an interval.

    Args:
        columns: what they were at its beginning, shape ``(n, n)``; led on in place.
        begun: root at its beginning, shape ``(n, n)``.
        later: what the columns of that have become, shape ``(n, n)``.
        work: work space, shape ``(n, 3 n + 5)``.
    """
    n = begun.shape[0]
    # Along the columns of the root, by forward substitution; the force is another, of which nothing was known.
    for j in range(n):
        for k in range(n - 1):
            total = columns[k, j]
            for i in range(k):
                total -= begun[k, i] * work[i, j]
            work[k, j] = total / begun[k, k] if begun[k, k] > 0.0 else 0.0
    for k in range(n):
        for j in range(n):
            total = 0.0
            for i in range(n - 1):
                total += later[k, i] * work[i, j]
            columns[k, j] = total


@kernel
def told(innovation: float, shift: Any, narrow: Any, widen: Any, work: Any) -> None:
    """Take in an innovation of deviation 1 whose slopes along the columns of the root are in ``work[:, n + 1]``.

    With T the ``narrow`` so far, what is left is T T' - d d' = T (I - b b') T' with b = T^-1 d, and I - b b' is the square of
    I - g b b'.
    """
    n = shift.shape[0]
    at, turned = n + 1, n + 2
    square = 0.0
    for i in range(n):
        shift[i] += work[i, at] * innovation
        work[i, turned] = 0.0
        for j in range(n):
            work[i, turned] += widen[i, j] * work[j, at]
        square += work[i, turned] * work[i, turned]
    square = min(square, 1.0 - 1e-12)
    if square <= 0.0:
        return
    less = (1.0 - math.sqrt(1.0 - square)) / square
    more = less / (1.0 - less * square)
    for i in range(n):
        along = 0.0
        for j in range(n):
            along += narrow[i, j] * work[j, turned]
        for j in range(n):
            narrow[i, j] -= less * along * work[j, turned]
    for j in range(n):
        along = 0.0
        for i in range(n):
            along += work[i, turned] * widen[i, j]
        for i in range(n):
            widen[i, j] += more * work[i, turned] * along


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
            # The reflection may reverse the sign of the whole column.
            sign = 1.0 if alpha > 0.0 else -1.0
            for k in range(i + 1, n):
                root[k, i] = sign * work[k, i]
        else:
            for k in range(i + 1, n):
                root[k, i] = work[k, i]


@loop
def correct(  # noqa: C901 - a compiled kernel
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
