"""The OpenAPI document without a running service."""

from __future__ import annotations

import json

from lubdub.settings import Settings
from lubdub.web.app import create_app


def openapi_json() -> str:
    """The document of the REST interface, as JSON text."""
    return json.dumps(create_app(Settings()).openapi(), indent=2)
