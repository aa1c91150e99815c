"""``fric identify --joint all``: every joint of the recordings by itself, one page over all of them."""

from __future__ import annotations

import contextlib
import json
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer
from fric.errors import InputError

from .options import Reading, progress
from .results import Record, Results

__all__ = ["ALL", "identify_each"]

ALL = "all"
_RECORD = Record("overview.json", ("joints", "identified"))


def _folders(joints: list[str]) -> dict[str, str]:
    """A folder's name for each joint: its own, where a file system takes it, and no two alike."""
    folders: dict[str, str] = {}
    for joint in joints:
        plain = re.sub(r"[^\w.-]+", "_", joint).strip(".") or "joint"
        taken = {name.lower() for name in folders.values()}
        name, number = plain, 2
        while name.lower() in taken:
            name, number = f"{plain}_{number}", number + 1
        folders[joint] = name
    return folders


def identify_each(recordings: list[Path], reading: Reading, results: Results, identify: Callable[[str, Results], None]) -> None:
    """Identify each joint of the recordings, and write overview.html and overview.json.

    A joint that can't be identified is listed with its reason and does not keep the others from it.

    Args:
        recordings: all of them, those kept apart too.
        reading: how they are read.
        results: where the overview goes; each joint gets a folder of its own below.
        identify: identifies one joint, and writes its results.

    Raises:
        InputError: no joint could be identified.
    """
    from fric.bagio.read import joint_list
    from fric.report.joints import joints_overview

    results = results.claimed(_RECORD, ("overview.html",))
    out, as_json = results.out, results.as_json
    topics = reading.topic_names()
    joints = list(dict.fromkeys(name for path in recordings for name in joint_list(path, topics)))
    if not joints:
        raise InputError(recordings[0], "holds no joint", "name the topic of the joint states: --topic joint_states=NAME")
    folders = _folders(joints)
    found: dict[str, dict[str, Any]] = {}
    failed: dict[str, str] = {}
    for joint in joints:
        progress(f"joint {joint}")
        if not as_json:
            typer.echo(f"joint {joint}")
        try:
            with contextlib.redirect_stdout(sys.stderr) if as_json else contextlib.nullcontext():
                identify(joint, replace(results, out=out / folders[joint], as_json=False))
        except InputError as error:
            failed[joint] = " ".join(str(error).split())
            progress(f"joint {joint}: {failed[joint]}")
            continue
        found[joint] = json.loads((out / folders[joint] / "identification.json").read_text(encoding="utf-8"))
    source = ", ".join(path.name for path in recordings)
    if not found:
        reasons = "; ".join(dict.fromkeys(failed.values()))
        raise InputError(source, f"none of {len(joints)} joint(s) could be identified: {reasons}", "give one with --joint NAME")
    entries = {joint: found[joint] if joint in found else {"error": failed[joint]} for joint in joints}
    summary = {"joints": entries, "identified": len(found), "failed": len(failed)}
    links = {joint: f"{folders[joint]}/report.html" for joint in found}
    page = joints_overview(source, found, failed, links)
    results.write(_RECORD, {"overview.html": page, _RECORD.name: json.dumps(summary, indent=2) + "\n"})
    if as_json:
        typer.echo(json.dumps(summary))
        return
    typer.echo(f"{len(found)} of {len(joints)} joints identified")
    for joint, reason in failed.items():
        typer.echo(f"- not {joint}: {reason}")
    typer.echo(f"written: {out / 'overview.html'}, overview.json, and a folder for each joint")
