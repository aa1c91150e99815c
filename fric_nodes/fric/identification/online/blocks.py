"""What recursive least squares keep: the equations of a block of samples, and what was known before it."""

from __future__ import annotations

from dataclasses import dataclass

from ...record import Array, Mask
from ..rests import Rests, at_rest

__all__ = ["Block", "Known"]


@dataclass(frozen=True)
class Known:
    """What has been learnt until some moment."""

    values: Array
    information: Array
    scores: Array
    n_blocks: float
    energy: float
    lagged_energy: float
    weight: float
    last_residual: float
    explained: float
    samples_used: int


@dataclass(eq=False)
class Block:
    """The equations of one block: rows ``(n, n_parameters)``, the rest of shape ``(n,)``, and the two sample times [s].

    Whether it rests in a row is judged beside the motion of all blocks kept, not of its own: ``sliding`` rows aren't at rest,
    and into ``clear`` ones no rest reaches.
    """

    rows: Array
    target: Array
    velocity: Array
    rests: Rests
    row_time: float
    sample_time: float
    sliding: Mask
    clear: Mask

    def used(self, only_clear: bool) -> Mask:
        """Rows to learn from."""
        return self.clear if only_clear else self.sliding

    def judge(self, rest: float) -> None:
        """Say where it rests, when that is slower than ``rest`` [x/s] for a while."""
        limit = max(rest, self.rests.noise)
        self.sliding = ~at_rest(self.velocity, limit, self.row_time)
        self.clear = self.sliding & self.rests.clear(limit)
