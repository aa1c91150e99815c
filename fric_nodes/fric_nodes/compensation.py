"""The force of the node ``compensator``: a model's or a file's feedforward behind one fading, with parameters of ROS."""

from __future__ import annotations

from collections.abc import Mapping

from fric.control.controller_file import read_controller
from fric.control.fading import Faded
from fric.control.feedforward import Feedforward, fastest_identified
from fric.control.feedforward_kind import Force
from fric.control.shaping import Shaped, Shaping
from fric.errors import InputError
from fric.model import Model
from fric.model_file import read_model

from .parameters import NodeParameter, Settings
from .pid_parameters import same_period

__all__ = ["COMPENSATION", "Compensation"]

_LARGEST = 1e12  # physical scale: far above any force of an axis
COMPENSATION = (
    NodeParameter("model_file", "", "fric-model/1 file to start with; empty: no force until a model comes"),
    NodeParameter("controller_file", "", "fric-controller/1 file: its feedforward takes the place of a model's; empty: none"),
    NodeParameter("scale", 1.0, "share of the force that is given", "1", 0.0, 1.0, settable=True),
    NodeParameter("force_limit", 1e6, "largest force", "N or N m", 1e-12, _LARGEST, settable=True),
    NodeParameter("slew_limit", _LARGEST, "largest change of the force in a second", "N/s or N m/s", 1e-12, _LARGEST,
                  settable=True),
    NodeParameter("enabled", True, "give the force; false gives zero", settable=True),
    NodeParameter("follow_topic", True, "take over models from friction/model", settable=True),
    NodeParameter("terms", [""], "effects of the model to compensate; empty: all"),
    NodeParameter("include_inertia", True, "feed the inertia force forward too", settable=True),
    NodeParameter("preview", -1.0, "how much later than its stamp the force acts; negative: by the clock", "s", -1.0, 10.0,
                  settable=True),
    NodeParameter("transition_time", 0.2, "time to change from a model to another, and to switch on and off", "s", 0.0, 100.0),
    NodeParameter("rest_fade_time", 0.1, "time in which a static friction force is let down at rest", "s", 0.0, 100.0),
)  # fmt: skip


class Compensation:
    """The feedforward of a node with these settings.

    Args:
        settings: with :data:`COMPENSATION`.
        joint: whose models are taken.
        period: between two references [s].
        usual_preview: how much later than its stamp a force acts, where ``preview`` is negative [s].

    Attributes:
        force: what the node gives; its ``friction`` is the share of friction.

    Raises:
        InputError: a parameter or a file can't be used.
    """

    def __init__(self, settings: Settings, joint: str, period: float, usual_preview: float) -> None:
        self._settings, self._joint, self._usual = settings, joint, usual_preview
        self._said = False
        self._file = path = settings.text("controller_file")
        model_file, fade, enabled = settings.text("model_file"), settings.number("transition_time"), settings.flag("enabled")
        if path and model_file:
            raise InputError("compensator", "has a model_file and a controller_file", "give one of them")
        self._of_model = Feedforward(
            period,
            preview=self._preview(),
            transition_time=fade,
            rest_fade_time=settings.number("rest_fade_time"),
            terms=settings.texts("terms"),
            include_inertia=settings.flag("include_inertia"),
            enabled=enabled,
        )
        if model_file:
            self._of_model.set_model(self.checked(read_model(model_file)), at_once=True)
        made: Force = _feedforward_of(path, period, self._preview()) if path else self._of_model
        # A model's feedforward fades by itself when it is switched.
        self._faded = Faded(made, period, scale=settings.number("scale"), enabled=enabled or not path, time=fade)
        self.force = Shaped(self._faded, self._limits())

    def _preview(self) -> float:
        given = self._settings.number("preview")
        return given if given >= 0.0 else self._usual

    def _limits(self) -> Shaping:
        return Shaping(force_limit=self._settings.number("force_limit"), slew_limit=self._settings.number("slew_limit"))

    def update(self) -> None:
        """Take over settings that have changed."""
        enabled = self._settings.flag("enabled")
        if self._file:
            self._faded.enabled = enabled
        self._of_model.enabled = enabled
        self._of_model.include_inertia = self._settings.flag("include_inertia")
        self._of_model.preview = self._preview()
        self._faded.scale, self.force.shaping = self._settings.number("scale"), self._limits()

    def condition(self) -> Mapping[str, str]:
        """What the node adds to its report."""
        model = self._of_model.model
        effects = "none" if model is None else ", ".join(model.prefixes)
        return {
            "model": self._file or effects,
            "enabled": str(self._settings.flag("enabled")),
            "share in use": f"{self._faded.gain:.3g}",
            "limited": str(self.force.limited),
            "references faster than the model's recordings": str(self._of_model.beyond),
        }

    def beyond(self) -> str:
        """One line, the first time that a reference is faster than the recordings of the model; empty otherwise."""
        model = self._of_model.model
        if self._said or self._of_model.beyond == 0 or model is None:
            return ""
        self._said = True
        speed = fastest_identified(model)
        return f"reference: faster than the recordings of the model ({speed:.3g}); its friction is extrapolated from there on"

    def checked(self, model: Model) -> Model:
        """``model`` as it would be used.

        Raises:
            InputError: it can't be.
        """
        if self._file:
            raise InputError("model", f"the feedforward of {self._file} is in use", "leave controller_file out to take models")
        if model.joint != self._joint:
            raise InputError("model", f"is of joint '{model.joint}'", f"give one of joint '{self._joint}'")
        return self._of_model.selected(model)

    def use(self, model: Model) -> None:
        """Change to ``model``, over the transition time."""
        self._of_model.set_model(model)
        self._said = False


def _feedforward_of(path: str, period: float, preview: float) -> Force:
    """The feedforward of a controller file.

    Raises:
        InputError: the file can't be used, is for another period, or names no feedforward.
    """
    found = read_controller(path)
    same_period(path, found.period, period)
    if found.feedforward is None:
        raise InputError(path, "names no feedforward", "add the key feedforward, or give a model_file")
    return found.feedforward.build(period, preview)
