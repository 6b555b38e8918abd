"""The caller's idempotency key, bound to the very call it came with."""

from __future__ import annotations

import hashlib
from typing import Annotated

from fastapi import Depends, Header, Request

from lubdub.cases.repeating import Repeatable

IdempotencyKey = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        description="Any text of your own. The same call with the same key happens once, for 24 hours.",
    ),
]


async def _repeatable(request: Request, idempotency_key: IdempotencyKey = None) -> Repeatable | None:
    if idempotency_key is None:
        return None
    call = f"{request.method} {request.url.path}?{request.url.query}\0".encode()
    return Repeatable(idempotency_key, hashlib.sha256(call + await request.body()).hexdigest())


RepeatableDep = Annotated[Repeatable | None, Depends(_repeatable)]
