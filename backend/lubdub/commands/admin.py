"""`lubdub admin ...`: what the person who runs the service does by command."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from lubdub.commands import backup, clinicians, holds, master_key, references, settings
from lubdub.commands.faults import CommandFault
from lubdub.commands.opened import database, opened, say


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the admin commands to the command line."""
    admin = commands.add_parser("admin", help="portal keys, clinicians, references, master key, backup and settings")
    things = admin.add_subparsers(
        dest="thing", required=True, metavar="key|clinician|references|case|master-key|backup|restore|settings"
    )
    key = things.add_parser("key", help="keys by which portals call the REST interface")
    verbs = key.add_subparsers(dest="verb", required=True, metavar="create|list|revoke")
    create = verbs.add_parser("create", help="make a key; its token is printed this once")
    create.add_argument("name", help="the portal's name")
    create.add_argument("--scope", action="append", help="what it may do; repeat for several (default: all)")
    create.add_argument("--sandbox", action="store_true", help="for trying out: it opens made-up cases alone")
    create.set_defaults(run=opened(_create_key))
    verbs.add_parser("list", help="all keys").set_defaults(run=opened(_list_keys))
    revoke = verbs.add_parser("revoke", help="end a key")
    revoke.add_argument("id", help="the key's id, as `key list` shows it")
    revoke.set_defaults(run=opened(_revoke_key))
    clinicians.add_parser(things)
    references.add_parser(things)
    holds.add_parser(things)
    master_key.add_parser(things)
    backup.add_parsers(things)
    settings.add_parser(things)


def _create_key(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import create_key
    from lubdub.cases.people import SCOPES

    try:
        key, token = create_key(database(), typed.name, tuple(typed.scope or SCOPES), typed.sandbox)
    except ValueError as fault:
        raise CommandFault(str(fault)) from fault
    sys.stderr.write(f"Key {key.id} for {key.name}. The token below is shown this once; keep it safe.\n")
    say(token)
    return 0


def _list_keys(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import list_keys

    for key in list_keys(database()):
        state = "revoked" if key.revoked_at else "sandbox" if key.is_sandbox else "living"
        say(f"{key.id}  {key.prefix}…  {state}  {key.created_at:%Y-%m-%d}  {' '.join(key.scopes)}  {key.name}")
    return 0


def _revoke_key(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import revoke_key

    if not revoke_key(database(), typed.id):
        raise CommandFault(f"There is no living key {typed.id}.")
    say(f"Key {typed.id} is revoked.")
    return 0
