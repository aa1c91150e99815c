"""C loops to measure against: compiled with ``cc -O3`` where there is a compiler, and called through ctypes."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

from ..errors import InputError
from ..record import Array

__all__ = ["FOLDER", "CLoop", "compile_loop", "compiler"]

FOLDER = Path(__file__).parent / "laws_c"
"""Where the C texts are."""

CLoop = Callable[..., None]
"""``(p, u, h, load, temperature, x, z, x_out, friction_out, applied_out)``; see :func:`fric.engine.loops.simulate`."""

_DOUBLES = ctypes.POINTER(ctypes.c_double)


def compiler() -> str | None:
    """The C compiler: ``$CC``, or ``cc``; None when there is none."""
    return shutil.which(os.environ.get("CC", "cc"))


def compile_loop(source: str, law: str, folder: Path) -> CLoop:
    """The function ``run`` of ``source``, compiled with ``-D law`` into ``folder``.

    Raises:
        InputError: there is no compiler, or it doesn't compile.
    """
    cc = compiler()
    if cc is None:
        raise InputError("fric bench laws", "no C compiler", "install one (cc), or set CC")
    library = folder / f"{Path(source).stem}_{law}.so"
    command = [cc, "-O3", f"-D{law}", "-shared", "-fPIC", "-o", str(library), str(FOLDER / source), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InputError(
            f"fric bench laws: {source}", f"'{' '.join(command)}' failed: {done.stderr.strip()}", "check the compiler"
        )
    run = ctypes.CDLL(str(library)).run
    run.restype = None
    run.argtypes = [_DOUBLES, _DOUBLES, ctypes.c_size_t, *[ctypes.c_double] * 3, *[_DOUBLES] * 5]

    def call(p: Array, u: Array, h: float, load: float, temperature: float, *arrays: Array) -> None:
        pointers = [values.ctypes.data_as(_DOUBLES) for values in (p, u, *arrays)]
        run(pointers[0], pointers[1], u.shape[0], h, load, temperature, *pointers[2:])

    return call
