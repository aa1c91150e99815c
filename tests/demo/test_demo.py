"""The demonstration's parts that can be looked at without running all of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fric.record import Record, RecordError, Units
from fric_nodes.demo.graph import Graph, GraphError, NodeSetup
from fric_nodes.demo.outcome import read_run
from ruamel.yaml import YAML


def test_values_reach_ros_with_their_type() -> None:
    node = NodeSetup("plant", {"a": 1.0, "b": 1e-7, "c": 2, "d": True, "e": ["x", "y"], "f": 1e22}, None)
    given = dict(entry.split(":=") for entry in node.command() if ":=" in entry)
    read = {name: YAML(typ="safe").load(text) for name, text in given.items()}
    assert read == {"a": 1.0, "b": 1e-7, "c": 2, "d": True, "e": ["x", "y"], "f": 1e22}
    assert [type(read[name]) for name in "abcdf"] == [float, float, int, bool, float]


def test_a_node_that_fails_ends_the_run_with_its_last_words(tmp_path: Path) -> None:
    nodes = [NodeSetup("plant", {"period": "fast"})]
    with pytest.raises(GraphError, match=r"plant.*status 2.*period"), Graph(nodes, tmp_path, domain=87) as graph:
        graph.wait_for("plant", timeout=60.0)


def test_a_run_is_measured_against_its_reference(tmp_path: Path) -> None:
    from fric.bagio.write import write_record

    time = np.arange(0.0, 5.0, 0.002)
    reference = 0.01 * np.sin(time)
    record = Record(time, reference + 3e-6, np.cos(time), reference=reference, units=Units())
    write_record(record, tmp_path / "bag")
    run = read_run(tmp_path / "bag", 0.002)
    assert run.rms == pytest.approx(3e-6, rel=1e-3)
    assert run.missed == 0


def test_a_run_without_reference_is_refused(tmp_path: Path) -> None:
    from fric.bagio.write import write_record

    time = np.arange(0.0, 1.0, 0.002)
    write_record(Record(time, np.sin(time), np.cos(time)), tmp_path / "bag")
    with pytest.raises(RecordError, match="reference"):
        read_run(tmp_path / "bag", 0.002)


def test_the_motions_end_within_the_time_given_to_them() -> None:
    from fric.excitation import EXCITATIONS
    from fric.shared_files import config_file
    from fric_nodes.demo.run import _MOTIONS

    for name, given in _MOTIONS.items():
        values = YAML(typ="safe").load(config_file(f"{name}.yaml"))["/**"]["ros__parameters"]
        total = values["start_delay"]
        random = np.random.default_rng(values["seed"])
        for kind in values["kinds"]:
            set_ = {p.name: p.default for p in EXCITATIONS[kind].parameters} | values.get(kind, {})
            total += EXCITATIONS[kind].plan(set_, random).duration + values["pause"]
        assert total - values["pause"] <= given, name
