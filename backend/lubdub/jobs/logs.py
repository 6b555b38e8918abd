"""Log lines as JSON on standard error, with an allow-list: case ids, never names, coordinates, tokens or paths."""

from __future__ import annotations

import logging
import logging.config
from typing import Any

import structlog

from lubdub.settings import Settings

ALLOWED = frozenset(
    {"event", "level", "timestamp", "logger", "exception", "request_id", "method", "route", "status", "milliseconds"}
    | {"case_id", "job_id", "kind", "worker", "outcome", "stage", "how", "number"}
)


NOISY = ("dbos", "alembic", "sqlalchemy", "uvicorn", "httpx", "websockets", "viser", "opentelemetry", "urllib3")
HEAD = ("timestamp", "level", "event")


def _only_allowed(logger: object, name: str, line: Any) -> Any:
    return {key: value for key, value in line.items() if key in ALLOWED}


def _as_text(logger: object, name: str, line: Any) -> str:
    """`time level event key=value ...`; a traceback, the one thing of many lines, is quoted as well."""
    rest = " ".join(f"{key}={value!r}" for key, value in sorted(line.items()) if key not in HEAD)
    return " ".join((str(line.get("timestamp")), str(line.get("level")), repr(line.get("event")), rest)).rstrip()


def configure_logs(settings: Settings) -> None:
    """Send every logger of this process, ours and the libraries', through one formatter.

    Either way a value is quoted: a line break in it never makes a second line.
    """
    is_json = settings.log_format == "json"
    drawn: Any = structlog.processors.JSONRenderer() if is_json else _as_text
    shared: list[Any] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_log_level,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.ExtraAdder(),
        structlog.processors.TimeStamper(fmt="iso", utc=True),
    ]
    structlog.configure(
        processors=[*shared, structlog.stdlib.ProcessorFormatter.wrap_for_formatter],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
    )
    formatter = structlog.stdlib.ProcessorFormatter(
        foreign_pre_chain=shared,
        processors=[
            structlog.stdlib.ProcessorFormatter.remove_processors_meta,
            structlog.processors.format_exc_info,
            _only_allowed,
            drawn,
        ],
    )
    handler = logging.StreamHandler()
    handler.setFormatter(formatter)
    logging.basicConfig(handlers=[handler], level=settings.log_level.upper(), force=True)
    for noisy in NOISY:
        library = logging.getLogger(noisy)
        library.setLevel(logging.WARNING)
        library.propagate = True
    # DBOS adds its own handler unless it finds one.
    logging.getLogger("dbos").addHandler(logging.NullHandler())
