"""The lock files are in step with what they lock, and everything is locked by hash."""

from __future__ import annotations

import json
import re

import pytest

from tests.rules.source import ROOT

REQUIREMENT_FILES = sorted(path.name for path in ROOT.glob("requirements*.in"))
PINNED = re.compile(r"^([A-Za-z0-9._-]+)(?:\[[^]]*\])?==([^ ;\\]+)([^\\\n]*)", re.M)
"""Package, version and the marker that says for which Python or system."""


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def wanted(name: str) -> set[str]:
    lines = (line.split("#")[0].strip() for line in (ROOT / name).read_text().splitlines())
    return {canonical(re.split(r"[\s\[=<>!~;]", line)[0]) for line in lines if line and not line.startswith("-")}


@pytest.mark.parametrize("name", REQUIREMENT_FILES)
def test_everything_wanted_is_pinned_with_hashes(name: str) -> None:
    lock = (ROOT / name).with_suffix(".txt").read_text()
    pinned = {canonical(package) for package, _, _ in PINNED.findall(lock)}
    assert wanted(name) <= pinned
    blocks = re.split(r"\n(?=[A-Za-z0-9])", re.sub(r"(?m)^\s*#.*\n", "", lock))
    assert [block.split("\\")[0] for block in blocks if "==" in block and "--hash=sha256:" not in block] == []


def test_all_lock_files_agree_about_versions() -> None:
    versions: dict[tuple[str, str], set[str]] = {}
    for name in REQUIREMENT_FILES:
        if name == "requirements-make.in":  # for rebuilding the references, in an environment of its own
            continue
        for package, version, marker in PINNED.findall((ROOT / name).with_suffix(".txt").read_text()):
            versions.setdefault((canonical(package), marker.strip()), set()).add(version)
    assert {package: found for package, found in versions.items() if len(found) > 1} == {}


@pytest.mark.parametrize("folder", ["frontend", "tests/peers"])
def test_packages_of_npm_are_locked_with_checksums(folder: str) -> None:
    declared = json.loads((ROOT / folder / "package.json").read_text())
    locked = json.loads((ROOT / folder / "package-lock.json").read_text())["packages"]
    for name, version in (declared.get("dependencies", {}) | declared["devDependencies"]).items():
        assert locked[f"node_modules/{name}"]["version"] == version
    fetched = [package for path, package in locked.items() if path and not package.get("inBundle")]
    assert all("integrity" in package for package in fetched)
