"""The generic asperity model: friction of a population of asperities, driven by a displacement.

Each of N independent asperities has a random height z and meets, one after the other, waves of random length w with a gap of
alpha w behind each. Where it meets a wave its tip sticks, and its spring k_t is stretched as the base moves on; the tip slips
while the spring holds mu(t) k_n z, with t the age of this contact; where the tip has come to the end of the wave it lets go,
and what the spring held, and the tip's m v^2/2, is lost. The next wave begins at the end of the gap or, where the base has
passed that already, at once. Motion may turn back at any time: springs relax and are stretched the other way, and a contact may
be lost at either end.

Energy method: the force over an interval is the work done in it over the displacement. With constant speed between samples this
is the mean force over the interval, which is what the compiled step gives, exactly, with any number of contacts found and lost
within.

What is not plain in print (scanned, with letters and fives missing) and how it is taken:

- *Mean force at constant mu_0* (Sec. 6). A contact slips over all of its wave, which takes mu_0 k_n z w, after it has been
  stretched to x_s = mu_0 k_n z/k_t, which takes mu_0 k_n z x_s/2; the period is (1 + alpha) w. The ratio of the means is F_t =
  mu_0 k_n z_0/(1 + alpha) [1 + c mu_0 k_n z_0/(2 k_t w_0) + m v^2/(2 mu_0 k_n z_0 w_0)], c = <z^2>/z_0^2. The print has c = 1,
  equal heights; uniform heights from 0 to 2 z_0 have c = 4/3. Where a wave is so short that x_s > alpha w, the period is w +
  x_s instead, which takes the share x_s^2/(4 alpha (1 + alpha) w_0^2) off (uniform waves, x_s < 2 alpha w_0).
- *Flat part* (Sec. 9): below v* = 1/(3 k_t*) with F_t* = mu* (1 + c mu*/(2 k_t*)), mu* = mu_inf/mu_0: the same with mu_inf. The
  print has "1(1 + 1/2kt) having the value of 12." The second mu* is missing: without it the value at 200 and 5 would be 5.0125;
  with it 5.0625 for equal heights, 5.083 for uniform ones (5.082 with the short waves). 5.125, which fives put back into ".12"
  would give, has the energy of sticking twice.
- *Normal force* (Sec. 5): k_n z while the asperity touches and its base lies within [0, (1 + L) w] of the wave. L is a constant
  of its own, lambda beside alpha in Fig. 2 and in the list of Sec. 7 (k_t* = 200, mu* = 5, alpha = 1, lambda = 0.5, m* = 0);
  here it is ``reach``. With uniform waves and x_s < 2 lambda w_0, 2 alpha w_0, and X = x_s/w_0, F_n* is the mean over the
  heights of y (1 + X - X^2/(4 lambda)) / (1 + X^2/(4 alpha (1 + alpha))): each contact begins to carry more as it is stretched
  further, so for lambda = 0.5 the load *falls* with speed. Lift-up as in Fig. 6, load that rises with speed because a foot that
  sticks misses the next step, needs the denominator to win: lambda = 0, load only while the base is above the wave, which is
  the default.
- Figures 6 to 8: k_t* of 500, 200 and 20; frequencies of 0.5, 0.2 and 0.1; m* = 5.

Source: F. Al-Bender, V. Lampaert, J. Swevers, Tribology Letters 16 (2004), Secs. 4 to 12, Eq. 1, Appendix I.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from ..record import Array
from . import asperity_growth as laws
from . import asperity_loops as loops

__all__ = ["GROWTH_LAWS", "AsperityError", "AsperityParameters", "AsperityPopulation", "AsperityRun"]

GROWTH_LAWS = laws.GROWTH_LAWS

_BLOCK = 512  # asperities whose states fit into the fastest memory


class AsperityError(InputError):
    """Parameters or a motion that an asperity population can't take."""


