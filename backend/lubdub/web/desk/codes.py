"""Picture codes: for a code app, and for anybody with a camera."""

from __future__ import annotations

import segno
from markupsafe import Markup

from lubdub.cases.credentials import provisioning_uri


def code_picture(secret: str, email: str) -> Markup:
    """A QR code for a code app, as an SVG of one path."""
    return qr_svg(provisioning_uri(secret, email))


def qr_svg(text: str) -> Markup:
    """A QR code (ISO/IEC 18004) as an SVG of one path; error correction M survives a scratched screen."""
    drawn = segno.make_qr(text, error="m").svg_inline(omitsize=True, border=4, dark="#000", light="#fff")
    return Markup(drawn)  # nosec B704 (a path of squares; the text itself is not in it)
