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
from typing import Any, NamedTuple, cast

import numba
import numpy as np

from ..effect import Effect
from ..plant import Plant
from ..record import Array
from . import loops
from .kernel import kernel

__all__ = [
    "IMPORTS",
    "CacheFolder",
    "Loops",
    "cache_folder",
    "fingerprint",
    "imported",
    "loops_for",
    "plain",
    "with_work_space",
]

# What the texts of plants and loops may name besides the model's own functions.
IMPORTS = (
    "import math",
    "from typing import Any",
    "from fric.engine.assembled import Inner, Surroundings",
    "from fric.effect import Context",
    "from fric.engine.kernel import kernel, local_array, loop",
)


@dataclass(frozen=True)
class Loops:
    """Compiled loops of one model structure; arguments as in :mod:`fric.engine.loops`, without the work space.

    Attributes:
        simulate: motion from force.
        predict: force from motion.
        observe: one-step prediction along measured positions.
        pursue: the model kept at measured positions by impulses.
        lead: motion along a given one, and the force that it takes.
        respond: the command path alone.
        fan: many copies of the plant over one interval; with its work space as an argument, being called at every sample.
    """

    simulate: Callable[..., None]
    predict: Callable[..., None]
    observe: Callable[..., None]
    pursue: Callable[..., None]
    lead: Callable[..., None]
    respond: Callable[..., None]
    fan: Callable[..., None]


def loops_for(plant: Plant, effects: Sequence[Effect]) -> Loops:
    """The compiled loops for ``plant`` with ``effects`` in this order."""
    return _loops_for(plant, tuple(effects))


@lru_cache(maxsize=256)
def _loops_for(plant: Plant, effects: tuple[Effect, ...]) -> Loops:
    source = _source(plant, effects)
    module = imported(source, fingerprint(effects, source))
    n_constants = _counter(plant, effects)
    names = [function.__name__ for function in loops.LOOPS]
    return Loops(*(with_work_space(getattr(module, name), n_constants) for name in names))


def _counter(plant: Plant, effects: tuple[Effect, ...]) -> Callable[[Array], int]:
    """Function that gives the number of constants for the values of a model."""
    if not any(callable(effect.n_constants) for effect in effects):
        fixed = sum(effect.constants(()) for effect in effects)
        return lambda values: fixed

    def count(values: Array) -> int:
        at = len(plant.parameters)
        total = 0
        for effect in effects:
            total += effect.constants([float(value) for value in values[at : at + len(effect.parameters)]])
            at += len(effect.parameters)
        return total

    return count


def with_work_space(loop: Callable[..., None], n_constants: Callable[[Any], int]) -> Callable[..., None]:
    """``loop`` with its work space, the last arguments, made anew for each call, so that threads don't meet."""
    parameters = list(inspect.signature(getattr(loop, "py_func", loop)).parameters)
    if "z" not in parameters:
        return loop
    z = parameters.index("z")

    def call(*arguments: Any) -> None:
        work = np.empty(2 * arguments[z].shape[0]), np.zeros(n_constants(arguments[0]))
        loop(*arguments, *work)

    return call


class _Assembly:
    """The bodies of a model's functions, grown effect by effect; see :mod:`fric.engine.assembled` for what each is."""

    def __init__(self, at: int) -> None:
        self.imports: list[str] = list(IMPORTS)
        self.level: list[str] = []
        self.force: list[str] = []
        self.remember: list[str] = []
        self.bending: list[Effect] = []
        self.pushed: list[Effect] = []
        self.remembering: list[Effect] = []
        self.slip = "    return 0.0"
        self.command: list[str] = []
        self.play: list[str] = []
        self.prepare: list[str] = []
        self._at = at
        self._memory = 0

    def add(self, number: int, effect: Effect) -> None:
        """Add the effect that is the model's term ``number``."""
        parameters = [f"p[{self._at + k}]" for k in range(len(effect.parameters))]
        self._at += len(parameters)
        for role, function in effect.functions.items():
            self.imports.append(f"from {function.__module__} import {function.__name__} as {role}_{number}")

        def call(role: str, *first: str) -> str:
            return f"{role}_{number}({', '.join((*first, *parameters))})"

        if effect.uses_acceleration:
            self.bending.append(effect)
        if effect.uses_push:
            self.pushed.append(effect)
        if effect.remember is not None:
            self.remembering.append(effect)
        kept = (str(self._memory),) if effect.n_memory else ()
        if effect.remember is not None:
            self.remember.append(f"    {call('remember', 'c', 'total' if effect.level else '0.0', *kept)}")
        if effect.level is not None:
            line = f"    total = {call('level', 'c', 'total', *kept)}"
            self.level.append(line)
            self.remember.append(line)
        if effect.force is not None:
            self.force.append(f"    total += {call('force', 'c', *kept)}")
        if effect.command is not None:
            self.command.append(f"    u = {call('command', 'u', 'h', 'memory', str(self._memory))}")
        if effect.play is not None:
            self.play.append(f"    total += {call('play')}")
        constants = self._prepare(call) if effect.prepare is not None else ()
        if effect.slip is not None:
            self.slip = f"    return {call('slip', 'z', 'z_next', '0', 'v', 'h', 'level', *constants)}"
        self._memory += effect.n_memory

    def _prepare(self, call: Callable[..., str]) -> tuple[str, str]:
        # At most one term has constants, since only slip dynamics take them: its offset is 0.
        self.prepare.append(f"    {call('prepare', 'constants', '0')}")
        return "constants", "0"


