"""Several named pieces of bytes in one, for the way to a sandboxed child and back. Read without trust."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

LENGTH = struct.Struct("<I")


class BadBundle(ValueError):
    """The bytes are no bundle: cut, or lengths that do not add up."""


@dataclass(frozen=True)
class Bundle:
    """facts: small values as JSON; parts: name -> bytes."""

    facts: Mapping[str, Any]
    parts: Mapping[str, bytes]

    def to_bytes(self) -> bytes:
        """A length, that many bytes of JSON with the parts' names and sizes, then the parts one after another."""
        sizes = [[name, len(part)] for name, part in self.parts.items()]
        head = json.dumps({"facts": dict(self.facts), "parts": sizes}).encode()
        return b"".join([LENGTH.pack(len(head)), head, *self.parts.values()])

    @staticmethod
    def from_bytes(data: bytes) -> Bundle:
        """Raises BadBundle."""
        try:
            (length,) = LENGTH.unpack_from(data)
            head = json.loads(data[LENGTH.size : LENGTH.size + length])
            facts, sizes = dict(head["facts"]), [(str(name), int(size)) for name, size in head["parts"]]
        except (struct.error, ValueError, KeyError, TypeError) as error:
            raise BadBundle("no bundle") from error
        parts, place = {}, LENGTH.size + length
        for name, size in sizes:
            if size < 0 or place + size > len(data):
                raise BadBundle("a part is cut")
            parts[name] = data[place : place + size]
            place += size
        if place != len(data):
            raise BadBundle("bytes are left over")
        return Bundle(facts, parts)
