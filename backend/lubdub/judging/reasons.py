"""Why a result is shown only with care, or not at all. One sentence each, and what to do."""

from __future__ import annotations

from lubdub.results import Reason

AREA_NOT_SCANNED = Reason(
    "area_not_scanned",
    "The scan has a hole or ends where one of the four places should be.",
    "Scan again and move slowly over the whole chest, from the neck to the belly button and down both sides.",
)
CHEST_NOT_IN_SCAN = Reason(
    "chest_not_in_scan",
    "The scan does not show enough of the chest.",
    "Scan again so that everything from the neck to the belly button is in it, with the chest bare.",
)
CHEST_NOT_MATCHED = Reason(
    "chest_not_matched",
    "Where this body's chest should be, a part of it is not in the scan.",
    "Scan again so that both sides of the chest are in it, from the neck to the belly button. If they are, feel for "
    "both ends of the breastbone and mark them.",
)
FIT_FAILED = Reason(
    "fit_failed",
    "The scan does not look enough like a chest seen from the front for us to be sure of anything.",
    "Scan again with the person lying on their back, the chest bare, and nothing lying on it.",
)
ORIENTATION_UNKNOWN = Reason(
    "orientation_unknown",
    "We cannot tell from the scan's shape alone which way up the body lies.",
    "Mark the top edge of the breastbone, its lower end and the belly button, and try again.",
)
LIE_UNCLEAR = Reason(
    "lie_unclear",
    "We could not tell which way the body lies.",
    "Please turn it and mark the points yourself.",
)
DISAGREEMENT = Reason(
    "methods_disagree",
    "The breastbone points and the shape of the body do not agree about the places.",
    "Check the breastbone points: the bone's upper edge, not the soft hollow above it, and its lower end.",
)
STRONG_DISAGREEMENT = Reason(
    "methods_disagree_strongly",
    "The points you marked and the shape of the body point to very different places.",
    "Check every point, the unit and the age, and that the points belong to this scan.",
)
BONES_NOT_GIVEN = Reason(
    "bones_not_given",
    "The breastbone was not marked, and the skin alone does not show exactly where the ribs are.",
    "Feel for the breastbone's upper edge and its lower end and mark both: then the places become trustworthy.",
)
NOTCH_NOT_GIVEN = Reason(
    "notch_not_given",
    "Without the top of the breastbone the places are less sure.",
    "Feel for the hard upper edge of the breastbone and mark it: then the places become trustworthy.",
)
LOWER_END_NOT_GIVEN = Reason(
    "lower_end_not_given",
    "Without the lower end of the breastbone the places are less sure.",
    "Feel for the last hard spot of the breastbone and mark it: then the places become trustworthy.",
)
LANDMARKS_SUGGESTED = Reason(
    "landmarks_suggested",
    "Nobody marked any point: all of them were found by the program.",
    "Look at each suggested point on the body and correct the ones that are off.",
)
AGE_MISSING = Reason(
    "age_missing",
    "The age was not said. The place for the mitral sound moves as a child grows.",
    "Say the age and run again.",
)
AGE_AND_SIZE = Reason(
    "age_and_size",
    "The body is unusually large or small for the age that was said.",
    "Check the age, in years and months for a small child, and the unit of the scan.",
)
SITTING = Reason(
    "posture_sitting",
    "The reference bodies lie on their backs; sitting moves the skin over the ribs.",
    "If you can, scan again with the person lying on their back.",
)
SITTING_WOMAN = Reason(
    "posture_sitting_breasts",
    "For girls and women after puberty the places can only be found when lying on the back.",
    "Scan again with her lying flat on her back, arms beside the body.",
)
THIN_COVERAGE = Reason(
    "thin_coverage",
    "Parts of the chest are missing in the scan.",
    "Scan again if you can, slowly and from both sides.",
)
ROUGH_SURFACE = Reason(
    "rough_surface",
    "The scanned skin is rough or blurred, perhaps because of movement or clothes.",
    "Scan again with the chest bare and the person still, just after breathing out.",
)
ODD_SHAPE = Reason(
    "odd_shape",
    "The scanned body is unlike any body we know.",
    "Check that the scan shows one bare chest and that its unit is right.",
)
PAPER_METHOD = Reason(
    "skin_method",
    "This method follows the skin only; it cannot see the ribs.",
    "Use the default method for a person; this one is for comparison.",
)
LOOKS_LIKE_A_BACK = Reason(
    "looks_like_a_back",
    "The marked side of the body looks like a back, not a chest.",
    "Scan the front of the chest, from the neck to the belly button, and mark the points there."
    " If this is the front and the breastbone is sunk in, Lubdub cannot find the places on this chest.",
)
FLAT_CHEST = Reason(
    "flat_chest",
    "The chest is flatter below the neck than chests usually are.",
    "Check that this is the front of the body, and that the two breastbone points are on the bone.",
)
