"""Keys that can be rotated and exchanged for short-lived tokens, and tenants that are sandboxes."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Bring the tables to this revision."""
    op.add_column("tenants", sa.Column("is_sandbox", sa.Boolean(), server_default=sa.false(), nullable=False))
    op.add_column("portal_keys", sa.Column("expires_at", sa.DateTime(), nullable=True))
    op.create_table(
        "access_tokens",
        sa.Column("token_sha256", sa.String(length=64), nullable=False),
        sa.Column("key_id", sa.String(length=64), nullable=False),
        sa.Column("scopes", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("expires_at", sa.DateTime(), nullable=False),
        sa.ForeignKeyConstraint(["key_id"], ["portal_keys.id"]),
        sa.PrimaryKeyConstraint("token_sha256"),
    )


def downgrade() -> None:
    """Bring the tables back to the revision before."""
    op.drop_table("access_tokens")
    with op.batch_alter_table("portal_keys") as table:
        table.drop_column("expires_at")
    with op.batch_alter_table("tenants") as table:
        table.drop_column("is_sandbox")
