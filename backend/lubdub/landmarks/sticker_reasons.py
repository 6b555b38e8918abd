"""What printed stickers can show to be wrong with a scan, in words."""

from __future__ import annotations

from collections.abc import Mapping

from lubdub.results import LandmarkName, Reason

MIRRORED = Reason(
    "mirrored_by_stickers",
    "This scan is mirrored: the stickers on it read backwards, so left and right are swapped.",
    "Scan again with the back camera, without a mirror and with nothing flipped in the app. Then send the new scan.",
)

CONTRADICTORY = Reason(
    "stickers_contradictory",
    "One sticker on this scan reads forwards and another one backwards.",
    "Take mirrors and spare stickers out of the picture. Then scan again.",
)

SWAPPED = Reason(
    "stickers_swapped",
    "The body seems to lie the other way round than its two stickers say.",
    "Look if sticker 1 is at the top of the breastbone and sticker 2 at its lower end, and scan again. If they are "
    "right, scan more of the body: from the chin to below the belly button.",
)

TWICE = Reason(
    "sticker_seen_twice",
    "Two stickers for the same bone can be seen, so neither was used.",
    "Stick one sticker 1 and one sticker 2 of the same size, take the others away, and scan again.",
)

_UNTRUE_ADVICE = "Check the unit of the scan. If it is right, use a scanning app that measures depth, and scan again."

LARGER_THAN_PRINTED = Reason(
    "sticker_size_untrue",
    "The stickers are larger than they were printed, so the size of this scan is not true.",
    _UNTRUE_ADVICE,
)

SMALLER_THAN_PRINTED = Reason(
    "sticker_size_untrue",
    "The stickers are smaller than they were printed, so the size of this scan is not true.",
    _UNTRUE_ADVICE,
)

_DOUBTFUL_ADVICE = (
    "Measure the line on the sticker sheet: it must be exactly 50 mm long. If it is not, print the sheet again at "
    "100 %. If it is, the scan's size is a little off: scan again slowly."
)

A_LITTLE_LARGER = Reason(
    "sticker_size_doubtful",
    "The stickers are a little larger on this scan than they should be on paper.",
    _DOUBTFUL_ADVICE,
)

A_LITTLE_SMALLER = Reason(
    "sticker_size_doubtful",
    "The stickers are a little smaller on this scan than they should be on paper.",
    _DOUBTFUL_ADVICE,
)

_WHICH_IS_RIGHT = "Look which of the two is right. If the sticker is, take the point back to it."

AWAY_FROM_STICKER: Mapping[LandmarkName, Reason] = {
    "suprasternal_notch": Reason(
        "away_from_sticker",
        "The point for the top of the breastbone was marked far away from its sticker.",
        _WHICH_IS_RIGHT,
    ),
    "xiphisternum": Reason(
        "away_from_sticker",
        "The point for the lower end of the breastbone was marked far away from its sticker.",
        _WHICH_IS_RIGHT,
    ),
}
"""A point marked by hand lies far from the sticker that marks the same bone."""
