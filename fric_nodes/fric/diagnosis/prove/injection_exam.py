"""The diagnosis examined on effects that were concealed in recordings of a real axis (:mod:`.injection`).

They are as large as multiples of what stays unexplained, or of their detection limits as the diagnosis of the recordings as
they are states them: above these they should be found, below not.

Each is diagnosed in a process of its own pool, and written down when it is done: a stopped examination goes on in its folder.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...files import write_text
from ...model import Model
from ...model_file import model_to_text
from ...record import Record
from ..blocks import in_blocks
from ..confidence import AS_LIKELY
from ..deadline import refuse_no_time
from ..diagnose import diagnose
from ..result import Diagnosis, Finding
from .examination import in_processes
from .injection import Injected, acting, at_limit, can_be_at_limit, injected
from .yardstick import Yardstick

__all__ = ["AT_LIMITS", "CANNOT_SHOW", "InjectionOutcome", "examined", "told_in"]

AT_LIMITS = (1.5, 0.5)
"""Of its detection limit: an effect that should be found, and one that should not."""

CANNOT_SHOW = "can't show in this motion"
"""Of an effect that the nominal model's own parameters take up, or that would have to be larger than the force itself."""
_SIZED, _LIMITED = "by what it leaves missing", "by its detection limit"
_FOLDER = "injected"


@dataclass(frozen=True)
class InjectionOutcome:
    """What the diagnosis said of one.

    Attributes:
        what: was injected.
        rms: root mean square of the added force where it acts [F].
        rest: that of what stays unexplained there in the recordings as they are [F]; None where the size is one of a limit.
        limit: the detection limit of which the size is a multiple, in words; empty where it is one of the rest.
        presence: of the injected effect, or of one as which its limit says that it may be told; 0 where neither is named.
        wrong: effects named with at least :data:`.confidence.AS_LIKELY` that are neither injected nor named in the recordings
            as they are, however surely: what is named there may be the axis's own.
        failure: why there is no diagnosis; empty where there is one.
    """

    what: Injected
    rms: float
    rest: float | None
    presence: float
    wrong: tuple[str, ...]
    failure: str = ""
    limit: str = ""

    @property
    def asked(self) -> bool:
        """False where nothing was concealed, since it could not have shown."""
        return self.failure != CANNOT_SHOW

    @property
    def found(self) -> bool:
        """True where it is named as more likely there than not."""
        return self.presence >= AS_LIKELY


def examined(
    records: Sequence[Record],
    nominal: Model,
    wanted: Sequence[Injected] | None,
    n_blocks: int,
    out: Path,
    progress: Callable[[str], None],
    jobs: int | None = None,
    at_most: float | None = None,
) -> tuple[Diagnosis, list[InjectionOutcome]]:
    """The diagnosis of ``records`` as they are, and of every injection into them.

    Args:
        records: of one axis.
        nominal: what the diagnosis starts from.
        wanted: what is concealed, one at a time; every effect whose detection limit is stated, :data:`AT_LIMITS`, when None.
        n_blocks: into which each recording is cut, every other one held back.
        out: folder; one that holds the same examination is gone on with.
        progress: told what goes on.
        jobs: worker processes; as many as there are cores when None.
        at_most: time after which a diagnosis looks for no further effects [s]; None: each ends by itself.

    Raises:
        InputError: the folder holds another examination, ``at_most`` is no time, or every recording is at one speed.
    """
    refuse_no_time(at_most)
    _claim(out, records, nominal, n_blocks, at_most, _LIMITED if wanted is None else _SIZED)
    progress("diagnosing the recordings as they are")
    bare = diagnose(*in_blocks(records, n_blocks), nominal, at_most=at_most)
    if bare.by_means:
        problem = "is at one speed, as all others are: what is concealed in it would be a friction curve's mean alone"
        raise InputError(records[0].source, problem, "give recordings whose speed changes")
    own = {each.effect: each.confidence for each in reversed(bare.findings)}
    plans = [*(_at_limits(bare) if wanted is None else _by_rest(records, bare, wanted))]
    tasks: list[tuple[object, ...]] = []
    for plan in plans:
        if _at(out, plan.what).exists():
            continue
        if plan.conceal is None:
            _write(out, plan, 0.0, own, CANNOT_SHOW, ())
        else:
            tasks.append((str(out), plan, records, nominal, n_blocks, own, at_most))
    in_processes(_diagnosed, tasks, progress, "diagnosed", jobs)
    return bare, [_outcome(json.loads(_at(out, plan.what).read_text(encoding="utf-8"))) for plan in plans]


@dataclass(frozen=True)
class _Plan:
    """One injection.

    Attributes:
        what: is injected.
        conceal: recordings to those with it; None where it could not show.
        rest: as of :class:`InjectionOutcome`.
        limit: likewise.
        like: another effect as which it may be told at its limit; empty where none is.
    """

    what: Injected
    conceal: Callable[[Sequence[Record]], list[Record]] | None
    rest: float | None = None
    limit: str = ""
    like: str = ""


