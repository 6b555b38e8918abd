"""`./lubdub benchmark review`: what a clean case costs a clinician, from the worklist to signed, in a real browser.

Each case is one of the demo scans, in a fresh service, in a window of 1280 x 800, reviewed by mouse: it is opened, four
areas are looked at, and it is signed. Two times are told apart. The *wait* is measured: from an action until the page
is ready for the next, which is when the body is drawn after opening, when the area's letter stands before the camera
that has arrived after a look, and when the worklist is back after signing. The page is asked at most five times a
second and drawn without a graphics card, so the waits are upper bounds.

The *interaction* is what would remain if nothing had to be waited for. It is calculated, not measured on people: by the
keystroke-level model of Card, Moran and Newell (Communications of the ACM 23:396-410, 1980; a mouse button's 0.1 s down
and 0.1 s up are from Kieras's later guide to it), with a mental preparation before every action although the main
button stays in one place. The model knows nothing of judging a picture. So looking is an assumption of ours: 3 s an
area, ten fixations of about 0.3 s, for letter, breastbone, ribs and nipple. "look for" says how long each area could be
looked at instead until interaction and measured waiting fill a minute. Other work on the machine lengthens the waits
alone: "load" says how many processes wanted a core.
"""

from __future__ import annotations

import functools
import os
import random
import re
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lubdub.results import AREA_NAMES
from tests.benchmark.demo import DEMO
from tests.benchmark.experiment import Cell, Experiment, Report, Row, Table, Unit
from tests.benchmark.journey import desk

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

    from tests.web.service import Service

HAND = "H, hand to the mouse"
MIND = "M, mental preparation"
POINT = "P, pointing"
BUTTON = "B, mouse button down and up"
KEY = "K, key"
LOOKING = "looking at an area"
SECONDS = {HAND: 0.4, MIND: 1.35, POINT: 1.1, BUTTON: 0.2, KEY: 0.28, LOOKING: 3.0}
"""The model's operators, and our looking time."""
OPERATORS = {"click": (MIND, POINT, BUTTON), "key": (MIND, KEY)}
LIMITS = {"actions": 6, "interaction, s": 60.0, "interaction and waiting, s": 60.0}


def one_case(body: Path, number: int) -> list[Row]:
    """A row for each action of one review."""
    from tests.journeys.clinic import Room, reviewed_soon
    from tests.web.reviewing import ORGANISATION

    with desk() as opened:
        case = reviewed_soon(opened.service, f"Review-{number}", body)
        room = Room(opened.service, opened.browser)
        try:
            waits = list(_reviewed(room.window("desk"), opened.service, case))
        finally:
            room.close()
        status = opened.service.portal(ORGANISATION).state(case)["status"]
    if status != "reviewed":
        raise RuntimeError(f"{body.name} was reviewed to the end, but its case is {status}")
    common = {"case": f"{number}, {body.name}", "by": "click", "load": os.getloadavg()[0]}
    return [{**common, "action": action, "waited_s": waited} for action, waited in waits]


def _reviewed(page: Page, service: Service, case: str) -> Iterator[tuple[str, float]]:
    """Each action and the seconds until the page was ready for the next."""
    from playwright.sync_api import expect

    from tests.journeys.clinic import is_drawn_at, on_screen
    from tests.journeys.conftest import DRAWN_MS
    from tests.journeys.steps import WORK_MS, soon, wait_for_body

    main = page.locator("#main-button")
    page.goto("/desk", wait_until="networkidle")
    begun = _clicked(page.locator(f"[data-case='{case}']"))
    main.wait_for()
    wait_for_body(page)
    yield "open", time.perf_counter() - begun
    for area in AREA_NAMES:
        place = on_screen(page, service, case, area)
        begun = _clicked(main)
        expect(page.locator(f"[data-area={area}] .areas__state")).to_have_text("looked at", timeout=DRAWN_MS)
        soon(page, functools.partial(is_drawn_at, page, area, *place), f"the letter of {area}")
        yield area, time.perf_counter() - begun
    begun = _clicked(main)
    page.wait_for_url(re.compile("/desk$"), timeout=WORK_MS)
    yield "sign", time.perf_counter() - begun


