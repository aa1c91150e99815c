"""What a static map is, and its table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ..result import Identification
from .break_away import BreakAway
from .curve import Choice
from .load import LoadLaw, MeanForce
from .presliding import Compliance, Presliding, Reversal
from .stick_slip import StickSlip

__all__ = ["StaticMap", "map_table"]


@dataclass(frozen=True, eq=False)
class StaticMap(Identification):
    """An identification by static maps, with the maps.

    Attributes:
        means: mean forces of the settled parts.
        choice: of the friction curve; None where there is none.
        loads: friction over load.
        load_unit: of the loads; empty where none was recorded.
        presliding: by recording and direction.
        reversals: by recording, in the order of ``sources``.
        compliance: what the loads tell about the rig; None without reversals.
        break_away: by recording and direction.
        slips: branches of stick-slip.
        sources: the recordings.
    """

    means: tuple[MeanForce, ...] = ()
    choice: Choice | None = None
    loads: LoadLaw | None = None
    load_unit: str = ""
    presliding: tuple[Presliding, ...] = ()
    reversals: tuple[tuple[Reversal, ...], ...] = ()
    compliance: Compliance | None = None
    break_away: tuple[BreakAway, ...] = ()
    slips: tuple[StickSlip, ...] = ()
    sources: tuple[str, ...] = ()

    @property
    def several_loads(self) -> bool:
        """True when the maps are of friction over load rather than over velocity."""
        return self.loads is not None and self.loads.line is not None

    @property
    def attachments(self) -> Mapping[str, str]:
        """The maps as a table."""
        return {"maps.csv": map_table(self)}


def _row(
    kind: str, quantity: str, unit: str, where: tuple[str, float, float, float], value: float, error: float, n: int
) -> str:
    source, direction, velocity, load = where
    half = float(stats.t.ppf(0.975, max(n - 1, 1))) * error
    numbers = (velocity, load, value, error, value - half, value + half)
    cells = [kind, quantity, unit, source, f"{direction:+.0f}" if direction else "0", *(_number(x) for x in numbers), str(n)]
    return ",".join(f'"{cell}"' if "," in cell else cell for cell in cells)


def _number(value: float) -> str:
    return f"{value:.8g}" if np.isfinite(value) else ""


def map_table(found: StaticMap) -> str:
    """The maps as CSV: one row per quantity with standard error, 95 % interval and the number of values behind it."""
    units = found.model.units
    force, way = units.force, units.position
    rows = ["kind,quantity,unit,recording,direction,velocity,load,value,standard_error,low,high,n"]
    add = rows.append
    none = float("nan")
    for m in found.means:
        n = m.n if m.n > 1 else 60  # a single part's error is that of many samples
        add(_row("settled", "mean force", force, (m.source, m.direction, m.velocity, m.load), m.force[0], m.force[1], n))
    if found.loads is not None and found.load_unit:
        for p in found.loads.points:
            where = ("", 0.0, float(np.mean(p.speeds)), p.load)
            add(_row("load", "friction", force, where, *p.friction, p.freedom + 1))
    if found.choice is not None:
        for curve, kind in ((found.choice.best, "curve"), (found.choice.rival, "rival")):
            if curve is not None:
                for v in _grid([m.velocity for m in found.means]):
                    value = float(curve.force(np.array([v]))[0])
                    error = float(curve.half_width(np.array([v]))[0] / stats.t.ppf(0.975, max(curve.freedom, 1)))
                    where = (curve.candidate.title, float(np.sign(v)), v, none)
                    add(_row(kind, "force", force, where, value, error, curve.freedom + 1))
    for s in found.presliding:
        where = (s.source, s.direction, none, s.load)
        add(_row("presliding", "break-away distance", way, where, *s.distance, s.n))
        add(_row("presliding", "way to half", way, where, *s.half, s.n))
        add(_row("presliding", "initial stiffness", f"{force}/{way}", where, *s.stiffness, s.n))
    if found.compliance is not None and found.compliance.told_apart:
        c = found.compliance
        add(_row("rig", "compliance", f"{way}/{force}", ("", 0.0, none, none), *c.compliance, c.freedom + 1))
        add(_row("rig", "distance free of it", way, ("", 0.0, none, none), *c.distance, c.freedom + 1))
    for b in found.break_away:
        add(_row("break-away", "force", force, (b.source, b.direction, 0.0, b.load), *b.force, max(b.n, 2)))
    for k in found.slips:
        for branch, values, errors in (("rising", k.rising, k.rising_error), ("falling", k.falling, k.falling_error)):
            for v, f, e in zip(k.speed.tolist(), values.tolist(), errors.tolist(), strict=True):
                add(_row("stick-slip", f"friction {branch}", force, ("", k.direction, k.direction * v, none), f, e, k.n))
    return "\n".join(rows) + "\n"


def _grid(velocities: Sequence[float]) -> list[float]:
    """Velocities from the slowest to the fastest of either direction."""
    grid: list[float] = []
    for sign in (-1.0, 1.0):
        speeds = [abs(v) for v in velocities if v * sign > 0]
        if speeds:
            side = np.geomspace(min(speeds), max(speeds), 25) if max(speeds) > min(speeds) else np.array(speeds[:1])
            grid += sorted((sign * side).tolist())
    return grid
