"""What is refused in a worker process is refused with the same words in the one that asked."""

from __future__ import annotations

import pickle

import pytest
from fric.control.feedbacks.pid import PidError
from fric.diagnosis import DiagnosisError
from fric.errors import InputError
from fric.model import ModelError


@pytest.mark.parametrize("kind", [InputError, ModelError, DiagnosisError, PidError])
def test_an_error_comes_back_from_another_process_as_it_was(kind: type[InputError]) -> None:
    error = kind("axis.yaml", "has no mass", "give it one")
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert str(again) == str(error) == "axis.yaml: has no mass; give it one"
    assert (again.where, again.problem, again.remedy) == ("axis.yaml", "has no mass", "give it one")
