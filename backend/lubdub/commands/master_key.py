"""`lubdub admin master-key ...`: which master key is in use, and changing it while the service runs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from lubdub.commands.faults import CommandFault
from lubdub.commands.opened import opened, say

if TYPE_CHECKING:
    from lubdub.cases.rotation import Rotation


def add_parser(things: argparse._SubParsersAction[Any]) -> None:
    """Add the commands about the master key."""
    parser = things.add_parser("master-key", help="the key above the keys of all cases")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="show|rotate|retire|new")
    for verb, meaning, command in (
        ("show", "which one is in use, and how much is sealed under older ones", _show),
        ("rotate", "put a new one in use while the service runs; run it again when it was broken off", _rotate),
        ("retire", "drop the old ones, a minute after the rotation or later", _retire),
    ):
        verbs.add_parser(verb, help=meaning).set_defaults(run=opened(_told(command)))
    verbs.add_parser("new", help="a fresh key on standard output, for LUBDUB_MASTER_KEY").set_defaults(run=_new)


def _show(rotation: Rotation) -> int:
    standing = rotation.standing()
    current, *older = standing.fingerprints
    say(f"Current master key: {current}")
    for one in older:
        say(f"Older master key:   {one}")
    say(f"{_many(standing.sealed, 'key')} sealed, {standing.behind} of them under an older master key.")
    return 0


def _rotate(rotation: Rotation) -> int:
    if rotation.begin():
        sys.stderr.write("A new master key is in use for everything new. Sealing the keys of all cases anew ...\n")
    else:
        sys.stderr.write("A new master key is in use already; going on with what is sealed under the old one ...\n")
    done = rotation.seal_anew(_tell)
    say(f"{_many(done, 'key')} sealed anew; the current master key is {rotation.standing().fingerprints[0]}.")
    say(
        "The old one is kept for what is under way. In a minute or later: make a backup, then drop the old key with "
        "./lubdub admin master-key retire"
    )
    return 0


def _retire(rotation: Rotation) -> int:
    dropped = rotation.retire()
    say(f"{_many(dropped, 'old master key')} dropped. Destroy {'its' if dropped == 1 else 'their'} copies, too.")
    return 0


def _tell(so_far: int) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\r{_many(so_far, 'key')} ")


def _many(count: int, thing: str) -> str:
    return f"{count} {thing}{'' if count == 1 else 's'}"


def _new(typed: argparse.Namespace) -> int:
    import base64
    import secrets

    say(base64.b64encode(secrets.token_bytes(32)).decode())
    return 0


def _told(command: Callable[[Rotation], int]) -> Callable[[argparse.Namespace], int]:
    def run(typed: argparse.Namespace) -> int:
        from lubdub.cases.errors import SealBroken
        from lubdub.cases.master_key import MasterKeyUnusable
        from lubdub.cases.rotation import CannotRotate

        try:
            with _rotation() as rotation:
                return command(rotation)
        except (CannotRotate, MasterKeyUnusable) as fault:
            raise CommandFault(str(fault)) from fault
        except SealBroken as fault:
            raise CommandFault("There are keys that none of the master keys opens. Nothing was dropped.") from fault

    return run


@contextmanager
def _rotation() -> Iterator[Rotation]:
    from lubdub.cases.opening import open_cases
    from lubdub.cases.rotation import Rotation
    from lubdub.commands.service import read_settings

    settings = read_settings({})
    database, vault = open_cases(settings.database, settings.store, settings.master_key_source)
    try:
        yield Rotation(database, vault.keys)
    finally:
        database.close()
