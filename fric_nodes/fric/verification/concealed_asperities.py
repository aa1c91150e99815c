"""An axis whose friction is a population of asperities, which no candidate equals, diagnosed from a Coulomb model."""

from __future__ import annotations

import numpy as np

from ..friction.asperity import AsperityParameters, AsperityPopulation
from ..model import build_model, term
from ..record import Array, Record
from .concealed_reference import Case, Limits, evidence, found_in
from .verification import Evidence, Verification

__all__ = ["VERIFICATION", "slide"]

_STEP, _FINER = 2e-3, 16  # [s], between samples; steps of the integration per sample
_MASS, _VISCOUS = 2.0, 12.0
_POPULATION = AsperityParameters(force=3.0, stiffness=4e4, wavelength=2e-3, time=0.05, growth=1.6)
_RESOLUTION, _NOISE = 2e-7, 0.05  # [m], [N]
_TONES = ((0.35, 0.020), (1.3, 0.008), (4.1, 0.003))  # [Hz], [m]


def slide(
    population: AsperityPopulation, mass: float, viscous: float, reference: tuple[Array, Array, Array], step: float, finer: int
) -> tuple[Array, Array]:
    """Position [m] and force [N] at each sample of a body that a controller moves along ``reference`` over ``population``.

    The body is led by the symplectic Euler method; the population is exact along each of its steps.

    Args:
        population: is led on.
        mass: [kg].
        viscous: [N s/m].
        reference: position, velocity and acceleration, each ``(n,)``.
        step: between samples [s].
        finer: steps of the integration per sample.
    """
    position, force = np.empty_like(reference[0]), np.empty_like(reference[0])
    h = step / finer
    q, v = float(reference[0][0]), 0.0
    # Crossover near 8 Hz: it follows, and pre-sliding still shows.
    kp, kd = mass * 2500.0, mass * 70.0
    for k, (r, w, a) in enumerate(zip(*(each.tolist() for each in reference), strict=True)):
        u = kp * (r - q) + kd * (w - v) + mass * a
        position[k], force[k] = q, u
        for _ in range(finer):
            ahead = q + h * v
            friction = float(population.run(np.array([q, ahead]), h).force[0])
            q = ahead
            v += h / mass * (u - viscous * v - friction)
    return position, force


def _reference(duration: float, random: np.random.Generator) -> tuple[Array, Array, Array]:
    """Swings of three frequencies, which a slow rise and fall makes now large, now small."""
    t = np.arange(0.0, duration, _STEP)
    slow = 2.0 * np.pi / duration * 2.0
    size, grow, bend = 0.55 - 0.45 * np.cos(slow * t), 0.45 * slow * np.sin(slow * t), 0.45 * slow**2 * np.cos(slow * t)
    q, v, a = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
    for frequency, amplitude in _TONES:
        w = 2.0 * np.pi * frequency * float(random.uniform(0.9, 1.1))
        phase = w * t + float(random.uniform(0.0, 2.0 * np.pi))
        q += amplitude * np.sin(phase)
        v += amplitude * w * np.cos(phase)
        a -= amplitude * w**2 * np.sin(phase)
    return size * q, size * v + grow * q, size * a + 2.0 * grow * v + bend * q


def _recorded(duration: float, seed: int, name: str) -> Record:
    random = np.random.default_rng(seed)
    population = AsperityPopulation(_POPULATION, 600, seed)
    position, force = slide(population, _MASS, _VISCOUS, _reference(duration, random), _STEP, _FINER)
    return Record(
        time=_STEP * np.arange(position.shape[0], dtype=np.float64),
        position=np.round(position / _RESOLUTION) * _RESOLUTION,
        effort=force + _NOISE * random.standard_normal(force.shape[0]),
        source=name,
        effort_hold="following",
    )


def _case() -> Case:
    terms = [term("coulomb", force=2.5), term("viscous", coefficient=15.0), term("bias", force=0.0)]
    nominal = build_model("rigid", {"mass": 1.1 * _MASS}, terms)
    return Case([_recorded(20.0, 5, "training")], [_recorded(14.0, 6, "validation")], nominal)


def _run() -> Evidence:
    p = _POPULATION
    notes = [
        f"Concealed: 600 asperities of random height that stick, slip and let go (k_t* = {p.normalised_stiffness:g}, growth"
        f" {p.growth:g} within {p.time:g} s): springs after a reversal and friction that falls with speed, both of one cause.",
        "No candidate equals it; what is named is the nearest of what they are, and the share that stays unexplained is said.",
    ]
    case = _case()
    # With growth the population weakens with speed, too: either of its two sides may come first.
    return evidence(case, found_in(case), ("presliding", "stribeck"), ("guideway friction",), Limits(), notes)


VERIFICATION = Verification(
    id="concealed_asperities",
    title="Concealed: friction of an asperity population behind a Coulomb model",
    source="Al-Bender, Lampaert, Swevers 2004, Secs. 4 to 6; the body integrated by the symplectic Euler method",
    run=_run,
)
