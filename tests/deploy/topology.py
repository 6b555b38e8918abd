"""Lubdub as on many machines, natively: several web, view and worker processes with nothing in common but a PostgreSQL,
a store that speaks S3 and the master key, behind the proxy of docker-compose.yml with its very configuration."""

from __future__ import annotations

import ipaddress
import os
import shutil
import signal
import ssl
import subprocess
import sys
import sysconfig
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from lubdub.settings import Settings
from tests.postgres import own_postgres
from tests.web.service import ROOT, Service, eventually, free_port

CADDYFILE = ROOT / "backend" / "deploy" / "Caddyfile"
STORE_KEY, STORE_SECRET, BUCKET = "topologytest", "onlyforthistest", "scans"
TRIES = 60
STARTS_S = 900.0
"""A dozen processes start at once, on a machine that may be busy."""


def proxy_program() -> str | None:
    """Caddy, installed or unpacked by `./lubdub test`; None when there is none."""
    unpacked = ROOT / ".system" / "proxy" / "usr" / "bin" / "caddy"
    return shutil.which("caddy") or (str(unpacked) if unpacked.exists() else None)


def store_program() -> str:
    """rclone, which serves a folder by S3; one of the tests' own packages."""
    return str(Path(sysconfig.get_path("scripts")) / "rclone")


@dataclass
class Process:
    """One process of a role, with a data folder and a port of its own, that can be killed and started again."""

    role: str
    settings: Settings
    log: Path
    running: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start; it is not ready yet."""
        environment = os.environ | self.settings.to_environment()
        environment |= {"PYTHONPATH": str(ROOT / "backend"), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        command = [sys.executable, "-m", "lubdub", self.role]
        with self.log.open("ab") as log:
            self.running = subprocess.Popen(command, env=environment, cwd=ROOT, stdout=log, stderr=log)

    def kill(self) -> None:
        """SIGKILL: it has no chance to put anything in order."""
        assert self.running is not None
        self.running.send_signal(signal.SIGKILL)
        self.running.wait()

    @property
    def address(self) -> str:
        """Where it listens itself."""
        return f"http://127.0.0.1:{self.settings.port}"

    def is_up(self) -> bool:
        """Whether it answers, or says that it works."""
        assert self.running is not None
        assert self.running.poll() is None, self.log.read_text()[-3000:]
        if self.role == "worker":
            return '"a worker is ready"' in self.log.read_text()
        return answers(f"{self.address}/livez")


@dataclass
class Town:
    """All of it. settings: as the tests' own programs reach database, store and key; address: the proxy's."""

    settings: Settings
    certificate: Path
    webs: list[Process] = field(default_factory=list)
    views: list[Process] = field(default_factory=list)
    workers: list[Process] = field(default_factory=list)

    @property
    def service(self) -> Service:
        """What the tests of the web need to make portals and families."""
        return Service(self.settings)

    @property
    def everybody(self) -> list[Process]:
        """All processes of Lubdub's own."""
        return [*self.webs, *self.views, *self.workers]

    def client(self, **more: Any) -> httpx.Client:
        """A caller through the proxy, who asks again when told that a process was lost."""
        return httpx.Client(base_url=self.settings.address, transport=AskingAgain(self.tls), timeout=120, **more)

    def revive(self) -> None:
        """Start again whoever was killed."""
        for process in self.everybody:
            if process.running is not None and process.running.poll() is not None:
                process.start()
        for process in self.everybody:
            eventually(process.is_up, STARTS_S)

    @property
    def tls(self) -> ssl.SSLContext:
        """Trusts the town's certificate and no other."""
        return ssl.create_default_context(cafile=self.certificate)


class AskingAgain(httpx.BaseTransport):
    """Sends a call again after 502, 503 and 504: what the proxy says when the process that had it is gone."""

    def __init__(self, tls: ssl.SSLContext) -> None:
        self._once = httpx.HTTPTransport(verify=tls)

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        """As httpx asks for it."""
        request.read()
        for _ in range(TRIES):
            response = self._once.handle_request(request)
            if response.status_code not in (502, 503, 504):
                return response
            response.close()
            time.sleep(1)  # as a client that was turned away does
        return self._once.handle_request(request)

    def close(self) -> None:
        """Give the connections back."""
        self._once.close()


