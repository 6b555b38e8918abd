"""How many bytes of scans a family and an organisation may send in a day, so that nobody fills the store for all."""

from __future__ import annotations

import math

from lubdub.cases.rates import Budget, Rates
from lubdub.cases.values import Actor
from lubdub.jobs.metrics import REFUSED
from lubdub.settings import Settings
from lubdub.web.problems import Problem

DAY_S = 86_400.0
MEGABYTE = 1_000_000
STEP = 16 * MEGABYTE
"""A scan whose size was not announced is charged in steps, so that it ends before it is whole."""


class UploadQuotas:
    """What a scan costs is taken when it is begun or as it arrives; a broken upload is not given back."""

    def __init__(self, rates: Rates, settings: Settings) -> None:
        """Counted where calls are counted."""
        self._rates = rates
        self._of_family = settings.family_mb_per_day * MEGABYTE
        self._of_tenant = settings.tenant_mb_per_day * MEGABYTE

    def charge(self, actor: Actor, size: int) -> None:
        """Take so many bytes. Raises Problem `upload-quota`."""
        budgets = [Budget(f"scans of organisation {actor.tenant_id}", self._of_tenant, DAY_S)]
        if actor.kind == "family":
            budgets.insert(0, Budget(f"scans of family {actor.id}", self._of_family, DAY_S))
        taken = self._rates.take(budgets, size)
        if taken.wait_s > 0:
            REFUSED.labels("too many bytes").inc()
            wait = str(math.ceil(taken.wait_s))
            raise Problem("upload-quota", "Wait, or ask who runs this service for more.", {"Retry-After": wait})
