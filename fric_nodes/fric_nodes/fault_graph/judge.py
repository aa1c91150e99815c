"""What reached the drive, against its limits: every entry that the judged plants have written.

A sample is unsafe when the force is beyond its limit, when it has changed by more than its rate allows since the entry before,
when the mean speed since the sample before is beyond the limit, or the position out of its range. Where the process of the
drive was held up longer than its watchdog waits, the force may have gone to zero at once, as a watchdog does.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from fric.control.safety import Limits, State, stop_from

from .judged_plant import ENTRY

__all__ = ["Judge", "Judgement"]

_ROUNDING = 1e-9  # numerical: relative error of a rate from forces and times in double precision
_SHORTEST = 1_000_000  # numerical: [ns] a mean speed over less says nothing, by the digits of a position
_STOPPING = list(State).index(State.STOPPING)


@dataclass
class Judgement:
    """What was found.

    Attributes:
        samples: entries looked at.
        unsafe: of them.
        why: the first of the unsafe ones.
        slow_stops: stops that took longer than stated.
    """

    samples: int = 0
    unsafe: int = 0
    why: str = ""
    slow_stops: int = 0


@dataclass
class _Drive:
    """One process's record, as far as it was read."""

    read: int = 0
    time: int = 0
    force: float = 0.0
    place: tuple[int, float] | None = None  # time [ns] and position [m] of the last mean speed
    speed: float = 0.0
    stop_by: int = 0  # [ns]; 0: no stop under way
    state: int = 0


@dataclass
class Judge:
    """Reads the records in ``folder``.

    Args:
        folder: with the records.
        limits: of the axis.
        watchdog: longest time without an entry until the drive's watchdog has cut the force [s].
    """

    folder: Path
    limits: Limits
    watchdog: float
    _drives: dict[Path, _Drive] = field(default_factory=dict)

    def look(self) -> Judgement:
        """Judge what has been written since the last time."""
        found = Judgement()
        for path in sorted(self.folder.glob("*.drive")):
            drive = self._drives.setdefault(path, _Drive())
            with path.open("rb") as file:
                file.seek(drive.read)
                data = file.read()
            whole = len(data) - len(data) % ENTRY.size
            drive.read += whole
            for entry in ENTRY.iter_unpack(data[:whole]):
                self._entry(drive, found, *entry)
        return found

    def _entry(self, drive: _Drive, found: Judgement, time: int, force: float, position: float, state: int) -> None:
        limits, broken = self.limits, ""
        passed = 1e-9 * (time - drive.time) if drive.time else 0.0
        paused = passed > self.watchdog
        allowed = limits.force_rate * passed * (1.0 + _ROUNDING) + _ROUNDING
        if not abs(force) <= limits.force:
            broken = f"force {force:.6g} N"
        elif not (abs(force - drive.force) <= allowed or (paused and force == 0.0)):
            broken = f"force from {drive.force:.6g} to {force:.6g} N in {passed:.6g} s"
        elif not limits.position_min <= position <= limits.position_max:
            broken = f"position {position:.6g} m"
        if drive.place is None:
            drive.place = (time, position)
        elif time - drive.place[0] >= _SHORTEST:
            drive.speed = 1e9 * (position - drive.place[1]) / (time - drive.place[0])
            drive.place = (time, position)
            if not abs(drive.speed) <= limits.speed:
                broken = broken or f"speed {drive.speed:.6g} m/s"
        found.samples += 1
        if broken:
            found.unsafe += 1
            found.why = found.why or broken
        self._stop(drive, found, time, force, state, paused)
        drive.time, drive.force, drive.state = time, force, state

    def _stop(self, drive: _Drive, found: Judgement, time: int, force: float, state: int, paused: bool) -> None:
        if state != _STOPPING or paused:
            drive.stop_by = 0
        elif drive.state != _STOPPING:
            stated = stop_from(self.limits, drive.speed, drive.force).time + self.limits.latency
            drive.stop_by = time + round(1e9 * stated)
        elif drive.stop_by and time > drive.stop_by:
            found.slow_stops += 1
            drive.stop_by = 0
