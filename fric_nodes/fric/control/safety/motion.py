"""Whether a motion can come from the forces given, and how fast the axis may be by now.

Equation: with the momentum balance m dv/dt = F + d, m between m_0 and m_1, |d| <= D, three readings of the position (t_i, x_i)
give the change of mean speed between the two halves of their window,

    dv = (x_2 - x_1) / (t_2 - t_1) - (x_1 - x_0) / (t_1 - t_0)

and the same difference of the twice integrated force S (S'' = F) gives the momentum J that the drive put in. Then

    J - D w <= m dv <= J + D w,   w = (t_2 - t_0) / 2

must hold for an m in its range, but for the error of the readings. A reading against it is no motion of this axis: a jump, a
frozen or reversed encoder, a wrong gear ratio; or the axis hit something.
D holds friction and load, and by how much the force has changed over the window and the latency before it: so far the force
that acts may be from the one that was given.
Source: the momentum observer of collision detection (De Luca and Mattone 2005, ICRA, Eq. 12), with bounds in place of a model.
"""

from __future__ import annotations

import math
from collections import deque

from .limits import Limits

__all__ = ["MotionWatch"]

_NS = 1e-9
_WIDTHS = 10.0  # physical scale: an axis that far outside its range, in widths of it, isn't there but misread
_FARTHEST = 1e12  # numerical: beyond it, a position in double precision has no digits left for its changes
_KEPT = 64  # numerical: forces kept at most; a window holds a few
_REBASE = 256  # numerical: after so many readings the integrals of the force start from zero, so that no digits are lost


