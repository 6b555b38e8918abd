"""What can be wrong with landmarks, in words."""

from __future__ import annotations

from collections.abc import Mapping

from lubdub.results import LandmarkName, Reason

SIDES_SWAPPED = Reason(
    "sides_swapped",
    "The patient's left and right do not fit together on this scan: two points are swapped, or the scan is mirrored.",
    "Mark the nipple on the side of the patient's own left hand as the left one. If it already is, the scan is "
    "mirrored: scan again without the selfie camera and without any mirror setting.",
)

UPSIDE_DOWN = Reason(
    "points_out_of_order",
    "The points do not run from the neck down to the belly button in the order they should.",
    "Check each point: top edge of the breastbone, its lower end, then the belly button.",
)

BREASTBONE_IMPLAUSIBLE = Reason(
    "breastbone_implausible",
    "The two breastbone points are much too close or too far apart for this age.",
    "Feel again for the bone's upper edge (not the soft hollow above it) and its lower end where the ribs meet. "
    "Check the age and the unit of the scan too.",
)

BREASTBONE_UNUSUAL = Reason(
    "breastbone_unusual",
    "The two breastbone points are further apart or closer than usual for this age.",
    "Feel again for the bone's upper edge (not the soft hollow above it) and its lower end where the ribs meet.",
)

LANDMARKS_IMPLAUSIBLE = Reason(
    "landmarks_implausible",
    "The points are not where they can be on a body: their distances do not fit together.",
    "Look at each point again and move the wrong one.",
)

LANDMARKS_UNUSUAL = Reason(
    "landmarks_unusual",
    "The points are a little unusual for one body: one of them may be off.",
    "Look at each point again before you trust the places.",
)

FAR_FROM_GUESS = Reason(
    "point_far_from_guess",
    "A point lies far from where the shape of the body lets one expect it.",
    "Look at it again, and move it if it is not right.",
)


_PLACE_AGAIN = "Place it again by touching the body in the picture, and check that it belongs to this scan."

OFF_BODY: Mapping[LandmarkName, Reason] = {
    "suprasternal_notch": Reason(
        "landmark_off_body", "The point for the top of the breastbone is not on the scanned skin.", _PLACE_AGAIN
    ),
    "xiphisternum": Reason(
        "landmark_off_body", "The point for the lower end of the breastbone is not on the scanned skin.", _PLACE_AGAIN
    ),
    "navel": Reason("landmark_off_body", "The point for the belly button is not on the scanned skin.", _PLACE_AGAIN),
    "nipple_left": Reason(
        "landmark_off_body", "The point for the patient's left nipple is not on the scanned skin.", _PLACE_AGAIN
    ),
    "nipple_right": Reason(
        "landmark_off_body", "The point for the patient's right nipple is not on the scanned skin.", _PLACE_AGAIN
    ),
}
"""A landmark that hangs in the air."""
