"""Which settings do not go together. A fault keeps the service from starting; a warning is said and lived with."""

from __future__ import annotations

import base64
import binascii
import ipaddress
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol
from urllib.parse import parse_qs, unquote, urlsplit

from pydantic import SecretStr

LONG_RETENTION_DAYS = 365.0
GUESSED_FIRST = frozenset(
    {"admin", "changeme", "change-me", "lubdub", "minioadmin", "password", "postgres", "root", "secret", "test"}
)
"""Passwords out of examples: whoever attacks tries these first."""
ENCRYPTED_POSTGRES = frozenset({"require", "verify-ca", "verify-full"})


class Chosen(Protocol):
    """The settings that are looked at here; what each means stands in `settings.py`."""

    host: str
    behind_tls_proxy: bool
    trusted_proxies: str
    max_upload_mb: int
    family_mb_per_day: int
    tenant_mb_per_day: int
    public_url: str
    metrics_host: str
    metrics_token: SecretStr
    otlp_url: str
    data_dir: Path
    database_url: str
    jobs_database_url: str
    store_url: str
    master_key: SecretStr
    master_key_file: Path | None
    master_key_command: str
    oidc_issuer: str
    oidc_client_id: str
    oidc_client_secret: SecretStr
    retention_days: float
    webhooks_to_private: bool

    @property
    def store(self) -> str:
        """URL of the store."""


Check = Callable[[Chosen], str | None]


def is_loopback(host: str) -> bool:
    """Whether only programs on this machine can reach a server bound to host."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def faults(chosen: Chosen) -> list[str]:
    """Why the service must not start, each in one sentence with the way out."""
    return [said for check in FAULTS if (said := check(chosen)) is not None]


def warnings(chosen: Chosen) -> list[str]:
    """What is safe only under circumstances that nobody but the person who runs the service knows."""
    return [said for check in WARNINGS if (said := check(chosen)) is not None]


def _open_binding(chosen: Chosen) -> str | None:
    """Bodies of children must not cross a network in the clear."""
    if is_loopback(chosen.host) or chosen.behind_tls_proxy:
        return None
    return (
        f"Listening on {chosen.host} without HTTPS would send scans of bodies in the clear. Listen on 127.0.0.1, or "
        "put a TLS proxy in front and set LUBDUB_BEHIND_TLS_PROXY=true."
    )


def _plain_address(chosen: Chosen) -> str | None:
    address = urlsplit(chosen.public_url)
    if not chosen.public_url or address.scheme == "https" or is_loopback(address.hostname or ""):
        return None
    return "LUBDUB_PUBLIC_URL must begin with https://, or people would send scans of bodies in the clear."


def _blind_trust(chosen: Chosen) -> str | None:
    """Who may say where a call comes from may be anybody, and is counted as nobody."""
    for one in chosen.trusted_proxies.split(","):
        try:
            ipaddress.ip_network(one.strip())
        except ValueError:
            return (
                "LUBDUB_TRUSTED_PROXIES must be addresses or networks such as 10.0.0.0/8, separated by commas; "
                f"{one.strip()!r} is none."
            )
    return None


def _quotas_below_one_scan(chosen: Chosen) -> str | None:
    """A scan of the allowed size must fit into a day."""
    for name in ("family_mb_per_day", "tenant_mb_per_day"):
        if getattr(chosen, name) < chosen.max_upload_mb:
            return f"LUBDUB_{name.upper()} must be at least LUBDUB_MAX_UPLOAD_MB ({chosen.max_upload_mb})."
    return None


def _open_numbers(chosen: Chosen) -> str | None:
    """How much is going on is nobody's business."""
    if is_loopback(chosen.metrics_host) or chosen.metrics_token.get_secret_value():
        return None
    return "LUBDUB_METRICS_HOST other than this machine's own needs LUBDUB_METRICS_TOKEN beside it."


def _odd_collector(chosen: Chosen) -> str | None:
    if not chosen.otlp_url:
        return None
    wrong = "LUBDUB_OTLP_URL must be an address such as http://127.0.0.1:4318; /v1/traces is added to it."
    try:
        address = urlsplit(chosen.otlp_url)
        is_whole = address.scheme in ("http", "https") and address.hostname and address.port != 0
    except ValueError:
        return wrong
    return None if is_whole and not (address.query or address.fragment) else wrong


def _open_login(chosen: Chosen) -> str | None:
    """Whoever can change what a login says can be anybody here."""
    issuer = urlsplit(chosen.oidc_issuer)
    is_safe = issuer.scheme == "https" or (issuer.scheme == "http" and is_loopback(issuer.hostname or ""))
    return None if not chosen.oidc_issuer or is_safe else "LUBDUB_OIDC_ISSUER must be an https:// address."


def _login_without_name(chosen: Chosen) -> str | None:
    if not chosen.oidc_issuer or chosen.oidc_client_id:
        return None
    return "LUBDUB_OIDC_ISSUER needs LUBDUB_OIDC_CLIENT_ID beside it."


