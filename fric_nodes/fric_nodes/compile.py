"""From a model's structure to compiled loops, fused for its terms and cached on disk.

The structure of a model (which plant, which effects, in which order) is written out as a small Python module that calls the
effects' own compiled functions and holds the text of the plant's step and of the loops; numba compiles that module as a
whole: the terms are inlined into one step, parameters stay data. (Passing the functions as arguments instead would be
shorter, but numba does not cache a function that takes functions.) The module is stored under a name that holds a hash of
everything it is made from, so that a second start finds the machine code on disk and a changed equation is never served
from an old cache.

The cache lives in ``$FRIC_CACHE_DIR``, or ``fric`` in the user's cache folder, or, where neither can be written, in a
temporary folder for this process.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib.util
import inspect
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numba
import numpy as np

from . import loops
from .effect import Effect
from .kernel import kernel
from .plant import Plant

__all__ = ["Loops", "loops_for"]


_LOOPS = (loops.simulate, loops.predict, loops.observe)


@dataclass(frozen=True)
class Loops:
    """Compiled loops of one model structure; arguments as in :mod:`fric_nodes.loops`.

    Attributes:
        simulate: motion from force.
        predict: force from motion.
        observe: one-step prediction along measured positions.
        n_friction_states: number of states of the slip dynamics.
    """

    simulate: Callable[..., None]
    predict: Callable[..., None]
    observe: Callable[..., None]
    n_friction_states: int


def loops_for(plant: Plant, effects: Sequence[Effect]) -> Loops:
    """The compiled loops for ``plant`` with ``effects`` in this order."""
    return _loops_for(plant, tuple(effects))


@lru_cache(maxsize=256)
def _loops_for(plant: Plant, effects: tuple[Effect, ...]) -> Loops:
    source = _source(plant, effects)
    module = _import(source, _fingerprint(effects, source))
    n_states = sum(effect.n_states for effect in effects)
    sizes = len(plant.states), 2 * n_states
    return Loops(
        _with_work_space(module.simulate, sizes),
        _with_work_space(module.predict, sizes),
        _with_work_space(module.observe, sizes),
        n_states,
    )


def _with_work_space(loop: Callable[..., None], sizes: tuple[int, int]) -> Callable[..., None]:
    """``loop`` with ``x_next`` and ``z_next``, its last arguments, made anew for each call, so that threads don't meet."""

    def call(*arguments: object) -> None:
        loop(*arguments, np.empty(sizes[0]), np.empty(sizes[1]))

    return call


def _source(plant: Plant, effects: tuple[Effect, ...]) -> str:
    """Text of the module that binds the structure's functions together."""
    imports = [
        "from typing import Any",
        "from fric_nodes.effect import Context",
        "from fric_nodes.kernel import kernel, loop",
    ]
    level, force, slip = ["    total = 0.0"], ["    total = 0.0"], ["    return 0.0"]
    at = len(plant.parameters)
    state = 0
    for number, effect in enumerate(effects):
        values = "".join(f", p[{at + k}]" for k in range(len(effect.parameters)))
        at += len(effect.parameters)
        for role in ("level", "force", "slip"):
            function = getattr(effect, role)
            if function is not None:
                imports.append(f"from {function.__module__} import {function.__name__} as {role}_{number}")
        if effect.level is not None:
            level.append(f"    total = level_{number}(c, total{values})")
        if effect.force is not None:
            force.append(f"    total += force_{number}(c{values})")
        if effect.slip is not None:
            slip = [f"    return slip_{number}(z, z_next, {state}, v, h, level{values})"]
            state += effect.n_states
    lines = [
        f'"""Assembled for: {plant.id} | {", ".join(effect.key for effect in effects) or "no terms"}."""',
        *imports,
        f"RIGID = {all(effect.slip is None for effect in effects)}",
        "@kernel\ndef unpacked(p):",
        f"    return ({''.join(f'p[{k}], ' for k in range(at))})",
        "@kernel\ndef level_sum(c, p):",
        *level,
        "    return total",
        "@kernel\ndef level(c, p):",
        "    return max(level_sum(c, p), 0.0)",
        "@kernel\ndef force(c, p):",
        *force,
        "    return total",
        "@kernel\ndef slip(z, z_next, v, h, level, p):",
        *slip,
        *(inspect.getsource(_plain(function)) for function in plant.functions),
        *("@loop\n" + inspect.getsource(function) for function in _LOOPS),
    ]
    return "\n".join(lines)


def _plain(function: Callable[..., Any]) -> Callable[..., Any]:
    """The Python function under a compiled one."""
    return cast(Callable[..., Any], getattr(function, "py_func", function))


def _fingerprint(effects: tuple[Effect, ...], source: str) -> str:
    """Hash of all that the machine code depends on."""
    digest = hashlib.sha256()
    modules = {Effect.__module__, kernel.__module__}
    for effect in effects:
        modules |= {f.__module__ for f in (effect.level, effect.force, effect.slip) if f is not None}
    for name in sorted(modules):
        digest.update(inspect.getsource(sys.modules[name]).encode())
    for part in (source, numba.__version__, np.__version__, platform.python_version(), platform.machine()):
        digest.update(part.encode())
    return digest.hexdigest()[:24]


@lru_cache(maxsize=1)
def _cache_folder() -> Path:
    """The first of the candidate folders that can be written."""
    candidates = [os.environ.get("FRIC_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME"), str(Path.home() / ".cache")]
    for number, candidate in enumerate(candidates):
        if not candidate:
            continue
        folder = Path(candidate) if number == 0 else Path(candidate) / "fric"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    folder = Path(tempfile.mkdtemp(prefix="fric-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _import(source: str, fingerprint: str) -> ModuleType:
    """The module with this source, stored under its fingerprint and imported from there."""
    name = f"fric_assembled_{fingerprint}"
    path = _cache_folder() / f"{name}.py"
    if not path.exists():
        # Written aside and renamed, so that another process never sees half a file.
        with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8") as file:
            file.write(source)
        Path(file.name).replace(path)
    specification = importlib.util.spec_from_file_location(name, path)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module
