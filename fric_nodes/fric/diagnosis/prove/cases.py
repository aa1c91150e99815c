"""A case of the examination: recordings of an axis with concealed physics, the nominal model, and the key.

Strength is a statement about what a refitted nominal structure leaves, reckoned without noise on a recording that its fit
has not seen (:mod:`.reckoning`):

- *moderate*: an NOE between 1 and 15 %, and at least 15 times the noise floor;
- *weak*: an NOE of 3 to 5 times the noise floor, which itself is 0.02 to 0.07 %;
- a *pair*: two effects, each of which is moderate when it is concealed alone on this axis and these recordings;
- *mixed*: as a pair, of an effect and of physics outside the vocabulary, as real machines have both;
- *compound*: three to five effects, each of which leaves at least five times the noise floor when it is concealed alone.

In the variant *dirt* the recordings are written as real machines write them (:mod:`.dirt`).

In the variant *slow-log* a recording holds every second to eighth sample of the controller, and doesn't say that: what acted
between two of them nobody knows. Weak effects, whose strength is one beside the noise alone, aren't asked for there.

In the variants *mujoco* and *events* the axis is led by another hand (:mod:`.generators`), under another controller, through
motions of work in place of those of an experiment; its recordings are dirty, too. Weak effects aren't asked for.

Everything follows from the seed: the same seed gives the same recordings.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...model import Model
from ...model_file import model_to_text
from ...record import Record
from .axis import draw_setting
from .concealed import CONCEALED, Changes, Concealed, clash
from .course import Unreachable
from .excitation import drawn_reference
from .experiment import Bench, draw_recording, turned
from .generators import GENERATORS
from .generators.controllers import drawn_controller
from .generators.generator import Hand
from .generators.motions import drawn_motion
from .outside import OUTSIDE, Outside
from .physics import Physics
from .reckoning import CELL, Nominal
from .structure import nominal_model, relative_errors, true_model
from .written import dirty, logged, recorded

__all__ = ["KINDS", "VARIANTS", "Case", "Order", "draw", "plan"]

KINDS = ("moderate", "weak", "pair", "unknown", "nothing", "mixed", "compound")
VARIANTS = ("standard", "form", "half-rate", "double-rate", "mixed", "slow-log", "foreign", "dirt", "compound", *GENERATORS)

_SHARES = {"moderate": 0.32, "weak": 0.16, "pair": 0.16, "unknown": 0.15, "nothing": 0.21}
_MIXED_SHARES = {"mixed": 0.5, "unknown": 0.5}  # what is found beside something unknown: rightly, and wrongly
_COMPOUND_SHARES = {"compound": 0.85, "nothing": 0.15}
_WITHOUT_WEAK = {"moderate": 0.42, "pair": 0.16, "unknown": 0.16, "nothing": 0.26}
_SHARES_OF = {"mixed": _MIXED_SHARES, "slow-log": _WITHOUT_WEAK, "dirt": _WITHOUT_WEAK, "compound": _COMPOUND_SHARES}
_SHARES_OF |= dict.fromkeys(GENERATORS, _WITHOUT_WEAK)
_SEVERAL = (3, 5)  # effects of a compound
_OVER_FLOOR = 5.0  # times the noise floor, that each of a compound leaves alone at the least
_RATE = {"half-rate": 0.5, "double-rate": 2.0}
_NO_AXIS = 100.0  # [%]: where the nominal structure explains nothing, friction has stopped the axis, or it swings
_MODERATE = (1.0, 15.0)
_ATTEMPTS = 25
_LARGEST_ASYMMETRY = 0.8  # of the Coulomb friction: with more, both together are another machine's friction of one direction
_REFERENCE_TEMPERATURE = 25.0


@dataclass(frozen=True)
class Order:
    """What a case is to be: a number, a seed, a kind, and the effects or the kind of physics outside that it conceals."""

    number: int
    seed: int
    kind: str
    names: tuple[str, ...]
    variant: str = "standard"


@dataclass(frozen=True, eq=False)
class Case:
    """One case.

    Attributes:
        train: recordings to fit.
        validation: recordings held back.
        nominal: the model that is handed out.
        key: what is concealed, and all that a score needs; plain data.
    """

    train: tuple[Record, ...]
    validation: tuple[Record, ...]
    nominal: Model
    key: Mapping[str, Any]


def plan(n_cases: int, seed: int, variant: str = "standard") -> list[Order]:
    """The cases of an examination, balanced over kinds and, within them, over effects; in random order."""
    if variant not in VARIANTS:
        raise InputError("--variant", f"'{variant}' is not known", f"use one of {', '.join(VARIANTS)}")
    if n_cases < 1:
        raise InputError("--cases", f"{n_cases} is too few", "ask for at least one case")
    random = np.random.default_rng([seed, VARIANTS.index(variant)])
    counts = _counts(n_cases, _SHARES_OF.get(variant, _SHARES))
    chosen: list[tuple[str, tuple[str, ...]]] = []
    for kind, count in counts.items():
        chosen += [(kind, names) for names in _names(kind, count, variant, random)]
    order = random.permutation(len(chosen)).tolist()
    seeds = random.integers(1, 2**31, len(chosen)).tolist()
    return [Order(k, seeds[k], chosen[at][0], chosen[at][1], variant) for k, at in enumerate(order)]


def _counts(n_cases: int, shares: Mapping[str, float]) -> dict[str, int]:
    """Cases of each kind, by largest remainder."""
    exact = {kind: share * n_cases for kind, share in shares.items()}
    counts = {kind: int(value) for kind, value in exact.items()}
    for kind in sorted(exact, key=lambda each: counts[each] - exact[each])[: n_cases - sum(counts.values())]:
        counts[kind] += 1
    return counts


def _single_effects(variant: str) -> list[str]:
    """What can be concealed alone; in the variants of other forms only what has such a form."""
    found = list(CONCEALED.items())
    if variant == "form":
        found = [(name, each) for name, each in found if each.forms > 1]
    if variant == "foreign":
        found = [(name, each) for name, each in found if each.foreign]
    if variant in GENERATORS:
        found = [(name, each) for name, each in found if name not in GENERATORS[variant].without]
    return [name for name, _ in found]


def _names(kind: str, count: int, variant: str, random: np.random.Generator) -> list[tuple[str, ...]]:
    if kind == "nothing":
        return [()] * count
    if kind == "unknown":
        return [(name,) for name in _balanced(list(OUTSIDE), count, random)]
    if kind == "pair":
        effects = _single_effects(variant if variant in GENERATORS else "standard")
        pairs = [(a, b) for k, a in enumerate(effects) for b in effects[k + 1 :] if not clash(CONCEALED[a], CONCEALED[b])]
        return [pairs[int(at)] for at in random.permutation(len(pairs))[:count]]
    if kind == "compound":
        return [_several(random) for _ in range(count)]
    if kind == "mixed":
        known, others = _balanced(_single_effects("standard"), count, random), _balanced(list(OUTSIDE), count, random)
        # An axis can't need a part that it may not have.
        return [
            (a, b if not CONCEALED[a].needs & OUTSIDE[b].lacks else "floor_vibration")
            for a, b in zip(known, others, strict=True)
        ]
    return [(name,) for name in _balanced(_single_effects(variant), count, random)]


def _several(random: np.random.Generator) -> tuple[str, ...]:
    """Effects that can all be concealed together."""
    wanted = int(random.integers(_SEVERAL[0], _SEVERAL[1] + 1))
    effects = _single_effects("standard")
    while True:
        chosen: list[str] = []
        for at in random.permutation(len(effects)):
            name = effects[int(at)]
            if not any(clash(CONCEALED[name], CONCEALED[other]) for other in chosen):
                chosen.append(name)
            if len(chosen) == wanted:
                return tuple(chosen)


def _balanced(names: Sequence[str], count: int, random: np.random.Generator) -> list[str]:
    """``count`` names, each as often as the others or once more."""
    found: list[str] = []
    while len(found) < count:
        found += [names[int(at)] for at in random.permutation(len(names))]
    return found[:count]


def draw(seed: int, kind: str | None = None, effect: str | Sequence[str] | None = None, variant: str = "standard") -> Case:
    """A case from its seed.

    Args:
        seed: of everything in it.
        kind: one of :data:`KINDS`; by chance when None.
        effect: id of an effect, two for a pair, or the name of a kind of physics outside; by chance when None.
        variant: one of :data:`VARIANTS`.

    Raises:
        InputError: unknown kind, variant or effect, or no axis was found on which the effect has the strength wanted.
    """
    random = np.random.default_rng([seed, 77])
    if kind is None:
        kind = str(random.choice(KINDS))
    if kind not in KINDS:
        raise InputError("draw", f"unknown kind '{kind}'", f"use one of {', '.join(KINDS)}")
    if isinstance(effect, str):
        effect = (effect,)
    names = _names(kind, 1, variant, random)[0] if effect is None else tuple(effect)
    return make(Order(0, seed, kind, names, variant))


def make(order: Order) -> Case:
    """The case that ``order`` asks for.

    Raises:
        InputError: no axis was found on which it has the strength wanted.
    """
    for known, name in zip(_catalogues(order.kind), order.names, strict=False):
        if name not in known:
            raise InputError("draw", f"unknown effect '{name}'", f"use one of {', '.join(known)}")
    why = ""
    for attempt in range(_ATTEMPTS):
        try:
            return _attempt(order, np.random.default_rng([order.seed, *_code(order), attempt]))
        except Unreachable as reason:
            why = str(reason)
    names = " and ".join(order.names)
    raise InputError(f"case {order.seed}", f"no axis shows {names} with the strength wanted ({why})", "take another seed")


def _catalogues(kind: str) -> tuple[Mapping[str, Concealed] | Mapping[str, Outside], ...]:
    """Where the names of a case of this kind are found, one for each."""
    return {"unknown": (OUTSIDE,), "mixed": (CONCEALED, OUTSIDE)}.get(kind, (CONCEALED,) * _SEVERAL[1])


def _code(order: Order) -> tuple[int, int]:
    """Numbers by which cases of one seed differ."""
    return VARIANTS.index(order.variant), zlib.crc32(" ".join((order.kind, *order.names)).encode())


def _form(entry: Concealed, variant: str, random: np.random.Generator) -> int:
    if variant == "foreign" and entry.foreign:
        return int(random.choice(entry.foreign))
    return int(random.integers(1, entry.forms)) if variant == "form" and entry.forms > 1 else 0


def _attempt(order: Order, random: np.random.Generator) -> Case:
    entries: list[Concealed | Outside]
    entries = [known[name] for known, name in zip(_catalogues(order.kind), order.names, strict=False)]
    needs = frozenset[str]().union(*(each.needs for each in entries if isinstance(each, Concealed)))
    lacks = frozenset[str]().union(*(each.lacks for each in entries))
    setting = draw_setting(random, needs, lacks, _RATE.get(order.variant, 1.0))
    signals = frozenset(each for entry in entries if isinstance(entry, Concealed) for each in entry.signals)
    # Some axes record more than matters.
    signals |= {name for name in ("normal_load", "temperature") if random.random() < 0.15}
    windows = any(isinstance(each, Outside) and each.windows for each in entries)
    believed = setting.physics.using({"mass": setting.physics.mass * float(random.uniform(0.8, 1.2))})
    other = GENERATORS.get(order.variant)
    drawn = drawn_reference if other is None else drawn_motion
    train = draw_recording(setting, believed, setting.train_time, signals, windows, random, drawn)
    validation = draw_recording(setting, believed, setting.validation_time, signals, windows, random, drawn)
    led = None if other is None else Hand(other, drawn_controller(setting, "delay" in order.names, random))
    bench = Bench(setting, (train,), validation, setting.resolution, led=led)
    bench = bench.with_noise(setting.physics, float(math.exp(random.uniform(math.log(0.02), math.log(0.07)))))
    forms = [_form(each, order.variant, random) if isinstance(each, Concealed) else 0 for each in entries]
    makers = [each.make(setting, random, form) for each, form in zip(entries, forms, strict=True)]
    bench = _fine_enough(bench, makers)
    nominal = Nominal(setting.parts)
    changes: dict[str, Any] = {}
    alone: list[float] = []
    for entry, maker in zip(entries, makers, strict=True):
        knob, strength = _solved(order.kind, bench, nominal, entry, maker, random)
        changes |= maker(knob)
        alone.append(strength)
    return _finished(order, bench, nominal, setting.physics.using(changes), alone, forms, signals, random)


def _fine_enough(bench: Bench, makers: Sequence[Any]) -> Bench:
    """The bench with an encoder that resolves a pre-sliding displacement and a gap."""
    finest = bench.resolution
    displacements = [bench.setting.physics.displacement] if "presliding" in bench.setting.parts else []
    for maker in makers:
        found = maker(1.0)
        displacements += [0.5 * found[name] for name in ("displacement", "gap", "dwell_length") if name in found]
    for each in displacements:
        finest = min(finest, each / 10.0)
    return replace(bench, resolution=finest)


def _solved(
    kind: str, bench: Bench, nominal: Nominal, entry: Concealed | Outside, maker: Any, random: np.random.Generator
) -> tuple[float, float]:
    """The knob for one effect concealed alone, and the NOE it then leaves [%]."""
    physics = bench.setting.physics
    last: dict[float, float] = {}

    def strength(knob: float) -> float:
        changes: Changes = maker(knob)
        concealing = physics.using(changes)
        last[knob] = bench.remainder(concealing, nominal).noe
        return last[knob] / bench.floor(concealing) if kind == "weak" else last[knob]

    largest = entry.largest if isinstance(entry, Concealed) else 30.0
    if kind == "weak":
        knob = turned(strength, 4.0, 1.2, largest)
    else:
        low, high = {"pair": (1.6, 7.0), "mixed": (1.6, 7.0), "compound": (0.5, 7.0)}.get(kind, (1.4, 11.0))
        target = float(math.exp(random.uniform(math.log(low), math.log(high))))
        knob = turned(strength, target, 1.25, largest, enough=low)
    return knob, last[knob]


def _finished(
    order: Order, bench: Bench, nominal: Nominal, physics: Physics, alone: list[float], forms: list[int],
    signals: frozenset[str], random: np.random.Generator,
) -> Case:  # fmt: skip
    if abs(physics.asymmetry) > _LARGEST_ASYMMETRY * physics.coulomb > 0.0:
        raise Unreachable("friction that would be none in one direction")
    left = bench.remainder(physics, nominal)
    floor = bench.floor(physics)
    _check(order.kind, left.noe, floor, alone)
    conditions = {
        "normal_load": round(bench.setting.physics.mass * 9.81, 3),
        "temperature": _REFERENCE_TEMPERATURE,
    }
    conditions = {name: value for name, value in conditions.items() if name in signals}
    exact, given = nominal_model(physics, bench.setting.parts, conditions, random)
    outside = next((name for name in order.names if name in OUTSIDE), None) if order.kind in ("unknown", "mixed") else None
    concealed = tuple(name for name in order.names if name != outside)
    components = sorted(OUTSIDE[outside].components) if outside else []
    key: dict[str, Any] = {
        "format": "fric-prove-key/1",
        "number": order.number,
        "seed": order.seed,
        "variant": order.variant,
        "kind": order.kind,
        "effects": [*concealed, "unknown"] if outside else list(order.names),
        "physics_outside": outside,
        "components": components,
        "forms": forms,
        "noe_alone": alone,
        "noe_refit": left.noe,
        "noise_floor": floor,
        "cell": CELL,
        "energy": [float(f"{value:.4g}") for value in left.energy.tolist()],
        "physics": physics.named(),
        "elements": [list(each) for each in physics.elements],
        "nominal_error_percent": relative_errors(exact, given),
        "sample_time": bench.setting.sample_time,
        "resolution": bench.resolution,
        "force_noise": bench.force_noise,
        "true_structure": model_to_text(true_model(physics, bench.setting.parts, concealed, conditions)),
    }
    if isinstance(bench.led, Hand):
        key["controller"] = asdict(bench.led.controller)
    written = [recorded(bench, physics, each, signals, conditions, "train") for each in bench.train]
    written.append(recorded(bench, physics, bench.validation, signals, conditions, "validation"))
    if order.variant == "dirt" or order.variant in GENERATORS:
        written = dirty(written, bench, key, random)
    if order.variant == "slow-log":
        written = logged(written, bench, key, random)
    return Case(tuple(written[:-1]), tuple(written[-1:]), given, key)


def _check(kind: str, noe: float, floor: float, alone: Sequence[float]) -> None:
    """Raise where the finished case isn't what its kind promises."""
    if noe > _NO_AXIS:
        raise Unreachable("a drive that can't move the axis")
    if kind == "nothing" and noe > 0.5 * floor:
        raise Unreachable(f"the reckoning leaves {noe:.3g} % where nothing is concealed")
    if kind == "weak" and not 3.0 <= noe / floor <= 5.0:
        raise Unreachable(f"{noe / floor:.2g} times the floor")
    if kind == "compound" and min(alone) < _OVER_FLOOR * floor:
        raise Unreachable(f"an effect that leaves only {min(alone) / floor:.3g} times the floor")
    if kind in ("moderate", "unknown", "pair", "mixed", "compound") and noe < 15.0 * floor:
        raise Unreachable(f"only {noe / floor:.3g} times the floor")
    if kind in ("moderate", "unknown") and not _MODERATE[0] <= noe <= _MODERATE[1]:
        raise Unreachable(f"an NOE of {noe:.3g} %")
