"""What a result says about itself."""

import re
from pathlib import Path

import lubdub
from lubdub.assembly import constants

ROOMS = ("scans", "landmarks", "library", "fitting", "areas", "judging")


def test_every_constant_of_the_six_rooms_counts_in_the_hash_of_the_parameters() -> None:
    package = Path(lubdub.__file__).parent
    sources = "".join(path.read_text() for room in ROOMS for path in (package / room).glob("*.py"))
    defined = set(re.findall(r"^class (\w+(?:Settings|Limits|Gates))\b", sources, re.M))
    assert len(defined) > 10
    assert defined <= set(re.findall(r"\w+", constants()))
