"""Calls that must not happen twice: a caller's idempotency key, and what came of its first call."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta

from sqlalchemy.orm import Session

from lubdub.cases.clock import now
from lubdub.cases.errors import IdempotencyMismatch
from lubdub.cases.models import IdempotencyRow
from lubdub.cases.values import Actor

REMEMBERED = timedelta(hours=24)
"""How long an idempotency key is honoured."""


@dataclass(frozen=True)
class Repeatable:
    """A caller's idempotency key and the SHA-256 of the call it came with: its address and its body."""

    key: str
    call_sha256: str


def remembered(session: Session, actor: Actor, repeatable: Repeatable | None) -> str | None:
    """The id of what the same call made or changed before, or None. Raises IdempotencyMismatch for another call."""
    row = None if repeatable is None else session.get(IdempotencyRow, (actor.name, repeatable.key))
    if repeatable is None or row is None:
        return None
    if row.created_at < now() - REMEMBERED:
        session.delete(row)
        session.flush()
        return None
    if row.body_sha256 != repeatable.call_sha256:
        raise IdempotencyMismatch(repeatable.key)
    return row.case_id


def remember(session: Session, actor: Actor, repeatable: Repeatable | None, made_id: str) -> None:
    """Note, inside the call's transaction, what it made or changed."""
    if repeatable is not None:
        session.add(
            IdempotencyRow(
                owner=actor.name,
                key=repeatable.key,
                body_sha256=repeatable.call_sha256,
                case_id=made_id,
                created_at=now(),
            )
        )
