"""Where the store's URL leads, and that nothing but the store learns its secret."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from lubdub.cases.object_store import open_store


def test_a_folder_is_made_when_it_is_missing(tmp_path: Path) -> None:
    open_store((tmp_path / "new" / "files").as_uri())
    assert (tmp_path / "new" / "files").is_dir()


def test_a_bucket_of_any_server_is_named_with_its_key_and_place() -> None:
    store: Any = open_store("s3://AKID:a%2Fb%40c@scans/clinic?endpoint=https://store.example:8333&region=here")
    config = store.config
    assert (config["bucket"], store.prefix) == ("scans", "clinic")
    assert (config["access_key_id"], config["secret_access_key"]) == ("AKID", "a/b@c")
    assert (config["endpoint"], config["region"]) == ("https://store.example:8333", "here")


@pytest.mark.parametrize(("endpoint", "allowed"), [("http://127.0.0.1:1", True), ("https://store.example", False)])
def test_only_an_endpoint_that_says_http_is_spoken_to_in_the_clear(endpoint: str, allowed: bool) -> None:
    store: Any = open_store(f"s3://k:s@scans?endpoint={endpoint}")
    assert store.client_options["allow_http"] == str(allowed).lower()


@pytest.mark.parametrize(
    "url", ["s3://scans?endpoint=https://x&acl=public", "s3://", "ftp://somewhere/x", "memory://"], ids=str
)
def test_a_url_that_is_no_store_is_refused(url: str) -> None:
    with pytest.raises(ValueError, match="URL"):
        open_store(url)
