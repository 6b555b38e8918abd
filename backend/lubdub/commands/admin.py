"""`lubdub admin ...`: what the person who runs the service does by command."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

from lubdub.commands.faults import CommandFault


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the admin commands to the command line."""
    admin = commands.add_parser("admin", help="portal keys and settings")
    things = admin.add_subparsers(dest="thing", required=True, metavar="key|settings")
    key = things.add_parser("key", help="keys by which portals call the REST interface")
    verbs = key.add_subparsers(dest="verb", required=True, metavar="create|list|revoke")
    create = verbs.add_parser("create", help="make a key; its token is printed this once")
    create.add_argument("name", help="the portal's name")
    create.add_argument("--scope", action="append", help="what it may do; repeat for several (default: all)")
    create.set_defaults(run=_opened(_create_key))
    verbs.add_parser("list", help="all keys").set_defaults(run=_opened(_list_keys))
    revoke = verbs.add_parser("revoke", help="end a key")
    revoke.add_argument("id", help="the key's id, as `key list` shows it")
    revoke.set_defaults(run=_opened(_revoke_key))
    things.add_parser("settings", help="every setting, its value and its meaning").set_defaults(run=_show_settings)


def _opened(command: Callable[[argparse.Namespace], int]) -> Callable[[argparse.Namespace], int]:
    """The command, with a database that cannot be opened said in its own sentence."""

    def run(typed: argparse.Namespace) -> int:
        from lubdub.cases.opening import CannotOpen

        try:
            return command(typed)
        except CannotOpen as fault:
            raise CommandFault(str(fault)) from fault

    return run


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")


def _create_key(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import create_key
    from lubdub.cases.people import SCOPES

    try:
        key, token = create_key(_database(), typed.name, tuple(typed.scope or SCOPES))
    except ValueError as fault:
        raise CommandFault(str(fault)) from fault
    sys.stderr.write(f"Key {key.id} for {key.name}. The token below is shown this once; keep it safe.\n")
    _say(token)
    return 0


def _list_keys(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import list_keys

    for key in list_keys(_database()):
        state = "revoked" if key.revoked_at else "living"
        _say(f"{key.id}  {key.prefix}…  {state}  {key.created_at:%Y-%m-%d}  {' '.join(key.scopes)}  {key.name}")
    return 0


def _revoke_key(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import revoke_key

    if not revoke_key(_database(), typed.id):
        raise CommandFault(f"There is no living key {typed.id}.")
    _say(f"Key {typed.id} is revoked.")
    return 0


def _show_settings(typed: argparse.Namespace) -> int:
    from lubdub.commands.service import read_settings

    settings = read_settings({})
    for name, field in type(settings).model_fields.items():
        _say(f"LUBDUB_{name.upper()}={getattr(settings, name)}\n    {field.description}")
    return 0


def _database() -> str:
    from lubdub.commands.service import read_settings

    return read_settings({}).database
