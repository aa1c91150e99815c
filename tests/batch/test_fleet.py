"""The statistics of a fleet, on simulated tables: what changed is found at once, and what did not is left in peace."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import numpy as np
import pyarrow as pa
import pytest
from fric.batch.fleet.changes import FALSE_ALARMS, alarms_of, robust_z, without_common
from fric.batch.fleet.look import Fleet, fleet_of
from fric.batch.fleet.page import fleet_page

AXES, DAYS, PER_DAY = 200, 60, 4
STEPPED, GROWING, FROM = 42, 137, 30
NAMES = ("mass", "coulomb.force", "viscous.coefficient", "backlash.gap")
USUAL = (5.0, 12.0, 30.0, 1e-4)
NOISE = 0.03  # of a value, from recording to recording


def simulated(seed: int, changed: bool, heavy: bool = False) -> pa.Table:
    """200 axes over 60 days: each with values and a slow drift of its own, under a common season; two of them change."""
    generator = np.random.default_rng(seed)
    shape = (AXES, DAYS, PER_DAY)
    day = np.broadcast_to(np.arange(DAYS, dtype=float)[None, :, None], shape)
    start = datetime(2026, 3, 1, 6, tzinfo=timezone.utc)
    stamps = [[start + timedelta(days=d, hours=3 * k) for k in range(PER_DAY)] for d in range(DAYS)]
    columns: dict[str, object] = {
        "path": [f"r{k}" for k in range(AXES * DAYS * PER_DAY)],
        "axis": np.repeat([f"machine_{k:03d}/slide" for k in range(AXES)], DAYS * PER_DAY),
        "joint": ["slide"] * (AXES * DAYS * PER_DAY),
        "time": pa.array([stamp for _ in range(AXES) for row in stamps for stamp in row], pa.timestamp("us", tz="UTC")),
        "status": ["ok"] * (AXES * DAYS * PER_DAY),
        "refusal": pa.nulls(AXES * DAYS * PER_DAY, pa.string()),
    }
    for k, (name, usual) in enumerate(zip(NAMES, USUAL, strict=True)):
        level = usual * (1.0 + 0.1 * generator.standard_normal((AXES, 1, 1)))
        drift = 1.0 + 0.02 * generator.standard_normal((AXES, 1, 1)) * day / DAYS + 0.03 * np.sin(day / 9.0) * (k == 2)
        noise = generator.standard_t(4, shape) / np.sqrt(2.0) if heavy else generator.standard_normal(shape)
        value = level * drift * (1.0 + NOISE * noise)
        if changed and name == "coulomb.force":
            value[STEPPED, FROM:] *= 1.2
        if changed and name == "backlash.gap":
            value[GROWING] *= 1.0 + 0.1 * np.maximum(day[GROWING] - FROM + 1.0, 0.0)
        flat = value.ravel()
        columns |= {name: flat, f"{name}.lower": flat * (1.0 - 2 * NOISE), f"{name}.upper": flat * (1.0 + 2 * NOISE)}
    return pa.table(columns)


@pytest.fixture(scope="module")
def fleet() -> Fleet:
    return fleet_of(simulated(1, changed=True), NAMES)


def test_a_step_and_a_growth_are_found_within_a_day_and_come_first(fleet: Fleet) -> None:
    dated = {(item.axis, item.about): item for item in reversed(fleet.items) if item.since}
    step = dated[f"machine_{STEPPED:03d}/slide", "coulomb.force"]
    growth = dated[f"machine_{GROWING:03d}/slide", "backlash.gap"]
    first = datetime(2026, 3, 1, tzinfo=timezone.utc) + timedelta(days=FROM)
    for item in (step, growth):
        assert 0 <= (datetime.fromisoformat(item.since).replace(tzinfo=timezone.utc) - first).days <= 1
    assert {item.axis for item in fleet.items[:2]} == {step.axis, growth.axis}
    assert "steps by" in step.what


@pytest.mark.parametrize("heavy", [False, True], ids=["normal", "heavy tails"])
def test_false_alarms_are_fewer_than_one_in_a_thousand_axis_days(heavy: bool) -> None:
    counts = []
    for seed in (2, 3):
        quiet = fleet_of(simulated(seed, changed=False, heavy=heavy), NAMES)
        assert quiet.axis_days == AXES * DAYS
        counts.append(sum(bool(item.since) for item in quiet.items))
    assert sum(counts) < 1e-3 * 2 * AXES * DAYS, counts


def test_a_common_change_is_no_alarm_and_is_taken_off() -> None:
    generator = np.random.default_rng(4)
    values = 10.0 + generator.standard_normal((40, 40)) * 0.1
    season = np.where(np.arange(40) >= 20, 1.0, 0.0)
    assert not alarms_of(values + season, np.full(values.shape, 0.1), 1)
    assert np.abs(np.median(without_common(values + season)[:, 20:]) - np.median(values)) < 1.0
    one = values.copy()
    one[7, 25] += 1.5  # gone the day after
    found = {(each.axis, each.day, each.kind) for each in alarms_of(one, np.full(values.shape, 0.1), 1)}
    assert found == {(7, 25, "one day")}


def test_an_imprecise_recording_is_no_alarm() -> None:
    generator = np.random.default_rng(5)
    values, errors = 10.0 + generator.standard_normal((3, 40)) * 0.1, np.full((3, 40), 0.1)
    values[1, 30] += 1.5
    assert [(each.axis, each.day) for each in alarms_of(values, errors, 1)] == [(1, 30)]
    errors[1, 30] = 1.0
    assert not alarms_of(values, errors, 1)


def test_robust_z_is_that_of_a_normal_distribution() -> None:
    z, scale = robust_z(3.0 + 2.0 * np.random.default_rng(6).standard_normal(4000))
    assert scale == pytest.approx(2.0, rel=0.05)
    assert np.mean(np.abs(z) > 1.96) == pytest.approx(0.05, abs=0.01)
    assert np.isnan(robust_z(np.arange(5.0))[0]).all()


def test_the_page_shows_what_comes_first_and_stands_alone(fleet: Fleet) -> None:
    page = fleet_page(fleet, simulated(1, changed=True), "identify")
    assert f"machine_{STEPPED:03d}/slide" in page
    assert f"{FALSE_ALARMS * AXES * DAYS:.2g}" in page
    assert page.count("<h2>") >= 6
    assert "<script src" not in page
    assert "https://" not in page.split("</style>")[1].split("<main>")[1].replace("https://plot.ly", "")


def test_a_table_without_times_or_with_one_axis_has_a_page() -> None:
    table = simulated(1, changed=False).slice(0, PER_DAY * 12)
    fleet = fleet_of(table, NAMES)
    assert fleet.axis_days == 12
    assert fleet_page(fleet, table, "identify")
    timeless = table.set_column(3, "time", pa.nulls(table.num_rows, pa.timestamp("us", tz="UTC")))
    fleet = fleet_of(timeless, NAMES)
    assert (fleet.undated, fleet.items, fleet.axis_days) == (table.num_rows, (), 0)
    assert fleet_page(fleet, timeless, "identify")
    empty = table.slice(0, 0)
    assert fleet_page(fleet_of(empty, NAMES), empty, "identify")


def test_axes_with_the_same_causes_are_put_together() -> None:
    table = simulated(1, changed=False)
    first = table.filter(pa.compute.equal(pa.compute.second(table["time"]), 0)).slice(0, PER_DAY * DAYS * 3)
    sure = [[{"effect": "backlash", "presence": 0.9}, {"effect": "stribeck", "presence": 0.3}]] * first.num_rows
    fleet = fleet_of(first.append_column("causes", pa.array(sure)), NAMES)
    (cluster,) = fleet.clusters
    assert cluster[0] == "backlash"
    assert cluster[1] == tuple(f"machine_{k:03d}/slide" for k in range(3))
    assert cluster[2] == pytest.approx(0.9)


def test_correlated_scatter_keeps_the_rate() -> None:
    generator = np.random.default_rng(9)
    left = generator.standard_normal((AXES, 90))
    for day in range(1, 90):
        left[:, day] = 0.7 * left[:, day - 1] + np.sqrt(1.0 - 0.7**2) * left[:, day]
    found = alarms_of(10.0 + 0.1 * left[:, 30:], np.full((AXES, DAYS), 0.05), len(NAMES))
    assert len(NAMES) * len(found) < 1e-3 * AXES * DAYS
