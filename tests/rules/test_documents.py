"""What the documents say is so: the commands of the README exist, every dependency has its licence noted."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lubdub.cli import build_parser
from tests.rules.source import ROOT, modules, tracked_files
from tests.rules.test_locks import canonical, wanted

PAGES = [path for path in tracked_files() if path.suffix == ".md"]
SHELL_COMMANDS = {"test", "setup"}


def commands() -> set[str]:
    choices = next(action.choices for action in build_parser()._actions if action.dest == "command")
    assert choices is not None
    return set(choices) | SHELL_COMMANDS


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_command_a_page_names_exists(page: Path) -> None:
    named = set(re.findall(r"\./lubdub ([a-z]+)", page.read_text()))
    assert named <= commands()


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_link_of_a_page_leads_somewhere(page: Path) -> None:
    targets = re.findall(r"\]\((?!https?:|mailto:|#)([^)#\s]+)", page.read_text())
    assert [target for target in targets if not (page.parent / target).exists()] == []


def test_the_shell_knows_every_command() -> None:
    script = (ROOT / "lubdub").read_text()
    known = set(re.findall(r"[a-z]+", " ".join(re.findall(r"^    ([a-z| ]+)\)", script, re.M))))
    assert commands() <= known


def test_the_notice_names_every_direct_dependency() -> None:
    notice = {canonical(word) for word in re.findall(r"[A-Za-z0-9._-]+", (ROOT / "NOTICE").read_text())}
    installed = ("requirements.in", "requirements-solver.in", "requirements-otel.in")
    assert set().union(*map(wanted, installed)) <= notice


def test_reason_codes_are_made_in_one_module_each() -> None:
    codes: dict[str, set[str]] = {}
    for module in modules():
        for code in re.findall(r"\bReason\(\s*\"([a-z_]+)\"", module.path.read_text()):
            codes.setdefault(code, set()).add(str(module))
    assert codes
    assert {code: places for code, places in codes.items() if len(places) > 1} == {}
