"""How often a job was started, and when its turn is."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Bring the tables to this revision."""
    op.add_column("cases", sa.Column("job_starts", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("cases", sa.Column("job_turn", sa.Integer(), nullable=False, server_default="1"))


def downgrade() -> None:
    """Bring the tables back to the revision before."""
    with op.batch_alter_table("cases") as cases:
        cases.drop_column("job_turn")
        cases.drop_column("job_starts")
