"""What the node ``excitation`` plays, as ROS parameters: the catalogue of excitations says which there are."""

from __future__ import annotations

import numpy as np
from fric.excitation import EXCITATIONS
from fric.excitation.sequence import Sequence, sequence_of
from fric.excitation_kind import OUTPUTS
from fric.record import Units

from .parameters import NodeParameter, Settings, from_declaration

__all__ = ["PLAN", "planned"]

PLAN = (
    NodeParameter("kinds", ["multisine"], "excitations to go through, in this order", choices=tuple(EXCITATIONS)),
    NodeParameter("seed", 0, "of what is random in them", "", 0, 2**31 - 1),
    NodeParameter("start_delay", 1.0, "rest before the first", "s", 0.0, 1e6),
    NodeParameter("pause", 0.5, "rest after each", "s", 0.0, 1e6),
    NodeParameter("repeat", False, "go through them again and again"),
    NodeParameter("output", "reference", "what is published; force: position is the force [N or N m]", choices=OUTPUTS),
    *(from_declaration(p, kind.id, Units()) for kind in EXCITATIONS.values() for p in kind.parameters),
    *(NodeParameter(f"{k.id}.{t.name}", t.default, t.doc, choices=t.choices) for k in EXCITATIONS.values() for t in k.texts),
)


def planned(settings: Settings) -> Sequence:
    """The excitations that ``settings`` ask for.

    Raises:
        ExcitationError: one of them can't be published as is wanted, or a value can't be used.
    """
    return sequence_of(
        [EXCITATIONS[name] for name in settings.texts("kinds")],
        settings.text("output"),
        lambda kind, name: settings.number(f"{kind}.{name}"),
        lambda kind, name: settings.text(f"{kind}.{name}"),
        np.random.default_rng(settings.integer("seed")),
        (settings.number("start_delay"), settings.number("pause"), settings.flag("repeat")),
    )
