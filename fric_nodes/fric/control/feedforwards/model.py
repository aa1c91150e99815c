"""Force that an identified model needs along the reference, as :mod:`fric.control.feedforward` computes it."""

from __future__ import annotations

from ...model_file import read_model
from ...parameter import Parameter
from ..feedforward import Feedforward
from ..feedforward_kind import FeedforwardKind, Force, Setting, Text, checked_units

__all__ = ["FEEDFORWARD"]


def _build(setting: Setting) -> Force:
    made = Feedforward(
        setting.period,
        preview=setting.preview,
        transition_time=0.0,
        rest_fade_time=setting.values["rest_fade_time"],
        terms=setting.lists["terms"],
        include_inertia=setting.values["inertia"] > 0.0,
    )
    model = made.selected(read_model(setting.texts["model"]))
    checked_units(model.units, setting, setting.texts["model"])
    made.set_model(model, at_once=True)
    return made


FEEDFORWARD = FeedforwardKind(
    id="model",
    title="inverse of an identified model",
    build=_build,
    parameters=(
        Parameter("rest_fade_time", "T_r", "s", "time in which a static friction force is let down at rest", 0.0, default=0.1),
        Parameter("inertia", "w_m", "1", "1 feeds the force of inertia forward, 0 doesn't", 0.0, 1.0, default=1.0),
    ),
    texts=(
        Text("model", "a fric-model/1 file", is_file=True),
        Text("terms", "the effects of the model that count; none named: all", default="", several=True),
    ),
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, section 5.2",
)
