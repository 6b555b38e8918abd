"""One job from beginning to end: the scan out of the vault, through a sandboxed child, the result back in."""

from __future__ import annotations

import json
import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, get_args

from lubdub.cases.away import is_away
from lubdub.cases.errors import FileNotFound, StartedTooOften
from lubdub.cases.files import Artefact, FileVault
from lubdub.cases.rows import job_of
from lubdub.cases.values import Case, Job
from lubdub.cases.work import Handed, WorkDesk
from lubdub.jobs.bundle import BadBundle, Bundle
from lubdub.jobs.engine import current_request
from lubdub.jobs.metrics import CHILD_ENDS, JOB_SECONDS, JOBS, STAGE_SECONDS, VERDICTS, count_fault
from lubdub.jobs.patience import patiently
from lubdub.jobs.sandbox import ChildResult, Limits
from lubdub.jobs.tracing import JobTrace, trace_job
from lubdub.results import UNREADABLE_FILE, Progress, Reason, VerdictWord

LOOK_EVERY_S = 0.3
"""How often a running job asks whether anybody still waits for it; a cancel is to be felt within a second."""
STORE_PATIENCE_S = 60.0
"""A store that is full or away is waited for so long; then the job ends, and the case says to come back later."""
FOR_EVER_S = float("inf")
"""Without its database a worker can do nothing else than wait for it."""
TELL_EVERY_S = 0.2
"""Progress within a stage is told no more often than this."""

BREAKS_READER = Reason(
    UNREADABLE_FILE,
    "This file cannot be read as a scan of a body.",
    "Please export the scan again, as PLY, GLB, OBJ or STL, or scan once more.",
)
TOO_HEAVY = Reason(
    UNREADABLE_FILE,
    "This scan holds more than we can work with.",
    "Please export it with less detail, or cut it down to the chest, and send it again.",
)
COME_BACK = Reason(
    "internal",
    "We cannot keep any results at the moment; nothing is known about this scan yet.",
    "Come back later and try again.",
)
FAILED = Reason("internal", "Something went wrong on our side; nothing is known about this scan yet.", "Try again.")

FILES: Mapping[str, frozenset[Artefact]] = {
    "check": frozenset({"examination.npz", "examination.json", "scan.ply"}),
    "locate": frozenset({"result.json", "outcome.npz"}),
}
"""What each kind of job may store: names that come out of a child are not taken on trust."""

STAGES = frozenset({"read", "clean", "fit", "choose", "project", "judge"})

log = logging.getLogger(__name__)


class Runner(Protocol):
    """What starts sandboxed children: the warm fork server."""

    def run(
        self, task: str, payload: bytes, limits: Limits, on_progress: Progress, cancelled: Callable[[], bool] = ...
    ) -> ChildResult:
        """Run the task on the payload in a child."""


@dataclass(frozen=True)
class TaskNames:
    """The functions run in the child, as module:function."""

    check: str = "lubdub.jobs.tasks:examine_task"
    locate: str = "lubdub.jobs.tasks:locate_task"


@dataclass(frozen=True)
class JobSettings:
    """How jobs are run. references: tells the folder of reference bodies, None for the project's own."""

    limits: Limits
    tasks: TaskNames
    references: Callable[[], Path | None]


