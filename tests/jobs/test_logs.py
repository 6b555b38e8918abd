"""Log lines: for machines or people, one line each, and only what is on the list."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.rules.source import ROOT

PROGRAM = """
import logging
from lubdub.jobs.logs import configure_logs
from lubdub.settings import Settings
import structlog
configure_logs(Settings())
structlog.contextvars.bind_contextvars(request_id="abc")
structlog.stdlib.get_logger("one").info("answered", route="/x", name="Emma", token="secret", path="/cases/7")
logging.getLogger("two").warning("it said %s", "a\\nforged line", extra={"job_id": "j", "patient": "Emma"})
try:
    raise ValueError("broken")
except ValueError:
    logging.getLogger("three").exception("a job failed")
"""


def lines(form: str) -> list[str]:
    environment = {"PYTHONPATH": str(ROOT / "backend"), "LUBDUB_LOG_FORMAT": form}
    ended = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=True)
    return ended.stderr.splitlines()


def test_each_line_is_json_with_fields_of_the_list_alone() -> None:
    one, two, three = map(json.loads, lines("json"))
    assert (one["event"], one["route"], one["request_id"]) == ("answered", "/x", "abc")
    assert two["event"] == "it said a\nforged line"
    assert (two["job_id"], two["request_id"]) == ("j", "abc")
    assert "ValueError: broken" in three["exception"]
    assert not {"name", "token", "path", "patient"} & {*one, *two, *three}
    assert all(line["timestamp"].endswith("Z") for line in (one, two, three))


@pytest.mark.parametrize("form", ["json", "text"])
def test_a_line_break_in_what_was_logged_makes_no_second_line(form: str) -> None:
    assert len(lines(form)) == 3


def test_for_people_there_is_text() -> None:
    one, two, three = lines("text")
    assert " info 'answered' " in one
    assert "request_id='abc'" in two
    assert "ValueError: broken" in three
    assert "Emma" not in one + two
