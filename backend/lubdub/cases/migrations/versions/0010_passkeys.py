"""Passkeys, the challenges they sign, and links that renew an account's ways to sign in."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Bring the tables to this revision."""
    with op.batch_alter_table("invitations") as invitations:
        invitations.add_column(sa.Column("clinician_id", sa.String(length=64), nullable=True))
        invitations.create_foreign_key("fk_invitations_clinician_id", "clinicians", ["clinician_id"], ["id"])
    op.create_table(
        "passkeys",
        sa.Column("id", sa.String(length=64), nullable=False),
        sa.Column("clinician_id", sa.String(length=64), nullable=False),
        sa.Column("credential_id", sa.LargeBinary(length=1023), nullable=False),
        sa.Column("public_key", sa.LargeBinary(), nullable=False),
        sa.Column("sign_count", sa.BigInteger(), nullable=False),
        sa.Column("device", sa.String(length=200), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("last_used_at", sa.DateTime(), nullable=True),
        sa.ForeignKeyConstraint(["clinician_id"], ["clinicians.id"]),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("credential_id"),
    )
    op.create_index("ix_passkeys_clinician_id", "passkeys", ["clinician_id"])
    op.create_table(
        "challenges",
        sa.Column("browser_sha256", sa.String(length=64), nullable=False),
        sa.Column("challenge", sa.LargeBinary(), nullable=False),
        sa.Column("expires_at", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("browser_sha256"),
    )


def downgrade() -> None:
    """Bring the tables back to the revision before."""
    op.drop_table("challenges")
    op.drop_index("ix_passkeys_clinician_id", "passkeys")
    op.drop_table("passkeys")
    with op.batch_alter_table("invitations") as invitations:
        invitations.drop_constraint("fk_invitations_clinician_id", type_="foreignkey")
        invitations.drop_column("clinician_id")
