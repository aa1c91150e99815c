"""Units of imported files, converted to SI at this edge and nowhere else.

A text such as ``N s/m``, ``mm/s²``, ``kN/mm`` or ``deg/s`` is a product of powers of symbols. Each symbol has a factor to SI
and exponents of the base quantities mass, length, time, angle, current, temperature and those that SI leaves without a unit
(per cent, counts); the exponents of the product say what it measures. Angle counts as a base quantity of its own, so that
``rad/s`` isn't a frequency. Factors are the exact ones of the SI brochure (9th edition) and of NIST SP 811, appendix B.
"""

from __future__ import annotations

import math
import re
from difflib import get_close_matches
from typing import NamedTuple

__all__ = ["Unit", "closest_units", "known_units", "unit"]


class Unit(NamedTuple):
    """A unit: what it measures, its SI unit, and ``si = value * factor + offset``."""

    quantity: str
    si: str
    factor: float
    offset: float = 0.0


Exponents = tuple[int, ...]

# mass, length, time, angle, current, temperature, per cent, counts
_KG, _M, _S, _RAD, _A, _K, _PER_CENT, _COUNT = (tuple(int(i == k) for i in range(8)) for k in range(8))
_NONE: Exponents = (0,) * 8


def _times(first: Exponents, second: Exponents, power: int = 1) -> Exponents:
    return tuple(a + power * b for a, b in zip(first, second, strict=True))


def _of(kg: int = 0, m: int = 0, s: int = 0, rad: int = 0, ampere: int = 0) -> Exponents:
    return (kg, m, s, rad, ampere, 0, 0, 0)


_FORCE, _TORQUE, _PRESSURE, _POWER = _of(1, 1, -2), _of(1, 2, -2), _of(1, -1, -2), _of(1, 2, -3)
_VOLT = _of(1, 2, -3, 0, -1)

# What a product of powers measures, and how its SI unit is written.
_QUANTITIES: dict[Exponents, tuple[str, str]] = {
    _NONE: ("number", "1"),
    _S: ("time", "s"),
    _M: ("length", "m"),
    _RAD: ("angle", "rad"),
    _FORCE: ("force", "N"),
    _TORQUE: ("torque", "N m"),
    _of(0, 1, -1): ("speed", "m/s"),
    _of(0, 0, -1, 1): ("angular speed", "rad/s"),
    _of(0, 1, -2): ("acceleration", "m/s^2"),
    _of(0, 0, -2, 1): ("angular acceleration", "rad/s^2"),
    _of(0, 1, -3): ("jerk", "m/s^3"),
    _K: ("temperature", "degC"),
    _A: ("current", "A"),
    _VOLT: ("voltage", "V"),
    _PER_CENT: ("per cent", "%"),
    _COUNT: ("counts", "counts"),
    _of(0, 2): ("area", "m^2"),
    _of(0, 3): ("volume", "m^3"),
    _of(0, 3, -1): ("flow", "m^3/s"),
    _of(1, 0, -1): ("damping", "N s/m"),
    _PRESSURE: ("pressure", "Pa"),
    _of(0, 0, -1): ("frequency", "Hz"),
    _KG: ("mass", "kg"),
    _of(1, 2): ("inertia", "kg m^2"),
    _of(1, -3): ("density", "kg/m^3"),
    _of(1, 0, -2): ("stiffness", "N/m"),
    _of(1, 2, -2, -1): ("torsional stiffness", "N m/rad"),
    _of(1, 2, -1, -1): ("torsional damping", "N m s/rad"),
    _of(1, 2, -1): ("angular momentum", "N m s"),
    _of(1, 1, -1): ("momentum", "N s"),
    _POWER: ("power", "W"),
    _of(1, -1, -1): ("viscosity", "Pa s"),
    _of(1, 1, -2, 0, -1): ("force constant", "N/A"),
    _of(1, 2, -2, 0, -1): ("torque constant", "N m/A"),
    _of(1, 2, -3, 0, -2): ("resistance", "ohm"),
}

