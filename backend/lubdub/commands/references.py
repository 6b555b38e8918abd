"""`lubdub admin references ...`: the bodies scans are compared with, and those of one's own signed cases."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from lubdub.commands.faults import CommandFault
from lubdub.commands.opened import opened, say

SEE = "./lubdub benchmark references"


def add_parser(things: argparse._SubParsersAction[Any]) -> None:
    """Add the commands about reference bodies."""
    references = things.add_parser("references", help="the reference bodies")
    verbs = references.add_subparsers(dest="verb", required=True, metavar="list|add|disable|withdraw|check")
    verbs.add_parser("list", help="all bodies, and who placed their marks").set_defaults(run=opened(_list))
    add = verbs.add_parser("add", help="make a signed case, whose family agreed to it, a reference body")
    add.add_argument("case", help="the case's id")
    add.set_defaults(run=opened(_add))
    disable = verbs.add_parser("disable", help="let a body serve no more")
    disable.add_argument("id", help="as `references list` shows it")
    disable.set_defaults(run=opened(_disable))
    withdraw = verbs.add_parser("withdraw", help="take a clinician's marks on a body away")
    withdraw.add_argument("id", help="the body, as `references list` shows it")
    withdraw.add_argument("clinician", help="the clinician's id, as `references list` shows it")
    withdraw.set_defaults(run=opened(_withdraw))
    check = verbs.add_parser("check", help="test every body, and remove those whose family took its yes back")
    check.set_defaults(run=opened(_check))


def _list(typed: argparse.Namespace) -> int:
    from lubdub.library.load import LibraryDamaged, load_library
    from lubdub.library.marks import read_marks
    from lubdub.library.own import cards

    folder = _settings().references
    try:
        serving = {one.id: one for one in load_library(folder).references}
    except LibraryDamaged as fault:
        raise CommandFault(str(fault)) from fault
    for card in cards(folder):
        body = serving.get(card["id"])
        placed_by = (card if body is None else body.card)["placed_by"]
        state = "disabled" if body is None else "serves"
        say(f"{card['id']}  {state}  {card['age_years']:g} years  {card['sex']}  placed by: {placed_by}")
        for one in read_marks(folder, card["id"]):
            since = f"handed in {one.handed_in_at[:10]}" if one.handed_in_at else "not handed in yet"
            stale = "" if one.fits(card) else ", of an earlier shape: does not count"
            say(f"    marked by {one.by_name} ({one.by}), {since}{stale}")
        if body is not None and body.spread_mm:
            say("    the two lie apart: " + ", ".join(f"{area} {far:.0f} mm" for area, far in body.spread_mm.items()))
    return 0


def _withdraw(typed: argparse.Namespace) -> int:
    from lubdub.cases.errors import StateConflict
    from lubdub.cases.opening import open_database
    from lubdub.jobs.reference_marks import ReferenceMarks

    settings = _settings()
    database = open_database(settings.database)
    try:
        marks = ReferenceMarks(database, settings.own_references, lambda: settings.references)
        marks.withdraw_for(typed.id, typed.clinician)
    except (StateConflict, ValueError) as fault:
        raise CommandFault(f"There are no marks of {typed.clinician} on {typed.id}.") from fault
    finally:
        database.close()
    say(f"The marks of {typed.clinician} on {typed.id} are withdrawn.")
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
    say(f"{name} is a reference body now. `{SEE}` shows what it changes.")
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
    database, files = open_cases(settings.database, settings.store, settings.master_key_source)
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
    say(f"{typed.id} serves no more.")
    return 0


def _check(typed: argparse.Namespace) -> int:
    from lubdub.library.load import LibraryDamaged
    from lubdub.library.own import check

    own = _settings().own_references
    if own is not None:
        _remove_without_consent(own)
    try:
        found = check(_settings().references)
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
    folder: Path | None = _settings().own_references
    if folder is None:
        raise CommandFault("Name a folder that all machines share with LUBDUB_REFERENCES_DIR; the shipped bodies stay.")
    return folder