def _two_master_keys(chosen: Chosen) -> str | None:
    if not chosen.master_key.get_secret_value():
        return None
    for name, value in (("FILE", chosen.master_key_file), ("COMMAND", chosen.master_key_command)):
        if value:
            return f"LUBDUB_MASTER_KEY and LUBDUB_MASTER_KEY_{name} are two answers to one question. Set one of them."
    return None


def _guessable_master_key(chosen: Chosen) -> str | None:
    for text in filter(None, chosen.master_key.get_secret_value().split(",")):
        try:
            key = base64.b64decode(text.strip(), validate=True)
        except (binascii.Error, ValueError):
            continue  # said, in better words, where the key is used
        if len(set(key)) < len(key) // 4:
            return "LUBDUB_MASTER_KEY can be guessed. Make one: ./lubdub admin master-key new"
    return None


def _example_passwords(chosen: Chosen) -> str | None:
    for name in ("database_url", "jobs_database_url", "store_url"):
        url = urlsplit(getattr(chosen, name))
        is_far = url.scheme == "s3" or not is_loopback(url.hostname or "")
        if url.password and is_far and unquote(url.password).lower() in GUESSED_FIRST:
            return f"The password in LUBDUB_{name.upper()} is one out of examples. Choose another, at its server too."
    if chosen.oidc_client_secret.get_secret_value().lower() in GUESSED_FIRST:
        return "LUBDUB_OIDC_CLIENT_SECRET is one out of examples. Take the one that the login gave you."
    return None


def _key_beside_the_files(chosen: Chosen) -> str | None:
    """A copy of the store must not be a copy of the key."""
    store = urlsplit(chosen.store)
    if chosen.master_key_file is None or store.scheme != "file":
        return None
    if not chosen.master_key_file.resolve().is_relative_to(Path(unquote(store.path)).resolve()):
        return None
    return "LUBDUB_MASTER_KEY_FILE lies in the store of files that it seals. Put it elsewhere."


def _key_in_the_data_folder(chosen: Chosen) -> str | None:
    if not _is_public(chosen) or chosen.master_key.get_secret_value() or chosen.master_key_command:
        return None
    file = chosen.master_key_file or chosen.data_dir / "master.key"
    if not file.resolve().is_relative_to(chosen.data_dir.resolve()):
        return None
    return (
        "The master key lies in the data folder: whoever copies that folder can open everything. Put it elsewhere with "
        "LUBDUB_MASTER_KEY_FILE, or under a key service with LUBDUB_MASTER_KEY_COMMAND."
    )


def _webhooks_inside(chosen: Chosen) -> str | None:
    if not chosen.webhooks_to_private or not _is_public(chosen):
        return None
    return (
        "LUBDUB_WEBHOOKS_TO_PRIVATE lets a portal's key make this machine call others in its network. That is right "
        "only in a closed network."
    )


def _plain_database(chosen: Chosen) -> str | None:
    for name in ("database_url", "jobs_database_url"):
        url = urlsplit(getattr(chosen, name))
        is_far = url.scheme.startswith("postgresql") and not is_loopback(url.hostname or "localhost")
        if is_far and parse_qs(url.query).get("sslmode", ["prefer"])[-1] not in ENCRYPTED_POSTGRES:
            return f"LUBDUB_{name.upper()} may be spoken to in the clear: add ?sslmode=require, or own the network."
    return None


def _plain_traces(chosen: Chosen) -> str | None:
    if _odd_collector(chosen) is not None:
        return None  # said there
    address = urlsplit(chosen.otlp_url)
    if address.scheme != "http" or is_loopback(address.hostname or ""):
        return None
    return "LUBDUB_OTLP_URL sends traces in the clear: use https://, or own the network. They name no case or person."


def _kept_long(chosen: Chosen) -> str | None:
    if chosen.retention_days <= LONG_RETENTION_DAYS:
        return None
    return f"LUBDUB_RETENTION_DAYS keeps scans of bodies for {chosen.retention_days:g} days. Is that in your consent?"


def _is_public(chosen: Chosen) -> bool:
    return chosen.behind_tls_proxy or not is_loopback(urlsplit(chosen.public_url).hostname or "localhost")


FAULTS: tuple[Check, ...] = (
    _open_binding,
    _plain_address,
    _blind_trust,
    _quotas_below_one_scan,
    _open_numbers,
    _odd_collector,
    _open_login,
    _login_without_name,
    _two_master_keys,
    _guessable_master_key,
    _example_passwords,
    _key_beside_the_files,
)
WARNINGS: tuple[Check, ...] = (_key_in_the_data_folder, _webhooks_inside, _plain_database, _plain_traces, _kept_long)


def without_password(value: str) -> str:
    """A URL as it may be shown."""
    try:
        password = urlsplit(value).password
    except ValueError:
        return value
    return value if password is None else value.replace(f":{password}@", ":(hidden)@")


def told(chosen: Chosen) -> Iterator[str]:
    """All faults and warnings as lines."""
    yield from (f"UNSAFE: {said}" for said in faults(chosen))
    yield from (f"Warning: {said}" for said in warnings(chosen))
