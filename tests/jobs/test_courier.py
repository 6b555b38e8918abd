"""Messages to portals: signed, tried until they arrive, written down, and never about a person."""

from __future__ import annotations

import contextlib
import json
import socket
import ssl
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import sqlalchemy as sa
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from standardwebhooks import Webhook, WebhookVerificationError

from lubdub.cases.errors import DeliveryNotFound, WebhookNotFound
from lubdub.cases.models_webhooks import DeliveryRow
from lubdub.cases.outbox import WAITS, Outbox
from lubdub.cases.values import Actor
from lubdub.cases.webhooks import Webhooks
from lubdub.jobs.courier import Couriers
from tests.cases.conftest import Room, girl_of_six, room
from tests.receiver import Receiver, receiver

__all__ = ["room"]


@dataclass
class Line:
    """A portal with a webhook at a receiver, and the courier between."""

    room: Room
    portal: Actor
    webhooks: Webhooks
    courier: Couriers
    receiver: Receiver
    id: str
    secret: str

    def open_case(self) -> str:
        return self.room.store.create(self.portal, girl_of_six(external_id="Emma Example"))[0].id

    def wait_over(self) -> None:
        """As if the time until the next try had passed."""
        with self.room.database.writing() as session:
            waiting = DeliveryRow.due_at.is_not(None)
            session.execute(sa.update(DeliveryRow).where(waiting).values(due_at=DeliveryRow.created_at))


@pytest.fixture
def line(room: Room) -> Iterator[Line]:
    portal, webhooks = room.portal(), Webhooks(room.database, room.vault)
    courier = Couriers(Outbox(room.database, room.vault), True, threading.Event())
    with receiver() as told:
        made = webhooks.create(portal, told.url, ["awaiting_scan", "deleted"])
        assert made.secret is not None
        yield Line(room, portal, webhooks, courier, told, made.id, made.secret)


def test_a_change_is_told_signed_and_without_a_word_about_the_person(line: Line) -> None:
    case = line.open_case()
    assert line.courier.carry_one()
    [(headers, body)] = line.receiver.taken
    said = Webhook(line.secret).verify(body, headers)
    assert said["type"] == "case.awaiting_scan"
    assert said["data"] == {"id": case, "status": "awaiting_scan"}
    assert set(said) == {"type", "timestamp", "data"}
    with pytest.raises(WebhookVerificationError):
        Webhook(line.secret).verify(body.replace(case.encode(), b"other"), headers)
    assert line.webhooks.deliveries(line.portal, line.id, 9)[0].state == "delivered"
    assert not line.courier.carry_one()


def test_a_deletion_is_told_too_and_other_states_are_not(line: Line) -> None:
    case = line.open_case()
    line.room.store.receive_scan(line.portal, case, line.room.vault.seal(case, "scan", b"skin"), None)
    line.room.privacy.delete(line.portal, case)
    while line.courier.carry_one():
        pass
    assert [json.loads(body)["type"] for _, body in line.receiver.taken] == ["case.awaiting_scan", "case.deleted"]


def test_another_tenants_case_is_not_told(line: Line) -> None:
    line.room.store.create(line.room.portal("other"), girl_of_six())
    line.room.store.create(line.room.family(), girl_of_six())
    assert not line.courier.carry_one()


def test_a_failed_try_is_written_down_and_repeated_under_the_same_id(line: Line) -> None:
    line.receiver.answers = [500, 301, 204]
    line.open_case()
    for status in (500, 301):
        assert line.courier.carry_one()
        assert not line.courier.carry_one(), "it waits before the next try"
        delivery = line.webhooks.deliveries(line.portal, line.id, 1)[0]
        assert (delivery.state, delivery.attempts[-1].status) == ("waiting", status)
        assert delivery.attempts[-1].fault
        line.wait_over()
    assert line.courier.carry_one()
    delivery = line.webhooks.deliveries(line.portal, line.id, 1)[0]
    assert (delivery.state, len(delivery.attempts)) == ("delivered", 3)
    assert {headers["webhook-id"] for headers, _ in line.receiver.taken} == {delivery.id}


def test_after_about_a_day_a_message_is_given_up_and_can_be_sent_again(line: Line) -> None:
    assert timedelta(hours=20) < sum(WAITS, timedelta()) < timedelta(hours=28)
    line.receiver.answers = [503]
    line.open_case()
    for _ in range(len(WAITS) + 1):
        assert line.courier.carry_one()
        line.wait_over()
    assert not line.courier.carry_one()
    delivery = line.webhooks.deliveries(line.portal, line.id, 1)[0]
    assert (delivery.state, len(delivery.attempts)) == ("given_up", len(WAITS) + 1)
    line.receiver.answers = [200]
    line.webhooks.replay(line.portal, line.id, delivery.id)
    assert line.courier.carry_one()
    again = line.webhooks.deliveries(line.portal, line.id, 1)[0]
    assert (again.state, len(again.attempts)) == ("delivered", len(WAITS) + 2)


def test_a_message_whose_worker_died_is_taken_up_by_another(line: Line) -> None:
    line.open_case()
    left = Outbox(line.room.database, line.room.vault)
    assert left.take() is not None
    assert not line.courier.carry_one(), "the dead worker still has it"
    line.wait_over()
    assert line.courier.carry_one()
    assert len(line.receiver.taken) == 1


