"""What the examiner's axis consists of: every number of its equations, by name.

The equations are those of :mod:`fric.diagnosis.prove.truth`. They are typed there anew and share no line with the models
that a diagnosis fits, so that an error of those models can't hide itself. Zero means "not there" for every field but the mass.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np

from ...record import Array

__all__ = ["FIELDS", "Physics"]


@dataclass(frozen=True)
class Physics:
    """Numbers of an axis, SI.

    Attributes:
        mass: all that moves [kg].
        load_share: part of it behind the transmission; 0: one body.
        coulomb: level [N].
        viscous: [N s/m].
        bias: [N], against positive motion.
        stribeck, stribeck_velocity, stribeck_form: surplus [N], [m/s]; form 0 Gaussian, 1 Hess and Soom, 2 Tustin, 3 secant.
        acceleration, acceleration_velocity, acceleration_form: speeding up [N], [m/s]; 0 Hess and Soom, 1 Gaussian, 2 secant.
        asymmetry, asymmetry_viscous: half the difference forward less backward [N], [N s/m].
        drag, drag_form: [N s^2/m^2]; form 1: exponent 1.75 instead of 2, 2: partly 3, the same at ``drag_velocity`` [m/s].
        shear, shear_velocity, shear_form: levels off [N], [m/s]; 0 exponential, 1 the power 2/3, 2 hyperbolic.
        presliding: 0 rigid, 1 bristle, 2 elements with slip dynamics, 3 population of elements that stick or slip.
        displacement: pre-sliding displacement, level over stiffness [m].
        presliding_damping: [N s/m], of the bristle or of the elements together.
        lag, lag_time: 1 first order, 2 second order, 3 pure delay, 4 two lags side by side; [s].
        dwell, dwell_form, dwell_time, dwell_length: [N], 1 logarithmic, 2 exponential, 3 hyperbolic, 4 of a root; [s], [m].
        load, load_form: relative change of the level per relative change of the load; form 1: a power of it, 2: its root.
        temperature, temperature_viscous, temperature_form: [1/K], [N s/m/K]; form 1: an exponential, 2: Vogel's.
        spot, spot_position, spot_width, spot_form: relative, [m], [m]; form 1: a Lorentz curve, 2: flat at its top.
        wave_cosine, wave_sine, wave_period: relative, [m].
        drift, drift_time: relative change per second or, with a time [s], in the long run.
        ripple_cosine, ripple_sine, ripple_period: [N], [m].
        stiffness, stiffness_position, cubic, cubic_position: [N/m], [m], [N/m^3], [m].
        gap, stop_stiffness, stop_damping: play [m]; its ends are rigid without a stiffness [N/m], [N s/m].
        shaft, shaft_damping, shaft_square, shaft_cubic: between both bodies [N/m], [N s/m], [N/m^2], [N/m^3].
        appendage, appendage_frequency, appendage_damping: [kg], [Hz], ratio.
        limit, limit_form: of the actuator [N]; form 1: a soft knee.
        dead_zone, dead_zone_form: half width [N]; form 1: rounded.
        delay: [s].
        actuator, actuator_time: 1 first, 2 second, 3 third order; [s].
        payload, payload_time: mass that joins [kg] at a time [s].
        heat, heat_time, heat_force: loss of gain at the usual force, [s], that force [N].
        dip: loss of gain in the windows.
        cable, cable_play, cable_position: one-sided drag chain [N/m], half width of its play [m], where it begins to pull [m].
        dirt: relative rise of the level in the windows.
        floor, floor_frequency: force from outside [N], [Hz].
        gear, gear_driven, gear_form: friction per force that drives the body, and, in form 1, that is driven back by it.
        gain_ripple, gain_ripple_period: relative change of the drive's gain over position, [m].
        fading: relative loss of the drive's gain per speed of the motor [s/m].
        thixotropy, thixotropy_time, thixotropy_shear: viscous coefficient at rest [N s/m], [s], [1/m].
        eccentricity, eccentricity_period: error of the encoder [m], [m].
        elements: of pre-sliding of kinds 2 and 3, each with its share of the level and of the stiffness.
    """

    mass: float = 1.0
    load_share: float = 0.0
    coulomb: float = 0.0
    viscous: float = 0.0
    bias: float = 0.0
    stribeck: float = 0.0
    stribeck_velocity: float = 1.0
    stribeck_form: float = 0.0
    acceleration: float = 0.0
    acceleration_velocity: float = 1.0
    acceleration_form: float = 0.0
    asymmetry: float = 0.0
    asymmetry_viscous: float = 0.0
    drag: float = 0.0
    drag_form: float = 0.0
    drag_velocity: float = 1.0
    shear: float = 0.0
    shear_velocity: float = 1.0
    shear_form: float = 0.0
    presliding: float = 0.0
    displacement: float = 1e-5
    presliding_damping: float = 0.0
    lag: float = 0.0
    lag_time: float = 1.0
    dwell: float = 0.0
    dwell_form: float = 0.0
    dwell_time: float = 1.0
    dwell_length: float = 1.0
    load: float = 0.0
    load_form: float = 0.0
    temperature: float = 0.0
    temperature_viscous: float = 0.0
    temperature_form: float = 0.0
    spot: float = 0.0
    spot_position: float = 0.0
    spot_width: float = 1.0
    spot_form: float = 0.0
    wave_cosine: float = 0.0
    wave_sine: float = 0.0
    wave_period: float = 1.0
    drift: float = 0.0
    drift_time: float = 0.0
    ripple_cosine: float = 0.0
    ripple_sine: float = 0.0
    ripple_period: float = 1.0
    stiffness: float = 0.0
    stiffness_position: float = 0.0
    cubic: float = 0.0
    cubic_position: float = 0.0
    gap: float = 0.0
    stop_stiffness: float = 0.0
    stop_damping: float = 0.0
    shaft: float = 0.0
    shaft_damping: float = 0.0
    shaft_square: float = 0.0
    shaft_cubic: float = 0.0
    appendage: float = 0.0
    appendage_frequency: float = 1.0
    appendage_damping: float = 0.0
    limit: float = 0.0
    limit_form: float = 0.0
    dead_zone: float = 0.0
    dead_zone_form: float = 0.0
    delay: float = 0.0
    actuator: float = 0.0
    actuator_time: float = 1.0
    payload: float = 0.0
    payload_time: float = 0.0
    heat: float = 0.0
    heat_time: float = 1.0
    heat_force: float = 1.0
    dip: float = 0.0
    cable: float = 0.0
    cable_play: float = 0.0
    cable_position: float = 0.0
    dirt: float = 0.0
    floor: float = 0.0
    floor_frequency: float = 1.0
    gear: float = 0.0
    gear_driven: float = 0.0
    gear_form: float = 0.0
    gain_ripple: float = 0.0
    gain_ripple_period: float = 1.0
    fading: float = 0.0
    thixotropy: float = 0.0
    thixotropy_time: float = 1.0
    thixotropy_shear: float = 0.0
    eccentricity: float = 0.0
    eccentricity_period: float = 1.0
    elements: tuple[tuple[float, float], ...] = field(default=())

    def vector(self) -> Array:
        """All numbers but the elements, in the order of :data:`FIELDS`, shape ``(n_fields,)``."""
        return np.array([float(getattr(self, name)) for name in FIELDS])

    def population(self) -> Array:
        """The elements, shape ``(n_elements, 2)``."""
        return np.array(self.elements, dtype=np.float64).reshape(-1, 2)

    def using(self, changes: Mapping[str, float | tuple[tuple[float, float], ...]]) -> Physics:
        """The same axis with other numbers."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def named(self) -> dict[str, float]:
        """What isn't at its default, by name."""
        return {name: float(getattr(self, name)) for name in FIELDS if getattr(self, name) != _DEFAULTS[name]}


FIELDS: tuple[str, ...] = tuple(each.name for each in fields(Physics) if each.name != "elements")
"""Names of the numbers in the order of :meth:`Physics.vector`."""

_DEFAULTS = {each.name: each.default for each in fields(Physics)}