class MotionWatch:
    """Compares readings with the forces given meanwhile.

    Args:
        limits: bounds of the axis.

    Attributes:
        limits: bounds of the axis.
        velocity: mean velocity over the newest window [x/s]; 0 while unknown.
        known: True when ``velocity`` is from readings.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._resistance = limits.friction + limits.load
        self._latency = round(limits.latency / _NS)
        self._given: deque[tuple[int, float]] = deque([(0, 0.0)])  # since when [ns], and which force [F]
        self._n = limits.readings
        width = limits.position_max - limits.position_min
        ends = max(abs(limits.position_min), abs(limits.position_max))
        self._farthest = min(ends + _WIDTHS * width, _FARTHEST)
        self._forget_forces(0)
        self.clear()

    def clear(self) -> None:
        """Forget all readings."""
        self._times: list[int] = []
        self._positions: list[float] = []
        self._integrals: list[float] = []
        self._momenta: list[float] = []
        self._since_rebase = 0
        self.velocity = 0.0
        self.known = False
        self._middle = 0.0

    def forget(self, now: int) -> None:
        """No force acts at ``now`` [ns], and since when nobody knows: forget readings and forces."""
        self._forget_forces(now)
        self._given.clear()
        self._given.append((now, 0.0))
        self.clear()

    def _forget_forces(self, now: int) -> None:
        self._changed = now
        self._force = self._momentum = self._integral = 0.0

    def force(self, now: int, force: float) -> None:
        """The drive gives ``force`` [F] from ``now`` [ns] on."""
        passed = (now - self._changed) * _NS
        if 0.0 <= passed < 1.0:  # numerical: beyond that a window holds no two readings of the same motion
            self._integral += passed * (self._momentum + 0.5 * passed * self._force)
            self._momentum += passed * self._force
        else:
            self._forget_forces(now)
            self.clear()
        self._changed, self._force = now, force
        given = self._given
        given.append((now, force))
        start = (self._times[0] if self._times else now) - self._latency
        # The one that was given when the window began stays.
        while len(given) > 1 and (given[1][0] <= start or len(given) > _KEPT):
            given.popleft()

    def _integrals_at(self, stamp: int) -> tuple[float, float]:
        """Twice and once integrated force at ``stamp`` [ns]."""
        passed = (stamp - self._changed) * _NS
        return self._integral + passed * (self._momentum + 0.5 * passed * self._force), self._momentum + passed * self._force

    def _outside(self, first: int, second: int, stamp: int, position: float, integral: float) -> bool:
        """True when the readings at two indices and a third one are no motion of the axis."""
        limits, times, positions, integrals = self.limits, self._times, self._positions, self._integrals
        before, after = (times[second] - times[first]) * _NS, (stamp - times[second]) * _NS
        change = (position - positions[second]) / after - (positions[second] - positions[first]) / before
        given = (integral - integrals[second]) / after - (integrals[second] - integrals[first]) / before
        start = times[first] - self._latency
        forces = [force for time, force in self._given if time > start] or [self._force]
        fastest = max(abs(position - positions[second]) / after, abs(positions[second] - positions[first]) / before)
        bound = self._resistance + limits.viscous * fastest + max(forces) - min(forces)
        around = 0.5 * bound * (before + after)
        noise = 2.0 * limits.position_noise * (1.0 / before + 1.0 / after)
        least, most = given - around, given + around
        least /= limits.inertia_min if least < 0.0 else limits.inertia_max
        most /= limits.inertia_min if most > 0.0 else limits.inertia_max
        return not least - noise <= change <= most + noise

    def jump(self, stamp: int, position: float) -> bool:
        """True when no motion leads from the last readings to ``position`` [x] at ``stamp`` [ns]."""
        times = self._times
        limits = self.limits
        if abs(position) > self._farthest:
            return True
        if not times:
            return False
        passed = (stamp - times[-1]) * _NS
        way = abs(position - self._positions[-1]) - 2.0 * limits.position_noise
        if not limits.brakes:
            # No more than the speed limit is known: twice that is an overspeed still, and more is none.
            return way > 2.0 * limits.speed * passed
        if len(times) == 1:
            fastest = 2.0 * limits.speed + (limits.force + self._resistance) / limits.inertia_min * passed
            return way > fastest * passed
        return self._outside(-2, -1, stamp, position, self._integrals_at(stamp)[0])

    def take(self, stamp: int, position: float) -> bool:
        """Take in a reading that is no jump; False when the motion over the window contradicts the force."""
        times, positions, n = self._times, self._positions, self._n
        integral, momentum = self._integrals_at(stamp)
        fits = True
        if len(times) >= 2 * n and self.limits.brakes:
            fits = not self._outside(-2 * n, -n, stamp, position, integral)
        if times:
            back = min(n, len(times))
            self.velocity = (position - positions[-back]) / ((stamp - times[-back]) * _NS)
            self._middle = 0.5 * (momentum + self._momenta[-back])
            self._middle_time = 0.5 * (stamp + times[-back])
            self._span = (stamp - times[-back]) * _NS
            self.known = True
        times.append(stamp)
        positions.append(position)
        self._integrals.append(integral)
        self._momenta.append(momentum)
        if len(times) > 2 * n:
            del times[0], positions[0], self._integrals[0], self._momenta[0]
        self._since_rebase += 1
        if self._since_rebase > _REBASE:
            self._rebase()
        return fits

    def _rebase(self) -> None:
        """Start the integrals of the force anew; differences over a window stay the same."""
        self._since_rebase = 0
        at, integral, momentum = self._changed, self._integral, self._momentum
        for k, time in enumerate(self._times):
            self._integrals[k] -= integral + momentum * (time - at) * _NS
            self._momenta[k] -= momentum
        self._middle -= momentum
        self._integral = self._momentum = 0.0

    def position(self) -> float:
        """The newest position [x]; NaN when there is none."""
        return self._positions[-1] if self._positions else math.nan

    def fastest(self, now: int) -> tuple[float, float]:
        """Bounds on the velocity at ``now`` [ns], the lower and the upper one [x/s]."""
        if not self.known:
            return 0.0, 0.0
        limits = self.limits
        noise = 2.0 * limits.position_noise / self._span
        if not limits.brakes:
            return self.velocity - noise, self.velocity + noise
        given = self._integrals_at(now)[1] - self._middle
        loaded = limits.load * (now - self._middle_time) * _NS
        up, down = given + loaded, given - loaded
        up /= limits.inertia_min if up > 0.0 else limits.inertia_max
        down /= limits.inertia_min if down < 0.0 else limits.inertia_max
        return self.velocity + down - noise, self.velocity + up + noise
