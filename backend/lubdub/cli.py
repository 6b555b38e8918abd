"""What can be typed after `./lubdub`. Rooms are imported only when their command runs, so help is instant."""

from __future__ import annotations

import argparse
import logging
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from lubdub import __version__
from lubdub.commands import admin, benchmark, service, stickers
from lubdub.commands.faults import CommandFault

WRONG_USE, INTERRUPTED = 2, 130
OLDEST_YEARS = 120.0

log = logging.getLogger(__name__)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line instead of the whole usage."""
        self.exit(WRONG_USE, f"{self.prog}: {message} (see {self.prog} --help)\n")


def main(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code: 0 done, 2 wrong use, 3 refused by `locate`, 130 interrupted."""
    # Before NumPy is loaded anywhere. A second BLAS thread made the fit ten times slower on a busy machine.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "2")
    _set_up_logging()
    try:
        code = _run(arguments)
    except CommandFault as fault:
        code = _say(str(fault))
    except KeyboardInterrupt:
        code = INTERRUPTED
    except BrokenPipeError:
        # Whoever read our output has left; the interpreter must not complain when it closes the stream.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    except Exception as fault:
        log.exception("the command failed")
        hint = "" if _debugging() else "; LUBDUB_DEBUG=1 shows where"
        code = _say(f"Something went wrong inside Lubdub: {type(fault).__name__}{hint}.")
    return code


def _run(arguments: Sequence[str]) -> int:
    if arguments[:1] == ["benchmark"]:
        return benchmark.run(arguments[1:])
    typed = build_parser().parse_args(arguments)
    code: int = typed.run(typed)
    return code


def _say(line: str) -> int:
    sys.stderr.write(f"lubdub: {' '.join(line.split())}\n")
    return WRONG_USE


def _debugging() -> bool:
    return bool(os.environ.get("LUBDUB_DEBUG"))


def _set_up_logging() -> None:
    """Without this, Python prints every library's warnings and our tracebacks to standard error."""
    logging.captureWarnings(True)
    handler = logging.StreamHandler() if _debugging() else logging.NullHandler()
    logging.basicConfig(handlers=[handler], level=logging.DEBUG if _debugging() else logging.WARNING)


def build_parser() -> argparse.ArgumentParser:
    """Everything that can be typed; each command puts the function to call into `run`."""
    parser = _Parser(
        prog="lubdub",
        description="Shows where on this chest the four heart-listening areas are, from a 3D scan.",
        epilog="./lubdub test checks everything; ./lubdub setup only sets up. Settings: ./lubdub admin settings",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"lubdub {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    service.add_parsers(commands)
    _add_locate(commands)
    stickers.add_parser(commands)
    benchmark.add_parser(commands)
    admin.add_parser(commands)
    return parser


def _add_locate(commands: argparse._SubParsersAction[_Parser]) -> None:
    parser = commands.add_parser(
        "locate",
        help="the areas of one scan as JSON, with no server",
        description="Prints the four listening areas of one scan as JSON. Exit code: 0 shown, 3 refused (the "
        "reason is in the JSON), 2 wrong use or a file that cannot be read.",
        allow_abbrev=False,
    )
    parser.add_argument("scan", type=Path, metavar="SCAN", help="PLY, STL, OBJ (also zipped), GLB, PCD or XYZ file")
    parser.add_argument("--landmarks", type=Path, metavar="L.json", help="points placed on the scan, by name")
    parser.add_argument("--age", type=_age, metavar="YEARS", help="age in years; 0.5 is six months")
    parser.add_argument("--sex", choices=("female", "male"))
    parser.add_argument("--posture", choices=("supine", "sitting"), default="supine")
    parser.add_argument("--unit", choices=("m", "cm", "mm"), help="unit of the file (default: found from the body)")
    parser.add_argument("--method", choices=("lubdub", "paper", "rule"), default="lubdub")
    parser.add_argument("--references", metavar="DIR", help="folder of reference bodies (default: our own)")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="also draw the result")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the JSON here, not to standard output")
    parser.set_defaults(run=_locate)


def _age(text: str) -> float:
    try:
        years = float(text)
    except ValueError:
        years = math.nan
    if not 0.0 <= years <= OLDEST_YEARS:
        raise argparse.ArgumentTypeError(f"{text!r} is no age in years between 0 and {OLDEST_YEARS:g}")
    return years


def _locate(typed: argparse.Namespace) -> int:
    from lubdub.commands.locate import Places, locate

    return locate(Places(typed.scan, typed.landmarks, typed.picture, typed.out), vars(typed))
