"""What is said to a family that is asked for a scan, and how its way so far is told at the desk."""

from __future__ import annotations

from collections.abc import Callable

from babel.dates import format_date

from lubdub.cases.clock import now
from lubdub.cases.desk_values import FamilyInvitation
from lubdub.web.languages import words_of


def text_to_send(language: str, asked: FamilyInvitation, address: str) -> str:
    """The words that go with the link, in the family's language."""
    _ = words_of(language).gettext
    if asked.taken_at is None:
        first = _("{organisation} asks you for a 3D scan of a chest. Lubdub shows you how. Open this on your phone:")
    else:
        first = _("{organisation} is waiting for your scan. Go on with it here, on your phone:")
    last = _("The link works once, until {day}. Please do not send it on.")
    day = format_date(asked.expires_at, locale=language)
    return "\n".join((first.format(organisation=asked.organisation), address, last.format(day=day)))


def state_words(_: Callable[[str], str], asked: FamilyInvitation) -> str:
    """How far a family has come."""
    if asked.is_locked:
        return _("Shut: the date of birth was wrong too often.")
    if asked.taken_at is None:
        return _("The link ran out.") if asked.expires_at < now() else _("Not opened yet")
    if asked.case_status is None:
        return _("Opened. Some questions are left.")
    return {
        "awaiting_scan": _("The scan is still to come."),
        "checking": _("Lubdub is at work."),
        "queued": _("Lubdub is at work."),
        "running": _("Lubdub is at work."),
        "awaiting_landmarks": _("The scan is here. Points are left to mark."),
        "done": _("The family sees the four places."),
        "in_review": _("Waiting for a review"),
        "reviewed": _("Reviewed"),
        "returned": _("Given back to the family"),
        "unusable": _("Not to be used"),
        "refused": _("Stopped, to be safe"),
        "failed": _("Stopped by a fault of ours"),
        "deleted": _("Deleted"),
    }[asked.case_status]
