"""The courier: takes due messages out of the outbox, signs them by Standard Webhooks, and carries them to portals."""

from __future__ import annotations

import asyncio
import logging
import threading
import time

import httpx
from standardwebhooks import Webhook

from lubdub.cases.clock import now
from lubdub.cases.outbox import Message, Outbox, Tried
from lubdub.jobs.addresses import AddressRefused, Destination, destination
from lubdub.jobs.metrics import WEBHOOK_TRIES

LOOK_EVERY_S = 1.0
ANSWER_S = 10.0
"""From connecting to the end of the answer's headers, all together: no receiver can hold a courier by dripping."""
COURIERS = 4
"""Messages carried at the same moment, so that one slow receiver does not hold up the others."""

log = logging.getLogger(__name__)


class Couriers:
    """Threads beside a worker's jobs, until `stopping` is set. What they leave undone is due again after its lease."""

    def __init__(self, outbox: Outbox, allow_private: bool, stopping: threading.Event) -> None:
        """allow_private: whether private addresses may be called."""
        self._outbox = outbox
        self._allow_private = allow_private
        self._stopping = stopping

    def start(self) -> None:
        """Start them."""
        for number in range(COURIERS):
            threading.Thread(target=self._run, daemon=True, name=f"courier-{number}").start()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                carried = self.carry_one()
            except Exception:  # a database that is away comes back; messages wait in it meanwhile
                log.exception("a courier failed and tries again")
                carried = False
            if not carried:
                self._stopping.wait(LOOK_EVERY_S)

    def carry_one(self) -> bool:
        """Try one message that is due. False when none is."""
        message = self._outbox.take()
        if message is None:
            return False
        started, at = time.monotonic(), now()
        status, fault = self._sent(message)
        milliseconds = round((time.monotonic() - started) * 1000)
        self._outbox.note(message, Tried(at, status, fault, milliseconds))
        WEBHOOK_TRIES.labels("arrived" if fault is None else "failed").inc()
        log.info("a message was tried", extra={"message": message.id, "status": status, "number": message.number})
        return True

    def _sent(self, message: Message) -> tuple[int | None, str | None]:
        """The answer's status, and why the message did not arrive. Redirects are not followed."""
        try:
            place = destination(message.url, self._allow_private)
            status = asyncio.run(asyncio.wait_for(_post(place, message), ANSWER_S))
        except AddressRefused as refused:
            return None, str(refused)
        except TimeoutError:
            return None, "The receiver did not answer in time."
        except httpx.HTTPError as fault:
            return None, f"The receiver could not be reached ({type(fault).__name__})."
        if 200 <= status < 300:
            return status, None
        return status, "The receiver did not take it: only an answer from 200 to 299 counts."


async def _post(place: Destination, message: Message) -> int:
    """The status of the answer, whose body is not read."""
    async with (
        httpx.AsyncClient(timeout=None, trust_env=False, follow_redirects=False) as http,  # nosec B113 (see ANSWER_S)
        http.stream(
            "POST",
            place.pinned_url,
            content=message.body.encode(),
            headers=signed_headers(message) | {"Host": place.authority},
            extensions={"sni_hostname": place.host},
        ) as answer,
    ):
        return answer.status_code


def signed_headers(message: Message) -> dict[str, str]:
    """The headers of Standard Webhooks: id, time of this try, and a signature by each living secret."""
    moment = now()
    signatures = [Webhook(secret).sign(message.id, moment, message.body) for secret in message.secrets]
    return {
        "Content-Type": "application/json",
        "User-Agent": "Lubdub",
        "webhook-id": message.id,
        "webhook-timestamp": str(int(moment.timestamp())),
        "webhook-signature": " ".join(signatures),
    }
