"""Whether a recording fits into memory, said before it is read."""

from __future__ import annotations

from pathlib import Path

from .read import joint_topic
from .source import Source
from .topics import Topics

__all__ = ["available", "needed"]

_COLUMNS = 80
"""Numbers of 8 byte per sample that are in memory at once, from messages to fit, a physical scale: `fric bench long-recordings`
measures it."""
_PACKED = 100  # numerical: a message takes at least a hundredth of that on the disk, so that a small file need not be opened


def available() -> int | None:
    """Memory that is free for a program [byte]; None where the system does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration, ValueError, IndexError):
        return None


def needed(path: Path, topics: Topics, room: int) -> int:
    """Memory that the recording at ``path`` needs when it is identified as a whole [byte]; 0 for one that surely fits.

    Args:
        path: bag folder, or a ``.mcap``, ``.db3`` or ``.bag`` file.
        topics: names of the topics.
        room: memory that there is [byte].

    Raises:
        BagError: it is not a recording, or has no joint states.
    """
    files = [file for file in path.rglob("*") if file.is_file()] if path.is_dir() else [path] if path.is_file() else []
    if sum(file.stat().st_size for file in files) * _PACKED < room:
        return 0
    with Source(path) as source:
        states, _ = joint_topic(source.path, source.topics, topics)
    return states.n_messages * 8 * _COLUMNS
