"""A ZIP with more files in it than any exporter packs is not looked into."""

from __future__ import annotations

import io
import zipfile

import pytest

from lubdub.results import ScanUnreadable
from lubdub.scans.limits import LIMITS
from lubdub.scans.reasons import unreadable
from lubdub.scans.unzip import only_scan


def packed(others: int) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        archive.writestr("scan.obj", "v 0 0 0\n")
        for number in range(others):
            archive.writestr(f"{number}.txt", "")
    return made.getvalue()


def test_as_many_files_as_are_said_are_taken_and_not_one_more() -> None:
    assert only_scan(packed(LIMITS.zip_entries - 1))[0] == b"v 0 0 0\n"
    with pytest.raises(ScanUnreadable) as refused:
        only_scan(packed(LIMITS.zip_entries))
    assert refused.value.reason == unreadable("zip_unsafe").reason