_TURN, _DEG = 2 * math.pi, math.pi / 180
_GRAVITY = 9.80665  # [m/s^2], standard gravity
_INCH, _POUND = 0.0254, 0.45359237
_INERTIAS = {"kgm": 1.0, "kgcm": 1e-4, "kgmm": 1e-6, "gcm": 1e-7, "gmm": 1e-9}
_NAMED: dict[str, tuple[float, Exponents]] = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), (1.0, _S)),
    **dict.fromkeys(("min", "minute", "minutes"), (60.0, _S)),
    **dict.fromkeys(("h", "hr", "hour", "hours"), (3600.0, _S)),
    "d": (86400.0, _S),
    "m": (1.0, _M),
    "in": (_INCH, _M),
    "inch": (_INCH, _M),
    "mil": (1e-3 * _INCH, _M),
    "ft": (12 * _INCH, _M),
    "g": (1e-3, _KG),
    "t": (1e3, _KG),
    "lb": (_POUND, _KG),
    "lbm": (_POUND, _KG),
    "oz": (_POUND / 16, _KG),
    "rad": (1.0, _RAD),
    "deg": (_DEG, _RAD),
    "°": (_DEG, _RAD),
    "arcmin": (_DEG / 60, _RAD),
    "arcsec": (_DEG / 3600, _RAD),
    "gon": (math.pi / 200, _RAD),
    **dict.fromkeys(("rev", "turn", "turns", "tr", "U", "r"), (_TURN, _RAD)),
    **dict.fromkeys(("rpm", "RPM"), (_TURN / 60, _of(0, 0, -1, 1))),
    "rps": (_TURN, _of(0, 0, -1, 1)),
    "dps": (_DEG, _of(0, 0, -1, 1)),
    "N": (1.0, _FORCE),
    **dict.fromkeys(("kgf", "kp"), (_GRAVITY, _FORCE)),
    "gf": (_GRAVITY * 1e-3, _FORCE),
    "lbf": (_POUND * _GRAVITY, _FORCE),
    "ozf": (_POUND / 16 * _GRAVITY, _FORCE),
    "Pa": (1.0, _PRESSURE),
    "bar": (1e5, _PRESSURE),
    "atm": (101325.0, _PRESSURE),
    "psi": (_POUND * _GRAVITY / _INCH**2, _PRESSURE),
    "l": (1e-3, _of(0, 3)),
    "L": (1e-3, _of(0, 3)),
    "ccm": (1e-6, _of(0, 3)),
    "A": (1.0, _A),
    "V": (1.0, _VOLT),
    "W": (1.0, _POWER),
    "J": (1.0, _TORQUE),
    "Hz": (1.0, _of(0, 0, -1)),
    **dict.fromkeys(("ohm", "Ohm", "Ω"), (1.0, _of(1, 2, -3, 0, -2))),
    "K": (1.0, _K),
    "g0": (_GRAVITY, _of(0, 1, -2)),
    "gn": (_GRAVITY, _of(0, 1, -2)),
    "Gal": (1e-2, _of(0, 1, -2)),
    **dict.fromkeys(("%", "percent", "pct"), (1.0, _PER_CENT)),
    **dict.fromkeys(("‰", "permille"), (0.1, _PER_CENT)),
    **dict.fromkeys(
        ("counts", "count", "cts", "inc", "incr", "ticks", "tick", "steps", "step", "LSB", "digit", "digits", "pulses"),
        (1.0, _COUNT),
    ),
    **{name: (factor, _of(1, 2)) for base, factor in _INERTIAS.items() for name in (f"{base}2", f"{base}^2")},
    "1": (1.0, _NONE),
    "-": (1.0, _NONE),
}
_TEMPERATURES = {
    **dict.fromkeys(("degC", "°C", "C", "℃"), Unit("temperature", "degC", 1.0)),
    "K": Unit("temperature", "degC", 1.0, -273.15),
    **dict.fromkeys(("degF", "°F"), Unit("temperature", "degC", 5 / 9, -160 / 9)),
}
_PREFIXES = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "h": 1e2, "k": 1e3, "M": 1e6, "G": 1e9}
_PREFIXED = {
    **dict.fromkeys(("m", "l", "L"), "numcdk"),
    **dict.fromkeys(("s", "rad"), "num"),
    "g": "numk",
    "N": "numckM",
    "Pa": "mhkMG",
    "bar": "mu",
    **dict.fromkeys(("A", "V", "J", "W", "Hz", "ohm", "Ω"), "numkMG"),
}
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_FACTOR = re.compile(r"([A-Za-z°%‰Ω℃]+0?|1|-)(?:\^?(-?\d))?$")
# Symbols of a force, a length and a time written as one word, as in Nm, mNm, Ncm, Nms, Ns.
_WORD = re.compile(r"([numckM]?N)(?!$)([numc]?m(?!s$)|m(?=s$))?(s)?$")
_TRIED = ("mm", "m/s", "mm/s", "rad/s", "deg", "deg/s", "mN", "kN", "N m", "mN m", "N mm", "um", "nm", "cm", "ms", "us", "ns")
_LISTED = {
    "time": "s, ms, us, ns, min, h",
    "length": "m, cm, mm, um, nm, in, ft",
    "angle": "rad, mrad, deg, rev, arcmin, arcsec",
    "force": "N, mN, uN, nN, kN, kgf, gf, lbf",
    "torque": "N m, mN m, uN m, kN m, N mm, N cm, lbf in",
    "speed": "m/s, cm/s, mm/s, um/s, m/min, mm/min",
    "angular speed": "rad/s, mrad/s, deg/s, rev/s, rpm",
    "acceleration": "m/s^2, mm/s^2, g",
    "angular acceleration": "rad/s^2, deg/s^2",
    "temperature": "degC, K, degF",
    "current": "A, mA",
    "voltage": "V, mV",
    "per cent": "%",
    "counts": "counts",
    "number": "1",
}


