"""Reads `references/`: the bodies, the topology they share, the basis drawn from their kind, signs of landmarks."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np

from lubdub.geometry.builds import Builds
from lubdub.geometry.signs import Sign, Signs
from lubdub.geometry.surface import Surface
from lubdub.library.marks import FOLDER, AreaMarks, marked, read_marks
from lubdub.results import AREA_NAMES, LANDMARK_NAMES, Library, Reference, ShapeBasis

SHIPPED = Path(__file__).resolve().parents[3] / "references"
"""The repository's own references."""

SHARED = ("topology.npz", "basis.npz", "signs.npz")

Name = TypeVar("Name", bound=str)

UNREADABLE = (OSError, ValueError, KeyError, zipfile.BadZipFile)


class LibraryDamaged(Exception):
    """A file of the reference library is missing or not what it was. The text is one sentence for a person."""


def load_library(folder: Path | None = None) -> Library:
    """All reference bodies, the basis and the signs, every file checked against its SHA-256.

    folder: holds `bodies/`, and may hold its own `topology.npz`, `basis.npz`, `signs.npz` and `manifest.json`; where
    it does not, the shipped ones serve, so a clinic can bring bodies alone, or `marks/` on the shipped bodies alone.
    Default: the shipped references. A body whose card says `disabled` does not serve; one that two people have marked
    has their areas. Raises LibraryDamaged for a missing or altered file.
    """
    home = bodies_home(folder)
    shared = _shared(home)
    hashes = _manifest(shared)
    topology, basis, signs = (_checked(shared / name, hashes.get(name)) for name in SHARED)
    triangles = _topology(topology, shared / "topology.npz")
    shape = _basis(basis, triangles, shared / "basis.npz")
    total = hashlib.sha256(topology + basis + signs)
    references, marks = [], _marks(folder)
    for card in sorted((home / "bodies").glob("*/card.json")):
        reference, digest = _reference(card, triangles, len(shape.mean))
        if reference.card.get("disabled"):
            continue
        as_marked = marked(reference, marks)
        references.append(as_marked)
        total.update(digest)
        if as_marked is not reference:
            total.update(np.array(list(as_marked.areas.values())).tobytes())
    if not references:
        raise LibraryDamaged(f"There are no reference bodies in {home / 'bodies'}: restore the folder or name another.")
    return Library(tuple(references), shape, _signs(signs, shared / "signs.npz"), total.hexdigest())


def load_body(folder: Path | None, name: str) -> Reference | None:
    """One body as it stands in the folder, whatever people marked on it; None when there is none of this name.

    Raises LibraryDamaged.
    """
    home = bodies_home(folder)
    card = next((one for one in (home / "bodies").glob("*/card.json") if one.parent.name == name), None)
    if card is None:
        return None
    shared = _shared(home)
    hashes = _manifest(shared)
    topology, basis = (_checked(shared / part, hashes.get(part)) for part in SHARED[:2])
    triangles = _topology(topology, shared / "topology.npz")
    return _reference(card, triangles, len(_basis(basis, triangles, shared / "basis.npz").mean))[0]


def bodies_home(folder: Path | None) -> Path:
    """Where the bodies of a folder are: the shipped ones when it holds marks on these alone."""
    if folder is None or (not (folder / "bodies").is_dir() and (folder / FOLDER).is_dir()):
        return SHIPPED
    return folder


def state_of(folder: Path | None) -> tuple[tuple[str, int, int, int], ...]:
    """Another one whenever a body or mark of one's own was added, changed or removed; the shipped ones never are."""
    if folder is None:
        return ()
    found = []
    for path in sorted((*folder.glob("bodies/*/card.json"), *folder.glob(f"{FOLDER}/*/*.json"))):
        with suppress(FileNotFoundError):  # removed a moment ago
            told = path.stat()
            found.append((str(path.relative_to(folder)), told.st_ino, told.st_mtime_ns, told.st_size))
    return tuple(found)


def _shared(home: Path) -> Path:
    return home if (home / "manifest.json").is_file() else SHIPPED