@contextmanager
def town(folder: Path, count: int = 2) -> Iterator[Town]:
    """A running town with `count` processes of each role, gone at the end."""
    with ExitStack() as stack:
        server = stack.enter_context(own_postgres())
        database = stack.enter_context(server.database())
        store = stack.enter_context(_store(folder))
        certificate, key = make_certificate(folder)
        port = free_port()
        common = Settings(
            data_dir=folder / "tests-own",
            master_key_file=folder / "master.key",
            database_url=database,
            store_url=store,
            public_url=f"https://localhost:{port}",
            behind_tls_proxy=True,
            requests_per_minute=100_000,
        )
        place = Town(common, certificate)
        for role, processes in (("web", place.webs), ("view", place.views), ("worker", place.workers)):
            for number in range(count):
                name = f"{role}-{number}"
                own = {"data_dir": folder / name, "port": free_port()}
                processes.append(Process(role, common.model_copy(update=own), folder / f"{name}.log"))
        stack.callback(_end, place.everybody)
        place.webs[0].start()  # the first one makes the tables, so that the others do not wait for each other
        eventually(place.webs[0].is_up, STARTS_S)
        for process in place.everybody[1:]:
            process.start()
        stack.enter_context(_proxy(folder, port, place, key))
        for process in place.everybody:
            eventually(process.is_up, STARTS_S)
        yield place


@contextmanager
def _store(folder: Path) -> Iterator[str]:
    """The URL of a store that keeps its objects in a folder and speaks S3."""
    (folder / "store" / BUCKET).mkdir(parents=True)
    port = free_port()
    command = [store_program(), "serve", "s3", "--addr", f"127.0.0.1:{port}", "--config", "/dev/null"]
    command += ["--vfs-cache-mode", "off", str(folder / "store")]
    environment = os.environ | {"RCLONE_AUTH_KEY": f'"{STORE_KEY},{STORE_SECRET}"'}
    with (
        (folder / "store.log").open("ab") as log,
        subprocess.Popen(command, env=environment, stdout=log, stderr=log) as process,
    ):
        try:
            eventually(lambda: answers(f"http://127.0.0.1:{port}/", but_any=True), STARTS_S)
            yield f"s3://{STORE_KEY}:{STORE_SECRET}@{BUCKET}?endpoint=http://127.0.0.1:{port}&region=test"
        finally:
            process.terminate()


@contextmanager
def _proxy(folder: Path, port: int, place: Town, key: Path) -> Iterator[None]:
    program = proxy_program()
    assert program is not None
    environment = os.environ | {
        "HOME": str(folder),
        "LUBDUB_BIND": "127.0.0.1",
        "LUBDUB_HOST": "localhost",
        "LUBDUB_HTTP_PORT": str(free_port()),
        "LUBDUB_HTTPS_PORT": str(port),
        "LUBDUB_TLS_CERTIFICATE": str(place.certificate),
        "LUBDUB_TLS_KEY": str(key),
        "LUBDUB_WEB_PROCESSES": _upstreams(place.webs),
        "LUBDUB_VIEW_PROCESSES": _upstreams(place.views),
    }
    command = [program, "run", "--adapter", "caddyfile", "--config", str(CADDYFILE)]
    with (
        (folder / "proxy.log").open("ab") as log,
        subprocess.Popen(command, env=environment, stdout=log, stderr=log) as process,
    ):
        try:
            yield
        finally:
            process.terminate()


def _upstreams(processes: list[Process]) -> str:
    return "to " + " ".join(f"127.0.0.1:{process.settings.port}" for process in processes)


def _end(processes: list[Process]) -> None:
    for process in processes:
        if process.running is not None:
            process.running.terminate()
    for process in processes:
        if process.running is not None:
            try:
                process.running.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()


def answers(address: str, but_any: bool = False) -> bool:
    """Whether a server answers well, or at all."""
    try:
        return httpx.get(address, timeout=5).status_code == 200 or but_any
    except httpx.TransportError:
        return False


def make_certificate(folder: Path) -> tuple[Path, Path]:
    """A certificate for this machine that vouches for itself, and its key: for the tests alone."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")])
    now = datetime.now(UTC)
    names = [x509.DNSName("localhost"), x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(hours=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )
    certificate, key_file = folder / "town.crt", folder / "town.key"
    certificate.write_bytes(made.public_bytes(serialization.Encoding.PEM))
    plain = (serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    key_file.write_bytes(key.private_bytes(*plain))
    return certificate, key_file