def _by_rest(records: Sequence[Record], bare: Diagnosis, wanted: Sequence[Injected]) -> Iterator[_Plan]:
    """What is ``wanted``, as large as multiples of what stays unexplained."""
    yardstick = Yardstick(records, bare)
    for what in wanted:
        measured = yardstick.measure(what.effect, what.times)
        shows = math.isfinite(measured.size)
        conceal = partial(injected, effect=what.effect, size=measured.size) if shows else None
        yield _Plan(what, conceal, rest=measured.rest)


def _at_limits(bare: Diagnosis) -> Iterator[_Plan]:
    """Every effect with a detection limit that can be put into the effort, above it and below."""
    for limit in bare.limits:
        # What a law's bounds allow at half of the limit they may not allow above it: a gear that loses all of its force.
        if can_be_at_limit(limit, AT_LIMITS[-1]):
            for times in AT_LIMITS:
                conceal = partial(at_limit, model=bare.model, limit=limit, times=times)
                what, can = Injected(limit.effect, times), can_be_at_limit(limit, times)
                yield _Plan(what, conceal if can else None, limit=limit.stated, like=limit.like)


def told_in(out: Path) -> Iterator[dict[str, Any]]:
    """What each diagnosis in the folder ``out`` said: ``injected``, ``own`` and ``findings``; nothing where it holds none.

    ``own`` is how sure each effect was that was named in the recordings as they are.
    """
    for at in sorted((out / _FOLDER).glob("*.json")):
        yield json.loads(at.read_text(encoding="utf-8"))


def _at(out: Path, what: Injected) -> Path:
    return out / _FOLDER / f"{what.effect}_{what.times:g}.json"


def _claim(out: Path, records: Sequence[Record], nominal: Model, n_blocks: int, at_most: float | None, sized: str) -> None:
    """Write down of what it is, or check that the folder holds the same."""
    limit = "" if at_most is None else f" {at_most}"
    told = hashlib.sha256(f"{model_to_text(nominal)} {n_blocks}{limit} {sized}".encode())
    for record in records:
        for each in (record.time, record.position, record.effort, record.mask):
            told.update(each.tobytes())
    at, text = out / "examined.json", json.dumps({"sha256": told.hexdigest()})
    if at.exists() and at.read_text(encoding="utf-8") != text:
        raise InputError(out, "holds an examination of other recordings", "choose another folder, or the same options")
    out.mkdir(parents=True, exist_ok=True)
    write_text(at, text)


def _diagnosed(
    out: str,
    plan: _Plan,
    records: Sequence[Record],
    nominal: Model,
    n_blocks: int,
    own: Mapping[str, float],
    at_most: float | None,
) -> None:
    """Diagnose ``records`` with what is planned concealed in them, and write down what was said."""
    assert plan.conceal is not None
    failure, rms = "", 0.0
    findings: tuple[Finding, ...] = ()
    try:
        changed = plan.conceal(records)
        rms = _added(records, changed)
        if rms == 0.0:
            _write(Path(out), plan, rms, own, CANNOT_SHOW, ())
            return
        findings = diagnose(*in_blocks(changed, n_blocks), nominal, at_most=at_most).findings
    except InputError as error:
        failure = str(error)
    _write(Path(out), plan, rms, own, failure, findings)


def _added(records: Sequence[Record], changed: Sequence[Record]) -> float:
    """Root mean square of what is concealed, where it acts [F]."""
    added = np.concatenate([new.effort - old.effort for old, new in zip(records, changed, strict=True)])
    return float(np.sqrt(np.mean(added[acting(added)] ** 2))) if np.any(added) else 0.0


def _write(out: Path, plan: _Plan, rms: float, own: Mapping[str, float], failure: str, findings: Sequence[Finding]) -> None:
    """Write down what was said of one."""
    told = {"injected": asdict(plan.what), "rms": rms, "rest": plan.rest, "limit": plan.limit, "own": dict(own)}
    told |= {"like": plan.like, "failure": failure, "findings": [*map(_said, findings)]}
    at = _at(out, plan.what)
    at.parent.mkdir(parents=True, exist_ok=True)
    write_text(at, json.dumps(told, indent=1))


def _said(finding: Finding) -> dict[str, Any]:
    weighed = None
    if finding.weighed is not None:
        weighed = {name: value if math.isfinite(value) else None for name, value in asdict(finding.weighed).items()}
    return {"effect": finding.effect, "confidence": finding.confidence, "weighed": weighed}


def _outcome(told: dict[str, Any]) -> InjectionOutcome:
    what = Injected(**told["injected"])
    sure = {each["effect"]: each["confidence"] for each in reversed(told["findings"])}
    # What is named in the recordings as they are says nothing of what was concealed.
    meant = {what.effect} | ({told.get("like", "")} - set(told["own"]))
    known = meant | {"unknown", *told["own"]}
    wrong = (effect for effect, c in sure.items() if c >= AS_LIKELY and effect not in known)
    presence = max(sure.get(effect, 0.0) for effect in meant)
    limit = told.get("limit", "")
    return InjectionOutcome(what, told["rms"], told["rest"], presence, tuple(sorted(wrong)), told["failure"], limit)
