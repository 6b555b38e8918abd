"""Clinicians' reviews: every act a row, and which cases were sent to them."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Bring the tables to this revision."""
    op.create_table(
        "review_steps",
        sa.Column("case_id", sa.String(length=64), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("run", sa.String(length=128), nullable=False),
        sa.Column("deed", sa.String(length=16), nullable=False),
        sa.Column("by", sa.String(length=140), nullable=False),
        sa.Column("by_name", sa.String(length=200), nullable=False),
        sa.Column("at", sa.DateTime(), nullable=False),
        sa.Column("said", sa.JSON(none_as_null=True), nullable=False),
        sa.ForeignKeyConstraint(["case_id"], ["cases.id"]),
        sa.PrimaryKeyConstraint("case_id", "number"),
    )
    op.add_column("cases", sa.Column("is_sent", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.execute("UPDATE cases SET is_sent = (1 = 1) WHERE status = 'in_review'")


def downgrade() -> None:
    """Bring the tables back to the revision before."""
    with op.batch_alter_table("cases") as cases:
        cases.drop_column("is_sent")
    op.drop_table("review_steps")
