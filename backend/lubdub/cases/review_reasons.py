"""Why a clinician gives a case back, or lets no places be used: short lists, in words for the family."""

from __future__ import annotations

from lubdub.results import Reason

_AGAIN = "Scan again, from the neck down to below the navel."

RETURN_REASONS: dict[str, Reason] = {
    "belly_missing": Reason("belly_missing", "A part of the chest or the belly is missing on the scan.", _AGAIN),
    "blurred": Reason(
        "blurred",
        "The scan is blurred, as if somebody moved.",
        "Scan again while everybody holds still and breathes calmly.",
    ),
    "covered": Reason(
        "covered",
        "Cloth, hands or hair cover a part of the chest.",
        "Free the chest, lay the arms aside, and scan again.",
    ),
    "points_wrong": Reason(
        "points_wrong",
        "The points on the bones do not look right.",
        "Feel for both ends of the breastbone once more, and move the points.",
    ),
    "scan_again": Reason("scan_again", "The clinician asks for a new scan.", "Read the note, and scan again."),
}
"""The family can mend these."""

UNUSABLE_REASONS: dict[str, Reason] = {
    "other_anatomy": Reason(
        "other_anatomy",
        "The usual places do not fit this body.",
        "Ask the clinician where to listen.",
    ),
    "wrong_person": Reason(
        "wrong_person",
        "It is not sure whose body is on this scan.",
        "Ask the clinician, and start again with a new case.",
    ),
    "not_to_be_used": Reason(
        "not_to_be_used",
        "The clinician has decided that these places must not be used.",
        "Ask the clinician what to do next.",
    ),
}
"""Nobody shall listen at the places of this case."""
