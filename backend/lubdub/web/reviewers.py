"""Who looks at a case when its family sends it."""

from __future__ import annotations

from lubdub.cases.staff import Staff
from lubdub.cases.values import FAMILIES, Case
from lubdub.settings import Settings


def reviewer_name(case: Case, staff: Staff, settings: Settings) -> str:
    """Their name as the family knows it; empty when nobody looks, so that nothing can be sent."""
    if case.tenant_id == FAMILIES and settings.clinic_name:
        return settings.clinic_name
    return staff.clinicians.reviewer_of(case.tenant_id) or settings.clinic_name
