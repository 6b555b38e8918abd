"""What printed stickers can show to be wrong with a scan, in words."""

from __future__ import annotations

from lubdub.landmarks.reasons import NAMES_IN_WORDS
from lubdub.results import LandmarkName, Reason

MIRRORED = Reason(
    "mirrored_by_stickers",
    "This scan is mirrored: the stickers on it read backwards, so left and right are swapped.",
    "Scan again with the back camera, without a mirror and with nothing flipped in the app. Then send the new scan.",
)

CONTRADICTORY = Reason(
    "stickers_contradictory",
    "One sticker on this scan reads forwards and another one backwards.",
    "Take every mirror and every spare sticker out of the picture and scan again.",
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


def size_untrue(scale: float) -> Reason:
    """The stickers measure far from their printed size. scale: measured over printed size."""
    return Reason(
        "sticker_size_untrue",
        f"The stickers are {_off(scale)} than they were printed, so the size of this scan is not true.",
        "Check the unit of the scan. If it is right, use a scanning app that measures depth, and scan again.",
    )


def size_doubtful(scale: float) -> Reason:
    """The same, a little off."""
    return Reason(
        "sticker_size_doubtful",
        f"The stickers are {_off(scale)} on this scan than they should be on paper.",
        "Measure the line on the sticker sheet: it must be exactly 50 mm long. If it is not, print the sheet again at "
        "100 %. If it is, the scan's size is a little off: scan again slowly.",
    )


def away_from_sticker(name: LandmarkName) -> Reason:
    """A point marked by hand lies far from the sticker that marks the same bone."""
    return Reason(
        "away_from_sticker",
        f"The point for {NAMES_IN_WORDS[name]} was marked far away from its sticker.",
        "Look which of the two is right. If the sticker is, take the point back to it.",
    )


def _off(scale: float) -> str:
    if scale > 2 or scale < 0.5:
        return f"{max(scale, 1 / scale):.0f} times {'larger' if scale > 1 else 'smaller'}"
    return f"{abs(scale - 1):.0%} {'larger' if scale > 1 else 'smaller'}"
