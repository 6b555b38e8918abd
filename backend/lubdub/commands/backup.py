"""`lubdub admin backup DEST` while the service runs, and `lubdub admin restore SRC` into an empty place."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lubdub.commands.faults import CommandFault
from lubdub.commands.opened import opened, say

if TYPE_CHECKING:
    from lubdub.cases.backup import OwnFile
    from lubdub.settings import Settings

KEYRING = "lubdub.keyring"


def add_parsers(things: argparse._SubParsersAction[Any]) -> None:
    """Add both commands."""
    backup = things.add_parser("backup", help="everything the running service holds, sealed, into a new folder")
    backup.add_argument("folder", type=Path, metavar="DEST", help="the new folder")
    backup.set_defaults(run=opened(_told(_backup)))
    restore = things.add_parser("restore", help="a backup into an empty place; the master key must be there before")
    restore.add_argument("folder", type=Path, metavar="SRC", help="a folder that `backup` made")
    restore.set_defaults(run=opened(_told(_restore)))
    for parser in (backup, restore):
        parser.add_argument(
            "--keyring",
            type=Path,
            metavar="FILE",
            help=f"keys of the cases that still live; only the newest may exist (default: {KEYRING} beside the folder)",
        )


def _backup(typed: argparse.Namespace, settings: Settings) -> int:
    from lubdub.cases.backup import Backup
    from lubdub.cases.opening import open_cases

    if typed.folder.resolve().is_relative_to(settings.data_dir.resolve()):
        raise CommandFault("A backup inside the data folder is lost together with it. Choose a folder elsewhere.")
    database, vault = open_cases(settings.database, settings.store, settings.master_key_source)
    try:
        made = Backup(database, vault).make(typed.folder, _keyring(typed), _own_files(settings.own_references))
    finally:
        database.close()
    say(f"{made.folder}: {made.cases} cases with {made.files} files, all of them sealed.")
    say(f"{made.keyring}: their keys. Keep it apart from the backups, and only this newest one: it opens all of them.")
    say("The master key is in neither. Without a copy of it, kept somewhere else, nothing here can be opened.")
    if made.missing:
        say(f"{len(made.missing)} files that cases point at are missing in the store: {', '.join(made.missing[:5])}")
    return 1 if made.missing else 0


def _restore(typed: argparse.Namespace, settings: Settings) -> int:
    from lubdub.cases.restoring import Restore, Target

    _must_be_new(settings)
    restore = Restore(typed.folder, _keyring(typed), settings.master_key_source)
    done = restore.into(Target(settings.database, settings.store, settings.own_references))
    say(f"{done.cases} cases with {done.files} files are back; {done.bodies} files of reference bodies.")
    if done.deleted:
        say(f"{done.deleted} cases were deleted since this backup was made, and stay deleted.")
    say("Start the service: it goes on with every job that was under way. Clinicians sign in again.")
    return 0


def _must_be_new(settings: Settings) -> None:
    """No database may be here: a queue of another service would take our jobs for its own."""
    for url in (settings.database, settings.jobs_database):
        path = Path(url.removeprefix("sqlite:///"))
        if url.startswith("sqlite") and path.exists():
            raise CommandFault(f"There is a service here already ({path.name}). Restore into an empty data folder.")


def _keyring(typed: argparse.Namespace) -> Path:
    named: Path | None = typed.keyring
    return typed.folder.resolve().parent / KEYRING if named is None else named


def _own_files(references: Path | None) -> list[OwnFile]:
    from lubdub.cases.backup import OwnFile

    if references is None or not references.is_dir():
        return []
    cases = {card.parent: json.loads(card.read_text()).get("case") for card in references.glob("bodies/*/card.json")}
    files = sorted(path for path in references.rglob("*") if path.is_file())
    return [OwnFile(str(path.relative_to(references)), path, cases.get(path.parent)) for path in files]


def _told(command: Callable[[argparse.Namespace, Settings], int]) -> Callable[[argparse.Namespace], int]:
    """The command, with everything that hinders it in its own sentence."""

    def run(typed: argparse.Namespace) -> int:
        from lubdub.cases.backup import CannotBackUp
        from lubdub.cases.database import DatabaseTooNew
        from lubdub.cases.errors import SealBroken
        from lubdub.cases.keyring import KeyringUnusable
        from lubdub.cases.master_key import MasterKeyUnusable
        from lubdub.cases.restoring import CannotRestore
        from lubdub.commands.service import read_settings

        try:
            return command(typed, read_settings({}))
        except (CannotBackUp, CannotRestore, KeyringUnusable, MasterKeyUnusable) as fault:
            raise CommandFault(str(fault)) from fault
        except DatabaseTooNew as fault:
            raise CommandFault("The backup was made by a newer Lubdub. Restore it with that version.") from fault
        except SealBroken as fault:
            raise CommandFault("There is a key here that the master key does not open. Nothing was written.") from fault
        except OSError as fault:
            raise CommandFault(f"This cannot be written or read: {fault.strerror or fault}.") from fault

    return run
