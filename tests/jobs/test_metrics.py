"""The numbers for Prometheus: who may read them, what they tell, and that the dashboard asks for what there is."""

from __future__ import annotations

import json
import re
from datetime import timedelta

import httpx
import pytest
from prometheus_client import REGISTRY
from pydantic import ValidationError

from lubdub.cases.clock import now
from lubdub.cases.database import Database
from lubdub.jobs import metrics
from lubdub.settings import Settings
from tests.cases.conftest import Room, girl_of_six, room
from tests.rules.source import ROOT
from tests.web.service import free_port

__all__ = ["room"]

DASHBOARD = ROOT / "backend" / "deploy" / "grafana.json"


def known() -> set[str]:
    """Every series a process may send."""
    names = {family.name + suffix for family in REGISTRY.collect() for suffix in ("", "_total", "_bucket")}
    return {name for name in names if name.startswith("lubdub_")} | {"lubdub_waiting", "lubdub_waiting_oldest_seconds"}


def test_the_dashboard_asks_for_numbers_that_exist() -> None:
    queries = [target["expr"] for panel in json.loads(DASHBOARD.read_text())["panels"] for target in panel["targets"]]
    asked = set(re.findall(r"lubdub_\w+", " ".join(queries)))
    assert len(asked) >= 15
    assert asked <= known()


def test_every_number_stands_on_the_dashboard() -> None:
    text = DASHBOARD.read_text()
    ours = {family.name for family in REGISTRY.collect() if family.name.startswith("lubdub_")}
    assert {name for name in ours if name not in text} == set()


def test_numbers_are_read_with_the_token_alone() -> None:
    settings = Settings(metrics_port=free_port(), metrics_token="a-long-token")  # type: ignore[arg-type]
    end = metrics.serve_metrics(settings)
    try:
        address = f"http://127.0.0.1:{settings.metrics_port}"
        assert httpx.get(f"{address}/metrics").status_code == 401
        assert httpx.get(f"{address}/metrics", headers={"Authorization": "Bearer wrong"}).status_code == 401
        told = httpx.get(f"{address}/metrics", headers={"Authorization": "Bearer a-long-token"})
        assert "# TYPE lubdub_http_requests_total counter" in told.text
        assert httpx.get(f"{address}/").status_code == 404
    finally:
        end()


def test_numbers_leave_the_machine_behind_a_token_alone() -> None:
    with pytest.raises(ValidationError, match="LUBDUB_METRICS_TOKEN"):
        Settings(metrics_host="0.0.0.0")
    Settings(metrics_host="0.0.0.0", metrics_token="a-long-token")  # type: ignore[arg-type]


def test_a_port_that_is_taken_is_said_in_one_sentence() -> None:
    settings = Settings(metrics_port=free_port())
    end = metrics.serve_metrics(settings)
    try:
        with pytest.raises(SystemExit, match="LUBDUB_METRICS_PORT"):
            metrics.serve_metrics(settings)
    finally:
        end()


def test_what_waits_is_told_with_its_age(room: Room) -> None:
    portal = room.portal()
    case = room.store.create(portal, girl_of_six())[0].id
    room.store.receive_scan(portal, case, room.vault.seal(case, "scan", b"scan"), None)
    later = metrics.Waiting(room.desk, lambda: now() + timedelta(seconds=90))
    count, age = ({sample.labels["what"]: sample.value for sample in family.samples} for family in later.collect())
    assert count == {"checking": 1, "queued": 0, "running": 0, "messages": 0}
    assert age["checking"] == pytest.approx(90, abs=60)
    assert age["queued"] == 0


def test_errors_are_counted_where_they_come_from(room: Room) -> None:
    def count(where: str) -> float:
        return REGISTRY.get_sample_value("lubdub_faults_total", {"where": where}) or 0.0

    metrics.watch_database(room.database)
    before = count("database"), count("own")
    with pytest.raises(Exception, match="nowhere"), room.database.engine.connect() as connection:
        connection.exec_driver_sql("SELECT 1 FROM nowhere")
    try:
        raise RuntimeError
    except RuntimeError as error:
        metrics.count_fault(error)
    assert (count("database"), count("own")) == (before[0] + 1, before[1] + 1)


def test_a_database_that_is_away_gives_no_number_instead_of_an_old_one(room: Room) -> None:
    class Away:
        def whats_waiting(self) -> None:
            Database("postgresql://nobody@127.0.0.1:1/none")

    assert list(metrics.Waiting(Away()).collect()) == []  # type: ignore[arg-type]
