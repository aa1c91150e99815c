"""A model from whatever a caller has: the model, its file, or the names of effects."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from ..effects import EFFECTS
from ..identification.start import start_model
from ..model import Model
from ..model_file import read_model
from ..record import Units

__all__ = ["ModelLike", "model_from", "to_fit"]

ModelLike = Model | str | Path | Iterable[str]


def model_from(given: ModelLike, joint: str = "axis", units: Units | None = None) -> Model:
    """The model that ``given`` stands for.

    Args:
        given: a model; the path of a ``fric-model/1`` file; or effects, as ``"coulomb,viscous,bias"`` or a list of names.
        joint: name of the joint, for effects.
        units: of the joint, for effects; m and N where not given.

    Raises:
        ModelError: no such file, not a model, or an effect that isn't known.
    """
    if isinstance(given, Model):
        return given
    if isinstance(given, (str, Path)):
        names = [name.strip() for name in str(given).split(",") if name.strip()]
        known = {effect.id for effect in EFFECTS.values()}
        is_file = Path(given).suffix in {".yaml", ".yml"} and not (names and names[0].split("/")[0] in known)
        if isinstance(given, Path) or is_file:
            return read_model(Path(given))
    else:
        names = list(given)
    return start_model(names, joint, units or Units())


def to_fit(given: ModelLike, joint: str, units: Units) -> Model:
    """:func:`model_from` for the joint of a recording, with nothing left of where the start values come from."""
    return replace(model_from(given, joint, units), joint=joint, standard_errors={}, provenance={})
