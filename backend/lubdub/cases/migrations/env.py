"""Alembic's door: it is always handed an open connection by `Database`, inside one transaction."""

from __future__ import annotations

from alembic import context

from lubdub.cases.models import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    transaction_per_migration=False,
)
context.run_migrations()
