"""Does the database take a row, give it back, and let it go?"""

from __future__ import annotations

import secrets

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.cases.models_desk import AttemptRow


class ProbeFailed(Exception):
    """What was written is not there."""


def probe_database(database: Database) -> None:
    """Write, read and delete a row of no meaning. Raises ProbeFailed or sqlalchemy.exc.SQLAlchemyError."""
    name = secrets.token_hex(32)
    with database.writing() as session:
        session.add(AttemptRow(subject_sha256=name, count=0, since=now()))
    with database.writing() as session:
        row = session.get(AttemptRow, name)
        if row is None:
            raise ProbeFailed
        session.delete(row)
