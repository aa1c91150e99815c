"""Model files: the way there and back, every kind of refusal with its line, writing all or nothing."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from fric.errors import InputError
from fric.model import Model, ModelError, build_model, term
from fric.model_file import json_schema, model_from_text, model_to_text, read_model, write_model
from fric.record import Units
from ruamel.yaml import YAML

GOOD = """\
format: fric-model/1
joint: axis
units: {position: m, force: N}
plant: {type: rigid, mass: 1.2}
terms:
  - {effect: coulomb, force: 4.0}
  - {effect: viscous, coefficient: 10.0}
"""


def whole() -> Model:
    terms = [
        term("presliding", stiffness=1e5, damping=100.0),
        term("coulomb", force=1.0 / 3.0),
        term("stribeck", force=2.0, velocity=0.01, exponent=1.7),
        term("asymmetry", force=-0.5, coefficient=1e-17),
        term("viscous", coefficient=1e22),
        term("bias", force=-0.7),
    ]
    errors = {"mass": 0.01, "stribeck.velocity": 1e-4}
    return build_model(
        "rigid",
        {"mass": 1.2},
        terms,
        joint="x: 1",
        units=Units("rad", "N m"),
        standard_errors=errors,
        nominal={"normal_load": 120.0, "temperature": 21.5},
        provenance={"bag": "a#b: 'c'"},
    )


def test_the_file_of_the_contract_is_read() -> None:
    model = model_from_text(GOOD)
    assert model.names == ("mass", "coulomb.force", "viscous.coefficient")
    np.testing.assert_array_equal(model.values, [1.2, 4.0, 10.0])
    assert (model.joint, model.units) == ("axis", Units("m", "N"))


def test_what_is_written_is_read_back_to_the_last_bit(tmp_path: Path) -> None:
    path = tmp_path / "new folder" / "model.yaml"
    write_model(whole(), path)
    again = read_model(path)
    assert again == whole()
    assert again.values.tobytes() == whole().values.tobytes()
    assert model_to_text(again) == path.read_text(encoding="utf-8")
    assert [entry.name for entry in path.parent.iterdir()] == ["model.yaml"]


def test_every_value_carries_its_unit() -> None:
    text = model_to_text(whole())
    assert re.search(r"mass: 1\.2 +# m \[kg m\^2\]", text)
    assert re.search(r"stiffness: 100000\.0 +# sigma_0 \[N m/rad\]", text)
    assert re.search(r"damping: 100\.0 +# sigma_1 \[N m s/rad\]", text)


def test_defaults_may_be_left_out() -> None:
    model = model_from_text(GOOD + "  - {effect: stribeck, force: 2, velocity: 1e-2}\n")
    assert model.value("stribeck.exponent") == 2.0
    assert model.value("stribeck.velocity") == 0.01


# What is put in place of a line of the good file, the line that the message must name, and what it must say.
BAD = [
    ("plant", "plant: {type: rigid, mass: -1}", 4, "'plant.mass' is -1", "greater than 0"),
    ("plant", "plant: {type: rigid, mass: 0}", 4, "'plant.mass' is 0", "greater than 0"),
    ("plant", "plant: {type: rigid}", 4, "'plant.mass' is missing", "moving mass"),
    ("plant", "plant: {type: foo, mass: 1}", 4, "'foo' is not known", "rigid"),
    ("plant", "plant: {mass: 2}", 4, "type is missing", "rigid"),
    ("plant", "plant: {type: rigid, mass: true}", 4, "'plant.mass' is True", "number"),
    ("plant", "plant: {type: rigid, mass: '1.2'}", 4, "'plant.mass' is '1.2'", "number"),
    ("plant", "plant: {type: rigid, mass: .inf}", 4, "'plant.mass' is inf", "finite"),
    ("plant", "plant: {type: rigid, mass: 1, stiffness: 2}", 4, "unknown key 'plant.stiffness'", "type, mass"),
    ("plant", "plant: [", 6, "", "correct the YAML"),
    ("plant", "plant: 3", 4, "'plant' is 3", "dictionary"),
    ("format", "format: fric-model/2", 1, "'format' is 'fric-model/2'", "fric-model/1"),
    ("format", "format: ", 1, "'format' is None", "fric-model/1"),
    ("units", "units: {position: m}", 3, "'units.force' is missing", "force: N"),
    ("units", "units: {position: mm, force: N}", 3, "'units.position' is 'mm'", "'m' or 'rad'"),
    ("units", "units: {position: m, force: ''}", 3, "'units.force' is ''", "at least 1 character"),
    ("joint", "joint: 3", 2, "'joint' is 3", "string"),
    ("joint", "jiont: axis", 2, "unknown key 'jiont'", "joint"),
    ("joint", "joint: axis\nbla: 3", 3, "unknown key 'bla'", "provenance"),
    ("joint", "joint: axis\njoint: other", 3, "duplicate key", "correct the YAML"),
    ("terms", "terms: 4", 5, "'terms' is 4", "list"),
    ("terms", "terms:\n  - {effect: bias, force: 1}\n  - {effect: coulob, force: 3}", 7, "'coulob' is not known", "coulomb"),
    (
        "terms",
        "terms:\n  - {effect: bias, force: 1}\n  - {effect: coulomb, froce: 3}",
        7,
        "unknown key 'terms.1.froce'",
        "force",
    ),
    ("terms", "terms:\n  - effect: coulomb\n    force: .nan", 7, "'terms.0.force' is nan", "finite"),
    ("terms", "terms:\n  - {effect: coulomb, force: -3}", 6, "'terms.0.force' is -3", "greater than or equal to 0"),
    ("terms", "terms:\n  - {effect: coulomb}", 6, "'terms.0.force' is missing", "friction level"),
    ("terms", "terms:\n  - {force: 3}", 6, "effect is missing", "coulomb"),
    ("terms", "terms:\n  - coulomb", 6, "'terms.0' is 'coulomb'", "dictionary"),
    ("terms", "terms:\n  - {effect: stribeck, law: hess, force: 3}", 6, "law 'hess' of stribeck is not known", "exponential"),
    (
        "terms",
        "terms:\n  - {effect: stribeck, force: 3, velocity: 1, exponent: 40}",
        6,
        "'terms.0.exponent' is 40",
        "less than or equal to 10",
    ),
    ("terms", "terms:\n  - {effect: coulomb, force: 3}\n  - {effect: coulomb, force: 3}", 5, "there twice", "keep one"),
    ("terms", "terms: []\nstandard_errors: {masss: 3}", 6, "'masss', which the model doesn't have", "mass"),
    ("terms", "terms: []\nstandard_errors: {mass: -3}", 6, "'standard_errors.mass' is -3", "greater than or equal to 0"),
]


def with_line(key: str, instead: str) -> str:
    lines = {line.split(":")[0]: line for line in GOOD.splitlines() if not line.startswith(" ")}
    lines["terms"] = "terms: []"
    lines[key] = instead
    return "\n".join(lines.values()) + "\n"


@pytest.mark.parametrize(("key", "instead", "line", "problem", "remedy"), BAD, ids=[row[1].replace("\n", " ") for row in BAD])
def test_each_refusal_names_line_cause_and_remedy(
    tmp_path: Path, key: str, instead: str, line: int, problem: str, remedy: str
) -> None:
    path = tmp_path / "axis.yaml"
    path.write_text(with_line(key, instead), encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        read_model(path)
    error = caught.value
    assert error.where == f"{path}, line {line}"
    assert problem in error.problem
    assert remedy in error.remedy
    assert "\n" not in str(error)


@pytest.mark.parametrize("text", ["", "[]", "just words", "3"])
def test_what_is_no_model_at_all_is_refused(text: str) -> None:
    with pytest.raises(ModelError, match="fric-model/1"):
        model_from_text(text, "f.yaml")


@pytest.mark.parametrize("text", ["format: fric-model/1", "{}"])
def test_an_empty_model_misses_something(text: str) -> None:
    with pytest.raises(ModelError, match="is missing"):
        model_from_text(text, "f.yaml")


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no such file"):
        read_model(tmp_path / "nothing.yaml")
    with pytest.raises(ModelError, match="cannot be read"):
        read_model(tmp_path)
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ModelError, match="cannot be read"):
        read_model(binary)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "model.yaml"
    path.write_text("old", encoding="utf-8")

    def full(source: object, target: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(InputError, match="cannot be written"):
        write_model(whole(), path)
    assert path.read_text(encoding="utf-8") == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["model.yaml"]


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="choose a folder"):
        write_model(whole(), tmp_path / "file" / "model.yaml")


def test_the_schema_lists_every_effect_with_its_bounds() -> None:
    definitions = json_schema()["$defs"]
    for name in ("coulomb", "viscous", "bias", "asymmetry_linear", "stribeck_exponential", "presliding_lugre"):
        entry = definitions[f"term_{name}"]
        assert entry["additionalProperties"] is False
        assert "=" in entry["description"]
    assert definitions["plant_rigid"]["properties"]["mass"]["exclusiveMinimum"] == 0.0
    assert definitions["term_coulomb"]["properties"]["force"]["minimum"] == 0.0
    assert definitions["term_coulomb"]["required"] == ["effect", "force"]


if importlib.util.find_spec("jsonschema") is not None:
    # Not among the packages that fric asks for; where it is there, the schema is held against what the reader does.

    def test_the_schema_takes_what_is_written() -> None:
        import jsonschema

        jsonschema.validate(YAML(typ="safe").load(model_to_text(whole())), json_schema())

    @pytest.mark.parametrize("row", BAD, ids=[row[1].replace("\n", " ") for row in BAD])
    def test_the_schema_refuses_what_the_reader_refuses(row: tuple[str, str, int, str, str]) -> None:
        import jsonschema

        beyond = ("there twice", "which the model doesn't have", "nan", "inf")  # what JSON, or a schema of one place, can't say
        if row[4] == "correct the YAML" or any(word in row[3] for word in beyond):
            return
        tree = YAML(typ="safe").load(with_line(row[0], row[1]))
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(tree, json_schema())
