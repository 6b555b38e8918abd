"""Where the master key comes from: a file, the environment, or a file that a key service's command opens.

There may be several: the first seals what is new, the others still open what was sealed before a rotation.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import os
import secrets
import shlex
import stat
import subprocess  # nosec B404
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from lubdub.cases.sealing import KEY_BYTES

COMMAND_S = 30.0
PLAIN, WRAPPED = "plain", "wrapped"
Verb = Literal["wrap", "unwrap"]


class MasterKeyUnusable(Exception):
    """The master key cannot be used. The text is one sentence for the person who runs the service."""


class NamesMasterKey(Protocol):
    """What the settings say about the master key."""

    @property
    def file(self) -> Path:
        """As `MasterKeySource` has it."""

    @property
    def text(self) -> str:
        """As `MasterKeySource` has it."""

    @property
    def command(self) -> str:
        """As `MasterKeySource` has it."""


@dataclass(frozen=True)
class MasterKeySource:
    """file: holds one line for each key, unless text does: keys in base64 with commas between.

    command: of a key service, called with `wrap` or `unwrap` as its last word, base64 in and out; the file then holds
    what it wrapped, and opens nothing without it.
    """

    file: Path
    text: str = ""
    command: str = ""

    @classmethod
    def of(cls, named: NamesMasterKey | Path) -> MasterKeySource:
        """From the settings; a path alone stands for a file of that name."""
        return cls(named) if isinstance(named, Path) else cls(named.file, named.text, named.command)

    @property
    def name(self) -> str:
        """What a person calls it."""
        return "key in LUBDUB_MASTER_KEY" if self.text else f"master key {self.file.name}"


def load(source: MasterKeySource, *, may_make: bool) -> tuple[bytes, ...]:
    """The keys, the current one first. may_make: whether a file that is missing is made. Raises MasterKeyUnusable."""
    if source.text:
        return tuple(_decoded(source, word) for word in source.text.split(","))
    if not source.file.exists():
        if not may_make:
            raise MasterKeyUnusable(
                f"The {source.name} is missing, and without it nothing that is stored here can be opened. "
                "Put it back from where you keep its copy."
            )
        source.file.parent.mkdir(parents=True, exist_ok=True)
        _make(source)
    if stat.S_IMODE(source.file.stat().st_mode) & 0o077:
        raise MasterKeyUnusable(f"The {source.name} can be read by others. Run: chmod 600 on it.")
    return tuple(_opened(source, line) for line in _lines(source))


def stamp(source: MasterKeySource) -> tuple[int, int] | None:
    """Changes whenever the file does; None for keys that cannot change while the process runs."""
    if source.text:
        return None
    try:
        found = source.file.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def put_in_front(source: MasterKeySource, key: bytes) -> None:
    """Make key the current one; those before stay behind it."""
    _write_over(source, [_line(source, key), *_lines(source)])


def keep_current_alone(source: MasterKeySource) -> None:
    """Drop every key but the current one."""
    _write_over(source, _lines(source)[:1])


def fingerprint(key: bytes) -> str:
    """By which people tell keys apart; it says nothing about the key."""
    return hashlib.sha256(b"lubdub master key\0" + key).hexdigest()[:12]


def _lines(source: MasterKeySource) -> list[str]:
    """The file's keys as `kind base64`. A file of exactly the key's bytes is how one key was kept at first."""
    content = source.file.read_bytes()
    if len(content) == KEY_BYTES:
        return [f"{PLAIN} {base64.b64encode(content).decode()}"]
    lines = [line for line in content.decode("ascii", "replace").splitlines() if line.strip()]
    if not lines or any(line.split(" ")[0] not in (PLAIN, WRAPPED) for line in lines):
        raise MasterKeyUnusable(f"The {source.name} is damaged: it must hold one key on each line.")
    return lines


def _opened(source: MasterKeySource, line: str) -> bytes:
    kind, _, text = line.partition(" ")
    if kind == PLAIN:
        return _decoded(source, text)
    if not source.command:
        raise MasterKeyUnusable(
            f"The {source.name} is wrapped by a key service. Name the command that opens it in "
            "LUBDUB_MASTER_KEY_COMMAND."
        )
    return _decoded(source, _ask(source.command, "unwrap", text.strip()))


def _decoded(source: MasterKeySource, text: str) -> bytes:
    try:
        key = base64.b64decode(text.strip(), validate=True)
    except (binascii.Error, ValueError):
        key = b""
    if len(key) != KEY_BYTES:
        raise MasterKeyUnusable(f"The {source.name} is damaged: a key is {KEY_BYTES} bytes, written in base64.")
    return key


def _line(source: MasterKeySource, key: bytes) -> str:
    text = base64.b64encode(key).decode()
    if not source.command:
        return f"{PLAIN} {text}"
    return f"{WRAPPED} {_ask(source.command, 'wrap', text)}"


def _ask(command: str, verb: Verb, text: str) -> str:
    """What the key service answers. Its own words are not repeated: nobody knows what stands in them."""
    try:
        done = subprocess.run(  # nosec B603
            [*shlex.split(command), verb], input=text, capture_output=True, text=True, timeout=COMMAND_S, check=True
        )
    except subprocess.CalledProcessError as error:
        why = f"ended with code {error.returncode}"
    except subprocess.TimeoutExpired:
        why = f"did not answer within {COMMAND_S:g} seconds"
    except (OSError, ValueError):
        why = "cannot be run"
    else:
        answer = "".join(done.stdout.split())
        if answer and answer.isascii():
            return answer
        why = "did not answer in base64"
    raise MasterKeyUnusable(f"The command in LUBDUB_MASTER_KEY_COMMAND {why} when asked to {verb} the master key.")


def _make(source: MasterKeySource) -> None:
    """Written whole under another name and then linked, so that two processes starting at once agree on one."""
    draft = _draft(source, [_line(source, secrets.token_bytes(KEY_BYTES))])
    try:
        os.link(draft, source.file)
    except FileExistsError:
        return
    finally:
        draft.unlink()


def _write_over(source: MasterKeySource, lines: Sequence[str]) -> None:
    os.replace(_draft(source, lines), source.file)
    folder = os.open(source.file.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def _draft(source: MasterKeySource, lines: Sequence[str]) -> Path:
    draft = source.file.with_name(f"{source.file.name}.{secrets.token_hex(4)}")
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as file:
        file.write("".join(f"{line}\n" for line in lines))
        file.flush()
        os.fsync(file.fileno())
    return draft