class Workbench:
    """Does jobs. One job may be done again after a crash: everything it leaves behind is written once, together."""

    def __init__(self, desk: WorkDesk, vault: FileVault, runner: Runner, settings: JobSettings) -> None:
        """Over open services."""
        self._desk = desk
        self._vault = vault
        self._runner = runner
        self._settings = settings
        self._is_closed = threading.Event()

    def close(self) -> None:
        """Hand in nothing from now on: what ends because its child is taken away is another worker's to do again."""
        self._is_closed.set()

    def do(self, job_id: str) -> None:
        """Do the job, if anybody still waits for it, and hand in what came of it.

        A database or store that is away meanwhile is waited for.
        """
        job = job_of(job_id)
        trace = JobTrace(job.kind, current_request())
        try:
            self._do(job, trace)
        finally:
            trace_job(trace)

    def _do(self, job: Job, trace: JobTrace) -> None:
        started = time.monotonic()
        try:
            case = patiently(lambda: self._desk.take_up(job), FOR_EVER_S)
            handed = None if case is None else self._handed(job, case, trace)
        except StartedTooOften:
            log.error("a job was started too often and is given up", extra={"job_id": job.id})
            handed = Handed("failed", reason=FAILED.to_json())
        if self._is_closed.is_set():
            trace.outcome = "put back"
        elif handed is None:
            trace.outcome = "cancelled"
        else:
            self._hand_in(job, handed)
            trace.outcome = handed.status
            JOBS.labels(job.kind, handed.status).inc()
            JOB_SECONDS.labels(job.kind).observe(time.monotonic() - started)
            log.info("a job ended", extra={"job_id": job.id, "outcome": handed.status})

    def _handed(self, job: Job, case: Case, trace: JobTrace) -> Handed | None:
        """What the job ends with; None when nobody waits for it any more."""
        try:
            ended = self._run(job, case, trace)
            CHILD_ENDS.labels(ended.status).inc()
            return None if ended.status == "cancelled" else _handed(job, ended)
        except FileNotFound:
            return None  # deleted meanwhile
        except Exception as error:
            count_fault(error)
            log.exception("a job failed", extra={"job_id": job.id})
            return Handed("failed", reason=(COME_BACK if is_away(error) else FAILED).to_json())

    def _hand_in(self, job: Job, handed: Handed) -> None:
        try:
            patiently(lambda: self._desk.hand_in(job, handed), STORE_PATIENCE_S)
        except FileNotFound:
            return  # deleted meanwhile
        except Exception as error:
            if not is_away(error):
                raise
            count_fault(error)
            log.exception("a result could not be kept", extra={"job_id": job.id})
            come_back = Handed("failed", reason=COME_BACK.to_json())
            patiently(lambda: self._desk.hand_in(job, come_back), FOR_EVER_S)

    def give_up(self, job: Job) -> None:
        """Hand a job in as failed: it was started again and again and never came to an end."""
        self._desk.hand_in(job, Handed("failed", reason=FAILED.to_json()))

    def _run(self, job: Job, case: Case, trace: JobTrace) -> ChildResult:
        tasks = self._settings.tasks
        scan = patiently(lambda: self._vault.read(case.id, "scan"), STORE_PATIENCE_S)
        payload = Bundle(self._facts(case), {"scan": scan}).to_bytes()
        return self._runner.run(
            tasks.check if job.kind == "check" else tasks.locate,
            payload,
            self._settings.limits,
            _Teller(self._desk, job, trace),
            _Watch(self._desk, job),
        )

    def _facts(self, case: Case) -> dict[str, Any]:
        references = self._settings.references()
        return {
            "age_years": case.age_years,
            "sex": case.sex,
            "posture": case.posture,
            "answers": dict(case.answers),
            "unit": case.unit,
            "method": case.method,
            "landmarks": dict(case.landmarks or {}),
            "references": None if references is None else str(references),
        }


def _handed(job: Job, ended: ChildResult) -> Handed:
    """What a child's end means for the case. A crash, a limit or a bundle that does not open: it cannot be read."""
    if ended.status in ("refused", "unreadable"):
        return Handed("refused", reason=_reason(json.loads(ended.payload)))
    if ended.status == "error":
        return Handed("failed", reason=FAILED.to_json())
    if ended.status != "ok":
        is_heavy = ended.status in ("memory", "timeout")
        return Handed("refused", reason=(TOO_HEAVY if is_heavy else BREAKS_READER).to_json())
    try:
        bundle = Bundle.from_bytes(ended.payload)
    except BadBundle:
        return Handed("refused", reason=BREAKS_READER.to_json())
    files = {name: bundle.parts[name] for name in FILES[job.kind] if name in bundle.parts}
    if job.kind == "check":
        return Handed("awaiting_landmarks", files)
    if bundle.facts["verdict"] in get_args(VerdictWord):
        VERDICTS.labels(bundle.facts["verdict"]).inc()
    if bundle.facts["verdict"] == "refuse":
        return Handed("refused", files, _reason(bundle.facts["reason"]))
    return Handed("done", files)


def _reason(said: Mapping[str, Any]) -> dict[str, str]:
    """A reason out of a child: its three texts and nothing else. Raises when it is none."""
    return Reason(str(said["code"]), str(said["message"]), str(said["advice"])).to_json()


class _Teller:
    """Passes progress on: a new stage at once, steps within one now and then."""

    def __init__(self, desk: WorkDesk, job: Job, trace: JobTrace) -> None:
        self._desk = desk
        self._job = job
        self._trace = trace
        self._stage = ""
        self._stage_began = self._told_at = 0.0

    def __call__(self, stage: str, fraction: float) -> None:
        moment = time.monotonic()
        if stage != self._stage or moment - self._told_at >= TELL_EVERY_S:
            if stage != self._stage:
                self._note_stage(moment)
                if stage in STAGES:
                    self._trace.note_stage(stage)
            self._stage, self._told_at = stage, moment
            with _unless_away():
                self._desk.tell(self._job, stage, fraction)

    def _note_stage(self, moment: float) -> None:
        """Stages are named by the child, so only names that are ours become labels."""
        if self._stage in STAGES:
            STAGE_SECONDS.labels(self._stage).observe(moment - self._stage_began)
        self._stage_began = moment


class _Watch:
    """Says whether the job was cancelled, asking the database now and then."""

    def __init__(self, desk: WorkDesk, job: Job) -> None:
        self._desk = desk
        self._job = job
        self._looked_at = 0.0
        self._is_over = False

    def __call__(self) -> bool:
        moment = time.monotonic()
        if not self._is_over and moment - self._looked_at >= LOOK_EVERY_S:
            self._looked_at = moment
            with _unless_away():
                self._is_over = not self._desk.is_current(self._job)
        return self._is_over


@contextmanager
def _unless_away() -> Iterator[None]:
    """The child's work goes on while nobody can be told of it, or asked whether it is still wanted."""
    try:
        yield
    except Exception as error:
        if not is_away(error):
            raise
        log.warning("the database is away while a job runs: %s", type(error).__name__)
