"""Options of a verb as ROS parameters of the node behind it."""

from __future__ import annotations

import json
from collections.abc import Mapping

__all__ = ["ros_arguments"]


def ros_arguments(program: str, values: Mapping[str, object], topics: list[str] | None) -> list[str]:
    """Command line of a node: ``program --ros-args -p name:=value ...``.

    Args:
        program: first entry, which ROS skips.
        values: parameters by name.
        topics: names of topics; None or empty leaves the node's own choice.
    """
    # Quoted as YAML does, so that a bag called 2024 stays a text.
    texts = {name: json.dumps(value if isinstance(value, (bool, int, float)) else str(value)) for name, value in values.items()}
    if topics:
        texts["topics"] = json.dumps(topics)
    return [program, "--ros-args", *(item for name, text in texts.items() for item in ("-p", f"{name}:={text}"))]
