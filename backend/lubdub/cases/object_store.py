"""Where sealed objects lie: a folder, or a bucket of any server that speaks S3."""

from __future__ import annotations

from datetime import timedelta
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from obstore.store import ObjectStore, S3Store, from_url

S3_OPTIONS = {"endpoint", "region"}
PATIENCE = timedelta(seconds=20)
"""A bucket that does not answer is asked again for so long; then the caller is told."""


def open_store(url: str) -> ObjectStore:
    """The store at url: file:///folder (made when needed), or s3://KEY:SECRET@bucket/prefix?endpoint=...&region=...

    Without a key the machine's own credentials count (environment, instance role). Raises ValueError.
    """
    parts = urlsplit(url)
    if parts.scheme == "file":
        return from_url(url, mkdir=True)
    if parts.scheme != "s3" or not parts.hostname:
        raise ValueError("a store is a file:// or an s3:// URL")
    more: dict[str, Any] = {**_options(parts.query), **_credentials(parts.username, parts.password)}
    retries: Any = {"max_retries": 5, "retry_timeout": PATIENCE}
    bucket, prefix = parts.netloc.rpartition("@")[2], parts.path.strip("/") or None
    return S3Store(bucket, prefix=prefix, retry_config=retries, **more)


def _options(query: str) -> dict[str, Any]:
    said = {name: values[-1] for name, values in parse_qs(query, keep_blank_values=True).items()}
    unknown = sorted(set(said) - S3_OPTIONS)
    if unknown:
        raise ValueError(f"an s3:// URL takes endpoint and region, not {unknown[0]}")
    is_plain = said.get("endpoint", "").startswith("http://")
    return {**said, "client_options": {"allow_http": is_plain}}


def _credentials(key: str | None, secret: str | None) -> dict[str, str]:
    if not key or not secret:
        return {}
    return {"access_key_id": unquote(key), "secret_access_key": unquote(secret)}
