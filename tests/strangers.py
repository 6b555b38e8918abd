"""Independent programs that judge what leaves Lubdub; they are installed in tests/peers by `./lubdub test`."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PEERS = ROOT / "tests" / "peers"
NODE = shutil.which("node") or str(ROOT / ".system" / "node" / "bin" / "node")
"""The machine's own, or the one that `./lubdub` fetched."""


def fhir_faults(resource: dict[str, Any]) -> list[dict[str, str]]:
    """What two validators of FHIR R4 find wrong with a resource, or with a bundle and all that is in it."""
    judged = subprocess.run(
        [NODE, PEERS / "validate-fhir.mjs"], input=json.dumps(resource), capture_output=True, text=True, check=True
    )
    return list(json.loads(judged.stdout))


def python_client(document: Path, folder: Path) -> Path:
    """The package `openapi-python-client` makes of an OpenAPI document. A warning of its is a failure."""
    binary = dict.fromkeys(("application/pdf", "application/offset+octet-stream"), "application/octet-stream")
    config = folder / "config.json"
    config.write_text(json.dumps({"content_type_overrides": binary, "post_hooks": []}))
    client = folder / "lubdub_client"
    command = [Path(sys.executable).parent / "openapi-python-client", "generate", "--fail-on-warning", "--meta", "none"]
    _run([*command, "--path", document, "--config", config, "--output-path", client])
    return client


def typescript_client(document: Path, folder: Path) -> Path:
    """The folder @hey-api/openapi-ts makes of an OpenAPI document, checked by the TypeScript compiler."""
    programs = PEERS / "node_modules"
    client = folder / "client"
    generator = programs / "@hey-api" / "openapi-ts" / "bin" / "run.js"
    said = _run([NODE, generator, "-i", document, "-o", client, "-c", "@hey-api/client-fetch"], cwd=folder)
    assert "unresolvable" not in said, said
    checks = ["--strict", "--noEmit", "--skipLibCheck", "--target", "es2022", "--module", "esnext"]
    compiler = programs / "typescript" / "bin" / "tsc"
    _run([NODE, compiler, *checks, "--moduleResolution", "bundler", client / "index.ts"], cwd=folder)
    return client


def _run(command: list[str | Path], cwd: Path | None = None) -> str:
    done = subprocess.run(command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode == 0, done.stdout
    return done.stdout
