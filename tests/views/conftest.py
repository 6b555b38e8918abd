"""A loopback viser server for each test that draws."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import viser

from lubdub.views.servers import start_server


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    running = start_server()
    yield running
    running.stop()
