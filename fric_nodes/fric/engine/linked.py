"""Loops for models of any structure, compiled once: the terms are called through a table.

:mod:`fric.engine.compile` takes the terms of one structure into loops of its own: the fastest there is, after seconds of
compiling. Where hundreds of structures are tried, as in a diagnosis, these seconds are minutes. Here the loops hold the plant
alone. What a model's terms do they look up in a table, made when the model is: for each role (slip level, force, memory,
command path, transmission) the addresses of the terms' functions with the places of their parameters and of their memory.
Every effect is compiled once, by itself, and kept on disk as the loops are. A step takes longer than one that is compiled for
its terms, the more so the fewer there are.

Each function has the same form, so that the terms of a role are one chain: ``f(c, total, memory, p)`` takes what the terms
before it have come to and gives what they come to with it; ``c`` is the :class:`fric.effect.Context` without the memory, or
what the role needs in its place.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..effect import Effect
from ..plant import Plant
from ..record import Array
from . import loops, pointers
from .compile import IMPORTS, Loops, fingerprint, imported, plain, with_work_space
from .kernel import kernel
from .pointers import call_linked, entry

__all__ = ["Linked", "chain", "compile_effect", "compile_loop", "linked", "linked_loops", "text_of"]

# Chains of the table, each with the number of its first row and of the one behind its last.
_CHAINS = ("level", "force", "remember", "command", "play", "link")
_SLIP, _SLIP_AT, _PREPARE, _CONSTANTS, _BENDS, _PUSHED = range(2 * len(_CHAINS), 2 * len(_CHAINS) + 6)
_HEAD = 2 * len(_CHAINS) + 6  # what is there before the rows
_ROW = 3  # function, place of its parameters, place of its memory; places in bytes
_BYTES = 8
# Fields of the context, without the memory.
_FIELDS = ("position", "velocity", "direction", "time", "load", "temperature", "acceleration", "step", "push")


class Linked(NamedTuple):
    """A model as linked loops take it.

    Attributes:
        values: of its plant and its terms, shape ``(n_parameters,)``.
        table: its terms' functions, shape ``(n,)``.
    """

    values: Array
    table: NDArray[np.int64]


@kernel
def chain(c: Any, total: float, which: int, memory: Any, p: Any, table: int) -> float:
    """What the terms of the chain ``which`` make of ``total``; ``memory`` and ``p`` are addresses."""
    for row in range(entry(table, 2 * which), entry(table, 2 * which + 1), _ROW):
        total = call_linked(entry(table, row), c, total, memory + entry(table, row + 2), p + entry(table, row + 1))
    return total


def linked_loops(plant: Plant, effects: Sequence[Effect]) -> Loops:
    """The loops for ``plant`` with ``effects``, which take a :class:`Linked` for values; they have no ``fan``."""
    rigid = all(effect.slip is None for effect in effects)
    return _loops(plant, rigid, any(effect.link is not None for effect in effects))


class Held(Protocol):
    """A term: an effect with its values."""

    @property
    def effect(self) -> Effect:
        """What it is."""

    @property
    def values(self) -> tuple[float, ...]:
        """Of its parameters."""


def linked(plant: Plant, plant_values: Sequence[float], terms: Sequence[Held]) -> Linked:
    """The values and the table of a model.

    Args:
        plant: kind of plant.
        plant_values: its own values.
        terms: in the order of assembly.
    """
    values = np.array([*plant_values, *(value for held in terms for value in held.values)], dtype=np.float64)
    effects = tuple(held.effect for held in terms)
    table = _table(len(plant.parameters), effects)
    n_constants = sum(held.effect.constants(held.values) for held in terms)
    if table[_CONSTANTS] != n_constants:
        table = table.copy()
        table[_CONSTANTS] = n_constants
    return Linked(values, table)


@lru_cache(maxsize=4096)
def _table(n_plant: int, effects: tuple[Effect, ...]) -> NDArray[np.int64]:
    chains: dict[str, list[tuple[int, int, int]]] = {name: [] for name in _CHAINS}
    head = np.zeros(_HEAD, dtype=np.int64)
    at, memory = n_plant, 0
    tight = any(effect.link is not None and effect.play is None for effect in effects)
    for effect in effects:
        held = _functions(effect)
        for name in _CHAINS:
            # The link of a term with play counts only where no other term has one.
            if name in held and not (name == "link" and tight and effect.play is not None):
                chains[name].append((held[name].address, _BYTES * at, _BYTES * memory))
        if "slip" in held:
            head[_SLIP], head[_SLIP_AT] = held["slip"].address, _BYTES * at
        if "prepare" in held:
            head[_PREPARE] = held["prepare"].address
        head[_BENDS] |= effect.uses_acceleration
        head[_PUSHED] |= effect.uses_push
        at += len(effect.parameters)
        memory += effect.n_memory
    rows: list[tuple[int, int, int]] = []
    if not any(effect.remember is not None for effect in effects):
        chains["remember"] = []
    for number, name in enumerate(_CHAINS):
        head[2 * number] = _HEAD + _ROW * len(rows)
        rows += chains[name]
        head[2 * number + 1] = _HEAD + _ROW * len(rows)
    return np.concatenate([head, np.array(rows, dtype=np.int64).ravel()])


@dataclass(frozen=True)
class _Writer:
    """Writes an effect's functions in the form in which a table takes them."""

    effect: Effect

    def text(self) -> str:
        """The module."""
        e = self.effect
        lines = [
            f'"""Linked: {e.key}."""',
            "from fric.effect import Context",
            "from fric.engine.pointers import array_at, led, linked, prepared",
        ]
        lines += [f"from {f.__module__} import {f.__name__} as {role}" for role, f in e.functions.items()]
        if e.level is not None:
            lines += self._linked("linked_level", f"level({self._given('around', 'total', memory=True)})")
        if e.force is not None:
            lines += self._linked("linked_force", f"total + force({self._given('around', memory=True)})")
        if e.level is not None or e.remember is not None:
            base = "total" if e.level is not None else "0.0"
            before = () if e.remember is None else (f"    remember({self._given('around', base, memory=True)})",)
            after = f"level({self._given('around', 'total', memory=True)})" if e.level is not None else "total"
            lines += self._linked("linked_remember", after, *before)
        if e.command is not None:
            lines += self._linked("linked_command", f"command({self._given('total', 'c[0]', 'memory', '0')})")
        if e.play is not None:
            lines += self._linked("linked_play", f"total + play({self._given()})")
        if e.link is not None:
            lines += self._linked("linked_link", f"total + link({self._given('c[0]', 'c[1]', 'c[2]', 'c[3]')})")
        if e.slip is not None:
            constants = ("constants", "0") if e.prepare is not None else ()
            lines += ["@led", "def linked_slip(z, z_next, v, h, level, constants, p):"]
            lines += [f"    {name} = array_at({name})" for name in ("z", "z_next", "constants")]
            lines += [f"    return slip({self._given('z', 'z_next', '0', 'v', 'h', 'level', *constants)})"]
        if e.prepare is not None:
            lines += ["@prepared", "def linked_prepare(constants, p):", "    constants = array_at(constants)"]
            lines += [f"    prepare({self._given('constants', '0')})", "    return 0.0"]
        return "\n".join(lines) + "\n"

    def _given(self, *first: str, memory: bool = False) -> str:
        kept = ("0",) if memory and self.effect.n_memory else ()
        return ", ".join((*first, *kept, *(f"p[{k}]" for k in range(len(self.effect.parameters)))))

    def _linked(self, name: str, result: str, *before: str) -> list[str]:
        lines = ["@linked", f"def {name}(c, total, memory, p):", "    memory = array_at(memory)"]
        if "around" in result or any("around" in each for each in before):
            fields = [f"c[{k}]" for k in range(len(_FIELDS))]
            lines += [f"    around = Context({', '.join((*fields[:-1], 'memory', fields[-1]))})"]
        return [*lines, *before, f"    return {result}"]


