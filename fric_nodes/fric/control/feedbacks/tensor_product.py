"""Tensor-product control after Szell: state feedback with an integral, its gains interpolated between those of the vertices.

Its gains come from a design file (``fric-tp-controller/1``), which a controller file names by ``design``:

    controller: {type: tensor_product, design: tp.yaml, filter_time: 0.002, tolerance: 1.0e-5}

The law is :class:`fric.control.tensor_product.law.TensorProductLaw`. It reads the position alone: a design that has the force
of the actuator for a state is for programs that measure it, and is refused here.
Source: Szell, Sec. 2 (polytopic model); Tanaka and Wang 2001, chapter 3 (parallel distributed compensation).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ...parameter import Parameter
from ..controller import Controller, Law
from ..tensor_product.design import TensorProductController
from ..tensor_product.design_file import read_tp_controller
from ..tensor_product.law import TensorProductLaw
from ..tensor_product.quasi_lpv import TensorProductControlError

__all__ = ["CONTROLLER", "designed_by"]


def _without_design(values: Mapping[str, float], limit: float) -> Law:
    raise TensorProductControlError("tensor-product controller", "it has no design", "read one with CONTROLLER.designed(path)")


def _designed(path: Path) -> Controller:
    design = read_tp_controller(path)
    if "force" in design.states or design.input_unit != "F":
        problem = "the design feeds back the force of the actuator, and only the position is read here"
        raise TensorProductControlError(path, problem, "design it for a mass on friction, or use TensorProductLaw.step")
    return designed_by(design)


def designed_by(design: TensorProductController) -> Controller:
    """The kind of controller that holds ``design``, which feeds back position and velocity alone."""
    return replace(CONTROLLER, build=lambda values, limit: TensorProductLaw(design, limit, **values), units=design.units)


CONTROLLER = Controller(
    id="tensor_product",
    title="tensor-product controller (parallel distributed compensation)",
    parameters=(
        Parameter("filter_time", "T_f", "s", "time constant of the measured velocity's filter", lower=0.0, default=0.0),
        Parameter("tolerance", "e_0", "x", "error within which the integral stands still", lower=0.0, default=0.0),
        Parameter("velocity_weight", "c", "1", "weight of the reference's velocity", lower=0.0, default=1.0),
    ),
    build=_without_design,
    source="Szell, Friction with Hysteresis Loop Modeled by Tensor Product; Tanaka and Wang 2001",
    designed=_designed,
)
