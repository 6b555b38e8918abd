"""What a worker does beside its jobs: it keeps itself known, and looks after what others left behind."""

from __future__ import annotations

import logging
import threading
import time
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

from dbos import DBOSClient, WorkflowStatus

from lubdub.cases.clock import now
from lubdub.cases.privacy import Privacy
from lubdub.cases.rows import job_of
from lubdub.cases.sharing import Sharing
from lubdub.cases.work import WorkDesk
from lubdub.jobs.alive import show_alive
from lubdub.jobs.engine import QUEUE, DbosEngine, jobs_url
from lubdub.jobs.liveness import NameLocks
from lubdub.jobs.unshared import remove_unshared
from lubdub.jobs.work import Workbench
from lubdub.settings import Settings

BEAT_S = 2.0
"""A lost machine is noticed after `liveness.LOST_AFTER_S`, and its jobs are taken over one beat later."""
PURGE_S = 3600.0
KEPT_IN_QUEUE = timedelta(days=1)
"""A job's row in the queue outlives the job by so long, for whoever looks for a fault; its case has the result."""
FORGOTTEN_AT_ONCE = 500
GRACE = timedelta(seconds=5)
"""A row is left alone this long after its last change: its call to the queue may still be on the way."""
LOOKS = 3
"""A job that the queue says is ours, and that is not at work at so many beats in a row, was lost on its way to us."""
BEATS_WITHOUT_NAME = 10
"""Until the server has forgotten our own lost connection our name is taken; after that it is another worker's."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Known:
    """What a worker tells of itself. sandbox: the limits of its children, and what else is taken from them."""

    name: str
    solver: str
    sandbox: Mapping[str, Any]


@dataclass(frozen=True)
class Desks:
    """The services it looks after."""

    work: WorkDesk
    privacy: Privacy
    sharing: Sharing


class Upkeep:
    """What a worker does beside its jobs, every few seconds."""

    def __init__(self, known_as: Known, workbench: Workbench, desks: Desks, settings: Settings) -> None:
        """For one worker."""
        self._known_as = known_as
        self._workbench = workbench
        self._desks = desks
        self._settings = settings
        self._engine = DbosEngine(settings.jobs_database)
        self._client = DBOSClient(system_database_url=jobs_url(settings.jobs_database), retry_connection_errors=False)
        self._purged_at = -PURGE_S
        self._forgets = False
        self._not_at_work: Counter[str] = Counter()

    def run(self, locks: NameLocks, at_work: Collection[str], stopping: threading.Event) -> bool:
        """Until stopping is set (True), or until another worker has this one's name (False).

        A database that is away for a while is waited for. at_work: the jobs this process works on.
        """
        older_than, beats_without_name, failed = timedelta(0), 0, False
        while not stopping.is_set():
            show_alive(self._settings.worker_pulse)
            try:
                self._desks.work.beat(self._known_as.name, self._known_as.solver, self._known_as.sandbox)
                beats_without_name = 0 if locks.keeps(self._known_as.name) else beats_without_name + 1
                if beats_without_name >= BEATS_WITHOUT_NAME:
                    log.error("another worker has taken this one's name", extra={"worker": self._known_as.name})
                    return False
                self._sweep(older_than)
                self._take_over(locks, at_work)
                self._purge()
            except Exception:  # a database or store that is away comes back; jobs must go on meanwhile
                log.exception("upkeep failed and is tried again")
                failed = True
            else:
                if failed:
                    log.info("upkeep works again", extra={"worker": self._known_as.name})
                older_than, failed = GRACE, False
            stopping.wait(BEAT_S)
        return True

    def put_back(self, at_work: Collection[str]) -> None:
        """This worker stops: what it was at is no fault of the jobs."""
        try:
            for job_id in tuple(at_work):
                self._desks.work.put_back(job_of(job_id))
        except Exception:  # with the database away the start counts, which does no harm
            log.exception("jobs could not be put back")

    def _sweep(self, older_than: timedelta) -> None:
        """Enqueue what the web process could not; give up what ended without a result."""
        waiting = self._desks.work.waiting(older_than)
        states = self._engine.states([job.id for job in waiting])
        for job in waiting:
            if states[job.id] == "unknown":
                self._engine.submit(job)
            elif states[job.id] == "ended":
                self._workbench.give_up(job)

    def _take_over(self, locks: NameLocks, at_work: Collection[str]) -> None:
        """Put jobs back into the queue: of dead workers, whose name's lock can be taken, and what we lost ourselves."""
        pending = self._pending()
        for dead in {job.executor_id for job in pending if job.executor_id is not None} - {self._known_as.name}:
            if not locks.try_take(dead):
                continue
            # Asked again, now that nobody else can: another worker may have been here since, and be at work on them.
            orphans = self._pending(executor_id=dead)
            self._resume([job.workflow_id for job in orphans])
            locks.release(dead)
            log.warning("the jobs of a dead worker were taken over", extra={"worker": dead})
        self._resume(self._lost(pending, at_work))

    def _pending(self, executor_id: str | None = None) -> list[WorkflowStatus]:
        """The jobs that the queue says are at work, of one worker or of all."""
        return self._client.list_workflows(
            status="PENDING", executor_id=executor_id, load_input=False, load_output=False
        )

    def _lost(self, pending: Sequence[WorkflowStatus], at_work: Collection[str]) -> list[str]:
        """A database that dies may have handed us a job without our hearing of it."""
        ours = [job.workflow_id for job in pending if job.executor_id == self._known_as.name]
        seen = self._not_at_work
        self._not_at_work = Counter({job_id: seen[job_id] + 1 for job_id in ours if job_id not in at_work})
        return [job_id for job_id, looks in self._not_at_work.items() if looks >= LOOKS]

    def _resume(self, job_ids: list[str]) -> None:
        for job_id in job_ids:
            self._client.resume_workflow(job_id, queue_name=QUEUE)
            self._not_at_work.pop(job_id, None)

    def _purge(self) -> None:
        """The retention clock, for cases, shared bodies and the queue."""
        if time.monotonic() - self._purged_at >= PURGE_S:
            self._purged_at = time.monotonic()
            gone = self._desks.privacy.purge(self._settings.retention_days)
            log.info("retention: %d cases deleted", len(gone))
            bodies = remove_unshared(self._desks.sharing, self._settings.own_references)
            log.info("retention: %d reference bodies removed", len(bodies))
            self._forgets = True
        if self._forgets:
            self._forgets = self._forget_ended()

    def _forget_ended(self) -> bool:
        """Delete rows of jobs that ended long ago, or the queue would grow for ever. Whether there may be more.

        A part at each beat, so that a long queue keeps nobody from being taken over.
        """
        ended = self._client.list_workflows(
            completed_before=(now() - KEPT_IN_QUEUE).isoformat(),
            limit=FORGOTTEN_AT_ONCE,
            load_input=False,
            load_output=False,
        )
        if ended:
            self._client.delete_workflows([job.workflow_id for job in ended])
            log.info("retention: the queue forgot %d jobs", len(ended))
        return len(ended) == FORGOTTEN_AT_ONCE
