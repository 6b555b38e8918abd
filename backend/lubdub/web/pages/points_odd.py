"""What is odd about marked points, in words: what we see, and how to mend it."""

from __future__ import annotations

from collections.abc import Callable


def odd_texts(_: Callable[[str], str]) -> dict[str, str]:
    """Kind of oddity (`marking.Oddity.what`) -> a sentence that may name the {point}."""
    return {
        "off_body": _("The point for “{point}” is not on the body. Choose it in the list and tap the skin."),
        "order": _(
            "The points do not run from the neck down to the belly button. Check the top of the breastbone, "
            "its lower end and the belly button."
        ),
        "sides": _(
            "Left and right seem swapped. The left nipple is on the side of the person's own left hand. "
            "If your points are right, the scan is mirrored: scan again with the back camera."
        ),
        "apart": _("The points lie too close together. Look at each one again and move the wrong one."),
        "bone_short": _(
            "The two ends of the breastbone are closer together than we expect at this age. "
            "Feel again for the hard upper edge and for the last hard spot."
        ),
        "bone_long": _(
            "The two ends of the breastbone are further apart than we expect at this age. "
            "Feel again for the hard upper edge, not the hollow above it, and for the last hard spot."
        ),
        "navel": _("The belly button and the breastbone do not fit together. Look at the belly button again."),
        "nipple_aside": _("The {point} is too near to the middle, or too far out. Look at it again."),
        "nipple_below": _("The {point} is too high or too low for this breastbone. Look at it again."),
        "far": _("The point for “{point}” is far from where we expected it. Look at it again."),
    }
