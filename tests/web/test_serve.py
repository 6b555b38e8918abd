"""One command, everything real: the product on one machine, from a scan to the areas, and what keeps it going."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from lubdub.jobs.confinement import protection
from lubdub.settings import Settings
from lubdub.web.schemas_result import ExaminationOut, ResultOut
from lubdub.web.serve import check_openable, listening_socket
from tests.web.service import ROOT, Portal, Service, eventually, free_port

SERVE = "from lubdub.settings import Settings; from lubdub.web.serve import serve; serve(Settings())"
DEMO = ROOT / "references" / "demo" / "phone-child"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    service = Service(Settings(data_dir=tmp_path_factory.mktemp("whole") / "data", port=free_port()))
    process = service.spawn([sys.executable, "-c", SERVE])
    try:
        eventually(lambda: is_ready(service) or process.poll() is not None, 120)
        assert process.poll() is None, service.log.read_text()[-3000:]
        yield service
    finally:
        service.stop()


def is_ready(service: Service) -> bool:
    try:
        return httpx.get(f"{service.settings.address}/readyz").status_code == 200
    except httpx.TransportError:
        return False


def children(pid: int) -> list[int]:
    lists = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for found in lists for child in found.read_text().split()]


def is_running(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def test_one_command_takes_a_childs_scan_to_its_four_areas(whole: Service) -> None:
    portal = whole.portal()
    case = portal.open_case()
    portal.send(case, (DEMO / "phone-child.glb").read_bytes())
    portal.wait(case, "awaiting_landmarks", "refused", "failed")
    examined = portal.call("GET", f"/cases/{case}/scan", 200).json()
    assert ExaminationOut.model_validate(examined).unit.name == "m"
    landmarks = json.loads((DEMO / "landmarks.json").read_text())
    portal.call("PUT", f"/cases/{case}/landmarks", 202, json=landmarks)
    portal.wait(case, "done", "refused", "failed")
    result = portal.call("GET", f"/cases/{case}/result", 200).json()
    assert ResultOut.model_validate(result).verdict in ("show", "show_with_care")
    assert set(result["areas"]) == {"aortic", "pulmonary", "tricuspid", "mitral"}
    assert portal.call("GET", f"/cases/{case}/scan.ply", 200).content.startswith(b"ply\nformat binary")
    view = portal.call("GET", f"/cases/{case}/view.html", 200)
    assert view.headers["content-security-policy"].startswith("sandbox allow-scripts; default-src 'none'")
    assert portal.call("GET", f"/cases/{case}/view.html", 200).text == view.text


def test_readiness_says_which_limits_hold_where_scans_are_read(whole: Service) -> None:
    told = httpx.get(f"{whole.settings.address}/readyz").json()
    assert told["ready"] is True
    limits = {"memory_mb": 4096, "cpu_s": 300, "wall_s": 600, "open_files": 64, "written_bytes": 0}
    assert told["sandbox"] == limits | protection().to_json()


def test_bytes_that_are_no_scan_are_refused_in_words(whole: Service) -> None:
    portal: Portal = whole.portal()
    case = portal.open_case()
    portal.send(case, os.urandom(5000))
    state = portal.wait(case, "refused", "failed", "awaiting_landmarks")
    assert (state["status"], state["reason"]["code"]) == ("refused", "unreadable_file")


def test_a_worker_that_dies_is_started_again_and_ctrl_c_ends_everything(whole: Service) -> None:
    server = whole.processes[0]
    (worker,) = children(server.pid)
    os.kill(worker, signal.SIGKILL)
    eventually(lambda: [child for child in children(server.pid) if child != worker])
    eventually(lambda: whole.log.read_text().count('"a worker is ready"') == 2, 120)
    family = [server.pid, *children(server.pid)]
    family += [grandchild for child in family[1:] for grandchild in children(child)]
    assert len(family) >= 3
    portal = whole.portal()
    with portal.http.stream("GET", f"/api/v1/cases/{portal.open_case()}/events") as listening:
        lines = listening.iter_lines()
        assert next(lines) == "event: status"
        server.send_signal(signal.SIGINT)
        assert [line for line in lines if line.startswith("data: ")]
    assert server.wait(20) == 0
    eventually(lambda: not any(map(is_running, family)))
    assert "Traceback" not in whole.log.read_text()


def test_the_welcome_says_where_everything_is(whole: Service) -> None:
    log = whole.log.read_text()
    assert f"{whole.settings.address}/\n" in log
    assert f"{whole.settings.address}/api/docs" in log
    assert "./lubdub admin key create" in log
    assert re.search(rf"{whole.settings.desk_address}/desk/join#[\w-]{{43}}\n", log)


def test_a_web_process_starts_without_the_libraries_that_few_of_its_pages_need() -> None:
    program = (
        "import sys, lubdub.web.serve; print([name for name in ('fpdf', 'trimesh', 'open3d') if name in sys.modules])"
    )
    end = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert end.stdout.strip() == "[]"


def test_a_port_that_is_taken_is_said_in_one_sentence(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        settings = Settings(data_dir=tmp_path, port=other.getsockname()[1])
        with pytest.raises(SystemExit, match=f"Port {settings.port} is taken"):
            listening_socket(settings)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"database_url": "postgresql://nobody@127.0.0.1:1/none"}, "LUBDUB_DATABASE_URL"),
        ({"store_url": "nonsense://x"}, "LUBDUB_STORE_URL"),
        ({"master_key_file": Path(__file__)}, "test_serve.py"),
        ({"data_dir": Path(__file__)}, "LUBDUB_DATA_DIR"),
    ],
)
def test_what_is_in_the_way_is_said_in_one_sentence(tmp_path: Path, wrong: dict[str, object], words: str) -> None:
    with pytest.raises(SystemExit, match=words) as said:
        check_openable(Settings(**{"data_dir": tmp_path} | wrong))
    assert "\n" not in str(said.value)
