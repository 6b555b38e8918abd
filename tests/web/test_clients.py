"""Two client generators of strangers accept the OpenAPI document without a word, and what they make is sound."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from lubdub.web.openapi import openapi_json
from tests.strangers import python_client, typescript_client


@pytest.fixture(scope="module")
def document(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("openapi") / "openapi.json"
    path.write_text(openapi_json())
    return path


def test_a_python_client_is_generated_for_every_call(document: Path, tmp_path: Path) -> None:
    client = python_client(document, tmp_path)
    made = {path.stem for path in client.glob("api/*/*.py")}
    operations = [one for methods in json.loads(document.read_text())["paths"].values() for one in methods.values()]
    assert {one["operationId"] for one in operations} <= made
    subprocess.run([sys.executable, "-m", "compileall", "-q", client], check=True)


def test_a_typescript_client_is_generated_and_type_checks(document: Path, tmp_path: Path) -> None:
    client = typescript_client(document, tmp_path)
    calls = (client / "sdk.gen.ts").read_text()
    for name in ("openCase", "placeLandmarks", "readBundle", "issueToken"):
        assert f"export const {name} " in calls
