"""The made-up bodies to try Lubdub with."""

from __future__ import annotations

import hashlib
import json
from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from starlette.concurrency import run_in_threadpool

from lubdub.cases.screening import STOP_REASONS
from lubdub.cases.values import NewCase
from lubdub.settings import PROJECT_FOLDER
from lubdub.web.problems import Problem

DEMOS = PROJECT_FOLDER / "references" / "demo"
CARD = "patient.json"
LANDMARKS = "landmarks.json"


@dataclass(frozen=True)
class Sample:
    """A made-up body: its folder's name, the scan's file, who it is, and where its points are known to lie.

    landmarks: name -> [x, y, z] in the file's own coordinates: nobody can feel the bones of a sample.
    """

    name: str
    scan: Path
    patient: NewCase
    landmarks: Mapping[str, list[float]]

    async def chunks(self) -> AsyncIterator[bytes]:
        """The scan."""
        yield await run_in_threadpool(self.scan.read_bytes)


def all_samples(folder: Path = DEMOS) -> list[Sample]:
    """Youngest first."""
    found = [_read(card) for card in folder.glob(f"*/{CARD}")]
    return sorted((one for one in found if one is not None), key=lambda one: one.patient.age_years)


def sample(name: str) -> Sample:
    """The sample of this name. Raises Problem `page-not-found`."""
    for one in all_samples():
        if one.name == name:
            return one
    raise Problem("page-not-found", "There is no such sample.")


def samples_to_try(gettext: Callable[[str], str]) -> list[dict[str, str]]:
    """Name and words of each sample, youngest first."""
    return [{"name": one.name, "title": _title(one.patient, gettext)} for one in all_samples()]


async def only_samples(chunks: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
    """The same bytes. Raises Problem `sandbox-takes-samples` at their end when they are no sample's file."""
    seen = hashlib.sha256()
    async for chunk in chunks:
        seen.update(chunk)
        yield chunk
    await run_in_threadpool(refuse_others, seen.hexdigest())


def refuse_others(scan_sha256: str) -> None:
    """Raises Problem `sandbox-takes-samples` for a file that is no sample's."""
    if scan_sha256 not in _known_scans():
        raise Problem("sandbox-takes-samples", "This case is for trying out. Send the file of one of the samples.")


@lru_cache(maxsize=1)
def _known_scans() -> frozenset[str]:
    return frozenset(hashlib.sha256(one.scan.read_bytes()).hexdigest() for one in all_samples())


def _read(card: Path) -> Sample | None:
    scan = next((file for file in sorted(card.parent.iterdir()) if file.suffix != ".json"), None)
    if scan is None:
        return None
    said: dict[str, Any] = json.loads(card.read_text(encoding="utf-8"))
    patient = NewCase(
        age_years=float(said["age_years"]),
        sex="female" if said.get("sex") == "female" else "male",
        posture="sitting" if said.get("posture") == "sitting" else "supine",
        answers=dict.fromkeys(STOP_REASONS, "no"),
        person="sample",
    )
    known = card.parent / LANDMARKS
    landmarks = json.loads(known.read_text(encoding="utf-8")) if known.exists() else {}
    return Sample(card.parent.name, scan, patient, landmarks)


def _title(patient: NewCase, gettext: Callable[[str], str]) -> str:
    age, is_female = patient.age_years, patient.sex == "female"
    if age < 2:
        return gettext("A baby of {months} months").format(months=round(age * 12))
    if age < 16:
        words = gettext("A girl of {years}") if is_female else gettext("A boy of {years}")
    else:
        words = gettext("A woman of {years}") if is_female else gettext("A man of {years}")
    return words.format(years=round(age))
