"""What can be done with a case, the same from a page and from REST: change the row, then tell the queue."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Literal

from starlette.concurrency import run_in_threadpool

from lubdub.cases.files import FileVault, Sealed, SealedWriter
from lubdub.cases.privacy import Privacy
from lubdub.cases.store import Asked, CaseStore, Repeatable
from lubdub.cases.values import Actor, Case, NewCase, Receipt
from lubdub.jobs.engine import JobEngine
from lubdub.web.problems import Problem

UnitName = Literal["m", "cm", "mm"]


class CaseActions:
    """Each method is one act of a person or portal. Raises CaseNotFound and StateConflict of `cases.errors`."""

    def __init__(self, store: CaseStore, files: FileVault, privacy: Privacy, engine: JobEngine) -> None:
        """Over the open services."""
        self._store = store
        self._files = files
        self._privacy = privacy
        self._engine = engine

    def open(self, actor: Actor, new: NewCase, repeatable: Repeatable | None = None) -> tuple[Case, bool]:
        """A new case, or with False the one an earlier call with the same key opened."""
        return self._store.create(actor, new, repeatable)

    async def receive_scan(
        self, actor: Actor, case_id: str, chunks: AsyncIterator[bytes], unit: UnitName | None = None
    ) -> Case:
        """Stream a scan into the vault, sealed piece by piece, and ask for its check.

        The caller caps the stream (`limits.capped`). Raises Problem `empty-body` for no bytes at all.
        """
        await run_in_threadpool(self._store.expect_scan, actor, case_id)
        writer = await run_in_threadpool(self._files.writer, case_id, "scan")
        try:
            sealed = await _fill(writer, chunks)
            case, job = await run_in_threadpool(self._store.receive_scan, actor, case_id, sealed, unit)
        except BaseException:
            await run_in_threadpool(writer.abort)
            raise
        await run_in_threadpool(self._engine.submit, job.id)
        return case

    def check_again(self, actor: Actor, case_id: str, unit: UnitName) -> Case:
        """Examine the same scan in the unit a person said it has."""
        case, job = self._store.check_again(actor, case_id, unit)
        self._engine.submit(job.id)
        return case

    def place_landmarks(self, actor: Actor, case_id: str, asked: Asked) -> Case:
        """Take the landmarks and queue the run. With none, the suggested ones are used, and the result says so."""
        case, job = self._store.place_landmarks(actor, case_id, asked)
        self._engine.submit(job.id)
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


async def _fill(writer: SealedWriter, chunks: AsyncIterator[bytes]) -> Sealed:
    async for chunk in chunks:
        await run_in_threadpool(writer.write, chunk)
    if writer.size == 0:
        raise Problem("empty-body", "The scan has no bytes. Send the file's content as the body of the call.")
    return await run_in_threadpool(writer.finish)
