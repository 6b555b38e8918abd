"""Handing jobs over to workers, durably. `JobEngine` is all the rest of Lubdub knows; DBOS stands behind it."""

from __future__ import annotations

import logging
from collections.abc import Collection, Mapping
from typing import Literal, Protocol

import sqlalchemy as sa
import structlog
from dbos import DBOSClient, EnqueueOptions, error
from sqlalchemy.exc import SQLAlchemyError

from lubdub.cases.values import Job

QUEUE = "cases"
WORKFLOW = "work_on_case"
APPLICATION = "lubdub"
APPLICATION_VERSION = "1"
"""Said explicitly: by default it is a hash of the source, and an upgrade would strand waiting jobs."""

POLL_S = 0.1
"""A free worker looks into the queue so often. At 0.4 s a twelfth of a busy worker's time went by waiting."""
UNTIL_INPUT_CLOSES = "--until-input-closes"
"""Told to a worker that its own web process starts: it ends with that process, whatever became of it."""
LAST_TURN = 2**31 - 1
"""The largest number that DBOS takes for a place in the queue; the smallest goes first."""

JobState = Literal["unknown", "waiting", "running", "ended"]

_STATES: dict[str, JobState] = {"ENQUEUED": "waiting", "DELAYED": "waiting", "PENDING": "running"}

log = logging.getLogger(__name__)


class JobEngine(Protocol):
    """A durable queue. A job is known by its id; submitting the same job again changes nothing."""

    def submit(self, job: Job) -> None:
        """Have a worker take the job up. The case's row is committed before this is called."""

    def cancel(self, job_id: str) -> None:
        """Keep a waiting job from starting. A running one looks at its case's row and stops by itself."""

    def states(self, job_ids: Collection[str]) -> Mapping[str, JobState]:
        """Where each job is."""

    def close(self) -> None:
        """Give the connections back."""


def current_request() -> str:
    """The id of the call at work, as the logs have it; empty for what nobody called for."""
    return str(structlog.contextvars.get_contextvars().get("request_id", ""))


def jobs_url(url: str) -> str:
    """The URL as DBOS wants it: PostgreSQL by psycopg 3."""
    parsed = sa.make_url(url)
    if parsed.get_backend_name() == "postgresql":
        parsed = parsed.set(drivername="postgresql+psycopg")
    return parsed.render_as_string(hide_password=False)


class DbosEngine:
    """The engine as the web process sees it: it enqueues, and runs nothing."""

    def __init__(self, jobs_database_url: str) -> None:
        """Connects when it is first used; the tables are made by the first worker."""
        self._client = DBOSClient(
            system_database_url=jobs_url(jobs_database_url), lazy=True, retry_connection_errors=False
        )

    def submit(self, job: Job) -> None:
        """Enqueue. When the queue cannot be reached the row stands, and a worker finds it (`worker.sweep`)."""
        options: EnqueueOptions = {
            "workflow_name": WORKFLOW,
            "queue_name": QUEUE,
            "workflow_id": job.id,
            "app_version": APPLICATION_VERSION,
            "application_name": APPLICATION,
            "priority": min(job.turn, LAST_TURN),
        }
        try:
            self._client.enqueue(options, job.id, current_request())
        except (error.DBOSException, SQLAlchemyError) as fault:
            log.warning("a job could not be enqueued and waits for a worker's sweep: %s", type(fault).__name__)

    def cancel(self, job_id: str) -> None:
        """Cancel. When the queue cannot be reached the job still finds out from its case's row."""
        try:
            self._client.cancel_workflow(job_id)
        except (error.DBOSException, SQLAlchemyError) as fault:
            log.warning("a job could not be cancelled in the queue: %s", type(fault).__name__)

    def states(self, job_ids: Collection[str]) -> Mapping[str, JobState]:
        """As the queue's tables say."""
        states: dict[str, JobState] = dict.fromkeys(job_ids, "unknown")
        if states:
            found = self._client.list_workflows(workflow_ids=list(job_ids), load_input=False, load_output=False)
            states |= {one.workflow_id: _STATES.get(one.status, "ended") for one in found}
        return states

    def close(self) -> None:
        """Give the connections back."""
        self._client.destroy()
