"""What can be done with a case, the same from a page and from REST: change the row, then tell the queue."""

from __future__ import annotations

import hashlib
from collections.abc import AsyncIterator
from typing import Literal

from starlette.concurrency import run_in_threadpool

from lubdub.cases.files import FileVault, Sealed, SealedWriter
from lubdub.cases.privacy import Privacy
from lubdub.cases.repeating import Repeatable
from lubdub.cases.review import Reviews
from lubdub.cases.reviewing import Reviewer
from lubdub.cases.store import Asked, CaseStore
from lubdub.cases.uploads import Upload, Uploads
from lubdub.cases.values import Actor, Case, NewCase, Receipt
from lubdub.jobs.engine import JobEngine
from lubdub.web.pages.samples import only_samples, refuse_others
from lubdub.web.problems import Problem
from lubdub.web.quotas import STEP, UploadQuotas

UnitName = Literal["m", "cm", "mm"]


class CaseActions:
    """Each method is one act of a person or portal. Raises CaseNotFound and StateConflict of `cases.errors`."""

    def __init__(
        self,
        store: CaseStore,
        files: FileVault,
        uploads: Uploads,
        privacy: Privacy,
        reviews: Reviews,
        engine: JobEngine,
        quotas: UploadQuotas,
    ) -> None:
        """Over the open services."""
        self._reviews = reviews
        self._store = store
        self._files = files
        self._uploads = uploads
        self._privacy = privacy
        self._engine = engine
        self._quotas = quotas

    def open(self, actor: Actor, new: NewCase, repeatable: Repeatable | None = None) -> tuple[Case, bool]:
        """A new case, or with False the one an earlier call with the same key opened.

        Raises Problem `consent-missing` for a family's case of a real body without consent.
        """
        if actor.kind == "family" and new.consent is None and new.person != "sample":
            raise Problem("consent-missing", "Open the first page of this service and answer its questions.")
        return self._store.create(actor, new, repeatable)

    async def receive_scan(
        self, actor: Actor, case_id: str, chunks: AsyncIterator[bytes], unit: UnitName | None = None
    ) -> Case:
        """Stream a scan into the vault, sealed piece by piece, and ask for its check.

        Raises Problem `empty-body` for no bytes at all, `sandbox-takes-samples` for a real body in a sandbox,
        `upload-quota`.
        """
        await run_in_threadpool(self._store.expect_scan, actor, case_id)
        writer = await run_in_threadpool(self._files.writer, case_id, "scan")
        try:
            sealed = await self._fill(actor, writer, only_samples(chunks) if actor.is_sandbox else chunks)
            case, job = await run_in_threadpool(self._store.receive_scan, actor, case_id, sealed, unit)
        except BaseException:
            await run_in_threadpool(writer.abort)
            raise
        await run_in_threadpool(self._engine.submit, job)
        return case

    async def join_upload(self, actor: Actor, upload: Upload) -> Case:
        """Make a whole upload the case's scan and ask for its check, as if it had come in one piece."""
        sealed = await run_in_threadpool(self._uploads.join, upload)
        try:
            if actor.is_sandbox:
                await run_in_threadpool(self._refuse_others, upload.case_id, sealed)
            case, job = await run_in_threadpool(self._store.receive_scan, actor, upload.case_id, sealed, upload.unit)
        except BaseException:
            await run_in_threadpool(self._files.discard, upload.case_id, [sealed.object_key])
            raise
        await run_in_threadpool(self._uploads.end, actor, upload.id)
        await run_in_threadpool(self._engine.submit, job)
        return case

    async def _fill(self, actor: Actor, writer: SealedWriter, chunks: AsyncIterator[bytes]) -> Sealed:
        charged = 0
        async for chunk in chunks:
            await run_in_threadpool(writer.write, chunk)
            if writer.size - charged >= STEP:
                await run_in_threadpool(self._quotas.charge, actor, writer.size - charged)
                charged = writer.size
        if writer.size == 0:
            raise Problem("empty-body", "The scan has no bytes. Send the file's content as the body of the call.")
        await run_in_threadpool(self._quotas.charge, actor, writer.size - charged)
        return await run_in_threadpool(writer.finish)

    def _refuse_others(self, case_id: str, scan: Sealed) -> None:
        seen = hashlib.sha256()
        for piece in self._files.stream_object(case_id, "scan", scan.object_key):
            seen.update(piece)
        refuse_others(seen.hexdigest())

    def check_again(self, actor: Actor, case_id: str, unit: UnitName) -> Case:
        """Examine the same scan in the unit a person said it has."""
        case, job = self._store.check_again(actor, case_id, unit)
        self._engine.submit(job)
        return case

    def place_landmarks(self, actor: Actor, case_id: str, asked: Asked, repeatable: Repeatable | None = None) -> Case:
        """Take the landmarks and queue the run, once for the same idempotency key.

        With none, the suggested ones are used, and the result says so.
        """
        case, job = self._store.place_landmarks(actor, case_id, asked, repeatable)
        if job is not None:
            self._engine.submit(job)
        return case

    def run_again(self, by: Reviewer, case_id: str, version: int) -> Case:
        """Queue a run with the landmarks a clinician moved. version: of the review, as the clinician saw it."""
        case, job = self._reviews.run_again(by, case_id, version)
        self._engine.submit(job)
        return case

    def cancel(self, actor: Actor, case_id: str) -> Case:
        """Stop what is at work; the case steps back to where it waited before."""
        case, job = self._store.cancel(actor, case_id)
        if job is not None:
            self._engine.cancel(job.id)
        return case

    def delete(self, actor: Actor, case_id: str) -> Receipt:
        """Delete the case for good, whatever it is doing; the worker notices and stops."""
        return self._privacy.delete(actor, case_id)

    def receipt(self, actor: Actor, case_id: str) -> Receipt | None:
        """Of the case's deletion; None while it is not deleted."""
        return self._privacy.receipt(actor, case_id)
