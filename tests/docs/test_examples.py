"""The ``python`` examples of the README and the tutorial, run as they are printed, in an empty folder.

The tutorial is walked through as a reader does: its files are saved under the names that they are given, its commands and its
Python blocks run in their order.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.M | re.S)
_NAMED = re.compile(r"# (\S+\.yaml)\n")
_INSTALLATION = "python3 -m venv"  # what .ci/run does


def _blocks(page: str) -> list[tuple[str, str]]:
    """Language and text of every block, in the order of the page."""
    return _BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))


def _run(folder: Path, *command: str) -> str:
    """Standard output of a command that has to end with status 0."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = {**os.environ, "PATH": path, "MPLBACKEND": "agg"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=1200.0)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def _walk(page: str, folder: Path, skipped: tuple[str, ...]) -> str:
    """What all blocks of a page print, one after the other."""
    printed = ""
    for language, block in _blocks(page):
        if language == "yaml":
            named = _NAMED.match(block)
            if named:
                (folder / named[1]).write_text(block, encoding="utf-8")
        elif language == "python":
            printed += _run(folder, sys.executable, "-c", block)
        elif language == "sh":
            for line in block.splitlines():
                if not line.startswith(skipped):
                    printed += _run(folder, "bash", "-c", line)
    return printed


def test_the_readme_s_python_runs_as_printed(tmp_path: Path) -> None:
    block = next(block for language, block in _blocks("README.md") if language == "python")
    printed = _run(tmp_path, sys.executable, "-c", block)
    assert "coulomb.force" in printed
    assert (tmp_path / "report.html").stat().st_size > 10_000


@pytest.mark.long
def test_the_tutorial_leads_to_a_compensated_axis(tmp_path: Path) -> None:
    printed = _walk("docs/tutorial.md", tmp_path, (_INSTALLATION, "fric diagnose"))
    # The errors that the page promises.
    alone, compensated = (float(error) for error in re.findall(r"tracking error \(RMS\) (\S+) m, as recorded", printed))
    assert alone == pytest.approx(0.88e-3, rel=0.05)
    assert compensated == pytest.approx(0.06e-3, rel=0.2)
    assert (tmp_path / "found.html").exists()


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_the_tutorial_s_diagnosis_names_what_it_says(tmp_path: Path) -> None:
    printed = _walk("docs/tutorial.md", tmp_path, (_INSTALLATION, "fric simulate", "fric doctor"))
    assert "Stribeck effect" in printed


@pytest.mark.parametrize("page", ["README.md", "docs/tutorial.md", "docs/howto/extend.md"])
def test_python_blocks_are_complete_programs(page: str) -> None:
    blocks = [block for language, block in _blocks(page) if language == "python"]
    assert blocks
    for block in blocks:
        compile(block, page, "exec")


def test_the_members_that_extend_shows_are_members(tmp_path: Path) -> None:
    shown = [block for language, block in _blocks("docs/howto/extend.md") if language == "python"]
    for constant, kind in (("EFFECT", "Effect"), ("IMPORTER", "Importer"), ("CHECK", "Check"), ("CONTROLLER", "Controller")):
        block = next(block for block in shown if f"{constant} = " in block)
        (tmp_path / "member.py").write_text(block, encoding="utf-8")
        assert _run(tmp_path, sys.executable, "-c", f"import member; print(type(member.{constant}).__name__)").strip() == kind
