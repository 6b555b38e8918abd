"""`lubdub admin settings`: every setting, what it is now and where that was said; and what must not stay so."""

from __future__ import annotations

import argparse
import os
from typing import Any

from lubdub.commands.opened import say
from lubdub.commands.service import checked

UNSAFE = 1


def add_parser(things: argparse._SubParsersAction[Any]) -> None:
    """Add the command."""
    parser = things.add_parser(
        "settings",
        help="every setting with its value, where that comes from, and its meaning; exit code 1 when they are unsafe",
    )
    parser.set_defaults(run=_show)


def _show(typed: argparse.Namespace) -> int:
    from lubdub.safety import faults, told
    from lubdub.settings import SettingsTable

    settings = checked(SettingsTable)
    in_environment = {name.upper() for name in os.environ}
    for name, field in SettingsTable.model_fields.items():
        variable = f"LUBDUB_{name.upper()}"
        source = "environment" if variable in in_environment else "default"
        say(f"{variable}={_shown(getattr(settings, name))}  [{source}]\n    {field.description}")
    for line in told(settings):
        say(line)
    return UNSAFE if faults(settings) else 0


def _shown(value: Any) -> str:
    from pydantic import SecretStr

    from lubdub.safety import without_password

    if isinstance(value, SecretStr):
        return "(hidden)" if value.get_secret_value() else ""
    return "" if value is None else without_password(str(value))
