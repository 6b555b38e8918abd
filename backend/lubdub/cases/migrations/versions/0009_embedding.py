"""Which pages may frame a tenant's cases, and sessions that live inside such a page."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Bring the tables to this revision."""
    op.add_column("tenants", sa.Column("embed_origins", sa.JSON(none_as_null=True), nullable=True))
    with op.batch_alter_table("family_sessions") as table:
        table.add_column(sa.Column("portal_id", sa.String(length=64), nullable=True))
        table.create_foreign_key("fk_family_sessions_portal", "tenants", ["portal_id"], ["id"])


def downgrade() -> None:
    """Bring the tables back to the revision before."""
    with op.batch_alter_table("family_sessions") as table:
        table.drop_constraint("fk_family_sessions_portal", type_="foreignkey")
        table.drop_column("portal_id")
    with op.batch_alter_table("tenants") as table:
        table.drop_column("embed_origins")