def test_a_receiver_that_is_gone_is_left_alone(line: Line) -> None:
    line.receiver.answers = [410]
    line.open_case()
    assert line.courier.carry_one()
    assert not line.webhooks.get(line.portal, line.id).is_enabled
    line.open_case()
    line.wait_over()
    assert not line.courier.carry_one()


def test_nobody_answering_is_a_sentence_in_the_log(line: Line) -> None:
    line.webhooks.change(line.portal, line.id, url="http://127.0.0.1:9/hook")
    line.open_case()
    assert line.courier.carry_one()
    tried = line.webhooks.deliveries(line.portal, line.id, 1)[0].attempts[0]
    assert tried.status is None
    assert tried.fault is not None
    assert tried.fault.endswith(".")


def test_a_receiver_that_drips_does_not_hold_the_courier(line: Line, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lubdub.jobs.courier.ANSWER_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def drip() -> None:
            connection, _ = server.accept()
            with connection, contextlib.suppress(OSError):
                for _ in range(100):
                    connection.sendall(b"H")
                    time.sleep(0.1)

        threading.Thread(target=drip, daemon=True).start()
        line.webhooks.change(line.portal, line.id, url=f"http://127.0.0.1:{server.getsockname()[1]}/")
        line.open_case()
        assert line.courier.carry_one()
    tried = line.webhooks.deliveries(line.portal, line.id, 1)[0].attempts[0]
    assert tried.fault == "The receiver did not answer in time."


def test_an_address_that_became_private_is_not_called(line: Line) -> None:
    careful = Couriers(Outbox(line.room.database, line.room.vault), False, threading.Event())
    line.webhooks.change(line.portal, line.id, url=line.receiver.url.replace("http:", "https:"))
    line.open_case()
    assert careful.carry_one()
    assert line.receiver.taken == []
    tried = line.webhooks.deliveries(line.portal, line.id, 1)[0].attempts[0]
    assert "private" in str(tried.fault)


def test_after_a_rotation_both_secrets_sign(line: Line) -> None:
    newer = line.webhooks.rotate(line.portal, line.id).secret
    assert newer not in (None, line.secret)
    line.open_case()
    line.courier.carry_one()
    [(headers, body)] = line.receiver.taken
    for secret in (line.secret, str(newer)):
        assert Webhook(secret).verify(body, headers)


def test_secrets_are_sealed_in_the_database(line: Line) -> None:
    with line.room.database.reading() as session:
        row = session.execute(sa.text("SELECT sealed_secret FROM webhooks")).scalar_one()
    assert line.secret.removeprefix("whsec_").encode() not in bytes(row)


def test_another_portals_webhook_is_not_there(line: Line) -> None:
    other = line.room.portal("other")
    line.open_case()
    message = line.webhooks.deliveries(line.portal, line.id, 1)[0].id
    for act in (line.webhooks.get, line.webhooks.rotate, line.webhooks.delete, line.webhooks.test):
        with pytest.raises(WebhookNotFound):
            act(other, line.id)
    with pytest.raises(WebhookNotFound):
        line.webhooks.deliveries(other, line.id, 9)
    mine = line.webhooks.create(other, line.receiver.url, ["done"])
    with pytest.raises(DeliveryNotFound):
        line.webhooks.replay(other, mine.id, message)
    assert [one.id for one in line.webhooks.all_of(other)] == [mine.id]


def self_signed(name: str, folder: Path) -> ssl.SSLContext:
    """A server's TLS with a certificate for this name that nobody vouches for."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    moment = datetime.now(UTC)
    certificate = (
        x509.CertificateBuilder(subject, subject, key.public_key(), x509.random_serial_number())
        .not_valid_before(moment - timedelta(days=1))
        .not_valid_after(moment + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(name)]), critical=False)
        .sign(key, hashes.SHA256())
    )
    pem = folder / "server.pem"
    secret = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    pem.write_bytes(secret + certificate.public_bytes(Encoding.PEM))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(pem)
    return context


def test_a_receiver_is_asked_for_by_its_name_and_nothing_is_said_before_it_proves_it(
    line: Line, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str | None] = []
    heard: list[bytes] = []
    context = self_signed("portal.example", tmp_path)
    context.sni_callback = lambda _socket, name, _context: asked.append(name)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with contextlib.suppress(OSError), context.wrap_socket(connection, server_side=True) as wrapped:
                heard.append(wrapped.recv(1000))

        listening = threading.Thread(target=serve, daemon=True)
        listening.start()
        port = server.getsockname()[1]
        here = [(socket.AF_INET, socket.SOCK_STREAM, 6, "", ("127.0.0.1", port))]
        monkeypatch.setattr("lubdub.jobs.addresses.socket.getaddrinfo", lambda *_args, **_more: here)
        line.webhooks.change(line.portal, line.id, url=f"https://portal.example:{port}/hook")
        line.open_case()
        assert line.courier.carry_one()
        monkeypatch.undo()
        listening.join(10)
    assert asked == ["portal.example"]
    assert not any(heard)
    tried = line.webhooks.deliveries(line.portal, line.id, 1)[0].attempts[0]
    assert (tried.status, tried.fault) == (None, "The receiver could not be reached (ConnectError).")
