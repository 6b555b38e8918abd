"""One running service with stand-in jobs for the whole session."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from lubdub.settings import Settings
from tests.web.service import Portal, Service, free_port


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    folder = tmp_path_factory.mktemp("service")
    settings = Settings(
        data_dir=folder / "data",
        port=free_port(),
        max_upload_mb=3,
        requests_per_minute=100_000,
        job_cpu_s=1,
        webhooks_to_private=True,
        metrics_port=free_port(in_a_row=2),
    )
    running = Service(settings)
    try:
        running.start_web()
        running.start_worker()
        yield running
    finally:
        running.stop()


@pytest.fixture(scope="session")
def portal(service: Service) -> Portal:
    return service.portal()
