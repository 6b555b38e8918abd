"""The worker: a process that takes jobs from the queue and does them."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
from dataclasses import dataclass

import structlog
from dbos import DBOS

from lubdub.cases.opening import CannotOpen, open_cases
from lubdub.cases.outbox import Outbox
from lubdub.cases.privacy import Privacy
from lubdub.cases.sharing import Sharing
from lubdub.cases.work import WorkDesk
from lubdub.geometry.sparse import solver_name
from lubdub.jobs.confinement import protection
from lubdub.jobs.courier import Couriers
from lubdub.jobs.engine import (
    APPLICATION,
    APPLICATION_VERSION,
    POLL_S,
    QUEUE,
    UNTIL_INPUT_CLOSES,
    WORKFLOW,
    jobs_url,
)
from lubdub.jobs.forkserver import ForkServer
from lubdub.jobs.liveness import claim_name, open_locks
from lubdub.jobs.logs import configure_logs
from lubdub.jobs.metrics import serve_metrics, watch_database
from lubdub.jobs.sandbox import Limits
from lubdub.jobs.tracing import check_traceable, start_tracing
from lubdub.jobs.upkeep import Desks, Known, Upkeep
from lubdub.jobs.work import JobSettings, TaskNames, Workbench
from lubdub.settings import Settings

MANY_STARTS = 100
"""How often the queue may start a job. It does not count everywhere: the case's own count decides, see `WorkDesk`."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Held:
    """What this worker process holds. DBOS knows workflows by their function, so there is one per process."""

    workbench: Workbench
    stopping: threading.Event
    at_work: set[str]


_held: _Held | None = None


@DBOS.workflow(name=WORKFLOW, max_recovery_attempts=MANY_STARTS)
def work_on_case(job_id: str, request_id: str = "") -> None:
    """The durable job: after a crash it is started again from the beginning, which changes nothing twice.

    request_id: of the call that asked for it; every line logged meanwhile carries it.
    """
    if _held is None:
        raise RuntimeError("no worker runs in this process")
    asked_by = {"request_id": request_id} if request_id else {}
    _held.at_work.add(job_id)
    try:
        with structlog.contextvars.bound_contextvars(job_id=job_id, **asked_by):
            _held.workbench.do(job_id)
    finally:
        if not _held.stopping.is_set():
            _held.at_work.discard(job_id)
    if _held.stopping.is_set():
        threading.Event().wait()  # killed by our own stop: it must not count as done


def main(tasks: TaskNames | None = None) -> None:
    """Entry of the process that a server starts beside itself. tasks: other functions to run, for tests."""
    if UNTIL_INPUT_CLOSES in sys.argv:
        threading.Thread(target=_stop_with_parent, daemon=True).start()
    run_worker(Settings(), tasks)


def run_worker(settings: Settings, tasks: TaskNames | None = None) -> None:
    """Run a worker until it is told to stop (SIGTERM, Ctrl-C).

    Ends the process with a sentence when database, files or key cannot be used.
    """
    global _held
    configure_logs(settings)
    check_traceable(settings)
    # Before any thread: what is forked later must not inherit a lock that somebody holds.
    sandbox = limits_of(settings).to_json() | protection().to_json()
    forks = ForkServer([] if tasks else ["lubdub.jobs.tasks:warm_up"])
    forks.start()
    try:
        database, vault = open_cases(settings.database, settings.store, settings.master_key_source)
    except CannotOpen as error:
        forks.stop()
        raise SystemExit(str(error)) from error
    desk = WorkDesk(database, vault)
    jobs = JobSettings(limits_of(settings), tasks or TaskNames(), lambda: settings.references)
    workbench = Workbench(desk, vault, forks, jobs)
    stopping = threading.Event()
    _held = _Held(workbench, stopping, at_work=set())
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stopping.set())

    locks = open_locks(settings.jobs_database, settings.data_dir)
    name = claim_name(locks)
    _launch(settings, name)
    known_as = Known(name, solver_name(), sandbox)
    upkeep = Upkeep(known_as, workbench, Desks(desk, Privacy(database, vault), Sharing(database)), settings)
    Couriers(Outbox(database, vault), settings.webhooks_to_private, stopping).start()
    watch_database(database)
    end_metrics = serve_metrics(settings, desk)
    end_tracing = start_tracing(settings, "worker")
    log.info("a worker is ready", extra={"worker": name})
    has_name = upkeep.run(locks, _held.at_work, stopping)
    stopping.set()
    end_metrics()
    workbench.close()
    forks.stop()
    upkeep.put_back(_held.at_work)
    end_tracing()
    sys.stderr.flush()
    os._exit(0 if has_name else 1)  # jobs at work are started again elsewhere; their threads cannot be ended


def limits_of(settings: Settings) -> Limits:
    """What one job may use."""
    return Limits(
        memory_mb=settings.job_memory_mb,
        cpu_s=settings.job_cpu_s,
        wall_s=settings.job_wall_s,
        readable=() if settings.own_references is None else (str(settings.own_references),),
    )


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
    DBOS.register_queue(QUEUE, worker_concurrency=settings.worker_slots, polling_interval_sec=POLL_S)


def _stop_with_parent() -> None:
    """End this process when the one that started it ends: its end of our standard input closes."""
    sys.stdin.buffer.read()
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    main()
