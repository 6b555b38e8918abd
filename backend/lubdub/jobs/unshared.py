"""Takes away reference bodies whose family's yes no longer stands: taken back, or deleted with the case."""

from __future__ import annotations

from pathlib import Path

from lubdub.cases.sharing import Sharing
from lubdub.library.own import cards, remove


def remove_unshared(sharing: Sharing, folder: Path | None) -> list[str]:
    """The ids of the bodies removed from a folder of one's own; the shipped bodies rest on nobody's consent."""
    if folder is None or not (folder / "bodies").is_dir():
        return []
    gone = [card["id"] for card in cards(folder) if "case" in card and not sharing.still_shared(card["case"])]
    for name in gone:
        remove(folder, name)
    return gone
