"""What the admin commands share: the database they work on, and how they speak."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

from lubdub.commands.faults import CommandFault


def opened(command: Callable[[argparse.Namespace], int]) -> Callable[[argparse.Namespace], int]:
    """The command, with a database that cannot be opened said in its own sentence."""

    def run(typed: argparse.Namespace) -> int:
        from lubdub.cases.opening import CannotOpen

        try:
            return command(typed)
        except CannotOpen as fault:
            raise CommandFault(str(fault)) from fault

    return run


def say(line: str) -> None:
    """A line of the command's answer."""
    sys.stdout.write(line + "\n")


def database() -> str:
    """The URL of the cases' database."""
    from lubdub.commands.service import read_settings

    return read_settings({}).database
