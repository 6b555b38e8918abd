"""What a running web process holds: one of each, opened at start and closed at the end."""

from __future__ import annotations

from dataclasses import dataclass

from lubdub.cases.database import Database
from lubdub.cases.files import FileVault
from lubdub.cases.opening import open_cases
from lubdub.cases.people import People
from lubdub.cases.privacy import Privacy
from lubdub.cases.store import CaseStore
from lubdub.cases.work import WorkDesk
from lubdub.jobs.engine import DbosEngine, JobEngine
from lubdub.settings import Settings
from lubdub.web.actions import CaseActions


@dataclass(frozen=True)
class Services:
    """Everything a request may need."""

    settings: Settings
    database: Database
    store: CaseStore
    files: FileVault
    people: People
    privacy: Privacy
    desk: WorkDesk
    engine: JobEngine
    actions: CaseActions

    def close(self) -> None:
        """Give the connections back."""
        self.engine.close()
        self.database.close()


def open_services(settings: Settings) -> Services:
    """Open the database (made or upgraded when needed), the vault and the queue.

    Raises CannotOpen.
    """
    database, files = open_cases(settings.database, settings.store, settings.master_key)
    store = CaseStore(database, files)
    privacy = Privacy(database, files)
    engine = DbosEngine(settings.jobs_database)
    return Services(
        settings=settings,
        database=database,
        store=store,
        files=files,
        people=People(database),
        privacy=privacy,
        desk=WorkDesk(database, files),
        engine=engine,
        actions=CaseActions(store, files, privacy, engine),
    )
