"""Jobs that do what the scan's bytes say, in place of the pipeline: quick, slow, hostile."""

from __future__ import annotations

import ctypes
import json
import time
from pathlib import Path

from lubdub.jobs.bundle import Bundle
from lubdub.results import Progress, Reason, ScanRefused, ScanUnreadable
from lubdub.scans.reasons import UNIT_IMPLAUSIBLE

MIRRORED = Reason("mirrored_scan", "Left and right are swapped.", "Turn mirroring off.")


def examine(payload: bytes, progress: Progress) -> bytes:
    """Obey the scan's first line."""
    bundle = Bundle.from_bytes(payload)
    order = bundle.parts["scan"].split(b"\n")[0].decode("ascii", "replace")
    if order == "sizeless" and bundle.facts["unit"] is None:
        raise ScanRefused(UNIT_IMPLAUSIBLE)
    _obey(order, progress)
    parts = {"examination.npz": b"npz", "examination.json": json.dumps({"coverage": 1}).encode(), "scan.ply": b"ply"}
    return Bundle({}, parts | {"../evil": b"never stored"}).to_bytes()


def locate(payload: bytes, progress: Progress) -> bytes:
    """Obey the scan's last line and repeat what was asked."""
    bundle = Bundle.from_bytes(payload)
    _obey(bundle.parts["scan"].split(b"\n")[-1].decode("ascii", "replace"), progress)
    result = {"verdict": "show", "asked": dict(bundle.facts)}
    return Bundle({"verdict": "show"}, {"result.json": json.dumps(result).encode(), "outcome.npz": b"npz"}).to_bytes()


def _obey(order: str, progress: Progress) -> None:
    word, _, rest = order.partition(" ")
    progress("read", 0.0)
    if word == "slow":
        for step in range(100):
            progress("fit", step / 100)
            time.sleep(float(rest) / 100)
    elif word in ("until", "quietly"):
        # Slow the first time, while the named file is not there; quick when the job is done again.
        path = Path(rest)
        progress("fit", 0.5)
        while not path.exists():
            if word == "until":
                progress("fit", 0.5)
            time.sleep(0.05)
    elif word == "crash":
        ctypes.string_at(0)
    elif word == "memory":
        bytearray(1 << 40)
    elif word == "hang":
        while True:
            pass
    elif word == "junk":
        raise ScanUnreadable(Reason("unreadable_file", "This file is no body scan.", "Send another one."))
    elif word == "refuse":
        raise ScanRefused(MIRRORED)
    elif word == "bug":
        raise RuntimeError("a bug of ours")
