"""Units of imported files, converted to SI at this edge and nowhere else."""

from __future__ import annotations

import math
from typing import NamedTuple

__all__ = ["Unit", "known_units", "unit"]


class Unit(NamedTuple):
    """A unit: what it measures, its SI unit, and ``si = value * factor + offset``."""

    quantity: str
    si: str
    factor: float
    offset: float = 0.0


_TURN = 2 * math.pi
_DEG = math.pi / 180
_GRAVITY = 9.80665  # [m/s^2], standard gravity
_TABLE: dict[str, Unit] = {}


def _add(quantity: str, si: str, **factors: float) -> None:
    for name, factor in factors.items():
        _TABLE[name] = Unit(quantity, si, factor)


_add("time", "s", s=1.0, ms=1e-3, us=1e-6, ns=1e-9, min=60.0, h=3600.0)
_add("length", "m", m=1.0, cm=1e-2, mm=1e-3, um=1e-6, nm=1e-9)
_TABLE["in"] = Unit("length", "m", 0.0254)
_add("angle", "rad", rad=1.0, mrad=1e-3, urad=1e-6, deg=_DEG, rev=_TURN, arcmin=_DEG / 60, arcsec=_DEG / 3600)
_add("force", "N", N=1.0, mN=1e-3, uN=1e-6, nN=1e-9, kN=1e3, kgf=_GRAVITY, gf=_GRAVITY * 1e-3, lbf=4.4482216152605)
_add("torque", "N m", Nm=1.0, mNm=1e-3, uNm=1e-6, kNm=1e3, Nmm=1e-3, Ncm=1e-2, mNmm=1e-6)
_TABLE["m/s"] = Unit("speed", "m/s", 1.0)
_TABLE["cm/s"] = Unit("speed", "m/s", 1e-2)
_TABLE["mm/s"] = Unit("speed", "m/s", 1e-3)
_TABLE["um/s"] = Unit("speed", "m/s", 1e-6)
_TABLE["m/min"] = Unit("speed", "m/s", 1 / 60)
_TABLE["mm/min"] = Unit("speed", "m/s", 1e-3 / 60)
_TABLE["rad/s"] = Unit("angular speed", "rad/s", 1.0)
_TABLE["mrad/s"] = Unit("angular speed", "rad/s", 1e-3)
_TABLE["deg/s"] = Unit("angular speed", "rad/s", _DEG)
_TABLE["rev/s"] = Unit("angular speed", "rad/s", _TURN)
_TABLE["rpm"] = Unit("angular speed", "rad/s", _TURN / 60)
_TABLE["rev/min"] = Unit("angular speed", "rad/s", _TURN / 60)
_TABLE["degC"] = Unit("temperature", "degC", 1.0)
_TABLE["C"] = Unit("temperature", "degC", 1.0)
_TABLE["K"] = Unit("temperature", "degC", 1.0, -273.15)
_SPELLINGS = {"°": "deg", "°C": "degC", "°/s": "deg/s", "Ncm": "Ncm", "sec": "s", "1/min": "rpm"}


def unit(text: str) -> Unit | None:
    """The unit that a text means, or None when it is not one with a known SI unit (``A``, ``V``, ``%``).

    Blanks, ``*`` and ``·`` between factors and the letter for micro do not matter; capitals do (``nm`` and ``Nm``).
    """
    plain = text.strip()
    for sign in (" ", "*", "·", "⋅"):
        plain = plain.replace(sign, "")
    plain = plain.replace("\u00b5", "u").replace("\u03bc", "u")
    return _TABLE.get(_SPELLINGS.get(plain, plain))


def known_units(*quantities: str) -> str:
    """Units of these quantities, for messages."""
    return ", ".join(name for name, entry in _TABLE.items() if entry.quantity in quantities)
