"""How sure a diagnosis would be of an effect that isn't there, were it of some energy: the evidence that is to be expected.

An effect that takes the energy g off what is missing, of which no rival leaves more than a part, has shares, evidence of halves
and of rivals that follow from g, at first order and on average over the noise. The map learnt from examinations
(:mod:`.calibration`) makes a probability of them, as it does of an effect that was found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.optimize import brentq

from .calibration import Evidence, calibration
from .confidence import AS_LIKELY, UNEXPLAINED, margin
from .fitting import NOTHING

__all__ = ["Expected"]

_MOST = 1e8  # numerical, of what the model leaves: an effect that isn't clear then never is


@dataclass(frozen=True)
class Expected:
    """Beside what an effect would come.

    Attributes:
        left: energy of what the model leaves [F^2].
        floor: what it would leave were nothing missing [F^2].
        excess: what is missing above that [F^2].
        independent: about how many independent values the recordings hold.
        least: energy that a term has to take off to come at all [F^2].
    """

    left: float
    floor: float
    excess: float
    independent: float
    least: float

    def nats(self, energy: float) -> float:
        """Evidence for something that takes off ``energy`` [F^2]."""
        return 0.5 * self.independent * math.log1p(energy / self.left)

    def sure(self, effect: str, energy: float, apart: float) -> float:
        """How likely an effect is said to be there, 0 to 1.

        Args:
            effect: its id.
            energy: that it takes off [F^2].
            apart: the part of that which the best of its rivals leaves, 0 to 1.
        """
        missing, alone = self.excess + energy, apart * energy
        rest = self.excess / missing
        return calibration().probability(
            effect,
            Evidence(
                share=energy / missing,
                rest=rest,
                halves=0.5 * self.nats(energy),
                functions=self.nats(alone),
                rivals=1.0 / (1.0 + math.exp(-min(self.nats(alone), 50.0))),
                margin=margin(self.excess + alone, self.excess, self.floor, missing),
                complete=rest <= UNEXPLAINED or self.excess <= NOTHING * self.floor,
                # Each half knows the effect to twice the variance that all do, and both differ by twice that.
                agreement=math.log(max(0.25 * self.independent * energy / self.left, 1e-300)),
            ),
        )

    def needed(self, effect: str, apart: float) -> float | None:
        """The energy at which an effect is as likely said to be there as not [F^2]; None where it never is.

        Args:
            effect: its id.
            apart: the part of its energy which the best of its rivals leaves, 0 to 1.
        """

        def lacks(log_energy: float) -> float:
            return AS_LIKELY - self.sure(effect, math.exp(log_energy), apart)

        low, high = math.log(self.least), math.log(max(_MOST * self.left, self.least))
        if lacks(low) <= 0.0:
            return self.least
        return None if lacks(high) > 0.0 else math.exp(brentq(lacks, low, high, xtol=1e-3))
