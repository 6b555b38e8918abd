"""Nothing of a case lies plain on any disk, not even while it is worked on; nothing readable is left after deletion.

The marks looked for: bytes out of the scan's file, the numbers of its landmarks, and words that only it knows.
"""

from __future__ import annotations

import json
import os
import struct
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from lubdub.cases.backup import Backup
from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.settings import Settings
from tests.web.service import ROOT, Service, eventually, free_port

DEMO = ROOT / "references" / "demo" / "overhead-bed"
WORDS = b"comment scanned by somebody called Marker4711"
REFERENCE = "outside-reference-4712"


@pytest.fixture
def service(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    """A real one, with a real worker and a folder for temporary files that can be watched."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    settings = Settings(data_dir=tmp_path / "data", port=free_port())
    service = Service(settings, worker_module="lubdub.jobs.worker")
    try:
        service.start_web()
        service.start_worker()
        eventually(lambda: '"a worker is ready"' in service.log.read_text(), 240)
        yield service
    finally:
        service.stop()


class Watch:
    """Looks through every file under a folder, again and again, for marks."""

    def __init__(self, folder: Path, marks: list[bytes]) -> None:
        self._folder, self._marks = folder, marks
        self._stop = threading.Event()
        self.found: set[tuple[str, bytes]] = set()
        self.rounds = 0
        self._thread = threading.Thread(target=self._look_on)

    def __enter__(self) -> Watch:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self.look()

    def look(self) -> None:
        for folder, _, names in os.walk(self._folder):  # goes on where a folder is gone meanwhile
            for path in (Path(folder) / name for name in names):
                try:
                    content = path.read_bytes() if path.is_file() else b""
                except OSError:
                    continue  # gone between being seen and being read
                self.found |= {(str(path.relative_to(self._folder)), mark) for mark in self._marks if mark in content}
        self.rounds += 1

    def _look_on(self) -> None:
        while not self._stop.wait(0.05):
            self.look()


def marks_of(scan: bytes, landmarks: dict[str, list[float]]) -> list[bytes]:
    """Pieces of the file from all over it, and each coordinate as text and as number."""
    pieces = [scan[at : at + 48] for at in range(4096, len(scan) - 48, len(scan) // 12)]
    numbers = [value for place in landmarks.values() for value in place if len(repr(value)) > 5]
    assert numbers
    texts = [repr(value).encode() for value in numbers]
    return [WORDS, *pieces, *texts, *(struct.pack("<d", value) for value in numbers)]


def test_a_whole_case_leaves_nothing_plain_while_it_is_worked_on_nor_after_its_deletion(
    service: Service, tmp_path: Path
) -> None:
    scan = (DEMO / "overhead-bed.ply").read_bytes().replace(b" 1.0\n", b" 1.0\n" + WORDS + b"\n", 1)
    assert WORDS in scan
    patient = {"posture": "supine"} | json.loads((DEMO / "patient.json").read_text())
    landmarks = json.loads((DEMO / "landmarks.json").read_text())
    marks, portal = marks_of(scan, landmarks), service.portal()
    with Watch(tmp_path, marks) as watch:
        case = portal.open_case(external_id=REFERENCE, patient=patient)
        portal.send(case, scan)
        state = portal.wait(case, "awaiting_landmarks", "refused", "failed")
        assert state["status"] == "awaiting_landmarks", state
        portal.call("PUT", f"/cases/{case}/landmarks", 202, json=landmarks)
        assert portal.wait(case, "done", "refused", "failed")["status"] == "done"
        for path in ("result", "view.html", "sheet.pdf", "scan.ply"):
            portal.call("GET", f"/cases/{case}/{path}", 200)
        back_up(service, tmp_path / "backups" / "before")
    assert watch.rounds > 3
    assert watch.found == set()

    places = {path for path in tmp_path.rglob("*") if path.is_file() and REFERENCE.encode() in path.read_bytes()}
    assert {path.name.split("-")[0] for path in places} <= {"lubdub.sqlite"}, "the portal's own name, in its row alone"
    portal.call("DELETE", f"/cases/{case}", 200)
    back_up(service, tmp_path / "backups" / "after")
    left = Watch(tmp_path, [*marks, REFERENCE.encode()])
    left.look()
    assert left.found == set()
    assert not list((service.settings.data_dir / "files").glob(f"{case}/*"))
    assert not list((tmp_path / "tmp").iterdir())
    assert case.encode() not in (tmp_path / "backups" / "after" / "manifest.json").read_bytes()


def back_up(service: Service, folder: Path) -> None:
    database = Database(service.settings.database)
    vault = FileVault(database, service.settings.store, service.settings.master_key_source)
    Backup(database, vault).make(folder, folder.parent / "lubdub.keyring")
    database.close()
