"""Whom an organisation's own login means."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Bring the tables to this revision."""
    op.add_column("clinicians", sa.Column("login_sha256", sa.String(64), nullable=True))
    op.create_index("ix_clinicians_login_sha256", "clinicians", ["login_sha256"], unique=True)


def downgrade() -> None:
    """Bring the tables back to the revision before."""
    op.drop_index("ix_clinicians_login_sha256", "clinicians")
    with op.batch_alter_table("clinicians") as clinicians:
        clinicians.drop_column("login_sha256")
