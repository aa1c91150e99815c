"""Online estimators against what they must do: follow a step of friction within three seconds, and stay put at rest.

The axis is simulated with known values, its position quantised, its force noisy. Coulomb friction grows by half from one
sample to the next while the axis follows a multisine; and for ten minutes it stands while the drive pushes below break-away
and the encoder flickers by a count. A short form of ``fric bench online``, which counts intervals too.
"""

from __future__ import annotations

from ..figure import Figure
from ..identification.online.trials import follow, wander
from ..report.figures import Curve, stacked
from .verification import Evidence, Verification

__all__ = ["VERIFICATION"]

_COLOURS = {"rls": "before", "ekf": "after", "ukf": "second"}
_REST, _REST_STEP = 600.0, 0.01  # [s]


def _run() -> Evidence:
    figures, panels = [], []
    for kind, colour in _COLOURS.items():
        found = follow(kind)
        shown = found.time > 12.0
        curves = [
            Curve("true", found.time[shown], found.truth[shown], "true", "dash"),
            Curve(kind, found.time[shown], found.value[shown], colour),
        ]
        panels.append(("Coulomb friction [N]", curves))
        figures.append(Figure(f"{kind}: within 5 % of a friction grown by half, after", found.settled, "s", "<= 3"))
        rest = wander(kind, _REST, _REST_STEP)
        figures += [
            Figure(f"{kind}: 10 min at rest, largest change of an estimate in its standard error", rest.errors, "1", "<= 0.5"),
            Figure(f"{kind}: 10 min at rest, largest change of an estimate, of its value", rest.share, "1", "<= 0.01"),
            Figure(f"{kind}: 10 min at rest, growth of a standard error", rest.widened, "1", "<= 0.1"),
        ]
    caption = "Estimated Coulomb friction around a step of the true one at 15 s, by each of the estimators."
    notes = ["Least squares learn in blocks of half a second, and want two of them before they believe in a change."]
    return Evidence(figures, [(stacked(panels, "time [s]"), caption)], notes)


VERIFICATION = Verification(
    id="online",
    title="Online identification",
    source="a simulated axis with known values, before and after a change",
    run=_run,
)
