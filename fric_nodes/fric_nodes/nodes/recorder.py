"""Records topics of the running graph into a rosbag2 bag, whatever their types, without decoding them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from fric.bagio.write import BagWriter

from ..base import FricNode
from ..parameters import NodeParameter, NodeParameterError
from ..recording import Recording
from ..run import run

__all__ = ["DEFAULT_TOPICS", "PARAMETERS", "RecorderNode", "main"]

DEFAULT_TOPICS = (
    "joint_states",
    "force_command",
    "reference",
    "feedforward_force",
    "normal_load",
    "temperature",
    "friction/model",
    "friction/estimate",
    "friction/mismatch",
    "/diagnostics",  # one for the whole graph, whatever the namespace
)
PARAMETERS = (
    NodeParameter("bag", "", "folder of the bag to write; must not exist"),
    NodeParameter("storage", "mcap", "storage format of the bag", choices=("mcap", "sqlite3")),
    NodeParameter("compression", "none", "compression of chunks (mcap) or messages (sqlite3)", choices=("none", "zstd")),
    NodeParameter("topics", list(DEFAULT_TOPICS), "names of the topics, relative ones in the node's namespace"),
    NodeParameter("all_topics", False, "record every topic that is not hidden"),
    NodeParameter("log_time", "receive", "log times: of reception, or the messages' stamps", choices=("receive", "stamp")),
    NodeParameter("joint", "axis", "name of the joint, for those who read the bag"),
    NodeParameter("position_unit", "m", "unit of positions, for those who read the bag"),
    NodeParameter("force_unit", "N", "unit of efforts, for those who read the bag"),
    NodeParameter("effort_hold", "preceding", "when an effort acts", choices=("following", "preceding", "linear", "unknown")),
    NodeParameter("queue_depth", 5000, "messages that may wait on each topic between two rounds", lower=1, upper=1_000_000),
    NodeParameter("drain_period", 0.02, "time between two rounds of taking messages", unit="s", lower=0.001, upper=1.0),
)
_LOOK = 0.05  # [s] between two looks at which topics there are
_REPORT = 1.0  # [s] between two reports


class RecorderNode(FricNode):
    """Writes what is published on its topics into a bag, from its construction to :meth:`close`.

    Raises:
        WriteError: the bag exists already or cannot be written.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("recorder", PARAMETERS, **node_options)
        settings = self.settings
        if not settings.text("bag"):
            raise NodeParameterError("parameter 'bag' of the recorder", "is missing", "name the folder to record into")
        bag = Path(settings.text("bag"))
        storage: Any = settings.text("storage")
        compression: Any = settings.text("compression")
        stored = ("joint", "position_unit", "force_unit", "effort_hold", "log_time")
        metadata = {f"fric.{name}": settings.text(name) for name in stored}
        writer = BagWriter(bag, storage=storage, compression=compression, metadata=metadata)
        wanted = {self.resolve_topic_name(name) for name in settings.texts("topics") or DEFAULT_TOPICS}
        self._recording = Recording(
            self, writer, None if settings.flag("all_topics") else wanted, settings.integer("queue_depth"),
            settings.text("log_time") == "stamp",
        )  # fmt: skip
        self._written_before = 0
        self.create_timer(settings.number("drain_period"), self.drain, clock=self.steady)
        self.create_timer(_LOOK, self.discover, clock=self.steady)
        self.report_every(_REPORT)
        self.get_logger().info(f"recording into {bag}")

    def discover(self) -> None:
        """Subscribe to every wanted topic whose type has become known, and follow a change of its quality of service."""
        self._recording.discover()

    def drain(self) -> None:
        """Take what the middleware has received on all topics, and write what is complete."""
        self._recording.drain()

    @property
    def written(self) -> Counter[str]:
        """Messages written so far, by topic."""
        return Counter({topic.name: topic.written for topic in self._recording.topics})

    def condition(self) -> Mapping[str, object]:
        """Counts, rate and losses."""
        written, before = self._recording.written, self._written_before
        self._written_before = written
        values: dict[str, object] = {"written": written, "rate [1/s]": written - before, "lost": self._recording.lost}
        for topic in self._recording.topics:
            values[topic.name] = f"{topic.received} received, {topic.repeated} repeated, {topic.lost} lost"
        return values

    def verdict(self, troubles: Sequence[str]) -> tuple[bytes, str]:
        """A warning once a message was lost."""
        lost = self._recording.lost
        return (DiagnosticStatus.WARN, f"{lost} messages lost") if lost else (DiagnosticStatus.OK, "no message lost")

    def close(self) -> None:
        """Take what is still in the queues, write it all and close the bag."""
        self._recording.close()
        self.get_logger().info(f"recorded {self._recording.written} messages, {self._recording.lost} lost")


main = partial(run, RecorderNode)
"""Record until SIGINT or SIGTERM, then close the bag; exit status 2 when the bag cannot be written."""


if __name__ == "__main__":
    main()
