"""The simulated axis as ROS parameters: its model file, its sensors, its drive."""

from __future__ import annotations

from pathlib import Path

from fric.axis import SimulatedAxis
from fric.model import Model
from fric.model_file import read_model
from fric.shared_files import config_file

from .parameters import NodeParameter, Settings

__all__ = ["AXIS", "model_at", "model_in", "simulated_axis"]

AXIS = (
    NodeParameter(
        "model_file",
        "",
        "fric-model/1 file of the axis; empty: the demo axis that comes with the package; set to another file of the same "
        "structure, the axis goes on with its values",
        settable=True,
    ),
    NodeParameter("resolution", 1e-7, "step of the encoder; 0: ideal", "m or rad", 0.0, 1.0),
    NodeParameter("position_noise", 0.0, "standard deviation of a reading of the encoder", "m or rad", 0.0, 1.0),
    NodeParameter("readings", 1, "readings of the encoder per sample; their mean is published", "", 1, 1000),
    NodeParameter("publish_velocity", True, "publish the difference quotient of positions as velocity; false: leave it empty"),
    NodeParameter("force_noise", 0.0, "standard deviation of the effort signal", "N or N m", 0.0, 1e9),
    NodeParameter(
        "force_limit", 1e6, "largest force of the drive (or largest command, if it is no force)", "N or N m", 0.0, 1e12
    ),
    NodeParameter("seed", 0, "of the noise", "", 0, 2**31 - 1),
)


def model_in(settings: Settings) -> Model:
    """The model that the parameter ``model_file`` means.

    Raises:
        InputError: the file can't be used.
    """
    return model_at(settings.text("model_file"))


def model_at(given: str) -> Model:
    """The model that is meant: of a path, or of a file that comes with fric; empty: of the demo axis.

    Raises:
        InputError: the file can't be used.
    """
    path = Path(given or "demo_axis.yaml")
    return read_model(config_file(path.name) if not given or (path.name == given and not path.exists()) else path)


def simulated_axis(settings: Settings) -> SimulatedAxis:
    """The axis that ``settings`` describe, compiled, or fetched from the cache, here and not at the first sample.

    Raises:
        InputError: a value or the model file can't be used.
    """
    axis = SimulatedAxis(
        model_in(settings),
        resolution=settings.number("resolution"),
        position_noise=settings.number("position_noise"),
        readings=settings.integer("readings"),
        force_noise=settings.number("force_noise"),
        force_limit=settings.number("force_limit"),
        seed=settings.integer("seed"),
    )
    axis.advance(0.0, 1e-12)
    axis.measure()
    return axis
