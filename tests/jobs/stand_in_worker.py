"""A real worker that runs the stand-in tasks: python -m tests.jobs.stand_in_worker."""

from __future__ import annotations

from lubdub.jobs.work import TaskNames
from lubdub.jobs.worker import main

if __name__ == "__main__":
    main(TaskNames("tests.jobs.stand_in_tasks:examine", "tests.jobs.stand_in_tasks:locate"))
