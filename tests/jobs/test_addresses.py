"""Which addresses are called: public ones by https, and exactly the machine that was looked up."""

from __future__ import annotations

import ipaddress
import socket

import pytest

from lubdub.jobs.addresses import AddressRefused, destination, is_public


@pytest.mark.parametrize(
    "address",
    [
        "127.0.0.1",
        "10.1.2.3",
        "172.16.0.1",
        "192.168.1.1",
        "169.254.169.254",
        "100.64.0.1",
        "0.0.0.0",
        "224.0.0.1",
        "255.255.255.255",
        "::1",
        "::",
        "fe80::1",
        "fd00::1",
        "ff02::1",
        "::ffff:127.0.0.1",
        "::ffff:10.0.0.1",
        "64:ff9b::7f00:1",
        "2002:7f00:1::",
    ],
)
def test_private_addresses_are_refused_in_every_spelling(address: str) -> None:
    assert not is_public(ipaddress.ip_address(address))
    host = f"[{address}]" if ":" in address else address
    with pytest.raises(AddressRefused, match="private"):
        destination(f"https://{host}/hook", allow_private=False)


@pytest.mark.parametrize("number", ["2130706433", "0x7f000001", "0177.0.0.1", "127.1", "localhost"])
def test_other_ways_to_write_this_machine_are_refused_too(number: str) -> None:
    with pytest.raises(AddressRefused):
        destination(f"https://{number}/", allow_private=False)


@pytest.mark.parametrize("address", ["93.184.216.34", "2606:2800:220:1:248:1893:25c8:1946"])
def test_public_addresses_are_called(address: str) -> None:
    assert is_public(ipaddress.ip_address(address))


@pytest.mark.parametrize(
    "url",
    [
        "http://93.184.216.34/",
        "ftp://93.184.216.34/",
        "https:///nowhere",
        "https://user:word@93.184.216.34/",
        "https://93.184.216.34/#part",
        "https://93.184.216.34:99999/",
        "https://93.184.216.34/a b",
        "https://93.184.216.34/" + "a" * 2000,
        "https://[::1",
        "nothing",
        "",
    ],
)
def test_what_is_no_plain_https_address_is_refused_in_a_sentence(url: str) -> None:
    with pytest.raises(AddressRefused, match=r"^[A-Z].*\.$"):
        destination(url, allow_private=False)


def test_a_name_with_one_private_address_among_public_ones_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    both = [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (ip, 443)) for ip in ("93.184.216.34", "10.0.0.1")]
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_args, **_more: both)
    with pytest.raises(AddressRefused, match="private"):
        destination("https://portal.example/", allow_private=False)


def test_the_address_that_was_looked_up_is_the_one_that_is_called(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter(["93.184.216.34", "127.0.0.1"])

    def first_good_then_bad(*_args: object, **_more: object) -> list[object]:
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (next(answers), 443))]

    monkeypatch.setattr(socket, "getaddrinfo", first_good_then_bad)
    place = destination("https://portal.example:8443/hook?x=1", allow_private=False)
    assert place.pinned_url == "https://93.184.216.34:8443/hook?x=1"
    assert (place.host, place.authority) == ("portal.example", "portal.example:8443")


def test_a_closed_network_may_allow_its_own_addresses() -> None:
    place = destination("http://127.0.0.1:8080/hook", allow_private=True)
    assert (place.pinned_url, place.authority) == ("http://127.0.0.1:8080/hook", "127.0.0.1:8080")
