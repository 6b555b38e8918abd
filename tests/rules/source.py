"""What the rules read: the package's modules, their imports and functions, and the files git knows."""

from __future__ import annotations

import ast
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "backend" / "lubdub"


@dataclass(frozen=True)
class Module:
    """One Python file of the package. room: its first folder, or its own name at the top."""

    path: Path
    tree: ast.Module

    @property
    def room(self) -> str:
        return self.path.relative_to(PACKAGE).parts[0].removesuffix(".py")

    def __str__(self) -> str:
        return str(self.path.relative_to(ROOT))


@cache
def modules() -> tuple[Module, ...]:
    return tuple(Module(path, ast.parse(path.read_text())) for path in sorted(PACKAGE.rglob("*.py")))


def imports(module: Module) -> Iterator[tuple[int, str]]:
    """Line and full name of everything a module imports, also inside functions."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, name.name) for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}:{node.lineno} imports relatively"
            yield from ((node.lineno, f"{node.module}.{name.name}") for name in node.names)


@cache
def tracked_files() -> tuple[Path, ...]:
    """The repository's own files: what git tracks; in a copy without git, all but what .gitignore names."""
    try:
        listing = subprocess.run(
            ["git", "-c", "safe.directory=*", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return tuple(sorted(_files_below(ROOT)))
    return tuple(ROOT / name for name in listing.stdout.decode().split("\0") if name and (ROOT / name).is_file())


def _files_below(folder: Path) -> Iterator[Path]:
    ignored = [line.strip("/") for line in (ROOT / ".gitignore").read_text().split() if line.endswith("/")]
    for path in folder.iterdir():
        if path.is_dir() and path.name not in {*ignored, ".git"}:
            yield from _files_below(path)
        elif path.is_file() and path.suffix != ".pyc":
            yield path


def text_of(path: Path) -> str | None:
    """A tracked file's text, None for a binary one."""
    content = path.read_bytes()
    return None if b"\0" in content else content.decode("utf-8")
