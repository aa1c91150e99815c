"""CiA 402 against a simulated drive on a virtual bus: state machine, torque, faults, heartbeats both ways."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterator

import pytest
from fric.axis import SimulatedAxis
from fric.drives import DRIVES, DriveError, JointReading
from fric.drives.cia402 import Cia402Drive, state_of
from fric.drives.cia402_emulator import Cia402Emulator
from fric.drives.drive import checked_options
from fric.model import build_model, term

pytest.importorskip("canopen", reason="the drive 'cia402' needs the extra 'can'")
RATED, INCREMENTS = 50.0, 1e7
HEARTBEAT = 0.25  # [s]
CHANNELS = (f"fric-{k}" for k in itertools.count())


class Bench:
    def __init__(self, **options: float | int | str) -> None:
        channel = next(CHANNELS)
        self.axis = SimulatedAxis(build_model("rigid", {"mass": 2.0}, [term("viscous", coefficient=35.0)]))
        self.emulator = Cia402Emulator(self.axis, channel, RATED, INCREMENTS)
        given = {
            "interface": "virtual", "channel": channel, "rated_force": RATED, "increments": INCREMENTS, "heartbeat": HEARTBEAT,
        }  # fmt: skip
        self.drive = Cia402Drive(checked_options(DRIVES["cia402"], given | options), time.monotonic_ns)

    def run(self, seconds: float, force: float, until: Callable[[], bool] = lambda: False) -> list[JointReading]:
        readings, end = [], time.monotonic() + seconds
        while time.monotonic() < end and not until():
            reading = self.drive.exchange(force)
            if reading is not None:
                readings.append(reading)
            time.sleep(0.002)
        return readings


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.drive.close()
    made.emulator.close()


def test_statuswords_are_those_of_the_profile() -> None:
    assert state_of(0x0250) == "switch on disabled"
    assert state_of(0x0231) == "ready to switch on"
    assert state_of(0x0233) == "switched on"
    assert state_of(0x0237) == "operation enabled"
    assert state_of(0x0217) == "quick stop active"
    assert state_of(0x021F) == "fault reaction active"
    assert state_of(0x0218) == "fault"
    assert state_of(0x0200) == "not ready to switch on"


def test_opening_walks_through_the_state_machine_and_gives_no_torque(bench: Bench) -> None:
    bench.drive.open()
    assert bench.emulator.path == ["switch on disabled", "ready to switch on", "switched on", "operation enabled"]
    assert bench.emulator.force == 0.0
    store = bench.emulator.node.data_store
    assert store[0x1600][1] == (0x60400010).to_bytes(4, "little")
    assert store[0x1A00][0] == b"\x03"
    assert store[0x1800][2] == b"\x01"
    bench.drive.close()
    bench.emulator.poll()
    assert bench.emulator.state in {"switch on disabled", "operation enabled"}  # the message may still be under way
    time.sleep(0.1)
    assert bench.emulator.state == "switch on disabled"


def test_torque_and_position_are_in_the_joint_s_units(bench: Bench) -> None:
    bench.drive.open()
    readings = bench.run(0.6, 7.0)
    assert bench.emulator.force == pytest.approx(7.0)
    assert readings[-1].effort == pytest.approx(7.0)
    assert readings[-1].position == pytest.approx(bench.axis.position, abs=0.2 * 0.05)
    assert readings[-1].position > 0.02
    stamps = [reading.stamp for reading in readings]
    assert stamps == sorted(set(stamps))


def test_the_counter_may_run_over() -> None:
    drive = Cia402Drive(checked_options(DRIVES["cia402"], {"increments": 1000.0}), time.monotonic_ns)
    top = (1 << 31) - 10
    places = [drive._reading(0, 0, count, 0).position for count in (top, top + 9, -(1 << 31) + 5, top, -(1 << 31))]
    assert places == pytest.approx([0.001 * (top + more) for more in (0, 9, 15, 0, 10)])


def test_a_fault_of_the_drive_is_named_and_opening_again_resets_it(bench: Bench) -> None:
    bench.drive.open()
    bench.run(0.05, 5.0)
    bench.emulator.fail(0x2310)
    with pytest.raises(DriveError, match="state 'fault', emergency 0x2310") as caught:
        bench.run(1.0, 5.0)
    assert "\n" not in str(caught.value)
    bench.emulator.poll()
    assert bench.emulator.force == 0.0
    bench.drive.close()
    bench.drive.open()
    assert bench.emulator.state == "operation enabled"
    assert bench.run(0.1, 1.0)


def test_a_drive_that_dies_is_found_out_within_its_heartbeat(bench: Bench) -> None:
    bench.drive.open()
    bench.run(0.1, 2.0)
    bench.emulator.silent = True
    bench.emulator.node.nmt.stop_heartbeat()
    begin = time.monotonic()
    with pytest.raises(DriveError, match=r"no heartbeat for|no answer to SYNC for"):
        bench.run(5.0, 2.0)
    assert time.monotonic() - begin < 2.0 * HEARTBEAT


def test_without_the_host_the_drive_stops_by_itself(bench: Bench) -> None:
    bench.drive.open()
    bench.run(0.1, 5.0)
    assert bench.emulator.force == 5.0
    bench.drive._host.stop()
    end = time.monotonic() + 5.0
    while bench.emulator.state != "fault" and time.monotonic() < end:
        time.sleep(0.01)
        bench.emulator.poll()
    assert bench.emulator.state == "fault"
    assert bench.emulator.force == 0.0


def test_a_mode_that_the_drive_has_not_is_said(bench: Bench) -> None:
    bench.emulator.modes = {8}
    with pytest.raises(DriveError, match="stays in mode 0 and not 10"):
        bench.drive.open()


def test_no_drive_and_no_bus_are_one_line() -> None:
    empty = Cia402Drive(checked_options(DRIVES["cia402"], {"interface": "virtual", "channel": next(CHANNELS)}), time.time_ns)
    with pytest.raises(DriveError, match="doesn't take its configuration"):
        empty.open()
    nowhere = Cia402Drive(checked_options(DRIVES["cia402"], {"channel": "no-such-bus"}), time.time_ns)
    with pytest.raises(DriveError, match="no CAN bus"):
        nowhere.open()


@pytest.mark.parametrize("force", [math.nan, math.inf])
def test_no_force_that_is_not_finite_leaves_the_host(bench: Bench, force: float) -> None:
    bench.drive.open()
    with pytest.raises(DriveError, match="finite"):
        bench.drive.exchange(force)
