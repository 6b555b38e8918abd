"""`lubdub admin clinician ...`: who works at the desk, by command, for the person who runs the service."""

from __future__ import annotations

import argparse
from typing import Any

from lubdub.commands.faults import CommandFault
from lubdub.commands.opened import database, opened, say

ROLES = ("clinician", "lead", "administrator")


def add_parser(things: argparse._SubParsersAction[Any]) -> None:
    """Add the commands about clinicians."""
    clinician = things.add_parser("clinician", help="people who review cases at the desk")
    verbs = clinician.add_subparsers(dest="verb", required=True, metavar="first|list|invite|renew|role|disable|enable")
    verbs.add_parser("first", help="a link for the very first clinician").set_defaults(run=opened(_first))
    verbs.add_parser("list", help="all clinicians").set_defaults(run=opened(_list))
    invite = verbs.add_parser("invite", help="a link for a colleague of somebody")
    invite.add_argument("email", help="address of a clinician in the same organisation")
    invite.add_argument("--role", choices=ROLES, default="clinician")
    invite.set_defaults(run=opened(_invite))
    renew = verbs.add_parser("renew", help="a link by which somebody gets new ways to sign in")
    renew.add_argument("email")
    renew.set_defaults(run=opened(_renew))
    role = verbs.add_parser("role", help="give somebody another role")
    role.add_argument("email")
    role.add_argument("change", choices=ROLES, metavar="|".join(ROLES))
    role.set_defaults(run=opened(_change))
    for verb, meaning in (("disable", "shut somebody out at once"), ("enable", "let somebody in again")):
        parser = verbs.add_parser(verb, help=meaning)
        parser.add_argument("email")
        parser.set_defaults(run=opened(_change), change=verb)


def _first(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import first_link

    offered = first_link(database())
    if offered is None:
        raise CommandFault("There are clinicians already. Use: ./lubdub admin clinician invite EMAIL")
    return _show_link(offered.token)


def _invite(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import invite_beside

    offered = invite_beside(database(), typed.email, typed.role)
    if offered is None:
        raise _nobody(typed.email)
    return _show_link(offered.token)


def _renew(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import renew_clinician

    offered = renew_clinician(database(), typed.email)
    if offered is None:
        raise _nobody(typed.email)
    return _show_link(offered.token)


def _list(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import list_clinicians

    for one in list_clinicians(database()):
        state = "disabled" if one.disabled_at else "living"
        say(f"{one.email}  {state}  {one.role}  {one.created_at:%Y-%m-%d}  {one.organisation}  {one.name}")
    return 0


def _change(typed: argparse.Namespace) -> int:
    from lubdub.cases.admin import change_clinician
    from lubdub.cases.errors import NotAllowed

    try:
        if not change_clinician(database(), typed.email, typed.change):
            raise _nobody(typed.email)
    except NotAllowed as fault:
        raise CommandFault(str(fault)) from fault
    say(f"{typed.email}: {typed.change}.")
    return 0


def _show_link(token: str) -> int:
    from lubdub.commands.service import read_settings

    say(f"{read_settings({}).desk_address}/desk/join#{token}")
    return 0


def _nobody(email: str) -> CommandFault:
    return CommandFault(f"There is no clinician with the address {email}.")
