"""Settings that do not go together: refused at the start, and by the command that shows them, in the same words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from lubdub.safety import FAULTS, WARNINGS, faults, warnings
from lubdub.settings import Settings, SettingsTable
from tests.test_cli import Run, run

__all__ = ["run"]

PUBLIC = {"behind_tls_proxy": True}
KEY = "AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8="
UNSAFE: dict[str, tuple[dict[str, Any], str]] = {
    "open to a network without HTTPS": ({"host": "0.0.0.0"}, "LUBDUB_BEHIND_TLS_PROXY"),
    "people come by http": ({"public_url": "http://lubdub.example"}, "LUBDUB_PUBLIC_URL"),
    "a proxy that is no address": ({"trusted_proxies": "127.0.0.1, proxy"}, "LUBDUB_TRUSTED_PROXIES"),
    "less a day than one scan": ({"tenant_mb_per_day": 1}, "LUBDUB_TENANT_MB_PER_DAY"),
    "numbers for everybody": ({"metrics_host": "0.0.0.0"}, "LUBDUB_METRICS_TOKEN"),
    "a collector without http": ({"otlp_url": "collector:4318"}, "LUBDUB_OTLP_URL"),
    "a login by http": ({"oidc_issuer": "http://login.example", "oidc_client_id": "x"}, "LUBDUB_OIDC_ISSUER"),
    "a login without a name": ({"oidc_issuer": "https://login.example"}, "LUBDUB_OIDC_CLIENT_ID"),
    "a login with an example's secret": ({"oidc_client_secret": "changeme"}, "LUBDUB_OIDC_CLIENT_SECRET"),
    "a master key twice, as text and file": ({"master_key": KEY, "master_key_file": "/k"}, "LUBDUB_MASTER_KEY_FILE"),
    "a master key twice, as text and service": (
        {"master_key": KEY, "master_key_command": "kms"},
        "LUBDUB_MASTER_KEY_COMMAND",
    ),
    "a master key of zeros": ({"master_key": "A" * 43 + "="}, "can be guessed"),
    "an old master key of zeros": ({"master_key": f"{KEY},{'A' * 43}="}, "can be guessed"),
    "a database with an example's password": (
        {"database_url": "postgresql://lubdub:lubdub@db.example/lubdub"},
        "LUBDUB_DATABASE_URL",
    ),
    "a queue with an example's password": (
        {"jobs_database_url": "postgresql://lubdub:Postgres@db.example/lubdub"},
        "LUBDUB_JOBS_DATABASE_URL",
    ),
    "a store with an example's password": (
        {"store_url": "s3://minioadmin:minioadmin@bucket?endpoint=http://127.0.0.1:9000"},
        "LUBDUB_STORE_URL",
    ),
    "the key among the files": (
        {"store_url": "file:///srv/lubdub", "master_key_file": "/srv/lubdub/keys/master.key"},
        "LUBDUB_MASTER_KEY_FILE",
    ),
}
DOUBTFUL: dict[str, tuple[dict[str, Any], str]] = {
    "the key in the data folder, for a service that others reach": (PUBLIC, "LUBDUB_MASTER_KEY_FILE"),
    "webhooks into private networks, for a service that others reach": (
        PUBLIC | {"webhooks_to_private": True, "master_key": KEY},
        "LUBDUB_WEBHOOKS_TO_PRIVATE",
    ),
    "a database that may be spoken to in the clear": (
        {"database_url": "postgresql://lubdub:hr7Gm2@db.example/lubdub"},
        "sslmode=require",
    ),
    "traces in the clear": ({"otlp_url": "http://collector.example:4318"}, "LUBDUB_OTLP_URL"),
    "scans kept for years": ({"retention_days": 1000}, "LUBDUB_RETENTION_DAYS"),
}
SAFE: dict[str, dict[str, Any]] = {
    "one machine": {},
    "tests on one machine": {"webhooks_to_private": True, "public_url": "http://localhost:8000"},
    "a clinic": PUBLIC
    | {
        "host": "0.0.0.0",
        "public_url": "https://lubdub.example",
        "master_key_file": "/etc/lubdub/master.key",
        "database_url": "postgresql://lubdub:hr7Gm2@db.example/lubdub?sslmode=verify-full",
        "store_url": "s3://lubdub:x9Kq3z@bucket?endpoint=https://s3.example",
        "oidc_issuer": "https://login.example",
        "oidc_client_id": "lubdub",
        "oidc_client_secret": "9fKw2p",
    },
    "a key service": PUBLIC | {"master_key_command": "kms"},
    "a local collector": {"otlp_url": "http://127.0.0.1:4318"},
    "a local database": {"database_url": "postgresql://postgres:postgres@127.0.0.1/lubdub"},
}


@pytest.mark.parametrize("name", UNSAFE)
def test_an_unsafe_combination_is_refused_with_the_setting_to_change(name: str) -> None:
    chosen, words = UNSAFE[name]
    (said,) = faults(SettingsTable(**chosen))
    assert words in said
    with pytest.raises(ValidationError, match=words):
        Settings(**chosen)


@pytest.mark.parametrize("name", DOUBTFUL)
def test_a_doubtful_combination_starts_with_a_warning(name: str) -> None:
    chosen, words = DOUBTFUL[name]
    (said,) = warnings(Settings(**chosen))
    assert words in said


@pytest.mark.parametrize("name", SAFE)
def test_a_sound_combination_is_not_complained_about(name: str) -> None:
    assert warnings(Settings(**SAFE[name])) == []


def test_every_check_has_a_row_that_it_alone_finds() -> None:
    found = {check for check in FAULTS for chosen, _ in UNSAFE.values() if check(SettingsTable(**chosen))}
    found |= {check for check in WARNINGS for chosen, _ in DOUBTFUL.values() if check(SettingsTable(**chosen))}
    assert found == {*FAULTS, *WARNINGS}


def test_settings_are_shown_with_their_source_and_without_secrets(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LUBDUB_MASTER_KEY", KEY)
    monkeypatch.setenv("LUBDUB_OIDC_CLIENT_SECRET", "9fKw2p")
    monkeypatch.setenv("LUBDUB_DATABASE_URL", "postgresql://lubdub:hr7Gm2@127.0.0.1/lubdub")
    monkeypatch.setenv("LUBDUB_STORE_URL", "s3://lubdub:x9Kq3z@bucket?endpoint=https://s3.example")
    code, out, _ = run("admin", "settings")
    assert code == 0
    for secret in (KEY, "9fKw2p", "hr7Gm2", "x9Kq3z"):
        assert secret not in out
    assert "LUBDUB_MASTER_KEY=(hidden)  [environment]" in out
    assert "LUBDUB_DATABASE_URL=postgresql://lubdub:(hidden)@127.0.0.1/lubdub  [environment]" in out
    assert "LUBDUB_PORT=8000  [default]" in out


def test_unsafe_settings_are_shown_all_the_same_and_called_unsafe(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LUBDUB_HOST", "0.0.0.0")
    code, out, _ = run("admin", "settings")
    assert code == 1
    assert "LUBDUB_HOST=0.0.0.0  [environment]" in out
    assert "UNSAFE: Listening on 0.0.0.0 without HTTPS" in out


def test_a_setting_that_means_nothing_is_one_sentence(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LUBDUB_PORT", "eighty")
    code, _, err = run("admin", "settings")
    assert (code, err.count("\n")) == (2, 1)
    assert "port" in err


def test_settings_come_whole_to_a_process_started_beside(tmp_path: Path) -> None:
    chosen = Settings(data_dir=tmp_path, master_key=KEY, oidc_client_secret="9fKw2p")
    told = chosen.to_environment()
    assert (told["LUBDUB_MASTER_KEY"], told["LUBDUB_OIDC_CLIENT_SECRET"]) == (KEY, "9fKw2p")
