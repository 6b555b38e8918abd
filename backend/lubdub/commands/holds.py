"""`lubdub admin case ...`: legal holds, for the person who runs the service."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from lubdub.commands.faults import CommandFault
from lubdub.commands.opened import database, opened, say

if TYPE_CHECKING:
    from lubdub.cases.holds import Holds


def add_parser(things: argparse._SubParsersAction[Any]) -> None:
    """Add the commands about single cases."""
    case = things.add_parser("case", help="legal holds, which keep a case from being deleted")
    verbs = case.add_subparsers(dest="verb", required=True, metavar="hold|release|held")
    for verb, meaning, command in (
        ("hold", "keep a case from being deleted, by anybody and by the clock", _hold),
        ("release", "lift the hold", _release),
    ):
        parser = verbs.add_parser(verb, help=meaning)
        parser.add_argument("id", help="the case's id")
        parser.add_argument("--reason", required=True, help="why, in words that name nobody; it stands in the trail")
        parser.set_defaults(run=opened(_told(command)))
    verbs.add_parser("held", help="all cases that are held").set_defaults(run=opened(_told(_list)))


def _hold(holds: Holds, typed: argparse.Namespace) -> None:
    from lubdub.cases.values import SYSTEM

    holds.place(SYSTEM, typed.id, typed.reason)
    say(f"Case {typed.id} is held: nobody can delete it, and the clock passes it by.")


def _release(holds: Holds, typed: argparse.Namespace) -> None:
    from lubdub.cases.values import SYSTEM

    holds.lift(SYSTEM, typed.id, typed.reason)
    say(f"Case {typed.id} is not held any more. If it is past its time, the clock deletes it within the hour.")


def _list(holds: Holds, typed: argparse.Namespace) -> None:
    from lubdub.cases.values import SYSTEM

    for hold in holds.list_all(SYSTEM):
        say(f"{hold.case_id}  {hold.since:%Y-%m-%d}  {hold.by}  {hold.reason}")


def _told(command: Callable[[Holds, argparse.Namespace], None]) -> Callable[[argparse.Namespace], int]:
    def run(typed: argparse.Namespace) -> int:
        from lubdub.cases.errors import CaseNotFound, StateConflict

        try:
            with _holds() as holds:
                command(holds, typed)
        except CaseNotFound as fault:
            raise CommandFault(f"There is no case {typed.id}.") from fault
        except (StateConflict, ValueError) as fault:
            raise CommandFault(str(fault)) from fault
        return 0

    return run


@contextmanager
def _holds() -> Iterator[Holds]:
    from lubdub.cases.holds import Holds
    from lubdub.cases.opening import open_database

    cases = open_database(database())
    try:
        yield Holds(cases)
    finally:
        cases.close()
