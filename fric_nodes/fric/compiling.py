"""Compiles ahead of time what every diagnosis needs, once on a machine and beside the first diagnosis.

The equations of effects and plants are compiled when they are first used and kept on disk. A first diagnosis waits for
dozens of them, one after the other. :func:`compile_all` makes them at leisure; :func:`compiled_beside` makes them in a second
process while the first one reads recordings and fits the nominal model, in the order in which they are needed.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

from .effects import EFFECTS
from .engine.compile import cache_folder, fingerprint
from .engine.linked import compile_effect, compile_loop, text_of
from .plants import PLANTS

__all__ = ["Part", "compile_all", "compiled_beside", "parts"]

_PLANT = "rigid"  # of nearly every recording: a plant of another kind is compiled when it is first diagnosed
_NICE = 5  # numerical: the diagnosis itself comes first


class Part(NamedTuple):
    """Something to compile.

    Attributes:
        name: for people.
        compiled: compiles it, or finds it on disk.
        at_once: every diagnosis asks for it as soon as the recordings are read.
    """

    name: str
    compiled: Callable[[], None]
    at_once: bool = False


def parts() -> list[Part]:
    """What a diagnosis of an axis needs, in the order in which it asks for it."""
    alone = PLANTS[_PLANT]
    found: list[Part] = []
    for rigid in (True, False):
        contact = "dry friction" if rigid else "pre-sliding"
        names = ("pursue", "lead", "predict", "observe") if rigid else ("pursue", "lead", "predict")
        for plant, elastic in ((alone, False), (alone.driven, False), (alone.driven, True)):
            if plant is not None:
                behind = "" if plant is alone else f", {'elastic' if elastic else 'stiff'} transmission"
                what = f"{alone.title}{behind}, {contact}"
                compiled = {name: partial(compile_loop, plant, rigid, elastic, name) for name in names}
                found += [Part(f"{what}: {name}", compiled[name], rigid and plant is alone) for name in names]
    return found + [Part(effect.title, partial(compile_effect, effect)) for effect in EFFECTS.values()]


def compile_all(progress: Callable[[int, int, str], None] | None = None) -> None:
    """Compile all :func:`parts`, or find them on disk.

    Args:
        progress: told the number of parts that are done, that of all, and what comes next.
    """
    todo = parts()
    for done, part in enumerate(todo):
        if progress is not None:
            progress(done, len(todo), part.name)
        part.compiled()
    stamp = _stamp()
    if stamp is not None:
        stamp.touch()


@contextmanager
def compiled_beside() -> Iterator[None]:
    """While the block runs, compile in a second process what is not on disk yet; what isn't done at its end waits."""
    stamp = _stamp()
    if stamp is None or stamp.exists():
        yield
        return
    process = subprocess.Popen(
        [sys.executable, "-m", __name__], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield
    finally:
        process.terminate()
        process.wait()


def _stamp() -> Path | None:
    """The file that says that all parts are compiled as they are now; None where nothing is kept."""
    folder = cache_folder()
    if not folder.kept:
        return None
    plants = [plant for plant in (PLANTS[_PLANT], PLANTS[_PLANT].driven) if plant is not None]
    made = fingerprint(tuple(EFFECTS.values()), "\n".join(text_of(plant) for plant in plants))
    return folder.path / f"compiled_{made}"


def _beside() -> None:
    """Compile all parts while another process compiles them, too: those that it needs at once come last."""
    os.nice(_NICE)
    for part in parts():
        if not part.at_once:
            part.compiled()
    compile_all()  # the others, and it says that all are there


if __name__ == "__main__":
    _beside()
