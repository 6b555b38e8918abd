"""The design system's style and behaviours as our pages need them: nothing foreign, and only the rules in use."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path

from lubdub.settings import PROJECT_FOLDER
from lubdub.web.problems import Problem

FRONTEND = PROJECT_FOLDER / "frontend"
OURS = ("style", "parts", "family", "clinician", "lib")
"""The folders of `frontend/` that hold pages, styles, scripts and drawings of ours."""
NHSUK = FRONTEND / "node_modules" / "nhsuk-frontend" / "dist" / "nhsuk"
OF_SCRIPTS = frozenset({"nhsuk-frontend-supported", "nhsuk-radios__conditional--hidden"})
"""Classes that only nhsuk's own scripts set."""
CLASS = re.compile(r"nhsuk-[A-Za-z0-9_-]+")


@lru_cache(maxsize=1)
def style() -> bytes:
    """The rules for the classes our pages use: a tenth of what the package brings. Raises Problem `not-ready`."""
    css = without_foreign(_installed("nhsuk-frontend.min.css"))
    return "".join(used_rules(css, classes_in_use() | OF_SCRIPTS)).encode()


@lru_cache(maxsize=1)
def script() -> bytes:
    """The behaviours. Raises Problem `not-ready`."""
    return re.sub(r"//# sourceMappingURL=\S+", "", _installed("nhsuk-frontend.min.js")).encode()


def without_foreign(css: str) -> str:
    """A style without anything fetched: no @font-face, no url(...) but data, no name of a font we may not use."""
    css = re.sub(r"@font-face\{[^}]*\}", "", css)
    css = re.sub(r"url\((?!['\"]?data:)[^)]*\)", "none", css)
    css = css.replace("Frutiger W01,arial", "system-ui,arial")
    return re.sub(r"/\*.*?\*/", "", css, flags=re.S)


def classes_in_use() -> frozenset[str]:
    """Every nhsuk class named in a template, style or script of ours."""
    files = (
        file for folder in OURS for file in (FRONTEND / folder).rglob("*") if file.suffix in (".html", ".css", ".js")
    )
    return frozenset(name for file in files for name in CLASS.findall(file.read_text(encoding="utf-8")))


def used_rules(css: str, classes: frozenset[str]) -> Iterator[str]:
    """The rules of a minified style that can match; those in @media and the like too. Names of no class stay."""
    for head, body in _blocks(css):
        if head.startswith(("@media", "@supports")):
            inner = "".join(used_rules(body, classes))
            if inner:
                yield f"{head}{{{inner}}}"
        elif head.startswith("@"):
            yield f"{head}{{{body}}}"
        else:
            kept = [one for one in _selectors(head) if set(CLASS.findall(one)) <= classes]
            if kept:
                yield f"{','.join(kept)}{{{body}}}"


def _blocks(css: str) -> Iterable[tuple[str, str]]:
    """Head and body of each block at the top; statements without a block, such as @charset, are left out."""
    depth, start, opened = 0, 0, 0
    for place, sign in enumerate(css):
        if sign == "{":
            if depth == 0:
                opened = place
            depth += 1
        elif sign == "}":
            depth -= 1
            if depth == 0:
                yield css[start:opened].rsplit(";", 1)[-1].strip(), css[opened + 1 : place]
                start = place + 1


def _selectors(head: str) -> list[str]:
    """The selectors of a rule; a comma inside brackets does not part them."""
    return re.split(r",(?![^(\[]*[)\]])", head)


def _installed(name: str) -> str:
    place: Path = NHSUK / name
    if not place.is_file():
        raise Problem("not-ready", "The pages' style is not installed. Run ./lubdub once to fetch it.")
    return place.read_text(encoding="utf-8")
