"""`lubdub admin references ...`: the bodies scans are compared with, and those of one's own signed cases."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from lubdub.commands.faults import CommandFault
from lubdub.commands.opened import opened, say


def add_parser(things: argparse._SubParsersAction[Any]) -> None:
    """Add the commands about reference bodies."""
    references = things.add_parser("references", help="the reference bodies")
    verbs = references.add_subparsers(dest="verb", required=True, metavar="list|add|disable|check")
    verbs.add_parser("list", help="all bodies, and who placed their marks").set_defaults(run=opened(_list))
    add = verbs.add_parser("add", help="make a signed case, whose family agreed to it, a reference body")
    add.add_argument("case", help="the case's id")
    add.set_defaults(run=opened(_add))
    disable = verbs.add_parser("disable", help="let a body serve no more")
    disable.add_argument("id", help="as `references list` shows it")
    disable.set_defaults(run=opened(_disable))
    check = verbs.add_parser("check", help="test every body, and remove those whose family took its yes back")
    check.set_defaults(run=opened(_check))


def _list(typed: argparse.Namespace) -> int:
    from lubdub.library.own import cards

    for card in cards(_settings().references_dir):
        state = "disabled" if card.get("disabled") else "serves"
        say(f"{card['id']}  {state}  {card['age_years']:g} years  {card['sex']}  placed by: {card['placed_by']}")
    return 0


def _add(typed: argparse.Namespace) -> int:
    from lubdub.cases.errors import CaseNotFound, FileNotFound, StateConflict
    from lubdub.library.load import LibraryDamaged
    from lubdub.library.own import add_body

    folder = _own_folder()
    try:
        name = add_body(folder, _signed_body(typed.case))
    except CaseNotFound as fault:
        raise CommandFault(f"There is no case {typed.case}.") from fault
    except FileNotFound as fault:
        raise CommandFault("The case's result is not here any more.") from fault
    except (StateConflict, ValueError, LibraryDamaged) as fault:
        raise CommandFault(str(fault)) from fault
    say(f"{name} is a reference body now. Restart the workers, and run ./lubdub benchmark to see what it changes.")
    return 0


def _signed_body(case_id: str) -> Any:
    """The case as a body, its areas as signed. Raises what hinders it."""
    from lubdub.cases.opening import open_cases
    from lubdub.cases.review import Reviews
    from lubdub.cases.sharing import Sharing
    from lubdub.cases.values import SYSTEM
    from lubdub.library.own import OwnBody
    from lubdub.report.archive import outcome_from_bytes
    from lubdub.report.corrected import corrected

    settings = _settings()
    database, files = open_cases(settings.database, settings.store, settings.master_key)
    try:
        case = Sharing(database).shared_case(case_id)
        review = Reviews(database, files).read(SYSTEM, case_id)
        outcome = outcome_from_bytes(files.read(case_id, "outcome.npz"))
    finally:
        database.close()
    if outcome.fit is None or review.decision is None:
        raise ValueError("The method of this case fits no body to the scan.")
    signed = corrected(outcome, {name: one.position for name, one in review.corrected.items()})
    return OwnBody(
        surface=outcome.fit.surface,
        landmarks={name: mark.position for name, mark in outcome.landmarks.items()},
        areas={name: area.position for name, area in signed.areas.items()},
        age_years=case.age_years or 0.0,
        sex=case.sex or "",
        placed_by=review.decision.by_name,
        case=case.id,
    )


def _disable(typed: argparse.Namespace) -> int:
    from lubdub.library.own import disable

    if not disable(_own_folder(), typed.id):
        raise CommandFault(f"There is no reference body {typed.id}.")
    say(f"{typed.id} serves no more. Restart the workers.")
    return 0


def _check(typed: argparse.Namespace) -> int:
    from lubdub.library.load import LibraryDamaged
    from lubdub.library.own import check

    folder = _settings().references_dir
    if folder is not None:
        _remove_without_consent(folder)
    try:
        found = check(folder)
    except LibraryDamaged as fault:
        raise CommandFault(str(fault)) from fault
    for name, faults in found.items():
        for line in faults:
            say(f"{name}: {line}")
    bad = sum(bool(faults) for faults in found.values())
    say(f"{len(found)} bodies checked, {bad} with faults.")
    return 1 if bad else 0


def _remove_without_consent(folder: Path) -> None:
    from lubdub.cases.opening import open_database
    from lubdub.cases.sharing import Sharing
    from lubdub.jobs.unshared import remove_unshared

    database = open_database(_settings().database)
    try:
        for name in remove_unshared(Sharing(database), folder):
            say(f"{name}: nobody agrees to its keeping any more; it is removed.")
    finally:
        database.close()


def _settings() -> Any:
    from lubdub.commands.service import read_settings

    return read_settings({})


def _own_folder() -> Path:
    folder: Path | None = _settings().references_dir
    if folder is None:
        raise CommandFault("Name a folder for your own references with LUBDUB_REFERENCES_DIR; the shipped ones stay.")
    return folder