def _marks(folder: Path | None) -> list[AreaMarks]:
    try:
        return read_marks(folder)
    except (*UNREADABLE, TypeError) as error:
        raise LibraryDamaged(f"A file of people's marks on reference bodies is damaged: {error}.") from error


def _manifest(folder: Path) -> Mapping[str, str]:
    try:
        return dict(json.loads(_read(folder / "manifest.json"))["files"])
    except (ValueError, KeyError, TypeError) as error:
        raise _damaged(folder / "manifest.json") from error


def _reference(card_path: Path, triangles: np.ndarray, vertex_count: int) -> tuple[Reference, bytes]:
    """The body beside a card, and the digest of both files."""
    text = _read(card_path)
    path = card_path.with_name("body.npz")
    try:
        card: dict[str, Any] = json.loads(text)
        content = _checked(path, card["sha256"])
        reference = _body(card, _arrays(content), triangles, vertex_count)
    except UNREADABLE as error:
        raise _damaged(path) from error
    return reference, hashlib.sha256(text + content).digest()


def _body(
    card: Mapping[str, Any], arrays: Mapping[str, np.ndarray], triangles: np.ndarray, vertex_count: int
) -> Reference:
    vertices = arrays["vertices"]
    if vertices.shape != (vertex_count, 3):
        raise ValueError("the body has another topology")
    return Reference(
        id=str(card["id"]),
        surface=Surface(vertices, triangles),
        landmarks=_named(LANDMARK_NAMES, arrays["landmark_positions"]),
        areas=_named(AREA_NAMES, arrays["area_positions"]),
        card=card,
    )


def _named(names: tuple[Name, ...], positions: np.ndarray) -> dict[Name, np.ndarray]:
    if positions.shape != (len(names), 3):
        raise ValueError("a mark is missing")
    return dict(zip(names, positions.astype(np.float64), strict=True))


def _topology(content: bytes, path: Path) -> np.ndarray:
    try:
        return _arrays(content)["triangles"].astype(np.int64)
    except UNREADABLE as error:
        raise _damaged(path) from error


def _basis(content: bytes, triangles: np.ndarray, path: Path) -> ShapeBasis:
    try:
        arrays = _arrays(content)
        return ShapeBasis(
            mean=arrays["mean"].astype(np.float64),
            modes=arrays["modes"] * arrays["mode_steps"].astype(np.float64)[:, None, None],
            triangles=triangles,
            landmark_corners=arrays["landmark_corners"].astype(np.int64),
            landmark_weights=arrays["landmark_weights"].astype(np.float64),
            area_corners=arrays["area_corners"].astype(np.int64),
            area_weights=arrays["area_weights"].astype(np.float64),
            data_weight=arrays["data_weight"].astype(np.float64),
            builds=Builds(*(arrays[f"build_{part}"].astype(np.float64) for part in ("ages", "means", "spread"))),
        )
    except UNREADABLE as error:
        raise _damaged(path) from error


def _signs(content: bytes, path: Path) -> Signs:
    try:
        arrays = {name: array.astype(np.float64) for name, array in _arrays(content).items()}
        parts = ("filters", "usual", "weights")
        navel, nipple = (Sign(*(arrays[f"{name}_{part}"] for part in parts)) for name in ("navel", "nipple"))
    except UNREADABLE as error:
        raise _damaged(path) from error
    return Signs(navel, nipple)


def _arrays(content: bytes) -> dict[str, np.ndarray]:
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def _checked(path: Path, sha256: str | None) -> bytes:
    content = _read(path)
    if hashlib.sha256(content).hexdigest() != sha256:
        raise _damaged(path)
    return content


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise _damaged(path, "is missing or cannot be read") from error


def _damaged(path: Path, what: Literal["is damaged", "is missing or cannot be read"] = "is damaged") -> LibraryDamaged:
    place = "/".join(path.parts[-3:])
    return LibraryDamaged(f"The reference file {place} {what}: restore the references folder from its source.")
