"""Several web processes on one database, as behind a balancer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lubdub.settings import Settings
from tests.databases import fresh_database
from tests.web.service import Service, free_port


@contextmanager
def replicas(kind: str, folder: Path, count: int = 2, **changes: object) -> Iterator[list[Service]]:
    """So many web processes that share database, files and key; the first one may be given a worker."""
    with fresh_database(kind, folder) as url:
        shared = {"data_dir": folder / "data", "database_url": url} | changes
        services = [
            Service(Settings(port=free_port(), metrics_port=free_port(in_a_row=2), **shared)) for _ in range(count)
        ]  # type: ignore[arg-type]
        try:
            for service in services:
                service.start_web()
            yield services
        finally:
            for service in services:
                service.stop()
