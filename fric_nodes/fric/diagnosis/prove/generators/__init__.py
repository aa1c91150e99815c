"""Truth by other hands: generators that write the same physics anew, each in another way."""

from __future__ import annotations

from .events import EVENTS
from .generator import Generator
from .mujoco_axis import MUJOCO

__all__ = ["GENERATORS"]

GENERATORS: dict[str, Generator] = {each.name: each for each in (MUJOCO, EVENTS)}
"""By the name of the variant of the examination."""
