"""Is the installation in order: versions, cache, compiler, the interfaces, and a message through the middleware and back."""

from __future__ import annotations

import importlib
import os
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Literal

__all__ = ["Item", "examine"]

State = Literal["ok", "warning", "fault"]

_PACKAGES = ("numpy", "scipy", "numba", "rosbags", "plotly", "pyarrow")


@dataclass(frozen=True)
class Item:
    """One thing that was looked at: its name, state, what was found, and what to do."""

    name: str
    state: State
    detail: str
    remedy: str = ""


def examine() -> list[Item]:
    """Everything, in the order in which one thing needs the other; nothing is raised."""
    looked: list[Callable[[], Item]] = [_versions, _cache, _compiler, _configuration]
    found = [_guarded(look) for look in looked]
    ros = _guarded(_ros)
    found.append(ros)
    if ros.state == "ok":
        found += [_guarded(_interfaces), _guarded(_round_trip)]
    return found


def _guarded(look: Callable[[], Item]) -> Item:
    try:
        return look()
    except Exception as error:  # whatever is broken is what was asked for
        return Item(
            look.__name__.lstrip("_").replace("_", " "), "fault", f"{type(error).__name__}: {error}", "install fric again"
        )


def _versions() -> Item:
    from fric import __version__

    parts = [f"fric {__version__}", f"Python {platform.python_version()}"]
    missing = []
    for name in _PACKAGES:
        try:
            parts.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            missing.append(name)
    if missing:
        return Item("versions", "fault", f"missing: {', '.join(missing)}", f"pip install {' '.join(missing)}")
    return Item("versions", "ok", f"{', '.join(parts)} on {sys.platform} {platform.machine()}")


def _cache() -> Item:
    from fric.engine.compile import cache_folder

    folder, kept = cache_folder()
    if not kept:
        detail = f"no folder for compiled models can be written: they go to {folder}, for this process only"
        return Item("cache", "warning", detail, "set FRIC_CACHE_DIR to a folder that can be written")
    free = os.statvfs(folder).f_bavail * os.statvfs(folder).f_frsize if hasattr(os, "statvfs") else 1 << 40
    if free < 50_000_000:
        return Item("cache", "warning", f"{folder} has {free / 1e6:.0f} MB left", "free space, or set FRIC_CACHE_DIR")
    return Item("cache", "ok", f"compiled models are kept in {folder}")


def _compiler() -> Item:
    import numpy as np
    from fric.model import build_model, term
    from fric.simulation import simulate

    started = time.perf_counter()
    model = build_model("rigid", {"mass": 2.0}, [term("viscous", coefficient=4.0)])
    moved = simulate(model, np.full(2001, 8.0), 1e-3)
    took = time.perf_counter() - started
    # m dv/dt = u - c v from rest: v = u/c (1 - exp(-c t/m)), after 2 s.
    expected = 2.0 * (1.0 - np.exp(-4.0))
    if abs(float(moved.velocity[-1]) - expected) > 1e-6:
        detail = f"a compiled model gives {moved.velocity[-1]:.9g} m/s where {expected:.9g} m/s is right"
        return Item("compiler", "fault", detail, "empty the cache folder, and install numba and llvmlite of matching versions")
    return Item("compiler", "ok", f"a model compiles and moves as it should ({took:.2g} s)")


def _configuration() -> Item:
    from fric.model_file import read_model
    from fric.shared_files import config_file

    path = config_file("demo_axis.yaml")
    read_model(path)
    return Item("configuration", "ok", f"found in {path.parent}")


def _ros() -> Item:
    rclpy = importlib.import_module("rclpy")
    implementation = rclpy.get_rmw_implementation_identifier()
    distribution = os.environ.get("ROS_DISTRO", "from the packages of this environment")
    return Item("ROS 2", "ok", f"rclpy with {implementation}, distribution {distribution}")


def _interfaces() -> Item:
    try:
        messages = importlib.import_module("fric_interfaces.msg")
    except ImportError as error:
        return Item(
            "interfaces", "fault", f"fric_interfaces can't be imported: {error}", "build it: pip install . or colcon build"
        )
    messages.StampedForce()
    return Item("interfaces", "ok", "fric_interfaces is built and can be used")


def _round_trip() -> Item:
    return round_trip_item(importlib.import_module("fric_nodes.round_trip").round_trip())


def round_trip_item(seconds: float | None) -> Item:
    """What a round trip through the middleware says; None: nothing came back."""
    if seconds is None:
        remedy = "allow UDP on the loopback interface, or set ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST and ROS_DOMAIN_ID"
        return Item("middleware", "fault", "a message did not come back within 10 s", remedy)
    return Item("middleware", "ok", f"messages come through, in {1e3 * seconds:.2g} ms (median of 20)")
