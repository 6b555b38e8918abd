"""Styles, scripts and drawings travel packed, once, and only what is used of them."""

from __future__ import annotations

import re

import httpx
import pytest

from lubdub.web import nhsuk
from tests.web.service import Service


@pytest.fixture
def http(service: Service) -> httpx.Client:
    return service.browser()


def test_every_file_a_page_names_is_packed_and_kept_for_good(http: httpx.Client) -> None:
    page = http.get("/")
    assert page.headers["content-encoding"] == "gzip"
    named = re.findall(r'"(/static/[^"]+)"', page.text)
    assert len(named) >= 5
    for address in named:
        answer = http.get(address)
        assert answer.headers["content-encoding"] == "gzip", address
        assert "immutable" in answer.headers["cache-control"], address


def test_the_first_page_weighs_less_than_150_kilobytes_with_all_it_names(http: httpx.Client) -> None:
    page = http.get("/").text
    addresses = ["/", *set(re.findall(r'"(/static/[^"]+)"', page))]
    scripts = [http.get(address).text for address in addresses if ".js" in address]
    addresses += [name for script in scripts for name in re.findall(r'from "(/static/[^"]+)"', script)]
    assert sum(weight(http, address) for address in addresses) < 150_000


def weight(http: httpx.Client, address: str) -> int:
    """Bytes over the wire, without headers."""
    with http.stream("GET", address) as answer:
        return sum(len(piece) for piece in answer.iter_raw())


def test_an_address_without_the_right_version_is_asked_for_again(http: httpx.Client) -> None:
    for address in ("/static/style/lubdub.css", "/static/style/lubdub.css?v=0123456789"):
        answer = http.get(address)
        assert answer.headers["cache-control"] == "no-cache"
        again = http.get(address, headers={"If-None-Match": answer.headers["etag"]})
        assert again.status_code == 304


def test_scripts_name_other_scripts_by_version_too(http: httpx.Client) -> None:
    assert re.search(r'from "/static/nhsuk\.js\?v=[0-9a-f]{10}"', http.get("/static/lib/page.js").text)


def test_who_cannot_unpack_gets_the_plain_file(http: httpx.Client) -> None:
    answer = http.get("/static/style/lubdub.css", headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in answer.headers
    assert "--paper" in answer.text


def test_pages_themselves_are_kept_by_nobody(http: httpx.Client) -> None:
    for path in ("/", "/ask/who"):
        assert http.get(path).headers["cache-control"] == "no-store"


def test_the_token_of_a_form_looks_different_each_time_and_works_each_time(
    http: httpx.Client, service: Service
) -> None:
    tokens = [re.search(r'csrf_token" value="(\w+)"', http.get("/ask/who").text) for _ in range(2)]
    found = [token.group(1) for token in tokens if token]
    assert len(set(found)) == 2
    for token in found:
        data = {"csrf_token": token, "who": "child"}
        answer = http.post("/ask/who", data=data, headers={"Origin": service.settings.address})
        assert answer.headers["location"] == "/ask/age"


def test_rules_of_classes_that_no_page_uses_are_left_out() -> None:
    css = (
        '@charset "utf-8";html{a:b}.nhsuk-a,.nhsuk-b:not(.x,.nhsuk-a){c:d}'
        "@media print{.nhsuk-b{e:f}}@media (x){.nhsuk-a{g:h}}"
    )
    kept = "".join(nhsuk.used_rules(css, frozenset({"nhsuk-a"})))
    assert kept == "html{a:b}.nhsuk-a{c:d}@media (x){.nhsuk-a{g:h}}"


def test_the_rules_our_pages_use_are_all_there() -> None:
    css = nhsuk.style().decode()
    for name in ("nhsuk-button", "nhsuk-error-summary", "nhsuk-skip-link", "nhsuk-u-visually-hidden", "nhsuk-input"):
        assert f".{name}" in css
    assert len(css) < 60_000


@pytest.mark.parametrize("path", ["", "../pages.py", "%2e%2e/pages.py", "..%2fpages.py", "none.js", ".git/config"])
def test_nothing_else_is_served(http: httpx.Client, path: str) -> None:
    answer = http.get(f"/static/{path}")
    assert answer.status_code == 404
    assert "import" not in answer.text