@lru_cache(maxsize=1024)
def _functions(effect: Effect) -> dict[str, Any]:
    """The effect's compiled functions by the chain in which they stand, and those of its slip dynamics."""
    text = _Writer(effect).text()
    module = imported(text, fingerprint((effect,), text, pointers.__name__))
    prefix = "linked_"
    return {name[len(prefix) :]: held for name, held in vars(module).items() if name.startswith(prefix)}


@lru_cache(maxsize=64)
def _loops(plant: Plant, rigid: bool, elastic: bool) -> Loops:
    text = _source(plant, rigid, elastic)
    module = imported(text, fingerprint((), text, pointers.__name__, __name__))

    def constants(given: Linked) -> int:
        return int(given.table[_CONSTANTS])

    names = [function.__name__ for function in loops.LOOPS if function is not loops.fan]
    return Loops(fan=_no_fan, **{name: with_work_space(getattr(module, name), constants) for name in names})


def _no_fan(*arguments: Any) -> None:
    raise NotImplementedError("many copies of one plant are of one structure: compile it")


def _source(plant: Plant, rigid: bool, elastic: bool) -> str:
    n = len(plant.parameters)
    values, table = f"p[{n}]", f"p[{n + 1}]"

    def chained(name: str, total: str = "-0.0", c: str = "c.numbers", memory: str = "address_of(c.memory)") -> str:
        return f"chain({c}, {total}, {_CHAINS.index(name)}, {memory}, {values}, {table})"

    lines = [
        f'"""Linked: {plant.id} | {"sticks" if rigid else "slip dynamics"}, {"elastic" if elastic else "stiff"}."""',
        *IMPORTS,
        "from fric.engine.linked import chain",
        "from fric.engine.pointers import address_of, instant as Context, call_led, call_prepared, entry",
        f"RIGID = {rigid}",
        "ACCELERATION = PUSHED = MEMORY = True",
        f"ELASTIC = {elastic}",
        f"N_STATES = {len(plant.states)}",
        f"SEEN, SEEN_RATE = {plant.encoder}",
        f"ACTUATED, ACTUATED_RATE = {plant.actuated or plant.encoder}",
        "@kernel\ndef unpacked(p):",
        "    at, table = address_of(p.values), address_of(p.table)",
        # A play doesn't change while a loop runs.
        f"    free = chain(local_array(1), 0.0, {_CHAINS.index('play')}, 0, at, table)",
        f"    return ({''.join(f'p.values[{k}], ' for k in range(n))}at, table, free)",
        f"@kernel\ndef bends(p):\n    return entry({table}, {_BENDS}) != 0",
        f"@kernel\ndef pushed(p):\n    return entry({table}, {_PUSHED}) != 0",
        "@kernel\ndef remembers(p):",
        f"    return entry({table}, {2 * _CHAINS.index('remember')}) != entry({table}, {2 * _CHAINS.index('remember') + 1})",
        f"@kernel\ndef level_sum(c, p):\n    return {chained('level')}",
        "@kernel\ndef level(c, p):\n    return max(level_sum(c, p), 0.0)",
        f"@kernel\ndef force(c, p):\n    return {chained('force')}",
        f"@kernel\ndef remember(c, p):\n    {chained('remember')}",
        f"@kernel\ndef play(p):\n    return p[{n + 2}]",
        "@kernel\ndef link(e_0, e_1, h, p):",
        "    c = local_array(4)",
        "    c[0], c[1], c[2], c[3] = e_0, e_1, h, play(p)",
        f"    return {chained('link', '0.0', 'c', '0')}",
        "@kernel\ndef slip(z, z_next, v, h, level, constants, p):",
        f"    own = {values} + entry({table}, {_SLIP_AT})",
        f"    return call_led(entry({table}, {_SLIP}), z, z_next, v, h, level, constants, own)",
        "@kernel\ndef command(u, h, memory, p):",
        "    c = local_array(1)",
        "    c[0] = h",
        f"    return {chained('command', 'u', 'c', 'address_of(memory)')}",
        "@kernel\ndef prepare(p, constants):",
        f"    if p.table[{_PREPARE}] != 0:",
        f"        call_prepared(p.table[{_PREPARE}], constants, address_of(p.values) + p.table[{_SLIP_AT}])",
        *(inspect.getsource(plain(function)) for function in (*plant.functions, loops.advance)),
        *("@loop\n" + inspect.getsource(function) for function in loops.LOOPS if function is not loops.fan),
    ]
    return "\n".join(lines)


