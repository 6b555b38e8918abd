"""The reviews' table: one row for every act of a clinician on a case, added and never changed."""

from __future__ import annotations

from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.orm import Mapped, mapped_column

from lubdub.cases.models import Base


class ReviewStepRow(Base):
    """One act. run: the job whose result was reviewed; said: area, position, landmarks, reason or note, by the deed."""

    __tablename__ = "review_steps"
    case_id: Mapped[str] = mapped_column(sa.ForeignKey("cases.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    run: Mapped[str] = mapped_column(sa.String(128))
    deed: Mapped[str] = mapped_column(sa.String(16))
    by: Mapped[str] = mapped_column(sa.String(140))
    by_name: Mapped[str] = mapped_column(sa.String(200))
    at: Mapped[datetime]
    said: Mapped[dict[str, Any]]
