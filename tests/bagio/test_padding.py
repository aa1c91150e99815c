from __future__ import annotations

import struct

import pytest
from fric.bagio.padding import PaddingEraser
from fric.bagio.types import JOINT_STATE, type_fields, typestore


def joint_state(padding: bytes, *, names: tuple[str, ...] = ("axis",), velocity: bool = True, order: str = "<") -> bytes:
    """A joint state laid out by hand from the rules of CDR, with ``padding`` (one byte) wherever bytes are skipped."""
    body = b""

    def align(size: int) -> None:
        nonlocal body
        body += padding * (-len(body) % size)

    def string(text: str) -> None:
        nonlocal body
        align(4)
        body += struct.pack(order + "I", len(text) + 1) + text.encode() + b"\0"

    def doubles(values: list[float]) -> None:
        nonlocal body
        align(4)
        body += struct.pack(order + "I", len(values))
        if values:
            align(8)
            body += struct.pack(f"{order}{len(values)}d", *values)

    body += struct.pack(order + "iI", 12, 34)
    string("")
    align(4)
    body += struct.pack(order + "I", len(names))
    for name in names:
        string(name)
    doubles([1.5] * len(names))
    doubles([-2.5] * len(names) if velocity else [])
    doubles([3.5] * len(names))
    return bytes([0, order == "<", 0, 0]) + body


@pytest.fixture
def erase() -> PaddingEraser:
    return PaddingEraser(JOINT_STATE, type_fields(JOINT_STATE))


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("velocity", [True, False])
@pytest.mark.parametrize("names", [("axis",), ("a", "bc", "def"), ("shoulder_joint",)])
def test_padding_becomes_zero_and_nothing_else_changes(
    erase: PaddingEraser, names: tuple[str, ...], velocity: bool, order: str
) -> None:
    clean = joint_state(b"\0", names=names, velocity=velocity, order=order)
    dirty = joint_state(b"\xa5", names=names, velocity=velocity, order=order)
    assert clean != dirty
    for _ in range(2):  # the layout derived, then the layout known
        assert erase(dirty) == clean
        assert erase(clean) == clean


def test_messages_of_equal_length_and_different_layout_are_kept_apart(erase: PaddingEraser) -> None:
    # Names of 3 and 5 bytes take the same room as two of 4, with the padding elsewhere.
    first, second = (joint_state(b"\xa5", names=names) for names in (("abc", "abcdef"), ("abcdef", "abc")))
    assert len(first) == len(second)
    for _ in range(2):
        assert erase(first) == joint_state(b"\0", names=("abc", "abcdef"))
        assert erase(second) == joint_state(b"\0", names=("abcdef", "abc"))


def test_many_layouts_are_all_erased(erase: PaddingEraser) -> None:
    for _ in range(2):
        for length in range(1, 41):
            assert erase(joint_state(b"\x7f", names=("x" * length,))) == joint_state(b"\0", names=("x" * length,))


def test_a_decoder_of_its_own_finds_the_same_values(erase: PaddingEraser) -> None:
    message = typestore().deserialize_cdr(erase(joint_state(b"\xff")), JOINT_STATE)
    assert (message.header.stamp.sec, message.name) == (12, ["axis"])
    assert (message.position[0], message.velocity[0], message.effort[0]) == (1.5, -2.5, 3.5)


@pytest.mark.parametrize("damaged", [b"", b"\x00\x01", joint_state(b"\xa5")[:-9], b"\x07\x07\x00\x00" + bytes(40)])
def test_what_does_not_fit_its_type_is_left_alone(erase: PaddingEraser, damaged: bytes) -> None:
    assert erase(damaged) == damaged
