"""A whole examination with a diagnosis that is made up here: sealed, held in other processes, gone on with, scored, shown."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fric.diagnosis.prove.cases import VARIANTS, plan
from fric.diagnosis.prove.examination import Examination, hold
from fric.diagnosis.prove.scoring import Found, Outcome, scored
from fric.diagnosis.prove.sealing import open_key
from fric.errors import InputError
from fric.report.prove import prove_page

_STUB = """
class Found:
    def __init__(self, validation):
        self.prediction = [
            {"time": v.time} | dict.fromkeys(("force_measured", "force_nominal", "force_refit", "force_augmented"), v.effort)
            for v in validation
        ]

    def report(self):
        place = {"time": [[1.0, 2.0]], "regime": "", "component": "load"}
        return {
            "format": "fric-report/1",
            "mismatch": True,
            "findings": [
                {"effect": "ripple", "confidence": 0.5, "runner_up": {"effect": "bias", "confidence": 0.1}, "where": place}
            ],
            "validation": {"noe_nominal": 3.0, "noe_refit": 2.0, "noe_augmented": 1.0, "noise_floor": 0.1},
        }


def diagnose(train, validation, nominal, progress=None, at_most=None):
    if train[0].n_samples % 2:
        raise ValueError("an odd number of <samples>")
    return Found(validation)
"""


@pytest.fixture
def entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A diagnosis that other processes can import."""
    folder = tmp_path / "stub"
    folder.mkdir()
    (folder / "made_up_diagnosis.py").write_text(_STUB)
    monkeypatch.syspath_prepend(str(folder))
    return "made_up_diagnosis:diagnose"


@pytest.mark.long
def test_an_examination_from_seed_to_page(tmp_path: Path, entry: str) -> None:
    out = tmp_path / "proof"
    said: list[str] = []
    held = hold(3, 2, out, jobs=1, entry=entry, progress=said.append)
    sealed_at = next(k for k, line in enumerate(said) if line.startswith("sealed"))
    assert sealed_at < next(k for k, line in enumerate(said) if line.startswith("diagnosed"))
    assert held.hash_of_key in said[sealed_at]
    assert len(held.outcomes) == 3
    keys = open_key(out)
    for key in keys:
        folder = out / "cases" / f"{key['number']:04d}"
        given = {each.name for each in folder.iterdir()}
        assert {"train", "validation", "nominal.yaml", "done.json"} <= given
        done = json.loads((folder / "done.json").read_text())
        assert ("ValueError" in done["failure"]) == ("report.json" not in given)
        if not done["failure"]:
            assert (folder / "prediction.csv").read_text().startswith("time,force_measured,force_nominal,force_refit,")
    page = prove_page(held, "fric prove")
    assert held.hash_of_key in page
    assert "&lt;samples&gt;" in page or all(not each.failure for each in held.outcomes)
    assert "<samples>" not in page
    assert all(f"cases/{each.number:04d}/report.json" in page for each in held.outcomes if not each.right)

    # Going on: what is finished isn't done again, what is missing is.
    stamp = (out / "cases" / "0000" / "done.json").stat().st_mtime_ns
    (out / "cases" / "0001" / "done.json").unlink()
    again = hold(3, 2, out, jobs=1, entry=entry)
    assert again.hash_of_key == held.hash_of_key
    assert (out / "cases" / "0000" / "done.json").stat().st_mtime_ns == stamp
    assert (out / "cases" / "0001" / "done.json").exists()

    # Under another limit of time every case is diagnosed anew.
    limited = hold(3, 2, out, jobs=1, entry=entry, at_most=5.0)
    assert limited.hash_of_key == held.hash_of_key
    assert all(json.loads(at.read_text())["at_most"] == 5.0 for at in (out / "cases").glob("*/done.json"))
    with pytest.raises(InputError, match="time"):
        hold(3, 2, out, entry=entry, at_most=-1.0)

    with pytest.raises(InputError, match="another examination"):
        hold(4, 2, out, entry=entry)
    key_file = out / "sealed" / "key.json"
    key_file.write_text(key_file.read_text().replace("fric-prove-keys", "fric-proved-keys"))
    with pytest.raises(InputError, match="hash"):
        hold(3, 2, out, entry=entry)


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_page_shows_a_miss_of_every_kind_of_case(variant: str) -> None:
    kinds = sorted({order.kind for order in plan(40, 1, variant)})
    missed = [
        Outcome(
            number=k, kind=kind, effects=("ripple",), outside="", components=frozenset({"load"}), mismatch=True,
            findings=(Found("bias", 0.4, "", "load"),), held=0.5, ratio=1.5, noe_nominal=3.0, noe_refit=2.0, noe_augmented=1.0,
            noe_own=0.9, strength=2.0, floor=0.1, seconds=5.0,
        )
        for k, kind in enumerate(kinds)
    ]  # fmt: skip
    page = prove_page(Examination(missed, scored(missed, variant), "0" * 64, 9.0), "fric prove")
    assert all(f"cases/{each.number:04d}/report.json" in page for each in missed)


def test_a_folder_with_other_things_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("x")
    with pytest.raises(InputError, match="isn't empty"):
        hold(2, 1, tmp_path, entry="json:dumps")


def test_a_diagnosis_that_is_not_there_is_said_before_anything_is_drawn(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no diagnosis is there"):
        hold(2, 1, tmp_path / "proof", entry="json:diagnose")
    assert not (tmp_path / "proof").exists()


@pytest.mark.long
@pytest.mark.timeout(3600)  # twenty diagnoses, and what they compile
def test_twenty_concealed_cases(tmp_path: Path) -> None:
    held = hold(20, 20, tmp_path / "proof")
    assert not [each.failure for each in held.outcomes if each.failure]
    assert sum(each.right for each in held.outcomes) >= 16
    assert not [each.number for each in held.outcomes if each.kind == "nothing" and each.mismatch]
    for each in held.outcomes:
        assert each.noe_augmented <= 1.001 * each.noe_refit
        assert all(found.confidence < 0.9 for found in each.findings[:1] if not each.right)
