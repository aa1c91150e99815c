"""Units: products and powers of symbols, checked for every signal."""

from __future__ import annotations

import json
from typing import Any

import pytest
from fric.errors import InputError
from fric.importers.units import closest_units, unit


@pytest.mark.parametrize(
    ("text", "quantity", "si", "factor"),
    [
        ("bar", "pressure", "Pa", 1e5),
        ("mbar", "pressure", "Pa", 100.0),
        ("MPa", "pressure", "Pa", 1e6),
        ("psi", "pressure", "Pa", 6894.757293168361),
        ("N/mm^2", "pressure", "Pa", 1e6),
        ("cm²", "area", "m^2", 1e-4),
        ("mm^3", "volume", "m^3", 1e-9),
        ("l/min", "flow", "m^3/s", 1e-3 / 60),
        ("m/s²", "acceleration", "m/s^2", 1.0),
        ("m/s/s", "acceleration", "m/s^2", 1.0),
        ("m s^-2", "acceleration", "m/s^2", 1.0),
        ("deg/s^2", "angular acceleration", "rad/s^2", 0.017453292519943295),
        ("kN/mm", "stiffness", "N/m", 1e6),
        ("N s/m", "damping", "N s/m", 1.0),
        ("Nm s/rad", "torsional damping", "N m s/rad", 1.0),
        ("Nms/rad", "torsional damping", "N m s/rad", 1.0),
        ("N-m", "torque", "N m", 1.0),
        ("lbf in", "torque", "N m", 0.1129848290276167),
        ("g", "mass", "kg", 1e-3),
        ("kg cm^2", "inertia", "kg m^2", 1e-4),
        ("kgm²", "inertia", "kg m^2", 1.0),
        ("mA", "current", "A", 1e-3),
        ("mV", "voltage", "V", 1e-3),
        ("kHz", "frequency", "Hz", 1e3),
        ("%", "per cent", "%", 1.0),
        ("counts", "counts", "counts", 1.0),
        ("°/s", "angular speed", "rad/s", 0.017453292519943295),
        ("N/A", "force constant", "N/A", 1.0),
        ("V/s", "other", "kg m^2 s^-4 A^-1", 1.0),
    ],
)
def test_units(text: str, quantity: str, si: str, factor: float) -> None:
    found = unit(text)
    assert found is not None
    assert (found.quantity, found.si, found.factor) == (quantity, si, pytest.approx(factor, rel=1e-12))


def test_what_a_symbol_means_where_two_are_meant() -> None:
    assert unit("g", "acceleration") == ("acceleration", "m/s^2", 9.80665, 0.0)
    turned = unit("1/min", "angular speed")
    assert turned is not None
    assert turned.factor == pytest.approx(0.10471975511965977)
    fahrenheit = unit("°F")
    assert fahrenheit is not None
    assert 212 * fahrenheit.factor + fahrenheit.offset == pytest.approx(100.0)


@pytest.mark.parametrize("text", ["foo", "", "MM", "mm//s", "m^^2", "N/", "Nmm mm3x", "12", "kgg", "NM"])
def test_what_is_no_unit(text: str) -> None:
    assert unit(text) is None


@pytest.mark.parametrize(
    ("signal", "text", "message"),
    [
        ("pressure", "foo", "signal 'pressure' has the unit 'foo', which is not known"),
        ("pressure", "Bar", "the closest: bar"),
        ("pressure", "", "signal 'pressure' has the unit '', which is not known"),
        ("acceleration", "m/s", "which is no unit of acceleration or angular acceleration"),
    ],
)
def test_units_of_further_signals_are_checked(imported: Any, signal: str, text: str, message: str) -> None:
    content = json.dumps({name: list(range(20)) for name in ("t", "q", "u", "p")})
    with pytest.raises(InputError, match=message):
        imported(content, "a.json", extra={signal: {"from": "p", "unit": text}})


def test_further_signals_are_in_si(imported: Any) -> None:
    content = json.dumps({name: list(range(20)) for name in ("t", "q", "u", "p")})
    extra = {"p": {"from": "p", "unit": "bar"}, "a": {"from": "p", "unit": "cm^2"}, "acceleration": {"from": "p", "unit": "g"}}
    record = imported(content, "a.json", extra=extra)
    assert {name: signal[1] for name, signal in record.extra.items()} == pytest.approx(
        {"p": 1e5, "a": 1e-4, "acceleration": 9.80665}
    )


def test_the_closest_units() -> None:
    assert closest_units("MM") == "mm"
    assert "rpm" in closest_units("rpmm", "angular speed")