def unit(text: str, *wanted: str) -> Unit | None:
    """The unit that a text means, or None when it is not known.

    Blanks, ``*``, ``·`` between factors and the letter for micro do not matter; capitals do (``nm`` and ``Nm``).

    Args:
        text: as written in a mapping or a header.
        wanted: quantities that are expected. ``g`` is a gram, or standard gravity where an acceleration is expected; ``1/min``
            is a frequency, or turns per minute where an angular speed is.
    """
    plain = text.strip().replace("\u00b5", "u").replace("\u03bc", "u").translate(_SUPERSCRIPTS)
    if "angular speed" in wanted and plain in {"1/min", "min^-1", "/min"}:
        plain = "rpm"  # as drives write it
    if plain in _TEMPERATURES:
        return _TEMPERATURES[plain]
    if plain == "g" and "acceleration" in wanted:
        plain = "g0"
    product = _product(plain)
    if product is None:
        return None
    factor, exponents = product
    quantity, si = _QUANTITIES.get(exponents, ("other", _written(exponents)))
    return Unit(quantity, si, factor)


def _written(exponents: Exponents) -> str:
    """A product of base units without a name of its own, such as ``kg m^-2``."""
    names = ("kg", "m", "s", "rad", "A", "K", "%", "counts")
    parts = zip(names, exponents, strict=True)
    return " ".join(name if power == 1 else f"{name}^{power}" for name, power in parts if power)


def _product(text: str) -> tuple[float, Exponents] | None:
    """Factor and exponents of products, quotients and powers of symbols; what follows a stroke divides."""
    joined = re.sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", "*", text)
    factor, exponents = 1.0, _NONE
    for place, part in enumerate(joined.replace("(", " ").replace(")", " ").split("/")):
        symbols = [symbol for symbol in re.split(r"[\s*·⋅.]+", part) if symbol]
        if not symbols:
            return None
        for symbol in symbols:
            found = _power(symbol)
            if found is None:
                return None
            sign = -1 if place else 1
            factor *= found[0] ** sign
            exponents = _times(exponents, found[1], sign)
    return factor, exponents


def _power(symbol: str) -> tuple[float, Exponents] | None:
    match = _FACTOR.match(symbol)
    if match is None:
        return None
    base = _symbol(symbol) or (_symbol(match[1]) if match[1] not in {"1", "-"} else None)
    power = int(match[2]) if match[2] and _symbol(symbol) is None else 1
    if base is None:
        return None
    return base[0] ** power, _times(_NONE, base[1], power)


def _symbol(name: str) -> tuple[float, Exponents] | None:
    if name in _NAMED:
        return _NAMED[name]
    for size in range(1, len(name)):
        prefix, base = name[:size], name[size:]
        if prefix in _PREFIXED.get(base, ()):
            factor, exponents = _NAMED[base]
            return _PREFIXES[prefix] * factor, exponents
    word = _WORD.match(name)
    if word is None:
        return None
    factor, exponents = 1.0, _NONE
    for part in word.groups():
        found = _symbol(part) if part else (1.0, _NONE)
        assert found is not None  # the pattern holds known symbols only
        factor, exponents = factor * found[0], _times(exponents, found[1])
    return factor, exponents


def known_units(*quantities: str) -> str:
    """Units of these quantities, for messages."""
    return ", ".join(_LISTED[quantity] for quantity in quantities if quantity in _LISTED)


def closest_units(text: str, *quantities: str) -> str:
    """Known units that are written nearly like ``text``, for messages; the usual ones when none is near."""
    listed = [name for quantity in (quantities or _LISTED) for name in _LISTED.get(quantity, "").split(", ") if name]
    names = list(dict.fromkeys([*listed, *([] if quantities else [*_NAMED, *_TRIED])]))
    plain = text.strip()
    near = [name for name in names if name.lower() == plain.lower()] or get_close_matches(plain, names, n=3, cutoff=0.5)
    return ", ".join(near or listed[:8])
