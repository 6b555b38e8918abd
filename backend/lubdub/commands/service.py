"""`lubdub serve`, `web`, `view`, `worker` and `openapi`: the service, whole or in its roles."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from lubdub.commands.faults import CommandFault

if TYPE_CHECKING:
    from lubdub.settings import Settings

S = TypeVar("S")

ROLES = {
    "serve": "the product on one machine: pages, REST interface and worker",
    "web": "the pages and the REST interface alone",
    "view": "the live 3D views and the pages around them alone, behind a proxy that sends each case to one of these",
    "worker": "one worker alone",
}


def add_parsers(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the service's commands to the command line."""
    for role, meaning in ROLES.items():
        parser = commands.add_parser(role, help=meaning)
        parser.set_defaults(run=_run_role, role=role)
        parser.add_argument("--data-dir", metavar="DIR", help="folder of the database, the key and the files")
        if role != "worker":
            parser.add_argument("--host", help="address to listen on (default: this machine alone)")
            parser.add_argument("--port", type=int, help="TCP port to listen on")
            parser.add_argument(
                "--behind-tls-proxy", action="store_true", default=None, help="a proxy in front speaks HTTPS"
            )
    openapi = commands.add_parser("openapi", help="the REST interface's OpenAPI document")
    openapi.set_defaults(run=_print_openapi)


def read_settings(given: Mapping[str, Any]) -> Settings:
    """The settings from the environment, with what was typed on top. Raises CommandFault."""
    from lubdub.settings import Settings

    return checked(lambda: Settings(**{name: value for name, value in given.items() if value is not None}))


def checked(make: Callable[[], S]) -> S:
    """Settings, or what is wrong with them in words. Raises CommandFault."""
    from pydantic import ValidationError

    try:
        return make()
    except ValidationError as fault:
        raise CommandFault("; ".join(_in_words(error) for error in fault.errors())) from fault


def _in_words(error: Any) -> str:
    where = ".".join(str(part) for part in error["loc"])
    words = str(error["msg"]).removeprefix("Value error, ")
    return f"Setting {where}: {words}" if where else words


def _run_role(typed: argparse.Namespace) -> int:
    names = ("data_dir", "host", "port", "behind_tls_proxy")
    settings = read_settings({name: getattr(typed, name, None) for name in names})
    match typed.role:
        case "serve":
            from lubdub.web.serve import serve

            serve(settings)
        case "web" | "view":
            from lubdub.web.serve import run_web

            run_web(settings, typed.role)
        case _:
            from lubdub.jobs.worker import run_worker

            run_worker(settings)
    return 0


def _print_openapi(typed: argparse.Namespace) -> int:
    from lubdub.web.openapi import openapi_json

    sys.stdout.write(openapi_json() + "\n")
    return 0
