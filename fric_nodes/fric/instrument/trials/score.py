"""How often the checks find what is there, and what is not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from .. import inspect
from ..check import Finding
from .axes import AXES, CLEAN_ONLY, MOTIONS, draw_rig, record_of, run_rig, scaled_nominal
from .faults import FAULTS, Fault, Trial
from .ordinary import ordinary

__all__ = ["LIMITS", "Alarms", "Hits", "clean_trial", "false_alarms", "hits", "ordinary_alarms"]

LIMITS = frozenset({"direction", "excitation", "length", "resolution", "sampling", "sensor_side"})
"""Checks whose warnings name a limit of the recording, which is no fault of it."""


@dataclass(frozen=True)
class Hits:
    """What became of one kind of fault.

    Attributes:
        fault: what it was.
        found: number of trials in which its check found it.
        named_first: number of trials in which no other check found a fault.
        trials: number of trials.
        missed: seeds of those in which it was not found, with what the check said.
    """

    fault: Fault
    found: int
    named_first: int
    trials: int
    missed: tuple[tuple[int, str], ...]


@dataclass(frozen=True)
class Alarms:
    """Verdicts of the checks on clean recordings.

    Attributes:
        faults: found, with the seed of the recording; each is a false one.
        warnings: number of recordings with a warning of each check that says that something is wrong; each is a false one.
        limits: the same of the checks that say what a recording can't show, rightly.
        trials: number of recordings.
    """

    faults: tuple[tuple[int, str], ...]
    warnings: Counter[str]
    limits: Counter[str]
    trials: int

    @property
    def wrong(self) -> int:
        """Number of recordings with a fault."""
        return len({seed for seed, _ in self.faults})


def hits(fault: Fault, seeds: Iterable[int]) -> Hits:
    """Trials of ``fault``, one for each seed."""
    found = alone = count = 0
    missed = []
    for seed in seeds:
        trial = fault.make(seed)
        findings = inspect(trial.records, trial.model)
        count += 1
        own = [finding for finding in findings if finding.check == fault.check]
        others = [finding for finding in findings if finding.check != fault.check and finding.verdict == "fault"]
        if any(finding.verdict in fault.verdicts for finding in own):
            found += 1
            alone += not others
        else:
            missed.append((seed, f"{trial.records[0].source}: {own[0].verdict}: {own[0].detail}"))
    return Hits(fault, found, alone, count, tuple(missed))


def clean_trial(seed: int) -> Trial:
    """A clean recording, with the nominal model for every other seed; all axes and motions take their turns."""
    axes, motions = (*AXES, *CLEAN_ONLY), tuple(MOTIONS)
    rig = draw_rig(seed, axes[seed % len(axes)], motions[seed // len(axes) % len(motions)])
    record = record_of(rig, run_rig(rig), seed)
    simple = rig.axis != "spring"
    return Trial((record,), scaled_nominal(rig) if seed % 2 and simple else None)


def false_alarms(seeds: Sequence[int]) -> tuple[list[tuple[int, Finding]], Counter[str]]:
    """Faults found in clean recordings, with their seeds; and how many warnings each check gave."""
    wrong: list[tuple[int, Finding]] = []
    warnings: Counter[str] = Counter()
    for seed in seeds:
        trial = clean_trial(seed)
        for finding in inspect(trial.records, trial.model):
            if finding.verdict == "fault":
                wrong.append((seed, finding))
            warnings[finding.check] += finding.verdict == "warning"
    return wrong, warnings


def ordinary_alarms(seeds: Sequence[int]) -> Alarms:
    """Verdicts of the checks on ordinary recordings; with the model for every other seed."""
    faults: list[tuple[int, str]] = []
    warnings: Counter[str] = Counter()
    limits: Counter[str] = Counter()
    for seed in seeds:
        test = ordinary(seed)
        for finding in inspect([test.record], test.model if seed % 2 else None):
            # A constant force beside friction is true of an axis with a weight.
            true = finding.check in LIMITS or (finding.check == "offset" and test.gravity != 0.0)
            if finding.verdict == "fault":
                faults.append((seed, f"{test.record.source}: {finding.check}: {finding.detail}"))
            elif finding.verdict == "warning":
                (limits if true else warnings)[finding.check] += 1
    return Alarms(tuple(faults), warnings, limits, len(seeds))


def every_fault(seeds: Sequence[int]) -> list[Hits]:
    """All faults, each over all seeds."""
    return [hits(fault, seeds) for fault in FAULTS]