def compile_effect(effect: Effect) -> None:
    """Compile the functions of ``effect``, or find them on disk."""
    _functions(effect)


def compile_loop(plant: Plant, rigid: bool, elastic: bool, name: str) -> None:
    """Compile one of the loops that a diagnosis runs, or find it on disk.

    Args:
        plant: kind of plant.
        rigid: no term has slip dynamics.
        elastic: the transmission gives a force.
        name: ``pursue``, ``lead``, ``predict`` or ``observe``.
    """
    none, begin = np.zeros(0), np.zeros(len(plant.states) + 1)
    signals: dict[str, tuple[Any, ...]] = {
        "pursue": (none, none, none, none, 1, none, none, 0.0, 0.0, 0.0, 0.0, begin, none, none, none),
        "observe": (none, none, none, 1, none, none, 0.0, 0.0, 0.0, begin, none, none, none),
        "lead": (none, none, none, none, 1, none, none, 0.0, 0.0, begin, none, none, none, none),
        "predict": (none, none, none, none, 0.0, none, none, none, none, none, none),
    }
    empty = Linked(np.zeros(len(plant.parameters)), np.zeros(_HEAD, dtype=np.int64))
    getattr(_loops(plant, rigid, elastic), name)(empty, *signals[name])


def text_of(plant: Plant) -> str:
    """What the loops of ``plant`` are made from, to tell whether they have changed."""
    return "\n".join(_source(plant, rigid, elastic) for rigid in (True, False) for elastic in (True, False))