@dataclass(frozen=True)
class AsperityParameters:
    """What all asperities of a population share.

    The defaults are the paper's, in its normalised units: lengths over w_0, times over tau, tangential forces over
    mu_0 k_n z_0 N/(1 + alpha), normal forces over k_n z_0 N/(1 + alpha).

    Attributes:
        force: mu_0 k_n z_0 N/(1 + alpha), friction of contacts that are all fresh and stiff [F].
        stiffness: k_t N/(1 + alpha), stiffness of the share that touches [F/x].
        wavelength: w_0, mean length of a wave [x].
        time: tau, time in which a contact grows old [s].
        growth: M, friction of an old contact over that of a fresh one [1]; by the laws' equations.
        law: one of :data:`GROWTH_LAWS`.
        beta: exponent of the laws ``stretched``, ``exponential_power`` and ``power``, in (0, 1].
        gamma: power of the law ``exponential_power``, in (0, 1].
        gap: alpha, mean way without a wave over that with one [1].
        reach: lambda, how far beyond its wave, in wave lengths, the base still carries load [1].
        mass: m N/(1 + alpha), mass of the tips that touch [F s^2/x].
        load: k_n z_0 N/(1 + alpha), normal force while every asperity carries as long as a wave is long [F].
    """

    force: float = 1.0
    stiffness: float = 200.0
    wavelength: float = 1.0
    time: float = 1.0
    growth: float = 5.0
    law: str = "exponential"
    beta: float = 1.0
    gamma: float = 1.0
    gap: float = 1.0
    reach: float = 0.0
    mass: float = 0.0
    load: float = 1.0

    def __post_init__(self) -> None:
        where = "asperity parameters"
        if self.law not in GROWTH_LAWS:
            raise AsperityError(where, f"unknown law '{self.law}'", f"choose one of {', '.join(GROWTH_LAWS)}")
        for name in ("force", "stiffness", "wavelength", "time", "load"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise AsperityError(where, f"{name} is {getattr(self, name)}", "it must be finite and greater than 0")
        for name in ("gap", "reach", "mass"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise AsperityError(where, f"{name} is {getattr(self, name)}", "it must be finite and not negative")
        for name in ("beta", "gamma"):
            if not 0.0 < getattr(self, name) <= 1.0:
                raise AsperityError(where, f"{name} is {getattr(self, name)}", "it must lie in (0, 1], where growth slows down")
        if not 1.0 <= self.growth < np.inf:
            raise AsperityError(where, f"growth is {self.growth}", "contacts grow stronger with age: give 1 or more")

    @property
    def normalised_stiffness(self) -> float:
        """k_t* = k_t w_0/(mu_0 k_n z_0)."""
        return self.stiffness * self.wavelength / self.force

    def strength(self, age: float) -> float:
        """Friction coefficient of a contact of this ``age`` [s] over that of a fresh one, mu*."""
        law = GROWTH_LAWS.index(self.law)
        clock = laws.aged(law, laws.fresh(law), age / self.time)
        return float(laws.strength(law, clock, self.growth, self.beta, self.gamma))


@dataclass(frozen=True)
class AsperityRun:
    """What a population did along a displacement; every array has shape ``(n_samples - 1,)``, one value for each interval.

    Attributes:
        force: tangential force, mean over the interval [F]: work over displacement.
        load: normal force at the interval's end [F].
        touching: share of the asperities in contact at its end [1].
        separation: how far the bodies have moved apart since the start, at its end, over the mean height of an asperity [1].
    """

    force: Array
    load: Array
    touching: Array
    separation: Array


class AsperityPopulation:
    """Asperities with their states, which live from call to call.

    At the start every asperity is relaxed, somewhere on its topography, and its contact fresh. Heights are uniform from zero
    on, scaled so that their mean is the one that the parameters speak of.

    Args:
        parameters: what all have in common.
        n: number of asperities.
        seed: which of all random populations.

    Attributes:
        states: shape ``(4 n,)``: place of the tip [x], extension [x], clock of the contact, number of the event.
        heights: over the mean height, shape ``(n,)``.

    Raises:
        AsperityError: no asperities, or a negative seed.
    """

    def __init__(self, parameters: AsperityParameters, n: int = 20_000, seed: int = 1) -> None:
        if n < 1 or seed < 0:
            raise AsperityError("asperity population", f"{n} asperities, seed {seed}", "give at least 1 and a seed from 0 on")
        self.parameters = parameters
        self.seed = seed
        self.heights: Array = np.empty(n)
        self.states: Array = np.empty(4 * n)
        self._law = GROWTH_LAWS.index(parameters.law)
        self._separation = np.zeros(1)
        loops.heights(self.heights, 0, n, seed)
        loops.start(self.states, n, seed, self._law, parameters.gap, parameters.wavelength)

    @property
    def extension(self) -> Array:
        """Extension of each asperity's spring [x], shape ``(n,)``."""
        n = self.heights.shape[0]
        return self.states[n : 2 * n]

    @property
    def elastic_energy(self) -> float:
        """Energy of all springs [F x]."""
        p = self.parameters
        each = p.stiffness * (1.0 + p.gap) / self.heights.shape[0]
        return float(0.5 * each * np.dot(self.extension, self.extension))

    def run(self, displacement: npt.ArrayLike, sample_time: float, load: float | None = None) -> AsperityRun:
        """Lead the population along ``displacement`` [x], shape ``(n_samples,)``, with constant speed between samples.

        Args:
            displacement: of the bodies against each other; only its differences count.
            sample_time: [s].
            load: None keeps the bodies at the separation that they have. A normal force [F] is held by adapting the separation
                after every interval: all overlaps, and with them the limits of sticking, change by the same amount.

        Raises:
            AsperityError: the displacement isn't a finite row of two samples or more, or the sample time or the load isn't
                positive.
        """
        where = "asperity population"
        displacement = np.ascontiguousarray(displacement, dtype=np.float64)
        if displacement.ndim != 1 or displacement.shape[0] < 2 or not np.all(np.isfinite(displacement)):
            raise AsperityError(where, "displacement can't be used", "give finite positions, two or more, in one row")
        if not 0.0 < sample_time < np.inf:
            raise AsperityError(where, f"sample time is {sample_time}", "it must be finite and greater than 0")
        if load is not None and not 0.0 < load < np.inf:
            raise AsperityError(where, f"load is {load}", "it must be finite and greater than 0")
        p = self.parameters
        n = self.heights.shape[0]
        each = (1.0 + p.gap) / n
        shared = (
            p.force / p.stiffness, p.stiffness * each, p.mass * each, self.seed, self._law, p.growth, p.time, p.beta, p.gamma,
            p.gap, p.wavelength, p.reach,
        )  # fmt: skip
        force, other, touching = (np.empty(displacement.shape[0] - 1) for _ in range(3))
        if load is None:
            work = np.empty(9 * min(n, _BLOCK))
            lift = float(self._separation[0])
            loops.run(displacement, sample_time, lift, self.states, work, self.heights, *shared, force, other, touching)
            return AsperityRun(force, other * p.load * each, touching / n, np.full(force.shape[0], lift))
        wanted = load / (p.load * each)
        loops.run_under_load(
            displacement, sample_time, wanted, self._separation, self.states, np.empty(4 * n), self.heights, np.empty(n),
            *shared, force, other, touching,
        )  # fmt: skip
        return AsperityRun(force, np.full(force.shape[0], load), touching / n, other)
