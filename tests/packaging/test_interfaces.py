"""Every field of every message and service says what it is and in which unit."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

INTERFACES = Path(__file__).parents[2] / "fric_interfaces"
DEFINITIONS = sorted([*INTERFACES.glob("msg/*.msg"), *INTERFACES.glob("srv/*.srv")])
FIELD = re.compile(r"(?P<type>[\w/\[\]<=]+)\s+(?P<name>\w+)(\s*=\s*\S+|\s+(?P<default>[^\s#]\S*))?\s*(#\s*(?P<comment>.*))?$")
UNIT = re.compile(r"\[[^\]]+\]")


def fields(path: Path) -> list[tuple[int, str]]:
    """Line number and text of every line that declares a field or a constant."""
    lines = enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
    return [(number, line) for number, line in lines if line.strip() and not line.startswith(("#", "---"))]


def test_there_are_definitions() -> None:
    names = {path.stem for path in DEFINITIONS}
    assert {"FrictionModel", "FrictionEstimate", "Mismatch", "StampedForce", "Reference"} <= names
    assert {"StartIdentification", "FreezeIdentification", "ResetIdentification", "SaveIdentification", "LoadModel"} <= names


@pytest.mark.parametrize("path", DEFINITIONS, ids=lambda path: path.name)
def test_every_field_has_a_comment_with_its_unit(path: Path) -> None:
    declared = fields(path)
    assert declared, f"{path.name} declares nothing"
    for number, line in declared:
        match = FIELD.match(line)
        assert match, f"{path.name}:{number}: not a field: {line}"
        comment = match["comment"] or ""
        assert UNIT.search(comment), f"{path.name}:{number}: no unit in brackets in the comment of {match['name']}"
        words = UNIT.sub("", comment).split()
        assert len(words) >= 2, f"{path.name}:{number}: the comment of {match['name']} says nothing but the unit"


@pytest.mark.parametrize("path", DEFINITIONS, ids=lambda path: path.name)
def test_every_definition_opens_with_what_it_is_for(path: Path) -> None:
    assert path.read_text(encoding="utf-8").startswith("# ")


@pytest.mark.parametrize("path", DEFINITIONS, ids=lambda path: path.name)
def test_the_installed_class_has_the_declared_fields(path: Path) -> None:
    import fric_interfaces.msg
    import fric_interfaces.srv

    halves: list[list[str]] = [[]]
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("---"):
            halves.append([])
        elif (match := FIELD.match(line)) and "=" not in line.split("#")[0]:
            halves[-1].append(match["name"])
    if path.suffix == ".msg":
        classes = [getattr(fric_interfaces.msg, path.stem)]
    else:
        service = getattr(fric_interfaces.srv, path.stem)
        classes = [service.Request, service.Response]
    installed = [list(each.get_fields_and_field_types()) for each in classes]
    # rosidl gives a definition without fields this one, because C has no empty structures
    assert [[name for name in names if name != "structure_needs_at_least_one_member"] for names in installed] == halves
