"""docker-compose.yml: valid, and with nothing in it that a security officer would send back."""

from __future__ import annotations

import json
import re
import shutil
import stat
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml
from compose_spec import PyCompose

from lubdub.cases.master_key import MasterKeySource, load
from lubdub.cases.object_store import open_store
from lubdub.commands.service import ROLES
from lubdub.settings import Settings
from tests.rules.source import ROOT

FILE = ROOT / "docker-compose.yml"
DEPLOY = ROOT / "backend" / "deploy"
GIVEN = {"LUBDUB_USER": "1000:1000", "LUBDUB_HOST": "lubdub.example", "LUBDUB_SECRETS": "/secrets"}
ONCE = {"bucket"}
"""Runs to its end, so that its exit code is its health."""
VARIABLE = re.compile(r"\$\{(\w+)(:?[-?][^}]*)?\}")


def raw() -> dict[str, Any]:
    return dict(yaml.safe_load(FILE.read_text()))


def filled(value: Any) -> Any:
    """With the variables put in, as compose does."""
    if isinstance(value, dict):
        return {key: filled(one) for key, one in value.items()}
    if isinstance(value, list):
        return [filled(one) for one in value]
    if isinstance(value, str):
        return VARIABLE.sub(lambda found: GIVEN[found[1]], value)
    return value


COMPOSE = filled(raw())
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
every_service = pytest.mark.parametrize("name", SERVICES)


def test_it_keeps_to_the_compose_specification() -> None:
    assert set(PyCompose.from_yaml(yaml.safe_dump(COMPOSE)).service_names()) == set(SERVICES)


def test_the_specification_is_really_checked() -> None:
    wrong = yaml.safe_load(yaml.safe_dump(COMPOSE))
    wrong["services"]["web"]["healtcheck"] = {}
    with pytest.raises(ValueError, match="healtcheck"):
        PyCompose.from_yaml(yaml.safe_dump(wrong))


