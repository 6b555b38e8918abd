"""The programs on the documentation page, taken from the page as a reader would take them."""

from __future__ import annotations

import html
import re

import httpx


def snippet(address: str, name: str) -> str:
    """The text of one of them, from the service at this address."""
    page = httpx.get(f"{address}/api/docs").text
    found = re.search(rf'<pre id="{re.escape(name)}">(.*?)</pre>', page, re.S)
    assert found is not None, f"the page does not show {name}"
    return html.unescape(found[1])
