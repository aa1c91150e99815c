"""A drive with the device profile CiA 402 over CANopen, in torque mode (4, profile torque, or 10, cyclic synchronous torque).

Once per exchange the host sends RPDO1 (controlword and target torque) and SYNC, and the drive answers with TPDO1 (statusword,
position and torque), sampled at the SYNC: the time of the SYNC is the stamp of the reading. Opening writes both mappings and
the heartbeat times, and walks through the state machine of the profile to ``operation enabled``, a fault reset included. Host
and drive watch each other by heartbeat: without the host's the drive takes its torque away itself.

Torque is in thousandths of the rated torque (0x6076), for which the option ``rated_force`` stands in the joint's unit; position
is in increments, of which ``increments`` are one metre or radian of the joint.
Source: CiA 301 v4.2 (heartbeat, PDO mapping); CiA 402-2 v3.0 (statusword and controlword, tables 23 to 30).
"""

from __future__ import annotations

import contextlib
import math
import struct
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .drive import Drive, DriveError, DriveKind, DriveOption, JointReading, Link, Options

if TYPE_CHECKING:
    import canopen

__all__ = ["DRIVE", "Cia402Drive", "state_of"]

_STATES = (
    (0x4F, 0x00, "not ready to switch on"),
    (0x4F, 0x40, "switch on disabled"),
    (0x6F, 0x21, "ready to switch on"),
    (0x6F, 0x23, "switched on"),
    (0x6F, 0x27, "operation enabled"),
    (0x6F, 0x07, "quick stop active"),
    (0x4F, 0x0F, "fault reaction active"),
    (0x4F, 0x08, "fault"),
)
_FAULT_RESET = 0x80
_NEXT = {
    "switch on disabled": 0x06,  # shutdown
    "ready to switch on": 0x07,  # switch on
    "switched on": 0x0F,  # enable operation
    "quick stop active": 0x00,  # disable voltage
    "fault": _FAULT_RESET,  # on a rising edge
}
_ENABLED = "operation enabled"
_ENABLE_OPERATION, _DISABLE_VOLTAGE = 0x0F, 0x00
_PROFILE = 402
_OPERATIONAL = 5
_COMMAND, _REPLY = struct.Struct("<Hh"), struct.Struct("<Hih")
_WALK = 2.0  # physical scale: [s] in which a drive has gone through its state machine
_POLL = 0.005  # physical scale: [s] between two looks at the state machine
_LOOK = 0.05  # numerical: [s] that the bus's thread waits at a time


def state_of(statusword: int) -> str:
    """State of the profile's state machine."""
    return next((name for mask, value, name in _STATES if statusword & mask == value), "unknown")


