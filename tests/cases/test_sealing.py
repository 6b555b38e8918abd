"""Sealed files: what goes in comes out, and nothing that was touched comes out at all."""

from __future__ import annotations

import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lubdub.cases.errors import SealBroken
from lubdub.cases.sealing import (
    FRAME,
    TAG,
    FrameSealer,
    open_frames,
    unwrap_key,
    wrap_key,
)

KEY, NAME, CASE = b"k" * 32, "object", "case"


def sealed(data: bytes, artefact: str = "scan", piece: int = 700_001) -> bytes:
    sealer = FrameSealer(KEY, NAME, CASE, artefact)
    body = b"".join(sealer.add(data[start : start + piece]) for start in range(0, len(data), piece))
    return body + sealer.last()


def opened(body: bytes, case: str = CASE, artefact: str = "scan", name: str = NAME) -> bytes:
    return b"".join(open_frames([body], KEY, name, case, artefact))


@pytest.mark.parametrize("size", [0, 1, FRAME - 1, FRAME, FRAME + 1, 2 * FRAME, 2 * FRAME + 17])
def test_every_length_comes_back_as_it_was(size: int) -> None:
    data = os.urandom(size)
    assert opened(sealed(data)) == data


@settings(max_examples=30, deadline=None)
@given(data=st.binary(max_size=5000), pieces=st.lists(st.integers(1, 4000), min_size=1, max_size=5))
def test_it_does_not_matter_in_which_pieces_bytes_arrive(data: bytes, pieces: list[int]) -> None:
    body, parts, place = sealed(data, piece=pieces[0]), [], 0
    while place < len(body):
        step = pieces[len(parts) % len(pieces)]
        parts.append(body[place : place + step])
        place += step
    assert b"".join(open_frames(parts, KEY, NAME, CASE, "scan")) == data


@settings(max_examples=40, deadline=None)
@given(place=st.integers(0, 3 * FRAME), change=st.integers(1, 255))
def test_a_changed_byte_is_noticed(place: int, change: int) -> None:
    body = bytearray(sealed(bytes(3 * FRAME)))
    body[place % len(body)] ^= change
    with pytest.raises(SealBroken):
        opened(bytes(body))


def test_frames_cannot_be_cut_off_or_swapped() -> None:
    body, step = sealed(os.urandom(3 * FRAME)), FRAME + TAG
    for touched in (body[:-step], body[:step], body[step : 2 * step] + body[:step] + body[2 * step :], b""):
        with pytest.raises(SealBroken):
            opened(touched)


@pytest.mark.parametrize("other", [{"case": "other"}, {"artefact": "scan.ply"}, {"name": "other"}])
def test_a_file_opens_only_as_what_it_was_sealed_as(other: dict[str, str]) -> None:
    with pytest.raises(SealBroken):
        opened(sealed(b"skin"), **other)


def test_a_data_key_opens_only_for_its_case_and_under_its_master_key() -> None:
    wrapped = wrap_key(b"m" * 32, KEY, CASE)
    assert unwrap_key(b"m" * 32, wrapped, CASE) == KEY
    for master, case in ((b"m" * 32, "other"), (b"n" * 32, CASE)):
        with pytest.raises(SealBroken):
            unwrap_key(master, wrapped, case)
