"""A disk that is full, read-only or out of reach: said, waited for, nothing lost. Real processes, a real small disk."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from lubdub.cases.away import is_away
from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.jobs.patience import patiently
from tests.jobs.desk import ONCE, Desk, open_desk
from tests.web.service import Service, eventually, free_port

SIZE_MB = 4


@contextmanager
def small_disk(place: Path) -> Iterator[Path]:
    """A disk of a few megabytes. Only root may make one."""
    place.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={SIZE_MB}m", "tmpfs", place], capture_output=True, check=False
    )
    if made.returncode != 0:
        pytest.skip(f"a small disk can only be made by root with the right to mount: {made.stderr.decode().strip()}")
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", place], check=True)


@pytest.fixture
def cramped(tmp_path: Path) -> Iterator[tuple[Path, Desk]]:
    """A service whose files lie on a small disk."""
    with (
        small_disk(tmp_path / "disk") as disk,
        open_desk(f"sqlite:///{tmp_path / 'cases.sqlite'}", tmp_path, store_url=(disk / "files").as_uri()) as desk,
    ):
        yield disk, desk


def fill(disk: Path) -> None:
    with (disk / "filler").open("wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            return


def make_read_only(disk: Path) -> None:
    subprocess.run(["mount", "-o", "remount,ro", disk], check=True)


def put_right(disk: Path) -> None:
    subprocess.run(["mount", "-o", f"remount,rw,size={SIZE_MB}m", disk], check=True)
    (disk / "filler").unlink(missing_ok=True)


def store_works(service: Service) -> bool:
    told = httpx.get(f"{service.settings.address}/readyz", timeout=60)
    works = told.json()["checks"]["store"]
    assert works or told.status_code == 503
    return bool(works)


@pytest.mark.parametrize("spoil", [fill, make_read_only], ids=["full", "read-only"])
def test_a_disk_that_takes_nothing_is_said_and_waited_for(
    cramped: tuple[Path, Desk], spoil: Callable[[Path], None]
) -> None:
    disk, desk = cramped
    desk.service.start_web()
    desk.service.start_worker()
    portal = desk.service.portal()
    waiting = portal.open_case()
    case = desk.send()
    desk.wait_until_at_work(case)
    eventually(lambda: store_works(desk.service))
    spoil(disk)
    desk.gate.touch()
    desk.says("is away and is waited for")
    assert desk.state(case).status == "checking"
    eventually(lambda: not store_works(desk.service))
    refused = portal.send(waiting, os.urandom(SIZE_MB << 19), expect=503)
    assert refused.json()["type"] == "/problems/not-ready"
    assert "come back later" in refused.json()["detail"]
    assert int(refused.headers["retry-after"]) > 0
    put_right(disk)
    desk.wait_until_examined(case)
    assert desk.statuses(case) == ONCE
    eventually(lambda: store_works(desk.service))
    portal.send(waiting, b"quick")


def test_a_bucket_out_of_reach_counts_as_away_and_not_as_a_lost_file(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'cases.sqlite'}")
    store = f"s3://key:secret@bucket?endpoint=http://127.0.0.1:{free_port()}&region=x"
    vault = FileVault(database, store, tmp_path / "master.key")
    with pytest.raises(Exception, match=r".") as caught:
        vault.probe()
    assert is_away(caught.value)
    database.close()


def test_waiting_ends_when_the_fault_is_no_absence() -> None:
    calls = []

    def broken() -> None:
        calls.append(1)
        raise ValueError("a fault of ours")

    with pytest.raises(ValueError, match="of ours"):
        patiently(broken, 60)
    assert len(calls) == 1


def test_waiting_ends_when_what_was_away_is_back() -> None:
    calls = []

    def away_twice() -> int:
        calls.append(1)
        if len(calls) < 3:
            raise OSError("no space left")
        return len(calls)

    assert patiently(away_twice, 60) == 3


def test_waiting_does_not_go_on_for_ever() -> None:
    with pytest.raises(OSError, match="no space left"):
        patiently(_never, 0.1)


def _never() -> None:
    raise OSError("no space left")
