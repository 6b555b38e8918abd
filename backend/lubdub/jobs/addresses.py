"""Which addresses of others may be called: public ones, looked up once and then held to."""

from __future__ import annotations

import ipaddress
import socket
from dataclasses import dataclass
from urllib.parse import urlsplit

IpAddress = ipaddress.IPv4Address | ipaddress.IPv6Address
LEAD_ELSEWHERE = tuple(ipaddress.ip_network(block) for block in ("64:ff9b::/96", "64:ff9b:1::/48", "2002::/16"))
"""IPv6 blocks (NAT64, 6to4) behind which any IPv4 address may stand, private ones too."""
LENGTH_AT_MOST = 2000


class AddressRefused(Exception):
    """An address that is not called. The text is one sentence that says why."""


@dataclass(frozen=True)
class Destination:
    """Where to connect. ip: the one address that is used, so that a second look-up cannot lead elsewhere."""

    scheme: str
    host: str
    port: int
    ip: IpAddress
    target: str

    @property
    def pinned_url(self) -> str:
        """The URL with the IP address in the place of the name."""
        host = f"[{self.ip}]" if self.ip.version == 6 else str(self.ip)
        return f"{self.scheme}://{host}:{self.port}{self.target}"

    @property
    def authority(self) -> str:
        """What the Host header says."""
        usual = {"https": 443, "http": 80}[self.scheme]
        host = f"[{self.host}]" if ":" in self.host else self.host
        return host if self.port == usual else f"{host}:{self.port}"


def destination(url: str, allow_private: bool) -> Destination:
    """Look the address up once. allow_private: also http and this machine's own network, for tests and closed nets.

    Raises AddressRefused, also when any of the name's addresses is a private one.
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise AddressRefused("This is not an address.") from error
    if parts.scheme not in (("https", "http") if allow_private else ("https",)) or not parts.hostname:
        raise AddressRefused("The address must begin with https:// and name a host.")
    if parts.username is not None or parts.password is not None or parts.fragment:
        raise AddressRefused("The address must hold no user, password or fragment.")
    if len(url) > LENGTH_AT_MOST or not url.isascii() or any(sign <= " " for sign in url):
        raise AddressRefused("The address must be plain and no longer than 2000 characters.")
    port = port or {"https": 443, "http": 80}[parts.scheme]
    found = _looked_up(parts.hostname, port)
    if not allow_private and not all(is_public(one) for one in found):
        raise AddressRefused("The address leads into a private network.")
    target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    return Destination(parts.scheme, parts.hostname, port, found[0], target)


def is_public(ip: IpAddress) -> bool:
    """Whether anybody on the internet would reach the same machine by it."""
    plain = (ip.ipv4_mapped or ip) if isinstance(ip, ipaddress.IPv6Address) else ip
    is_detour = any(plain in block for block in LEAD_ELSEWHERE if block.version == plain.version)
    return plain.is_global and not plain.is_multicast and not is_detour


def _looked_up(host: str, port: int) -> list[IpAddress]:
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        return [ipaddress.ip_address(str(place[0]).partition("%")[0]) for *_, place in found]
    except (OSError, UnicodeError, ValueError) as error:
        raise AddressRefused("The host's name cannot be looked up.") from error
