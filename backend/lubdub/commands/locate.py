"""`lubdub locate`: the four areas of one scan, with no server. Only a confined child ever parses the scan."""

from __future__ import annotations

import json
import os
import struct
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lubdub.commands.faults import CommandFault
from lubdub.commands.landmarks_file import read_landmarks

if TYPE_CHECKING:
    from lubdub.jobs.sandbox import ChildResult
    from lubdub.pipeline import Request
    from lubdub.results import Progress

SHOWN, REFUSED = 0, 3
MAX_SCAN_BYTES = 300_000_000  # as the readers' own cap, checked before the file is read into memory
CPU_S, WALL_S = 240.0, 240.0  # a million-point scan takes 20 s on a slow machine
_LENGTH = struct.Struct("<Q")


@dataclass(frozen=True)
class Errand:
    """What was typed, checked. All fields are plain values, so that a child can be told as JSON."""

    landmarks: Mapping[str, list[float]]
    age_years: float | None
    sex: str | None
    posture: str
    unit: str | None
    method: str
    references: str | None
    picture: bool


@dataclass(frozen=True)
class Places:
    """Where things are read and written."""

    scan: Path
    landmarks: Path | None
    picture: Path | None
    out: Path | None


def locate(places: Places, said: Mapping[str, Any]) -> int:
    """Run one scan and print or write its result. Returns the exit code; raises CommandFault.

    said: age, sex, posture, unit, method and references, as typed.
    """
    for target in (places.picture, places.out):
        _check_target(target)
    if said["references"] is not None and not Path(said["references"]).is_dir():
        raise CommandFault(f"There is no folder of reference bodies at {said['references']}.")
    errand = Errand(
        landmarks={} if places.landmarks is None else read_landmarks(places.landmarks),
        age_years=said["age"],
        picture=places.picture is not None,
        references=None if said["references"] is None else str(Path(said["references"]).resolve()),
        **{name: said[name] for name in ("sex", "posture", "unit", "method")},
    )
    document, picture = _unpack(_answer(_run(errand, _read_scan(places.scan))))
    if places.picture is not None:
        write_whole(places.picture, picture)
    if places.out is not None:
        write_whole(places.out, document)
    else:
        sys.stdout.write(document.decode())
        sys.stdout.flush()
    return REFUSED if json.loads(document)["verdict"] == "refuse" else SHOWN


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that it is there completely or, after a failure, as it was before. Raises CommandFault.

    A link stays a link, and what is no ordinary file (a pipe, /dev/null) is written into, never replaced.
    """
    path = path.resolve()
    try:
        if path.exists() and not path.is_file():
            path.write_bytes(content)
            return
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with open(handle, "wb") as file:
                file.write(content)
            Path(name).chmod(0o666 & ~_umask())
            Path(name).replace(path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as fault:
        raise CommandFault(f"{path} cannot be written: {fault.strerror}.") from fault


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _check_target(target: Path | None) -> None:
    if target is None:
        return
    if target.is_dir():
        raise CommandFault(f"{target} is a folder; name a file in it.")
    if not target.exists() and not os.access(target.parent, os.W_OK):
        raise CommandFault(f"{target} cannot be written: there is no folder {target.parent} open to you.")


def _read_scan(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_SCAN_BYTES + 1)
    except OSError as fault:
        raise CommandFault(f"The scan {path} cannot be opened: {fault.strerror}.") from fault
    if len(data) > MAX_SCAN_BYTES:
        raise CommandFault(f"The scan {path} is larger than {MAX_SCAN_BYTES // 1_000_000} MB; export it smaller.")
    return data


def _run(errand: Errand, data: bytes) -> ChildResult:
    from lubdub.jobs.sandbox import Limits, run_in_child

    def work(payload: bytes, progress: Progress) -> bytes:
        return locate_in_child(errand, payload, progress)

    readable = () if errand.references is None else (errand.references,)
    limits = Limits(cpu_s=CPU_S, wall_s=WALL_S, readable=readable)
    return run_in_child(work, data, limits, lambda stage, fraction: None)


def _answer(result: ChildResult) -> bytes:
    if result.status == "ok":
        return result.payload
    hint = " (LUBDUB_DEBUG=1 shows it)" if result.status == "error" else ""
    raise CommandFault(result.detail + hint)


def locate_in_child(errand: Errand, data: bytes, progress: Progress) -> bytes:
    """The part that touches the scan: a length, the result as JSON text, and the picture or nothing."""
    from lubdub.library.load import LibraryDamaged, load_library
    from lubdub.pipeline import locate as run_pipeline
    from lubdub.report.picture import draw
    from lubdub.report.result_json import result_json
    from lubdub.results import Reason, ScanUnreadable

    try:
        library = load_library(None if errand.references is None else Path(errand.references))
    except LibraryDamaged as fault:
        raise ScanUnreadable(Reason("references_damaged", str(fault), "")) from fault
    outcome = run_pipeline(data, _request(errand), library, progress)
    document = json.dumps(result_json(outcome), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    text = document.encode()
    return _LENGTH.pack(len(text)) + text + (draw(outcome) if errand.picture else b"")


def _request(errand: Errand) -> Request:
    import numpy as np

    from lubdub.pipeline import Request
    from lubdub.results import Patient

    told: dict[str, Any] = asdict(errand)
    landmarks: dict[Any, Any] = {name: np.array(position) for name, position in errand.landmarks.items()}
    patient = Patient(**{name: told[name] for name in ("age_years", "sex", "posture")})
    return Request(patient=patient, landmarks=landmarks, unit=errand.unit, method=told["method"])


def _unpack(answer: bytes) -> tuple[bytes, bytes]:
    (length,) = _LENGTH.unpack_from(answer)
    end = _LENGTH.size + length
    return answer[_LENGTH.size : end], answer[end:]
