"""What the tests of batches share: short recordings of an axis with friction, good ones and broken ones."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import fric
import numpy as np
import pytest
from fric.bagio.write import write_record
from fric.batch.job import Job
from fric.facade.structure import model_from
from fric.model_file import model_to_text

DAY = 86_400 * 10**9
FIRST = 1_772_323_200 * 10**9  # 1 March 2026, 0 h UTC [ns]


def recording(seed: int, coulomb: float = 12.0, joint: str = "axis") -> fric.Record:
    """Three seconds at 500 Hz of a mass with Coulomb and viscous friction."""
    generator = np.random.default_rng(seed)
    t = 2e-3 * np.arange(1500)
    force = 60.0 * np.sin(2.0 * np.pi * (0.4 + 0.4 * t) * t) + 0.2 * generator.standard_normal(t.size)
    terms = [fric.term("coulomb", force=coulomb), fric.term("viscous", coefficient=30.0)]
    motion = fric.simulate(fric.build_model("rigid", {"mass": 5.0}, terms), force, 2e-3)
    return replace(motion, position=motion.position.round(7), joint=joint)


@pytest.fixture(scope="session")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of five recordings of two machines."""
    root = tmp_path_factory.mktemp("good")
    for machine, day in ((1, 0), (1, 1), (1, 2), (2, 0), (2, 1)):
        path = root / f"machine_{machine}" / f"day_{day}" / "run"
        write_record(recording(10 * machine + day), path, start_time_ns=FIRST + day * DAY)
    return root


@pytest.fixture
def logs(good: Path, tmp_path: Path) -> Path:
    """A copy of :func:`good` that a test may change."""
    return Path(shutil.copytree(good, tmp_path / "logs"))


@pytest.fixture(scope="session")
def job() -> Job:
    return Job("identify", model_to_text(model_from("coulomb,viscous")))


Break = Callable[[Path], None]


def _cut(share: float) -> Break:
    def cut(bag: Path) -> None:
        (file,) = bag.glob("*.mcap")
        file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])

    return cut


def _replaced(change: Callable[[fric.Record], fric.Record]) -> Break:
    def write(bag: Path) -> None:
        shutil.rmtree(bag)
        write_record(change(recording(5)), bag)

    return write


def _noise(bag: Path) -> None:
    (file,) = bag.glob("*.mcap")
    data = bytearray(file.read_bytes())
    middle = len(data) // 3
    data[middle : middle + 4000] = np.random.default_rng(1).bytes(4000)
    file.write_bytes(bytes(data))


def _emptied(bag: Path) -> None:
    (file,) = bag.glob("*.mcap")
    file.write_bytes(b"")


def _unlinked(bag: Path) -> None:
    (file,) = bag.glob("*.mcap")
    file.unlink()


BROKEN: dict[str, Break] = {
    "cut off early": _cut(0.02),
    "empty file": _emptied,
    "no storage file": _unlinked,
    "bytes overwritten": _noise,
    "too short": _replaced(lambda record: record.between(0.0, 0.05)),
    "at rest": _replaced(lambda record: replace(record, position=np.zeros(record.n_samples), velocity=None)),
    "no force": _replaced(lambda record: replace(record, effort=np.zeros(record.n_samples))),
}
"""Ways to break a recording."""