def _clicked(target: Locator) -> float:
    """When the button was pressed. Playwright's own checks before a click are nobody's waiting."""
    target.click(trial=True)
    begun = time.perf_counter()
    target.click(no_wait_after=True)
    return begun


def operators(rows: list[Row]) -> Counter[str]:
    """How often each operator of the model comes in these actions of one case."""
    counted = Counter(name for row in rows for name in OPERATORS[row["by"]])
    counted[HAND] = int(any(row["by"] == "click" for row in rows))
    counted[LOOKING] = sum(row["action"] in AREA_NAMES for row in rows)
    return counted


def interaction_s(rows: list[Row]) -> float:
    """One case without any waiting."""
    return sum(SECONDS[name] * count for name, count in operators(rows).items())


def _one_line(rows: list[Row]) -> dict[str, float]:
    """What one case's actions add up to."""
    waited, interaction = sum(row["waited_s"] for row in rows), interaction_s(rows)
    looks = operators(rows)[LOOKING]
    return {
        "actions": len(rows),
        "interaction_s": interaction,
        "waited_s": waited,
        "both_s": interaction + waited,
        "look for, s": SECONDS[LOOKING] + (LIMITS["interaction, s"] - interaction - waited) / looks,
        "load": rows[0]["load"],
    }


def report(rows: list[Row]) -> Report:
    """Cases one by one, their medians beside what is promised, and how the interaction adds up."""
    names = dict.fromkeys(str(row["case"]) for row in rows)
    cases = {name: [row for row in rows if row["case"] == name] for name in names}
    lines = {name: _one_line(actions) for name, actions in cases.items()}
    columns = tuple(next(iter(lines.values())))
    medians = {column: float(np.median([line[column] for line in lines.values()])) for column in columns}
    found = {
        "actions": max(line["actions"] for line in lines.values()),
        "interaction, s": medians["interaction_s"],
        "interaction and waiting, s": medians["both_s"],
    }
    kept: list[tuple[Cell, ...]] = [
        (name, found[name], limit, "yes" if found[name] <= limit else "no") for name, limit in LIMITS.items()
    ]
    each: list[tuple[Cell, ...]] = [(name, *line.values()) for name, line in lines.items()]
    waits: list[tuple[Cell, ...]] = [
        (action, float(np.median(waited)), max(waited))
        for action in dict.fromkeys(str(row["action"]) for row in rows)
        if (waited := [row["waited_s"] for row in rows if row["action"] == action])
    ]
    counted = operators(next(iter(cases.values())))
    model: list[tuple[Cell, ...]] = [
        (name, seconds, counted[name], seconds * counted[name]) for name, seconds in SECONDS.items()
    ]
    tables = (
        Table("What is promised (the most actions, the median case)", ("what", "found", "limit", "kept"), kept),
        Table("Case by case", ("case", *columns), [*each, ("median", *medians.values())]),
        Table("Measured wait after each action, seconds", ("action", "median", "longest"), waits),
        Table("Interaction of the first case", ("operator", "seconds", "times", "together, s"), model),
    )
    return Report(tables, {"found": found}, words=__doc__.split("\n", 2)[2] if __doc__ else "")


def _units(size: int, seed: int) -> Iterable[Unit]:
    bodies = sorted(folder for folder in DEMO.iterdir() if folder.is_dir())
    random.Random(seed).shuffle(bodies)
    for number in range(1, size + 1):
        body = bodies[(number - 1) % len(bodies)]
        yield Unit(f"{number}, {body.name}", functools.partial(one_case, body, number))


REVIEW = Experiment("review", "what a clean case costs a clinician, in a browser", 3, "how many cases", _units, report)
