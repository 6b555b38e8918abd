"""Sealing of files: one data key per case under a master key, one derived key per file, AES-256-GCM frames.

A file is cut into frames of 1 MiB. Each is sealed with a counter as nonce and, as associated data, the case,
the artefact's name, the frame's number and whether it is the last: frames cannot be cut off, swapped or moved
to another case. Every file has its own key (HKDF of the case's key and the file's random name), so that a
counter never meets the same key twice, not even when an artefact is written again.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from collections.abc import Iterable, Iterator

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from lubdub.cases.errors import SealBroken

FRAME = 1 << 20
TAG = 16
KEY_BYTES = 32
NONCE_BYTES = 12


def wrap_key(master: bytes, data_key: bytes, case_id: str) -> bytes:
    """A case's data key, sealed under the master key: nonce and ciphertext."""
    nonce = secrets.token_bytes(NONCE_BYTES)
    return nonce + AESGCM(master).encrypt(nonce, data_key, case_id.encode())


def unwrap_key(master: bytes, wrapped: bytes, case_id: str) -> bytes:
    """The data key back. Raises SealBroken when it was made under another master key or for another case."""
    try:
        return AESGCM(master).decrypt(wrapped[:NONCE_BYTES], wrapped[NONCE_BYTES:], case_id.encode())
    except InvalidTag as error:
        raise SealBroken("the case's key does not open with this master key") from error


def note_key(master: bytes) -> bytes:
    """The key for short notes in the database, so that the master key itself never meets them."""
    return HKDF(SHA256(), KEY_BYTES, salt=None, info=b"lubdub note 1").derive(master)


def value_key(data_key: bytes) -> bytes:
    """The key for values in a case's rows."""
    return HKDF(SHA256(), KEY_BYTES, salt=None, info=b"lubdub value 1").derive(data_key)


def backup_rows_key(data_key: bytes) -> bytes:
    """The key for a case's rows in backups: it goes when the case's own goes."""
    return HKDF(SHA256(), KEY_BYTES, salt=None, info=b"lubdub backup rows 1").derive(data_key)


def manifest_mac(backup_key: bytes, manifest: bytes) -> str:
    """Proof that a backup's list of contents was written by somebody who has its key."""
    mac_key = HKDF(SHA256(), KEY_BYTES, salt=None, info=b"lubdub backup list 1").derive(backup_key)
    return hmac.new(mac_key, manifest, hashlib.sha256).hexdigest()


def signature(secret: bytes, words: str) -> str:
    """What only a holder of the secret can say of these words; hexadecimal."""
    key = HKDF(SHA256(), KEY_BYTES, salt=None, info=b"lubdub link 1").derive(secret)
    return hmac.new(key, words.encode(), hashlib.sha256).hexdigest()


class FrameSealer:
    """Turns a stream of bytes into sealed frames; feed it with `add`, end it with `last`."""

    def __init__(self, data_key: bytes, object_key: str, case_id: str, artefact: str) -> None:
        """For one file of one case."""
        self._cipher = _file_cipher(data_key, object_key)
        self._about = _about(case_id, artefact)
        self._frame_number = 0
        self._waiting = bytearray()
        self.size = 0

    def add(self, data: bytes) -> bytes:
        """Take bytes; give back what is sealed by now. One byte is always held back for the last frame."""
        self.size += len(data)
        self._waiting += data
        sealed = []
        while len(self._waiting) > FRAME:
            sealed.append(self._seal(bytes(self._waiting[:FRAME]), is_last=False))
            del self._waiting[:FRAME]
        return b"".join(sealed)

    def last(self) -> bytes:
        """The last frame, marked as such."""
        return self._seal(bytes(self._waiting), is_last=True)

    def _seal(self, frame: bytes, *, is_last: bool) -> bytes:
        number = self._frame_number
        self._frame_number += 1
        return self._cipher.encrypt(_nonce(number), frame, _frame_data(self._about, number, is_last))


def open_frames(
    sealed: Iterable[bytes], data_key: bytes, object_key: str, case_id: str, artefact: str
) -> Iterator[bytes]:
    """The plain bytes of a sealed file, frame by frame. Raises SealBroken."""
    cipher, about = _file_cipher(data_key, object_key), _about(case_id, artefact)
    waiting, number = bytearray(), 0
    for piece in sealed:
        waiting += piece
        while len(waiting) > FRAME + TAG:
            frame = bytes(waiting[: FRAME + TAG])
            del waiting[: FRAME + TAG]
            yield _open(cipher, frame, about, number, is_last=False)
            number += 1
    yield _open(cipher, bytes(waiting), about, number, is_last=True)


def _open(cipher: AESGCM, frame: bytes, about: bytes, number: int, *, is_last: bool) -> bytes:
    try:
        return cipher.decrypt(_nonce(number), frame, _frame_data(about, number, is_last))
    except InvalidTag as error:
        raise SealBroken("a stored file was changed or cut") from error


def _file_cipher(data_key: bytes, object_key: str) -> AESGCM:
    return AESGCM(HKDF(SHA256(), KEY_BYTES, salt=object_key.encode(), info=b"lubdub file 1").derive(data_key))


def _about(case_id: str, artefact: str) -> bytes:
    return f"{case_id}\0{artefact}\0".encode()


def _frame_data(about: bytes, number: int, is_last: bool) -> bytes:
    return about + number.to_bytes(8, "big") + (b"\1" if is_last else b"\0")


def _nonce(number: int) -> bytes:
    return number.to_bytes(NONCE_BYTES, "big")
