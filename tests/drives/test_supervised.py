"""A supervised drive on the serial emulator: unplugging stops, plugging in reconnects, and nothing moves before a reset."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from fric.axis import SimulatedAxis
from fric.control.safety import Limits, SafetyLayer, State
from fric.drives.serial import SerialDrive
from fric.drives.serial_emulator import SerialEmulator
from fric.drives.supervised import SupervisedDrive
from fric.model import build_model, term

H = 2_000_000  # [ns]
LIMITS = Limits(50.0, 2000.0, speed=0.5, inertia_min=1.6, inertia_max=2.4, friction=25.0, position_noise=1e-7)


class Machine:
    def __init__(self, port: Path) -> None:
        self.now = 10**18
        model = build_model("rigid", {"mass": 2.0}, [term("coulomb", force=5.0), term("viscous", coefficient=35.0)])
        self.emulator = SerialEmulator(SimulatedAxis(model), port, lambda: self.now)
        self.layer = SafetyLayer(LIMITS)
        drive = SerialDrive(str(port), 921_600, 0.05, lambda: self.now)
        self.supervised = SupervisedDrive(drive, self.layer, autostart=True)

    def run(self, seconds: float, force: float = 0.0) -> int:
        """Go on for so long; number of readings."""
        found = 0
        for _ in range(round(1e9 * seconds / H)):
            self.now += H
            self.layer.command(self.now, self.now, force)
            found += self.supervised.tick(self.now) is not None
            self.emulator.poll()
        return found


@pytest.fixture
def machine(tmp_path: Path) -> Iterator[Machine]:
    made = Machine(tmp_path / "drive")
    yield made
    made.supervised.close()
    made.emulator.close()


def test_it_waits_for_its_drive_and_starts_once(machine: Machine) -> None:
    assert machine.run(1.0, 10.0) == 0
    assert "can't be opened" in machine.supervised.trouble
    assert machine.layer.state is State.DISABLED
    assert not machine.layer.faults
    machine.emulator.plug()
    machine.run(0.5, 10.0)
    assert machine.layer.state is State.ENABLED
    assert machine.emulator.force == 10.0
    machine.layer.disable(machine.now)
    machine.run(1.0, 10.0)
    assert machine.layer.state is State.DISABLED
    assert machine.emulator.force == 0.0


def test_whoever_disables_it_before_it_starts_has_it_stay_disabled(machine: Machine) -> None:
    machine.run(0.1, 10.0)
    machine.supervised.disable(machine.now)
    machine.emulator.plug()
    assert machine.run(0.5, 10.0) > 0
    assert machine.layer.state is State.DISABLED
    machine.supervised.enable(machine.now)
    machine.run(0.5, 10.0)
    assert machine.emulator.force == 10.0


def test_unplugged_it_stops_and_is_back_within_a_second_but_gives_no_force(machine: Machine) -> None:
    machine.emulator.plug()
    machine.run(0.5, 15.0)
    assert machine.emulator.force == 15.0
    machine.emulator.unplug()
    machine.run(0.3, 15.0)
    assert machine.layer.cause.startswith("drive (")
    assert machine.emulator.force == 0.0
    machine.emulator.plug()
    assert machine.run(1.0, 15.0) > 350  # of 500: back within 0.3 s
    assert machine.layer.counters["drive opened"] == 2
    assert machine.emulator.force == 0.0
    assert machine.layer.state is State.FAULT
    machine.layer.reset(machine.now)
    machine.run(0.1, 15.0)
    machine.layer.enable(machine.now)
    machine.run(0.1, 15.0)
    assert machine.emulator.force == 15.0
