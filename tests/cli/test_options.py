"""The command as a whole: groups of options, what its help imports, settings of methods, tables, and what is overwritten."""

from __future__ import annotations

import ast
import contextlib
import importlib
import inspect
import io
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
import pytest
import typer
from fric import __version__
from fric.bagio.write import write_record
from fric.errors import InputError
from fric.identification import METHODS
from fric.identification.choice import refuse_unused
from fric.method_settings import Options, Setting, declarations, parsed, set_values
from fric.record import Record as Recording
from fric_nodes.cli.groups import Group, grouped
from fric_nodes.cli.main import verbs
from fric_nodes.cli.printed import console, plain_table
from fric_nodes.cli.results import Record, Results
from typer.testing import CliRunner

Command = Callable[..., "subprocess.CompletedProcess[str]"]
Refusal = Callable[..., str]
FOLDER = Path(importlib.import_module("fric_nodes.cli").__path__[0])
HEAVY = ("numpy", "scipy", "numba", "pandas", "rclpy", "plotly", "jinja2", "rich", "fric.model", "fric.identification")


def commands() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Every command and subcommand with the function that it calls."""
    for verb, (module, _) in verbs().items():
        app = typer.Typer()
        importlib.import_module(module).register(app)
        for info in app.registered_commands:
            assert info.callback is not None
            yield verb, info.callback
        for group in app.registered_groups:
            assert group.typer_instance is not None
            for info in group.typer_instance.registered_commands:
                assert info.callback is not None
                yield f"{verb} {info.name}", info.callback


def test_no_command_has_more_than_twelve_parameters() -> None:
    # A command with groups shows typer a signature of its own; the function behind it has the one that was written.
    written = {name: getattr(function, "__wrapped__", function) for name, function in commands()}
    counted = {name: len(inspect.signature(function).parameters) for name, function in written.items()}
    assert len(counted) > 18
    assert {name: count for name, count in counted.items() if count > 12} == {}


def test_every_module_with_a_verb_is_listed_and_no_other() -> None:
    with_verb = {
        path.stem
        for path in FOLDER.glob("*.py")
        if any(isinstance(node, ast.FunctionDef) and node.name == "register" for node in ast.parse(path.read_text()).body)
    }
    assert {module.rpartition(".")[2] for module, _ in verbs().values()} == with_verb
    assert {"identify", "import", "diagnose"} <= set(verbs())
    assert all(text[0].isupper() and text.endswith(".") for _, text in verbs().values())


def test_help_and_version_import_nothing_heavy() -> None:
    code = (
        "import sys\nfrom fric_nodes.cli.main import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], "
        "[name for name in sys.modules if name.startswith('fric_nodes.cli.')])"
    )
    for arguments in (("--help",), ("--version",)):
        done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=60, check=True)
        assert done.stdout.splitlines()[-1] == "[] ['fric_nodes.cli.main']"
    done = subprocess.run(
        [sys.executable, "-c", code, "identify", "--help"], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.splitlines()[-1].startswith("['rich'] ")


def test_a_wrong_option_is_refused_in_the_same_voice(refusal: Refusal) -> None:
    line = refusal("identify", "--robus")
    assert line.startswith("fric: identify: No such option: --robus")
    assert line.endswith("; see 'fric identify --help'")
    assert refusal("identfy") == "fric: No such command 'identfy'; see 'fric --help'"
    assert "see 'fric demo --help'" in refusal("demo", "--rate", "fast")


def test_the_version_is_the_packages(fric: Command) -> None:
    assert fric("--version").stdout == f"fric {__version__}\n"


def test_the_shell_completes_verbs_and_options() -> None:
    for words, expected in (("fric di", "diagnose"), ("fric identify --rest", "--rest-velocity"), ("fric model sh", "show")):
        done = subprocess.run(
            [sys.executable, "-c", "from fric_nodes.cli.main import main; main()"],
            env=os.environ
            | {"_FRIC_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": f"{len(words.split()) - 1}"},
            capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert expected in done.stdout.split(), done.stderr


# Groups


@dataclass(frozen=True)
class Place:
    """A group."""

    floor: Annotated[int, typer.Option("--floor", help="Floor [m].")]
    doors: Annotated[tuple[str, ...], typer.Option("--door")] = ()


def test_a_group_is_expanded_into_options_and_handed_over_built() -> None:
    held: list[Any] = []

    @grouped
    def go(name: Annotated[str, typer.Argument()], place: Annotated[Place, Group("The place")] = Place(3)) -> None:
        held.append((name, place))

    app = typer.Typer()
    app.command()(go)
    assert "The place" in CliRunner().invoke(app, ["--help"]).output
    assert CliRunner().invoke(app, ["a"]).exit_code == 0
    assert CliRunner().invoke(app, ["b", "--floor", "5", "--door", "x", "--door", "y"]).exit_code == 0
    assert held == [("a", Place(3)), ("b", Place(5, ("x", "y")))]


def test_a_group_that_cannot_be_expanded_is_refused() -> None:
    @dataclass(frozen=True)
    class Plain:
        floor: int = 0

    def without(place: Annotated[Plain, Group("x")] = Plain()) -> None: ...
    def twice(floor: int, place: Annotated[Place, Group("x")] = Place(1)) -> None: ...

    without.__annotations__ = {"place": Annotated[Plain, Group("x")]}
    with pytest.raises(TypeError, match=r"Plain\.floor is no option"):
        grouped(without)
    with pytest.raises(TypeError, match="'floor' is declared twice"):
        grouped(twice)


# Settings of methods


def test_every_common_setting_is_used_by_some_method_and_has_an_option() -> None:
    used = {name for method in METHODS.values() for name in method.uses}
    assert used == set(declarations())
    options = [setting.option for _, setting in declarations().values()]
    assert {"--hold", "--free", "--bound", "--gain", "--cutoff", "--rest-velocity"} <= set(options)
    assert len(set(options)) == len(options)


@dataclass(frozen=True)
class Fuzzy(Options):
    """Settings of a method with one of its own."""

    rules: Annotated[int, Setting("Number of rules", lower=1)] = 5


def test_a_method_has_settings_of_its_own() -> None:
    method = replace(METHODS["inverse-dynamics"], id="fuzzy", settings=Fuzzy)
    options = method.options(Options(cutoff=40.0), {"rules": "7"})
    assert options == Fuzzy(cutoff=40.0, rules=7)
    assert set_values(options) == {"cutoff": 40.0, "rules": 7}
    refuse_unused(method, options)
    for own, reason in (
        ({"rules": "0"}, "give 1 or more"),
        ({"rules": "x"}, "whole number"),
        ({"glue": "1"}, "choose from rules"),
    ):
        with pytest.raises(InputError, match=reason):
            method.options(Options(), own)
    with pytest.raises(TypeError, match="not declared: glue"):
        replace(method, uses=("glue",))


@pytest.mark.parametrize(
    ("name", "given", "held"),
    [
        ("gains", ["0.6,0.01"], ((0.6, 0.01),)),
        ("bounds", ["stribeck.velocity=0.001,0.05"], (("stribeck.velocity", 0.001, 0.05),)),
        ("held", ["mass"], ("mass",)),
        ("starts", 3, 3),
        ("robust", "true", True),
    ],
)
def test_settings_are_read_as_declared(name: str, given: object, held: object) -> None:
    assert parsed(name, given) == held


@pytest.mark.parametrize(
    ("name", "given", "says"),
    [
        ("gains", ["0.6"], "--gain"),
        ("gains", ["nan,1"], "finite"),
        ("bounds", ["mass=2,1"], "NAME=LO,HI"),
        ("cutoff", 0.0, "positive"),
        ("rest_velocity", -1.0, "0 or more"),
        ("horizon", float("inf"), "--horizon"),
        ("start_states", "loose", "measured, tied, free"),
    ],
)
def test_settings_out_of_their_limits_are_refused(name: str, given: object, says: str) -> None:
    with pytest.raises(InputError, match=says):
        parsed(name, given)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An axis of 2 kg on 5 N and 12 N s/m, whose motion is given."""
    time = np.arange(0.0, 6.0, 2e-3)
    parts = [(0.03, 0.7, 0.0), (0.008, 2.1, 1.0)]
    position = sum(a * np.sin(2 * np.pi * f * time + p) for a, f, p in parts)
    velocity = sum(a * 2 * np.pi * f * np.cos(2 * np.pi * f * time + p) for a, f, p in parts)
    acceleration = sum(-a * (2 * np.pi * f) ** 2 * np.sin(2 * np.pi * f * time + p) for a, f, p in parts)
    force = 2.0 * acceleration + 12.0 * velocity + 5.0 * np.sign(velocity)
    force += np.random.default_rng(1).normal(0.0, 0.1, time.size)
    return write_record(Recording(time, position, force, source="axis"), tmp_path_factory.mktemp("bag") / "axis")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--robust", "--method", "output-error"), "--robust: is not used by the method output-error; leave it out, or use"),
        (("--horizon", "1"), "one of output-error"),
        (("--cutoff", "40", "--method", "static-map"), "--cutoff: is not used by the method static-map"),
        (("--set", "rules=3"), "'rules'"),
        (("--set", "rules"), "NAME=VALUE"),
    ],
)
def test_a_setting_that_the_method_does_not_use_is_refused(
    arguments: tuple[str, ...], says: str, bag: Path, tmp_path: Path, refusal: Refusal
) -> None:
    assert says in refusal("identify", bag, *arguments, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


# What is overwritten


def test_an_earlier_run_is_replaced_and_what_others_wrote_is_not(
    bag: Path, tmp_path: Path, fric: Command, refusal: Refusal
) -> None:
    run = ("identify", bag, "--terms", "coulomb,viscous", "--out", tmp_path)
    (tmp_path / "model.yaml").write_text("mine\n")
    line = refusal(*run)
    assert "model.yaml was not written by this command" in line
    assert "--force" in line
    assert (tmp_path / "model.yaml").read_text() == "mine\n"
    assert fric(*run, "--force").returncode == 0
    again = fric(*run, "--json", "--cutoff", "50")
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["settings"] == {"cutoff": 50.0}
    (tmp_path / "model.yaml").write_text("mine\n")
    assert "was edited since" in refusal(*run)


def test_a_yes_on_a_terminal_replaces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "page.html").write_text("other")
    record, results = Record("page.json", form="a/1"), Results(tmp_path)
    asked: list[str] = []
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: True))
    monkeypatch.setattr(sys, "stderr", SimpleNamespace(isatty=lambda: True))
    answers = [False, True, False]
    monkeypatch.setattr(typer, "confirm", lambda text, err: asked.append(text) or answers.pop(0))
    with pytest.raises(InputError, match=r"page\.html was not written"):
        results.claimed(record, ("page.html",))
    results.claimed(record, ("page.html",)).write(record, {"page.html": "new", "page.json": '{"format": "a/1"}'})
    assert (tmp_path / "page.html").read_text() == "new"
    assert len(asked) == 2
    results.write(record, {"page.html": "newer", "page.json": '{"format": "a/1"}'})
    with pytest.raises(InputError, match=r"page\.json"):
        results.claimed(Record("page.json", form="b/1"), ())


# Tables


class Terminal(io.StringIO):
    """A narrow terminal."""

    def isatty(self) -> bool:
        return True


def test_tables_keep_one_line_per_row_in_a_pipe_and_fit_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("NO_COLOR", "1")
    row = ("presliding.stiffness", "123456.7", "a sentence of many words that does not fit into a narrow terminal")
    for stream, fits in ((io.StringIO(), False), (Terminal(), True)):
        with contextlib.redirect_stdout(stream):
            table = plain_table(("parameter", "value", "text"), numbers=("value",))
            table.add_row(*row)
            console().print(table)
        lines = re.sub("\x1b\\[[0-9;]*m", "", stream.getvalue()).splitlines()
        assert "…" not in stream.getvalue()
        assert "123456.7" in stream.getvalue()
        if fits:
            assert len(lines) > 2
            assert max(map(len, lines)) <= 40
        else:
            assert len(lines) == 2
            assert all(text in lines[1] for text in row)
