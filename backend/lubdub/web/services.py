"""What a running web process holds: one of each, opened at start and closed at the end."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta

from lubdub.cases.database import Database
from lubdub.cases.drafts import Drafts
from lubdub.cases.embedding import Embedding
from lubdub.cases.files import FileVault
from lubdub.cases.keys import Keys
from lubdub.cases.links import Links
from lubdub.cases.listing import CaseList
from lubdub.cases.opening import open_cases
from lubdub.cases.people import People
from lubdub.cases.privacy import Privacy
from lubdub.cases.rates import CarefulRates, open_rates
from lubdub.cases.review import Reviews
from lubdub.cases.sharing import Sharing
from lubdub.cases.staff import Staff, Times, open_staff
from lubdub.cases.store import CaseStore
from lubdub.cases.uploads import Uploads
from lubdub.cases.webhooks import Webhooks
from lubdub.cases.work import WorkDesk
from lubdub.cases.worklist import Worklist
from lubdub.jobs.engine import DbosEngine, JobEngine
from lubdub.jobs.reference_marks import ReferenceMarks
from lubdub.settings import Settings
from lubdub.web.actions import CaseActions
from lubdub.web.quotas import UploadQuotas
from lubdub.web.readiness import Readiness


@dataclass(frozen=True)
class Services:
    """Everything a request may need."""

    settings: Settings
    database: Database
    store: CaseStore
    files: FileVault
    listing: CaseList
    people: People
    keys: Keys
    webhooks: Webhooks
    staff: Staff
    embedding: Embedding
    drafts: Drafts
    uploads: Uploads
    links: Links
    reviews: Reviews
    worklist: Worklist
    sharing: Sharing
    reference_marks: ReferenceMarks
    privacy: Privacy
    desk: WorkDesk
    engine: JobEngine
    actions: CaseActions
    readiness: Readiness
    rates: CarefulRates
    quotas: UploadQuotas

    def close(self) -> None:
        """Give the connections back."""
        self.engine.close()
        self.rates.close()
        self.database.close()


def open_services(settings: Settings) -> Services:
    """Open the database (made or upgraded when needed), the vault and the queue.

    Raises CannotOpen.
    """
    database, files = open_cases(settings.database, settings.store, settings.master_key_source)
    store = CaseStore(database, files)
    privacy = Privacy(database, files)
    engine = DbosEngine(settings.jobs_database)
    uploads = Uploads(database, files)
    reviews = Reviews(database, files)
    people = People(database)
    rates = open_rates(settings.database, settings.data_dir)
    quotas = UploadQuotas(rates, settings)
    return Services(
        settings=settings,
        database=database,
        store=store,
        files=files,
        listing=CaseList(database),
        people=people,
        keys=Keys(database, people),
        webhooks=Webhooks(database, files),
        staff=open_staff(database, files, _times(settings)),
        embedding=Embedding(database, files),
        drafts=Drafts(database, files),
        uploads=uploads,
        links=Links(database),
        reviews=reviews,
        worklist=Worklist(database),
        sharing=Sharing(database),
        reference_marks=ReferenceMarks(database, settings.own_references, lambda: settings.references),
        privacy=privacy,
        desk=WorkDesk(database, files),
        engine=engine,
        actions=CaseActions(store, files, uploads, privacy, reviews, engine, quotas),
        readiness=Readiness(database, files, WorkDesk(database, files)),
        rates=rates,
        quotas=quotas,
    )


def _times(settings: Settings) -> Times:
    return Times(
        idle=timedelta(minutes=settings.desk_idle_minutes),
        longest=timedelta(hours=settings.desk_session_hours),
        family_link=timedelta(days=settings.invitation_days),
    )