class Cia402Drive:
    """A CiA 402 drive.

    Args:
        options: see :data:`DRIVE`.
        now: clock of stamps [ns].
    """

    def __init__(self, options: Options, now: Callable[[], int]) -> None:
        self._bus = {"interface": str(options["interface"]), "channel": str(options["channel"])}
        if options["interface"] != "virtual":
            self._bus["bitrate"] = options["bitrate"]  # type: ignore[assignment]
        self._node_id, self._host_id = int(options["node_id"]), int(options["host_id"])
        self._mode = int(options["mode"])
        self._rated, self._increments = float(options["rated_force"]), float(options["increments"])
        self._heartbeat = float(options["heartbeat"])
        self._name = f"drive 'cia402' (node {self._node_id} on {options['channel']})"
        self._now = now
        self._network: canopen.Network | None = None
        self._lock = threading.Lock()
        self._forget()

    def _forget(self) -> None:
        self._reply: tuple[int, int, int, int] | None = None  # stamp [ns], statusword, increments, thousandths
        self._synced = 0
        self._alive = self._answered = 0.0
        self._nmt = -1
        self._emergency = ""
        self._counted: int | None = None
        self._turns = 0

    def open(self) -> None:
        """Connect, configure and enable the drive; it gives no torque yet.

        Raises:
            DriveError: there is no bus or no drive, it has another profile or mode, or doesn't come to be enabled.
        """
        self.close()
        self._forget()
        try:
            import canopen
        except ImportError:
            raise DriveError(self._name, "python-canopen isn't installed", "install it: pip install 'fric[can]'") from None
        network = canopen.Network()
        network.NOTIFIER_CYCLE = _LOOK  # or closing would wait for a second
        try:
            network.connect(**self._bus)
        except Exception as error:  # each interface of python-can has errors of its own
            raise DriveError(self._name, f"no CAN bus ({error})", "look at interface and channel") from None
        self._network = network
        try:
            self._configure(canopen)
            self._walk()
        except (canopen.SdoCommunicationError, canopen.SdoAbortedError, OSError) as error:
            self.close()
            raise DriveError(
                self._name, f"doesn't take its configuration ({error})", "look at node id, cable, supply"
            ) from None
        except DriveError:
            self.close()
            raise

    def _configure(self, canopen: Any) -> None:
        network, node_id = self._network, self._node_id
        assert network is not None
        node = network.add_node(canopen.RemoteNode(node_id, canopen.ObjectDictionary()))
        node.sdo.RESPONSE_TIMEOUT = 0.5
        node.emcy.add_callback(self._on_emergency)
        node.nmt.add_heartbeat_callback(self._on_heartbeat)
        network.subscribe(0x180 + node_id, self._on_reply)
        node.nmt.send_command(0x80)  # pre-operational
        sdo = node.sdo
        profile = int.from_bytes(sdo.upload(0x1000, 0), "little") & 0xFFFF
        if profile != _PROFILE:
            raise DriveError(self._name, f"has the device profile {profile}", "give the node id of a CiA 402 drive")
        time_ms = round(1e3 * self._heartbeat)
        sdo.download(0x1017, 0, struct.pack("<H", time_ms // 2))
        sdo.download(0x1016, 1, struct.pack("<I", self._host_id << 16 | time_ms))
        self._host = network.send_periodic(0x700 + self._host_id, [_OPERATIONAL], 0.4 * self._heartbeat)
        self._map(sdo, 0x1400, 0x200 + node_id, 255, (0x60400010, 0x60710010))
        self._map(sdo, 0x1800, 0x180 + node_id, 1, (0x60410010, 0x60640020, 0x60770010))
        sdo.download(0x6071, 0, struct.pack("<h", 0))
        sdo.download(0x6060, 0, struct.pack("<b", self._mode))
        shown = struct.unpack("<b", sdo.upload(0x6061, 0))[0]
        if shown != self._mode:
            raise DriveError(self._name, f"stays in mode {shown} and not {self._mode}", "choose a mode that it supports")
        node.nmt.send_command(1)  # operational
        self._alive = self._answered = time.monotonic()

    @staticmethod
    def _map(sdo: Any, record: int, identifier: int, kind: int, objects: tuple[int, ...]) -> None:
        """Map ``objects`` into a PDO, in the order that CiA 301 asks for: invalid, empty, map, fill, valid."""
        sdo.download(record, 1, struct.pack("<I", 0x80000000 | identifier))
        sdo.download(record + 0x200, 0, b"\0")
        for at, mapped in enumerate(objects, 1):
            sdo.download(record + 0x200, at, struct.pack("<I", mapped))
        sdo.download(record + 0x200, 0, bytes((len(objects),)))
        sdo.download(record, 2, bytes((kind,)))
        sdo.download(record, 1, struct.pack("<I", identifier))

    def _walk(self) -> None:
        """Go through the state machine to ``operation enabled``."""
        deadline = time.monotonic() + _WALK
        state, control = "unknown", _DISABLE_VOLTAGE
        while state != _ENABLED or self._nmt != _OPERATIONAL:
            if time.monotonic() > deadline:
                stuck = f"stays in state '{state}'{self._emergency}"
                raise DriveError(self._name, stuck, "look at its supply, safe torque off and faults")
            # The reset of a fault is an edge of its bit: the word goes back in between.
            following = _ENABLE_OPERATION if state == _ENABLED else _NEXT.get(state, _DISABLE_VOLTAGE)
            control = following if control != _FAULT_RESET else _DISABLE_VOLTAGE
            self._send(control, 0)
            time.sleep(_POLL)
            with self._lock:
                state = state_of(self._reply[1]) if self._reply is not None else "silent"
        self._emergency = ""
        self._alive = time.monotonic()

    def _send(self, control: int, torque: int) -> None:
        network = self._network
        assert network is not None
        network.send_message(0x200 + self._node_id, _COMMAND.pack(control, torque))
        with self._lock:
            self._synced = self._now()
        network.send_message(0x80, b"")

    # What comes in, on the bus's own thread

    def _on_reply(self, _identifier: int, data: bytes, _timestamp: float) -> None:
        if len(data) == _REPLY.size:
            with self._lock:
                self._reply = (self._synced, *_REPLY.unpack(data))
                self._answered = time.monotonic()

    def _on_heartbeat(self, state: int) -> None:
        self._nmt, self._alive = state, time.monotonic()

    def _on_emergency(self, emergency: Any) -> None:
        if emergency.code:
            self._emergency = f", emergency 0x{emergency.code:04X} {emergency.get_desc()}".rstrip()

    def exchange(self, force: float) -> JointReading | None:
        """Send ``force`` [F], and give the newest reading that hasn't been given yet; None when there is none.

        Raises:
            DriveError: the bus is lost, the drive is silent, has left ``operation enabled``, or ``force`` isn't finite.
        """
        if self._network is None:
            raise DriveError(self._name, "isn't open", "open it first")
        if not math.isfinite(force):
            raise DriveError(self._name, f"the force is {force}", "send a finite force only")
        now = time.monotonic()
        if now - self._alive > self._heartbeat:
            raise DriveError(self._name, f"no heartbeat for {now - self._alive:.3g} s", "look at its supply and the cable")
        if self._nmt != _OPERATIONAL:
            raise DriveError(self._name, f"has left the NMT state operational (now {self._nmt})", "reset the fault")
        with self._lock:
            reply, self._reply = self._reply, None
            silent = now - self._answered
        if silent > self._heartbeat:
            raise DriveError(self._name, f"no answer to SYNC for {silent:.3g} s", "look at its supply and the cable")
        if reply is not None and state_of(reply[1]) != _ENABLED:
            raise DriveError(self._name, f"is in state '{state_of(reply[1])}'{self._emergency}", "reset the fault")
        torque = round(1e3 * force / self._rated)
        try:
            self._send(_ENABLE_OPERATION, min(max(torque, -32767), 32767))
        except Exception as error:  # each interface of python-can has errors of its own
            raise DriveError(self._name, f"the bus is lost ({error})", "plug the interface in again") from None
        return None if reply is None else self._reading(*reply)

    def _reading(self, stamp: int, _status: int, increments: int, thousandths: int) -> JointReading:
        """A reply in the joint's units; the counter of increments may run over."""
        if self._counted is not None and abs(increments - self._counted) > 1 << 31:
            self._turns += 1 if increments < self._counted else -1
        self._counted = increments
        position = (increments + self._turns * (1 << 32)) / self._increments
        return JointReading(stamp, position, effort=1e-3 * thousandths * self._rated)

    def close(self) -> None:
        """Take torque and voltage away, and let go of the bus."""
        network, self._network = self._network, None
        if network is None:
            return
        with contextlib.suppress(Exception):  # whatever is gone already
            network.send_message(0x200 + self._node_id, _COMMAND.pack(_DISABLE_VOLTAGE, 0))
            network.send_message(0, [0x80, self._node_id])
        with contextlib.suppress(Exception):
            self._host.stop()
        with contextlib.suppress(Exception):
            network.disconnect()


def _make(options: Options, now: Callable[[], int], link: Link | None) -> Drive:
    return Cia402Drive(options, now)


DRIVE = DriveKind(
    "cia402",
    "CANopen drive, profile CiA 402, torque mode",
    (
        DriveOption("interface", "socketcan", "interface of python-can"),
        DriveOption("channel", "can0", "channel of the interface"),
        DriveOption("bitrate", 1_000_000, "bits per second", "", 10_000, 1_000_000),
        DriveOption("node_id", 1, "node id of the drive", "", 1, 127),
        DriveOption("host_id", 127, "node id of the host, for its heartbeat", "", 1, 127),
        DriveOption("mode", 10, "4: profile torque, 10: cyclic synchronous torque", "", 4, 10),
        DriveOption("rated_force", 1.0, "force or torque of the joint at the drive's rated torque", "N or N m", 1e-9, 1e9),
        DriveOption("increments", 1.0, "increments of the position per unit of the joint", "1/m or 1/rad", 1e-9, 1e15),
        DriveOption("heartbeat", 0.1, "without a heartbeat for so long drive or host is lost", "s", 0.01, 10.0),
    ),
    _make,
)