def _links(effects: tuple[Effect, ...], at: int) -> list[str]:
    """The lines that add up the links of the transmission; those of terms with play only where there are no others."""
    lines: dict[bool, list[str]] = {False: [], True: []}
    for number, effect in enumerate(effects):
        parameters = "".join(f", p[{at + k}]" for k in range(len(effect.parameters)))
        at += len(effect.parameters)
        if effect.link is not None:
            lines[effect.play is not None].append(f"    total += link_{number}(e_0, e_1, h, free{parameters})")
    return lines[False] or lines[True]


def _source(plant: Plant, effects: tuple[Effect, ...]) -> str:
    """Text of the module that binds the structure's functions together."""
    n_parameters = len(plant.parameters) + sum(len(effect.parameters) for effect in effects)
    parts = _Assembly(len(plant.parameters))
    for number, effect in enumerate(effects):
        parts.add(number, effect)
    lines = [
        f'"""Assembled for: {plant.id} | {", ".join(effect.key for effect in effects) or "no terms"}."""',
        *parts.imports,
        f"RIGID = {all(effect.slip is None for effect in effects)}",
        f"ACCELERATION = {any(effect.uses_acceleration for effect in effects)}",
        f"PUSHED = {any(effect.uses_push for effect in effects)}",
        f"ELASTIC = {any(effect.link is not None for effect in effects)}",
        f"MEMORY = {any(effect.remember is not None for effect in effects)}",
        f"N_STATES = {len(plant.states)}",
        f"SEEN, SEEN_RATE = {plant.encoder}",
        f"ACTUATED, ACTUATED_RATE = {plant.actuated or plant.encoder}",
        f"@kernel\ndef unpacked(p):\n    return ({''.join(f'p[{k}], ' for k in range(n_parameters))})",
        "@kernel\ndef bends(p):",
        f"    return {bool(parts.bending)}",
        "@kernel\ndef pushed(p):",
        f"    return {bool(parts.pushed)}",
        "@kernel\ndef remembers(p):",
        f"    return {bool(parts.remembering)}",
        *_summing("level_sum(c, p)", parts.level),
        "@kernel\ndef level(c, p):",
        "    return max(level_sum(c, p), 0.0)",
        *_summing("force(c, p)", parts.force),
        *_summing("play(p)", parts.play),
        "@kernel\ndef link(e_0, e_1, h, p):",
        "    total = 0.0",
        "    free = play(p)",
        *_links(effects, len(plant.parameters)),
        "    return total",
        *_summing("remember(c, p)", parts.remember),
        "@kernel\ndef slip(z, z_next, v, h, level, constants, p):",
        parts.slip,
        "@kernel\ndef command(u, h, memory, p):",
        *parts.command,
        "    return u",
        "@kernel\ndef prepare(p, constants):",
        *(parts.prepare or ["    pass"]),
        *(inspect.getsource(plain(function)) for function in plant.functions),
        inspect.getsource(plain(loops.advance)),
        *("@loop\n" + inspect.getsource(function) for function in loops.LOOPS),
    ]
    return "\n".join(lines)


def _summing(head: str, body: list[str]) -> list[str]:
    """A function that starts from zero, lets each line of ``body`` change it, and returns it.

    The zero is the negative one, the only number to which adding doesn't cost an addition: 0.0 + -0.0 isn't -0.0.
    """
    return [f"@kernel\ndef {head}:", "    total = -0.0", *body, "    return total"]


def plain(function: Callable[..., Any]) -> Callable[..., Any]:
    """The Python function under a compiled one."""
    return cast(Callable[..., Any], getattr(function, "py_func", function))


def fingerprint(effects: tuple[Effect, ...], source: str, *others: str) -> str:
    """Hash of all that the machine code depends on: the text, the modules whose compiled functions it calls, and ``others``."""
    digest = hashlib.sha256()
    modules = {Effect.__module__, kernel.__module__, loops.__name__, *others}
    waiting = {f.__module__ for effect in effects for f in effect.functions.values()}
    while waiting:
        name = waiting.pop()
        modules.add(name)
        compiled = [held for held in vars(sys.modules[name]).values() if hasattr(held, "py_func")]
        waiting |= {f.py_func.__module__ for f in compiled} - modules
    for name in sorted(modules):
        digest.update(inspect.getsource(sys.modules[name]).encode())
    for part in (source, numba.__version__, np.__version__, platform.python_version(), platform.machine()):
        digest.update(part.encode())
    return digest.hexdigest()[:24]


class CacheFolder(NamedTuple):
    """Where compiled code lies, and whether it stays there when the process ends."""

    path: Path
    kept: bool


@lru_cache(maxsize=1)
def cache_folder() -> CacheFolder:
    """The first of the candidate folders that can be written."""
    candidates = [os.environ.get("FRIC_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME"), str(Path.home() / ".cache")]
    for number, candidate in enumerate(candidates):
        if not candidate:
            continue
        folder = Path(candidate) if number == 0 else Path(candidate) / "fric"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return CacheFolder(folder, kept=True)
        except OSError:
            continue
    folder = Path(tempfile.mkdtemp(prefix="fric-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return CacheFolder(folder, kept=False)


def imported(source: str, fingerprint: str) -> ModuleType:
    """The module with this source, stored under its fingerprint and imported from there."""
    name = f"fric_assembled_{fingerprint}"
    path = cache_folder().path / f"{name}.py"
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
