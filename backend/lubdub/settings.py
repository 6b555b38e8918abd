"""Every setting of the service in one frozen table: environment variables `LUBDUB_...`, each with unit and help."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, SecretStr, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from lubdub import safety
from lubdub.safety import is_loopback as is_loopback

PROJECT_FOLDER = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class MasterKeyNamed:
    """The key's file, or the key itself as text; and the command that opens what the file holds, if one is needed."""

    file: Path
    text: str
    command: str


class SettingsTable(BaseSettings):
    """The service's settings, whether they go together or not."""

    model_config = SettingsConfigDict(
        env_prefix="LUBDUB_",
        frozen=True,
        extra="ignore",
        # A file there named like the variable, such as lubdub_database_url, holds its value: for containers' secrets.
        secrets_dir=os.environ.get("LUBDUB_SECRETS_DIR"),
    )

    data_dir: Path = Field(
        default=PROJECT_FOLDER / ".data", description="Folder of the database, the key and the files."
    )
    host: str = Field(default="127.0.0.1", description="Address the web server listens on.")
    port: int = Field(default=8000, ge=0, le=65535, description="TCP port of the web server.")
    behind_tls_proxy: bool = Field(default=False, description="True when a proxy in front of the server speaks HTTPS.")
    trusted_proxies: str = Field(
        default="127.0.0.1,::1",
        description="Addresses or networks, with commas between, of the proxies whose word counts on who is calling.",
    )
    public_url: str = Field(
        default="", description="Address people use, such as https://lubdub.example; empty: host and port."
    )
    database_url: str = Field(
        default="", description="SQLAlchemy URL of the database; empty: an SQLite file in data_dir."
    )
    jobs_database_url: str = Field(
        default="", description="URL of the queue's own tables; empty: as database_url, own file."
    )
    store_url: str = Field(
        default="",
        description="Where sealed files go: a file:// URL, or s3://KEY:SECRET@bucket?endpoint=https://...&region=...; "
        "empty: a folder in data_dir.",
    )
    master_key_file: Path | None = Field(
        default=None, description="File of the master key; made at first start. Empty: master.key in data_dir."
    )
    master_key: SecretStr = Field(
        default=SecretStr(""),
        description="The master key itself, 32 bytes in base64, instead of a file; after a comma, older ones.",
    )
    master_key_command: str = Field(
        default="",
        description="Command of a key service that wraps and unwraps what master_key_file holds. It is called with "
        "`wrap` or `unwrap` as last word and gets and gives base64 on standard input and output.",
    )
    references_dir: Path | None = Field(
        default=None,
        description="Folder of reference bodies and of what clinicians mark on them; empty: a folder in data_dir, and "
        "the project's own bodies.",
    )

    max_upload_mb: int = Field(default=300, ge=1, le=4096, description="Largest scan accepted, in megabytes.")
    session_hours: float = Field(default=72.0, gt=0, description="How long a family's browser session lasts, in hours.")
    desk_idle_minutes: float = Field(
        default=60.0, gt=0, description="A clinician who does nothing for so many minutes is signed out."
    )
    desk_session_hours: float = Field(
        default=12.0, gt=0, description="A clinician signs in again after so many hours, whatever happens."
    )
    invitation_days: float = Field(
        default=14.0, gt=0, description="Days for which a link that asks a family for a scan works."
    )
    oidc_issuer: str = Field(
        default="",
        description="Issuer of an organisation's own login (OpenID Connect), an https:// URL; empty: none. It opens "
        "the account whose e-mail address it vouches for, and from then on that account to that very person.",
    )
    oidc_client_id: str = Field(default="", description="This service's name at that login.")
    oidc_client_secret: SecretStr = Field(default=SecretStr(""), description="This service's secret at that login.")
    oidc_name: str = Field(default="", max_length=80, description="That login's name, as clinicians know it.")

    retention_days: float = Field(default=30.0, gt=0, description="Days after which a case and its files are deleted.")
    requests_per_minute: int = Field(default=600, ge=1, description="Calls per minute for one key, session or address.")
    requests_per_minute_of_address: int = Field(
        default=6000, ge=1, description="Calls per minute from one address, whatever keys and sessions it shows."
    )
    family_mb_per_day: int = Field(
        default=3000, ge=1, description="Scans one family's session may send in a day, in megabytes."
    )
    tenant_mb_per_day: int = Field(
        default=500_000,
        ge=1,
        description="Scans one organisation, or all families without one together, may send in a day, in megabytes.",
    )

    clinic_name: str = Field(
        default="",
        max_length=80,
        description="Who looks at results that families send, as families know them; empty: nobody, and they save the "
        "sheet instead.",
    )

    fhir_names: str = Field(
        default="https://lubdub.example/fhir",
        description="First part of the names of our own FHIR code systems and identifiers; the same for every reader.",
    )
    snomed: bool = Field(
        default=False, description="True to give SNOMED CT codings in FHIR; in many countries this needs a licence."
    )

    webhooks_to_private: bool = Field(
        default=False, description="True to let webhooks call private addresses and http, in a closed network."
    )

    worker_slots: int = Field(default=1, ge=1, le=64, description="Jobs one worker runs at the same moment.")
    job_memory_mb: int = Field(default=4096, ge=256, description="Address space of one job's process, in megabytes.")
    job_cpu_s: float = Field(default=300.0, gt=0, description="Processor time of one job, in seconds.")
    job_wall_s: float = Field(default=600.0, gt=0, description="Wall-clock time of one job, in seconds.")
    worker_pulse: Path | None = Field(
        default=None,
        description="File whose time a worker renews every few seconds, for the health check of its container.",
    )

    metrics_port: int = Field(
        default=0,
        ge=0,
        le=65534,
        description="TCP port of this process's numbers for Prometheus; 0: none. The worker of `serve` has the next.",
    )
    metrics_host: str = Field(default="127.0.0.1", description="Address on which those numbers are served.")
    metrics_token: SecretStr = Field(
        default=SecretStr(""), description="Bearer token asked for there; needed on any address but this machine's own."
    )
    otlp_url: str = Field(
        default="",
        description="Address of an OpenTelemetry collector that takes traces as OTLP over HTTP, such as "
        "http://127.0.0.1:4318; empty: none. It needs the packages of requirements-otel.txt.",
    )
    stop_s: float = Field(
        default=8.0, gt=0, description="Seconds that calls at work have to end in when the web server is told to stop."
    )
    log_format: Literal["json", "text"] = Field(
        default="json", description="Log lines as JSON for machines, or as text for people."
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="Least severe line logged."
    )

    @property
    def is_https(self) -> bool:
        """Whether people reach the pages by https."""
        return self.behind_tls_proxy or self.public_url.startswith("https://")

    @property
    def address(self) -> str:
        """The address people open, without a slash at the end."""
        if self.public_url:
            return self.public_url.rstrip("/")
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}"

    @property
    def desk_address(self) -> str:
        """The address for clinicians: on this machine by its name, for browsers bind no passkey to a number."""
        return self.address.replace("http://127.0.0.1:", "http://localhost:")

    @property
    def database(self) -> str:
        """SQLAlchemy URL of the cases' database."""
        return self.database_url or f"sqlite:///{self.data_dir.resolve() / 'lubdub.sqlite'}"

    @property
    def jobs_database(self) -> str:
        """SQLAlchemy URL of the queue's tables: the same PostgreSQL, or a second SQLite file."""
        if self.jobs_database_url:
            return self.jobs_database_url
        if self.database.startswith("postgresql"):
            return self.database
        return f"sqlite:///{self.data_dir.resolve() / 'jobs.sqlite'}"

    @property
    def store(self) -> str:
        """URL of the store of sealed files."""
        return self.store_url or (self.data_dir.resolve() / "files").as_uri()

    @property
    def master_key_source(self) -> MasterKeyNamed:
        """Where the master key comes from."""
        file = self.master_key_file or self.data_dir / "master.key"
        return MasterKeyNamed(file, self.master_key.get_secret_value(), self.master_key_command)

    @property
    def own_references(self) -> Path | None:
        """Folder of reference bodies and marks of one's own, whether there are any or not.

        None where no folder was named and files go to a store of many machines: data_dir is then each machine's own.
        """
        if self.references_dir is None and not self.store.startswith("file:"):
            return None
        return (self.references_dir or self.data_dir / "references").resolve()

    @property
    def references(self) -> Path | None:
        """The folder to load reference bodies from now; None for the project's own."""
        if self.references_dir is not None:
            return self.references_dir.resolve()
        own = self.own_references
        return own if own is not None and any((own / part).is_dir() for part in ("bodies", "marks")) else None

    def to_environment(self) -> dict[str, str]:
        """The same settings as environment variables, for a process started beside this one."""
        told = self.model_dump(mode="json", exclude_none=True)
        told |= {name: secret.get_secret_value() for name, secret in self if isinstance(secret, SecretStr)}
        return {f"LUBDUB_{name.upper()}": str(value) for name, value in told.items()}


class Settings(SettingsTable):
    """The service's settings. Raises ValidationError, with sentences, for combinations that are not safe."""

    @model_validator(mode="after")
    def refuse_what_is_unsafe(self) -> Self:
        """The service must not even start with them."""
        faults = safety.faults(self)
        if faults:
            raise ValueError(" ".join(faults))
        return self
