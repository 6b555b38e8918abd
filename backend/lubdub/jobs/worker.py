"""The worker: takes jobs from the queue, keeps itself known, and looks after what other workers left behind."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import time
from dataclasses import dataclass
from datetime import timedelta

import structlog
from dbos import DBOS, DBOSClient

from lubdub.cases.opening import CannotOpen, open_cases
from lubdub.cases.outbox import Outbox
from lubdub.cases.privacy import Privacy
from lubdub.cases.sharing import Sharing
from lubdub.cases.work import WorkDesk
from lubdub.geometry.sparse import solver_name
from lubdub.jobs.courier import Couriers
from lubdub.jobs.engine import APPLICATION, APPLICATION_VERSION, QUEUE, WORKFLOW, DbosEngine, jobs_url
from lubdub.jobs.forkserver import ForkServer
from lubdub.jobs.liveness import NameLocks, claim_name, open_locks
from lubdub.jobs.logs import configure_logs
from lubdub.jobs.metrics import serve_metrics, watch_database
from lubdub.jobs.sandbox import Limits
from lubdub.jobs.unshared import remove_unshared
from lubdub.jobs.work import JobSettings, TaskNames, Workbench
from lubdub.settings import Settings

BEAT_S = 5.0
PURGE_S = 3600.0
MAX_STARTS = 3
"""A job that takes its worker down with it this often is given up."""
GRACE = timedelta(seconds=5)
"""A row is left alone this long after its last change: its call to the queue may still be on the way."""

UNTIL_INPUT_CLOSES = "--until-input-closes"

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Held:
    """What this worker process holds. DBOS knows workflows by their function, so there is one per process."""

    workbench: Workbench
    stopping: threading.Event


_held: _Held | None = None


@DBOS.workflow(name=WORKFLOW, max_recovery_attempts=MAX_STARTS)
def work_on_case(job_id: str, request_id: str = "") -> None:
    """The durable job: after a crash it is started again from the beginning, which changes nothing twice.

    request_id: of the call that asked for it; every line logged meanwhile carries it.
    """
    if _held is None:
        raise RuntimeError("no worker runs in this process")
    asked_by = {"request_id": request_id} if request_id else {}
    with structlog.contextvars.bound_contextvars(job_id=job_id, **asked_by):
        _held.workbench.do(job_id)
    if _held.stopping.is_set():
        threading.Event().wait()  # killed by our own stop: it must not count as done


def run_worker(settings: Settings, tasks: TaskNames | None = None) -> None:
    """Run a worker until it is told to stop (SIGTERM, Ctrl-C). tasks: other functions to run, for tests.

    Ends the process with a sentence when database, files or key cannot be used.
    """
    global _held
    configure_logs(settings)
    # Before any thread: what is forked later must not inherit a lock that somebody holds.
    forks = ForkServer([] if tasks else ["lubdub.jobs.tasks:warm_up"])
    forks.start()
    try:
        database, vault = open_cases(settings.database, settings.store, settings.master_key_source)
    except CannotOpen as error:
        forks.stop()
        raise SystemExit(str(error)) from error
    desk = WorkDesk(database, vault)
    limits = Limits(
        memory_mb=settings.job_memory_mb,
        cpu_s=settings.job_cpu_s,
        wall_s=settings.job_wall_s,
        file_mb=settings.job_output_mb,
        readable=() if settings.own_references is None else (str(settings.own_references),),
    )
    workbench = Workbench(desk, vault, forks, JobSettings(limits, tasks or TaskNames(), lambda: settings.references))
    stopping = threading.Event()
    _held = _Held(workbench, stopping)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stopping.set())

    locks = open_locks(settings.jobs_database, settings.data_dir)
    name = claim_name(locks)
    _launch(settings, name)
    upkeep = Upkeep(name, desk, workbench, Privacy(database, vault), Sharing(database), settings)
    Couriers(Outbox(database, vault), settings.webhooks_to_private, stopping).start()
    watch_database(database)
    end_metrics = serve_metrics(settings, desk)
    log.info("a worker is ready", extra={"worker": name})
    upkeep.run(locks, stopping)
    end_metrics()
    forks.stop()
    sys.stderr.flush()
    os._exit(0)  # jobs at work are started again by the next worker; their threads cannot be ended


def _launch(settings: Settings, name: str) -> None:
    DBOS(
        config={
            "name": APPLICATION,
            "system_database_url": jobs_url(settings.jobs_database),
            "executor_id": name,
            "application_version": APPLICATION_VERSION,
            "log_level": "WARNING",
            "enable_otlp": False,
        }
    )
    DBOS.launch()
    DBOS.register_queue(QUEUE, worker_concurrency=settings.worker_slots, polling_interval_sec=0.4)


class Upkeep:
    """What a worker does beside its jobs, every few seconds."""

    def __init__(
        self,
        name: str,
        desk: WorkDesk,
        workbench: Workbench,
        privacy: Privacy,
        sharing: Sharing,
        settings: Settings,
    ) -> None:
        """For the worker called name."""
        self._name = name
        self._desk = desk
        self._workbench = workbench
        self._privacy = privacy
        self._retention_days = settings.retention_days
        self._sharing, self._references = sharing, settings.own_references
        self._engine = DbosEngine(settings.jobs_database)
        self._client = DBOSClient(system_database_url=jobs_url(settings.jobs_database), retry_connection_errors=False)
        self._purged_at = -PURGE_S

    def run(self, locks: NameLocks, stopping: threading.Event) -> None:
        """Until stopping is set. A database that is away for a while is waited for."""
        self._sweep(timedelta(0))
        while not stopping.is_set():
            try:
                self._desk.beat(self._name, solver_name())
                self._sweep(GRACE)
                self._take_over(locks)
                self._purge()
            except Exception:  # a database or store that is away comes back; jobs must go on meanwhile
                log.exception("upkeep failed and is tried again")
            stopping.wait(BEAT_S)

    def _sweep(self, older_than: timedelta) -> None:
        """Enqueue what the web process could not; give up what was started too often."""
        for job in self._desk.waiting(older_than):
            state = self._engine.status(job.id)
            if state == "unknown":
                self._engine.submit(job.id)
            elif state == "ended":
                self._workbench.give_up(job)

    def _take_over(self, locks: NameLocks) -> None:
        """Put the jobs of dead workers back into the queue. Whose name's lock can be taken is dead."""
        pending = self._client.list_workflows(status="PENDING", load_input=False, load_output=False)
        for dead in {job.executor_id for job in pending if job.executor_id is not None} - {self._name}:
            if not locks.try_take(dead):
                continue
            for job in pending:
                if job.executor_id == dead:
                    self._client.resume_workflow(job.workflow_id, queue_name=QUEUE)
            locks.release(dead)
            log.warning("the jobs of a dead worker were taken over", extra={"worker": dead})

    def _purge(self) -> None:
        """The retention clock."""
        if time.monotonic() - self._purged_at >= PURGE_S:
            self._purged_at = time.monotonic()
            gone = self._privacy.purge(self._retention_days)
            log.info("retention: %d cases deleted", len(gone))
            bodies = remove_unshared(self._sharing, self._references)
            log.info("retention: %d reference bodies removed", len(bodies))


def _stop_with_parent() -> None:
    """End this process when the one that started it ends: its end of our standard input closes."""
    sys.stdin.buffer.read()
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    if UNTIL_INPUT_CLOSES in sys.argv:
        threading.Thread(target=_stop_with_parent, daemon=True).start()
    run_worker(Settings())
