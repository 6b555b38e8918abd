"""What a running process holds, one by one, as Annotated dependencies. Import them from `deps`."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from lubdub.cases.drafts import Drafts
from lubdub.cases.embedding import Embedding
from lubdub.cases.files import FileVault
from lubdub.cases.keys import Keys
from lubdub.cases.links import Links
from lubdub.cases.listing import CaseList
from lubdub.cases.review import Reviews
from lubdub.cases.staff import Staff
from lubdub.cases.store import CaseStore
from lubdub.cases.uploads import Uploads
from lubdub.cases.webhooks import Webhooks
from lubdub.cases.worklist import Worklist
from lubdub.jobs.engine import JobEngine
from lubdub.jobs.reference_marks import ReferenceMarks
from lubdub.settings import Settings
from lubdub.web.actions import CaseActions
from lubdub.web.quotas import UploadQuotas
from lubdub.web.services import Services


def services(connection: HTTPConnection) -> Services:
    """What this process holds."""
    held: Services = connection.app.state.services
    return held


ServicesDep = Annotated[Services, Depends(services)]


def _settings(held: ServicesDep) -> Settings:
    return held.settings


def _store(held: ServicesDep) -> CaseStore:
    return held.store


def _drafts(held: ServicesDep) -> Drafts:
    return held.drafts


def _files(held: ServicesDep) -> FileVault:
    return held.files


def _actions(held: ServicesDep) -> CaseActions:
    return held.actions


def _engine(held: ServicesDep) -> JobEngine:
    return held.engine


def _keys(held: ServicesDep) -> Keys:
    return held.keys


def _listing(held: ServicesDep) -> CaseList:
    return held.listing


def _uploads(held: ServicesDep) -> Uploads:
    return held.uploads


def _quotas(held: ServicesDep) -> UploadQuotas:
    return held.quotas


def _links(held: ServicesDep) -> Links:
    return held.links


def _staff(held: ServicesDep) -> Staff:
    return held.staff


def _reviews(held: ServicesDep) -> Reviews:
    return held.reviews


def _reference_marks(held: ServicesDep) -> ReferenceMarks:
    return held.reference_marks


def _embedding(held: ServicesDep) -> Embedding:
    return held.embedding


def _worklist(held: ServicesDep) -> Worklist:
    return held.worklist


def _webhooks(held: ServicesDep) -> Webhooks:
    return held.webhooks


KeysDep = Annotated[Keys, Depends(_keys)]
ListingDep = Annotated[CaseList, Depends(_listing)]
WorklistDep = Annotated[Worklist, Depends(_worklist)]
ReviewsDep = Annotated[Reviews, Depends(_reviews)]
ReferenceMarksDep = Annotated[ReferenceMarks, Depends(_reference_marks)]
EmbeddingDep = Annotated[Embedding, Depends(_embedding)]
WebhooksDep = Annotated[Webhooks, Depends(_webhooks)]
StaffDep = Annotated[Staff, Depends(_staff)]
UploadsDep = Annotated[Uploads, Depends(_uploads)]
QuotasDep = Annotated[UploadQuotas, Depends(_quotas)]
LinksDep = Annotated[Links, Depends(_links)]
SettingsDep = Annotated[Settings, Depends(_settings)]
StoreDep = Annotated[CaseStore, Depends(_store)]
DraftsDep = Annotated[Drafts, Depends(_drafts)]
FilesDep = Annotated[FileVault, Depends(_files)]
ActionsDep = Annotated[CaseActions, Depends(_actions)]
EngineDep = Annotated[JobEngine, Depends(_engine)]
