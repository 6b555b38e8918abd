"""What can go wrong with a case, in the words of the people involved."""

from __future__ import annotations


class CaseNotFound(Exception):
    """There is no such case, or it is somebody else's: the two are not told apart."""


class FileNotFound(Exception):
    """The case has no such file (yet, or any more)."""


class StateConflict(Exception):
    """What was asked does not fit the case's state. The text says the state and what would be possible."""


class IdempotencyMismatch(Exception):
    """An idempotency key was used again with another body."""


class SealBroken(Exception):
    """A stored file does not open: it was changed, cut, moved to another case, or its key is gone."""