@pytest.mark.skipif(
    shutil.which("docker") is None
    or subprocess.run(["docker", "compose", "version"], capture_output=True, check=False).returncode != 0,
    reason="docker compose is not here",
)
def test_docker_itself_takes_it(tmp_path: Path) -> None:
    folder = made_secrets(tmp_path)
    command = ["docker", "compose", "--env-file", str(folder / "env"), "-f", str(FILE), "config", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_role_can_be_scaled_but_what_holds_the_data() -> None:
    assert {"proxy", "web", "view", "worker", "database", "store"} <= set(SERVICES)
    scaled = {name: service for name, service in SERVICES.items() if name in ("web", "view", "worker")}
    for service in scaled.values():
        assert not {"container_name", "ports", "volumes"} & set(service)
        assert service["command"][0] in ROLES


def test_jobs_give_way_to_everything_else_when_processors_are_short() -> None:
    shares = {name: service.get("cpu_shares", 1024) for name, service in SERVICES.items()}
    assert shares.pop("worker") * 8 <= min(shares.values())


@every_service
def test_a_service_says_whether_it_is_healthy(name: str) -> None:
    if name in ONCE:
        assert SERVICES[name]["restart"] == "on-failure"
    else:
        assert SERVICES[name]["healthcheck"]["test"][0] == "CMD"


@every_service
def test_a_service_waits_for_what_it_needs_to_be_healthy_or_done(name: str) -> None:
    for needed, how in SERVICES[name].get("depends_on", {}).items():
        expected = "service_completed_successfully" if needed in ONCE else "service_healthy"
        assert how["condition"] == expected


@every_service
def test_a_service_runs_without_root_without_rights_and_writes_only_where_it_must(name: str) -> None:
    service = SERVICES[name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service.get("cap_add", []) == (["NET_BIND_SERVICE"] if name == "proxy" else [])
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert re.fullmatch(r"[1-9]\d*:[1-9]\d*", service["user"])
    assert not {"privileged", "pid", "ipc", "network_mode", "devices"} & set(service)
    for volume in service.get("volumes", []):
        assert volume.endswith(":ro") or volume.split(":")[0] in COMPOSE["volumes"]
        assert "docker.sock" not in volume


@every_service
def test_an_image_is_pinned_to_a_release(name: str) -> None:
    tag = SERVICES[name]["image"].rpartition(":")[2]
    assert re.match(r"v?\d+\.\d+", tag), tag


@every_service
def test_no_service_is_given_a_secret_in_the_open(name: str) -> None:
    for key, value in SERVICES[name].get("environment", {}).items():
        if re.search(r"PASSWORD|SECRET|TOKEN|KEY", key):
            assert str(value).startswith("/run/secrets"), key
    assert not re.search(r"(?i)(password|secret|token)\s*=\s*\w", json.dumps(SERVICES[name].get("command", "")))


def test_no_variable_has_a_default_so_that_nothing_starts_without_being_told() -> None:
    variables = VARIABLE.findall(FILE.read_text())
    assert {name for name, _ in variables} == set(GIVEN)
    assert {name for name, more in variables if not more.startswith(":?")} == set()


def test_secrets_come_from_files_alone() -> None:
    assert all(set(secret) == {"file"} for secret in COMPOSE["secrets"].values())
    wanted = {name for service in SERVICES.values() for name in service.get("secrets", [])}
    assert wanted == set(COMPOSE["secrets"])


def test_only_the_proxy_can_be_reached_from_outside() -> None:
    assert [name for name, service in SERVICES.items() if "ports" in service] == ["proxy"]
    reach_out = {name for name, service in SERVICES.items() if "outside" in service["networks"]}
    assert reach_out == {"proxy", "worker"}
    assert all(COMPOSE["networks"][name]["internal"] for name in ("front", "back"))
    assert "front" not in SERVICES["database"]["networks"] + SERVICES["store"]["networks"]


def test_the_proxys_word_counts_and_nobody_elses() -> None:
    subnet = COMPOSE["networks"]["front"]["ipam"]["config"][0]["subnet"]
    assert SERVICES["web"]["environment"]["LUBDUB_TRUSTED_PROXIES"] == subnet


def test_every_setting_it_names_exists() -> None:
    known = {f"LUBDUB_{name.upper()}" for name in Settings.model_fields} | {"LUBDUB_SECRETS_DIR"}
    for name in ("web", "view", "worker"):
        assert set(SERVICES[name]["environment"]) <= known


def made_secrets(folder: Path) -> Path:
    made = folder / "secrets"
    subprocess.run([DEPLOY / "make-secrets", made, "lubdub.example"], check=True, capture_output=True)
    return made


def test_the_secrets_that_are_made_are_those_the_file_asks_for(tmp_path: Path) -> None:
    made = made_secrets(tmp_path)
    given = dict(line.split("=", 1) for line in (made / "env").read_text().splitlines())
    assert set(given) == set(GIVEN)
    asked = {Path(secret["file"]).name for secret in COMPOSE["secrets"].values()}
    assert asked - {"tls.crt", "tls.key"} <= {path.name for path in made.iterdir()}
    assert stat.S_IMODE(made.stat().st_mode) == 0o700


def test_the_secrets_that_are_made_fit_the_programs_that_read_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = made_secrets(tmp_path)
    store: Any = open_store((made / "store_url").read_text())
    identity = json.loads((made / "store_identities.json").read_text())["identities"][0]
    assert identity["credentials"] == [
        {"accessKey": store.config["access_key_id"], "secretKey": store.config["secret_access_key"]}
    ]
    assert identity["actions"] == [f"{what}:{store.config['bucket']}" for what in ("Read", "Write", "List")]
    shown = tmp_path / "run"
    shown.mkdir()
    for name in SERVICES["web"]["secrets"]:
        (shown / name).write_bytes((made / Path(COMPOSE["secrets"][name]["file"]).name).read_bytes())
    read = Settings(_secrets_dir=str(shown))  # type: ignore[call-arg]
    password = (made / "database_password").read_text()
    assert read.database == f"postgresql://lubdub:{password}@database:5432/lubdub"
    assert read.store == (made / "store_url").read_text()
    assert [len(key) for key in load(MasterKeySource.of(read.master_key_source), may_make=False)] == [32]


def test_secrets_are_made_once_and_never_the_same(tmp_path: Path) -> None:
    first, second = made_secrets(tmp_path / "one"), made_secrets(tmp_path / "two")
    before = (first / "master_key").read_bytes()
    again = subprocess.run([DEPLOY / "make-secrets", first], capture_output=True, text=True, check=False)
    assert again.returncode == 1
    assert "nothing was changed" in again.stderr
    assert (first / "master_key").read_bytes() == before
    for name in ("master_key", "database_password", "store_url"):
        assert (first / name).read_bytes() != (second / name).read_bytes()


def test_the_image_holds_what_is_locked_by_hash_and_ends_without_root() -> None:
    lines = (DEPLOY / "Dockerfile").read_text().splitlines()
    assert all(re.search(r":\d+\.\d+", line) for line in lines if line.startswith("FROM"))
    installs = [line for line in lines if "pip install" in line]
    assert installs
    assert all("--require-hashes" in line for line in installs)
    assert [line for line in lines if line.startswith("USER")] == ["USER 10001:10001"]
    assert not [line for line in lines if line.startswith(("ADD", "ARG"))]


def test_everything_the_image_is_made_of_is_let_into_it() -> None:
    copied = re.findall(r"^COPY (?!--from)(.+) \S+$", (DEPLOY / "Dockerfile").read_text(), re.M)
    let_in = set(re.findall(r"^!(.+)$", (DEPLOY / "Dockerfile.dockerignore").read_text(), re.M))
    for source in " ".join(copied).split():
        assert (ROOT / source).exists()
        assert any(source == one or source.startswith(f"{one}/") for one in let_in), source


def test_neither_tests_nor_history_nor_tools_get_into_the_image() -> None:
    rules = (DEPLOY / "Dockerfile.dockerignore").read_text().split()
    let_in = {rule[1:] for rule in rules if rule.startswith("!")}
    assert rules[0] == "*"
    assert rules[-1] == "**/.*"
    assert {one for one in let_in if re.match(r"tests|requirements-(dev|benchmark|make)|\.|lubdub$", one)} == set()
    assert "requirements-dev" not in (DEPLOY / "Dockerfile").read_text()
