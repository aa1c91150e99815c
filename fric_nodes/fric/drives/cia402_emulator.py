"""A CiA 402 drive on a CAN bus, simulated: what the drive's firmware would do, for tests and trials."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from ..axis import SimulatedAxis

if TYPE_CHECKING:
    import canopen

__all__ = ["Cia402Emulator"]

_U8, _U16, _U32, _I8, _I16, _I32 = 0x5, 0x6, 0x7, 0x2, 0x3, 0x4  # data types of CiA 301
_OBJECTS: tuple[tuple[int, int, int, int], ...] = (  # index, subindex (-1: a plain variable), type, value
    (0x1000, -1, _U32, 0x00020192), (0x1001, -1, _U8, 0), (0x1017, -1, _U16, 0), (0x1016, 0, _U8, 1), (0x1016, 1, _U32, 0),
    (0x1400, 0, _U8, 2), (0x1400, 1, _U32, 0x80000000), (0x1400, 2, _U8, 255),
    (0x1600, 0, _U8, 0), *((0x1600, k, _U32, 0) for k in range(1, 5)),
    (0x1800, 0, _U8, 2), (0x1800, 1, _U32, 0x80000000), (0x1800, 2, _U8, 255),
    (0x1A00, 0, _U8, 0), *((0x1A00, k, _U32, 0) for k in range(1, 5)),
    (0x6040, -1, _U16, 0), (0x6041, -1, _U16, 0), (0x6060, -1, _I8, 0), (0x6061, -1, _I8, 0),
    (0x6064, -1, _I32, 0), (0x6071, -1, _I16, 0), (0x6077, -1, _I16, 0),
)  # fmt: skip
_WORDS = {
    "switch on disabled": 0x40, "ready to switch on": 0x21, "switched on": 0x23, "operation enabled": 0x27, "fault": 0x08,
}  # fmt: skip
_STEPS = {  # (state, masked command) -> state
    ("switch on disabled", 0x06): "ready to switch on",
    ("ready to switch on", 0x07): "switched on",
    ("switched on", 0x0F): "operation enabled",
}
_HEARTBEAT_LOST = 0x8130


class Cia402Emulator:
    """A drive of its own on a bus.

    Args:
        axis: that it moves.
        channel: of python-can's virtual bus.
        rated_force: force at the rated torque [F].
        increments: per unit of position.
        node_id: of the drive.
        now: clock [ns].

    Attributes:
        state: of the profile's state machine.
        path: states gone through.
        force: given now [F].
        modes: that the drive supports.
        silent: it says and hears nothing any more.
    """

    def __init__(
        self, axis: SimulatedAxis, channel: str, rated_force: float, increments: float, node_id: int = 1,
        now: Callable[[], int] = time.monotonic_ns,
    ) -> None:  # fmt: skip
        import canopen

        self.axis = axis
        self.state, self.path = "switch on disabled", ["switch on disabled"]
        self.force = 0.0
        self.modes = {4, 10}
        self.silent = False
        self._rated, self._increments, self._now = rated_force, increments, now
        self._target = self._control = 0
        self._moved = now()
        self._host_heard = 0.0
        self._network = canopen.Network()
        self._network.NOTIFIER_CYCLE = 0.05  # numerical: [s] that closing may take
        self._network.connect(interface="virtual", channel=channel)
        self.node: canopen.LocalNode = canopen.LocalNode(node_id, _dictionary())
        self._network.add_node(self.node)
        self.node.add_read_callback(self._on_read)
        self.node.add_write_callback(self._on_write)
        self._network.subscribe(0x200 + node_id, self._on_command)
        self._network.subscribe(0x80, self._on_sync)
        for host in range(1, 128):
            if host != node_id:
                self._network.subscribe(0x700 + host, self._on_host)
        self.node.nmt.state = "PRE-OPERATIONAL"

    def fail(self, code: int) -> None:
        """Go into the state ``fault`` with an emergency message."""
        self._enter("fault")
        self._target = 0
        self.node.emcy.send(code, 1)

    def _enter(self, state: str) -> None:
        self.state = state
        self.path.append(state)

    def _on_read(self, index: int, subindex: int, od: object) -> int | None:
        if index == 0x6041:
            return _WORDS[self.state]
        return None

    def _on_write(self, index: int, subindex: int, od: object, data: bytes) -> None:
        if index == 0x6060 and data[0] in self.modes:
            self.node.data_store.setdefault(0x6061, {})[0] = bytes(data)

    def _on_host(self, identifier: int, data: bytes, timestamp: float) -> None:
        self._host_heard = time.monotonic()

    def _on_command(self, identifier: int, data: bytes, timestamp: float) -> None:
        if self.silent or self.node.nmt.state != "OPERATIONAL":
            return
        control, self._target = struct.unpack("<Hh", data)
        if self.state == "fault":
            if control & 0x80 and not self._control & 0x80:
                self._enter("switch on disabled")
        elif not control & 0x02 and self.state != "switch on disabled":
            self._enter("switch on disabled")
        else:
            step = _STEPS.get((self.state, control & 0x0F))
            if step is not None:
                self._enter(step)
        self._control = control

    def _on_sync(self, identifier: int, data: bytes, timestamp: float) -> None:
        if self.silent or self.node.nmt.state != "OPERATIONAL":
            return
        self.poll()
        state = self.axis.measure()
        increments = round(state.position * self._increments)
        wrapped = (increments + (1 << 31)) % (1 << 32) - (1 << 31)
        torque = round(1e3 * self.force / self._rated)
        self._network.send_message(0x180 + self.node.id, struct.pack("<Hih", _WORDS[self.state], wrapped, torque))

    def poll(self) -> None:
        """Move the axis to the present, and watch the host's heartbeat."""
        now = self._now()
        self.axis.advance(self.force, (now - self._moved) * 1e-9)
        self._moved = now
        limit = struct.unpack("<I", self.node.get_data(0x1016, 1))[0] & 0xFFFF
        if limit and self.state == "operation enabled" and time.monotonic() - self._host_heard > 1e-3 * limit:
            self.fail(_HEARTBEAT_LOST)
        self.force = 1e-3 * self._target * self._rated if self.state == "operation enabled" else 0.0

    def close(self) -> None:
        """Leave the bus."""
        self.node.nmt.stop_heartbeat()
        self._network.disconnect()


def _dictionary() -> canopen.ObjectDictionary:
    import canopen
    from canopen.objectdictionary import ODRecord, ODVariable

    made = canopen.ObjectDictionary()
    for index, subindex, kind, value in _OBJECTS:
        variable = ODVariable(f"{index:04X}.{max(subindex, 0)}", index, max(subindex, 0))
        variable.data_type, variable.default, variable.access_type = kind, value, "rw"
        if subindex < 0:
            made.add_object(variable)
            continue
        if index not in made:
            made.add_object(ODRecord(f"{index:04X}", index))
        record = made[index]
        assert isinstance(record, ODRecord)
        record.add_member(variable)
    return made
