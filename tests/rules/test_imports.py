"""Imports run one way: numbers <- the six rooms <- pipeline <- jobs <- web. A wrong arrow is a failed test."""

from __future__ import annotations

import pytest

from tests.rules.source import PACKAGE, Module, imports, modules

SIX_ROOMS = {"scans", "landmarks", "library", "fitting", "areas", "judging"}
PIPELINE = {"stickers", "methods", "stages", "assembly", "pipeline", "marking"}
NUMBERS = {"geometry", "results"}

MAY_IMPORT: dict[str, set[str]] = {
    "geometry": set(),
    "results": {"geometry"},
    "safety": set(),
    "settings": {"safety"},
    **dict.fromkeys(SIX_ROOMS, NUMBERS),
    **dict.fromkeys(PIPELINE, NUMBERS | SIX_ROOMS | PIPELINE),
    "report": NUMBERS,
    "views": NUMBERS,
    "cases": {"results"},
    "jobs": NUMBERS | PIPELINE | {"library", "report", "cases", "settings"},
    "web": NUMBERS | {"marking", "areas", "cases", "jobs", "report", "views", "settings", "safety"},
    "commands": NUMBERS | {"pipeline", "library", "report", "cases", "jobs", "web", "settings", "safety"},
    "cli": {"commands"},
    "__main__": {"cli"},
    "__init__": set(),
}
"""For each room, the others it may import."""

CONFINED = {
    "open3d": {"geometry", "scans"},
    "sksparse": {"geometry"},
    "pyapriltags": {"landmarks"},
    "fpdf": {"report"},
    "fhir": {"report"},
    "viser": {"views"},
    "fastapi": {"web"},
    "starlette": {"web"},
    "uvicorn": {"web"},
    "sqlalchemy": {"cases", "jobs"},
    "alembic": {"cases"},
    "standardwebhooks": {"jobs"},
    "dbos": {"jobs"},
    "prometheus_client": {"jobs"},
    "opentelemetry": {"jobs"},
    "cryptography": {"cases"},
    "pwdlib": {"cases"},
    "zxcvbn": {"cases"},
    "webauthn": {"web"},
    "joserfc": {"web"},
    "obstore": {"cases"},
}
"""Libraries that only some rooms may know. The database is for cases; the queue has tables of its own."""


def by_name(module: Module) -> str:
    return str(module)


@pytest.mark.parametrize("module", modules(), ids=by_name)
def test_a_room_imports_only_the_rooms_below_it(module: Module) -> None:
    allowed = MAY_IMPORT[module.room] | {module.room, "__version__"}
    wrong = [
        f"line {line}: {name}"
        for line, name in imports(module)
        if name.startswith("lubdub.") and name.split(".")[1] not in allowed
    ]
    assert not wrong, f"{module.room} may import {sorted(allowed)}"


@pytest.mark.parametrize("module", modules(), ids=by_name)
def test_a_library_stays_in_its_room(module: Module) -> None:
    wrong = [
        f"line {line}: {name}"
        for line, name in imports(module)
        if module.room not in CONFINED.get(name.split(".")[0], {module.room})
    ]
    assert not wrong


def test_open3d_is_only_loaded_when_it_is_used() -> None:
    wrong = [
        f"{module}:{node.lineno}"
        for module in modules()
        for node in module.tree.body
        if any(name == "open3d" or name.startswith("open3d.") for name in _names(node))
    ]
    assert not wrong


def _names(node: object) -> list[str]:
    names = [name.name for name in getattr(node, "names", []) if hasattr(name, "name")]
    return [*names, str(getattr(node, "module", ""))]


def test_every_room_is_known_to_the_rule() -> None:
    assert {module.room for module in modules()} <= set(MAY_IMPORT)


def test_every_room_says_what_it_is_for() -> None:
    heads = [module for module in modules() if module.path.name == "__init__.py"]
    assert PACKAGE / "__init__.py" in {module.path for module in heads}
    for module in heads:
        first = module.tree.body[0] if module.tree.body else None
        said = getattr(getattr(first, "value", None), "value", None)
        assert isinstance(said, str), f"{module} has no docstring"
        assert len(said) > 20
