"""Publishes a recording into the running graph: the same bytes, in the same order, at the recording's own pace or another."""

from __future__ import annotations

import threading
from functools import partial
from pathlib import Path
from typing import Any

from builtin_interfaces.msg import Time
from fric.bagio.playback import Due, Pace, schedule
from fric.bagio.read import iterate_raw
from fric.errors import InputError
from rosgraph_msgs.msg import Clock

from ..bag_publishers import BagPublishers
from ..base import FricNode
from ..parameters import NodeParameter, NodeParameterError
from ..run import run

__all__ = ["PARAMETERS", "PlayerNode", "main"]

_BURST = 16  # messages published at once when there is no pace to keep; small against the queues of subscribers
PARAMETERS = (
    NodeParameter("bag", "", "bag to play: a rosbag2 folder, or a .mcap or .db3 file"),
    NodeParameter("rate", 1.0, "speed relative to the recording; 0: without a pace, limited by pause", lower=0.0, upper=1000.0),
    NodeParameter("start", 0.0, "leave out what comes before this time of the recording", unit="s", lower=0.0),
    NodeParameter("end", 0.0, "leave out what comes after this time of the recording; 0: nothing", unit="s", lower=0.0),
    NodeParameter("loop", False, "begin again at the end, until stopped", settable=True),
    NodeParameter("topics", [""], "topics to play; empty: all"),
    NodeParameter("clock", False, "publish the time of the recording on /clock"),
    NodeParameter("time_source", "log", "pace by time of reception, or by the messages' own stamps", choices=("log", "stamp")),
    NodeParameter("wait_for_subscribers", 0, "subscriptions, over all topics, to wait for before playing", lower=0, upper=1000),
    NodeParameter("wait_timeout", 10.0, "longest time to wait for them", unit="s", lower=0.0),
    NodeParameter("pause", 0.002, f"rest after every {_BURST} messages when rate is 0", unit="s", lower=0.0, upper=1.0),
)
_CLOCK_TICK = 0.01  # [s] of the recording between two messages on /clock


class PlayerNode(FricNode):
    """Publishes the messages of a bag; nothing happens before :meth:`play`.

    Raises:
        BagError: not a bag, damaged beyond use, or without a topic that was asked for.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__("player", PARAMETERS, **node_options)
        settings = self.settings
        if not settings.text("bag"):
            raise NodeParameterError("parameter 'bag' of the player", "is missing", "name the bag to play")
        self._bag = Path(settings.text("bag"))
        self.stop = threading.Event()  # set it to end the playing early
        self.published = 0  # messages so far
        self._time = self.create_publisher(Clock, "/clock", 10) if settings.flag("clock") else None
        self._thread: threading.Thread | None = None
        self._refusal: InputError | None = None
        self._publishers_of_bag = BagPublishers(self, self._bag, settings.texts("topics"))

    def begin(self) -> None:
        """Play in a thread of its own, so that the pace doesn't depend on what the executor has to do."""

        def work() -> None:
            try:
                self.play()
            except InputError as error:
                self._refusal = error

        self._thread = threading.Thread(target=work, name="play")
        self._thread.start()

    @property
    def done(self) -> bool:
        """True when the playing that was begun has ended."""
        return self._thread is not None and not self._thread.is_alive()

    def close(self) -> None:
        """End the playing.

        Raises:
            InputError: what kept it from being played.
        """
        self.stop.set()
        if self._thread is not None:
            self._thread.join()
        if self._refusal is not None:
            raise self._refusal

    def play(self) -> bool:
        """Publish the recording, as often as was asked for; True when it was published to its end.

        Raises:
            BagError: the bag turns out to be damaged on the way.
            NoSubscribersError: nobody subscribed in time.
        """
        settings, publishers = self.settings, self._publishers_of_bag
        publishers.wait_for(settings.integer("wait_for_subscribers"), settings.number("wait_timeout"), self.stop)
        rate, end = settings.number("rate"), settings.number("end")
        by_stamp = settings.text("time_source") == "stamp"
        while True:
            pace = Pace(rate, self.stop) if rate > 0 else None
            messages = schedule(
                iterate_raw(self._bag, publishers.names),
                stamped=publishers.stamped if by_stamp else (),
                start=settings.number("start"),
                end=end if end > 0 else None,
                tick=_CLOCK_TICK if self._time else None,
            )
            for due in messages:
                if not (pace.wait(due.time_ns) if pace else self._throttle()):
                    return False
                self._publish(due)
            late = f", at most {pace.worst_delay * 1e3:.1f} ms late" if pace else ""
            self.get_logger().info(f"played {self.published} messages{late}")
            if not settings.flag("loop"):
                publishers.settle()
                return True
            self.published = 0

    def _publish(self, due: Due) -> None:
        if due.message is not None:
            self._publishers_of_bag.publish(due.message)
            self.published += 1
            self._progress()
        elif self._time is not None:
            seconds, nanoseconds = divmod(due.time_ns, 1_000_000_000)
            self._time.publish(Clock(clock=Time(sec=seconds, nanosec=nanoseconds)))

    def _progress(self) -> None:
        total = self._publishers_of_bag.total
        if total and self.published * 10 // total != (self.published - 1) * 10 // total:
            self.get_logger().info(f"{100 * self.published // total} % ({self.published} of {total} messages)")

    def _throttle(self) -> bool:
        """Without a pace to keep, rest after every burst, so that subscribers can empty their queues; False when told to stop.

        Waiting for acknowledgements instead would be slower and no safer: they say that a message is in the subscriber's queue,
        not that it was taken out, and the middleware may ask for them as seldom as every 3 s.
        """
        if self.published % _BURST == 0 and self.published:
            return not self.stop.wait(self.settings.number("pause"))
        return not self.stop.is_set()


main = partial(run, PlayerNode)
"""Play a bag to its end; exit status 0 also when stopped by a signal, 2 when the bag cannot be played."""


if __name__ == "__main__":
    main()
