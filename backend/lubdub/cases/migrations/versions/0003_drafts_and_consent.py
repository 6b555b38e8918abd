"""Answers before the case, and consent, person and guide in it."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Bring the tables to this revision."""
    op.create_table(
        "drafts",
        sa.Column("session_id", sa.String(length=64), nullable=False),
        sa.Column("sealed", sa.LargeBinary(), nullable=False),
        sa.Column("updated_at", sa.DateTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["session_id"],
            ["family_sessions.id"],
        ),
        sa.PrimaryKeyConstraint("session_id"),
    )
    op.add_column("cases", sa.Column("person", sa.String(length=16), server_default="child", nullable=False))
    op.add_column("cases", sa.Column("consent", sa.JSON(none_as_null=True), nullable=True))
    op.add_column("cases", sa.Column("guide_app", sa.String(length=32), nullable=True))
    op.add_column("cases", sa.Column("guide_is_read", sa.Boolean(), server_default=sa.false(), nullable=False))


def downgrade() -> None:
    """Bring the tables back to the revision before."""
    for column in ("guide_is_read", "guide_app", "consent", "person"):
        op.drop_column("cases", column)
    op.drop_table("drafts")
