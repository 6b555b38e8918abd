"""What can go wrong with a case, in the words of the people involved."""

from __future__ import annotations


class CaseNotFound(Exception):
    """There is no such case, or it is somebody else's: the two are not told apart."""


class FileNotFound(Exception):
    """The case has no such file (yet, or any more)."""


class StateConflict(Exception):
    """What was asked does not fit the case's state. The text says the state and what would be possible."""


class CaseHeld(StateConflict):
    """The case is under a legal hold: whoever set it must lift it before anything is deleted."""

    def __init__(self) -> None:
        """Always in the same words; the reason is for the desk alone."""
        super().__init__("This case is under a legal hold and cannot be deleted until the hold is lifted.")


class KeyNotFound(Exception):
    """There is no such key, or it is another portal's: the two are not told apart."""


class WebhookNotFound(Exception):
    """There is no such webhook, or it is another portal's: the two are not told apart."""


class DeliveryNotFound(Exception):
    """The webhook has no such message, or its log was dropped."""


class BadCursor(Exception):
    """A cursor was not made here, or was changed."""


class IdempotencyMismatch(Exception):
    """An idempotency key was used again with another call."""


class SealBroken(Exception):
    """A stored file does not open: it was changed, cut, moved to another case, or its key is gone."""


class UploadNotFound(Exception):
    """There is no such upload, it is somebody else's, it ended, or it waited too long."""


class WrongOffset(Exception):
    """A piece of an upload does not begin where the bytes that are here end."""


class LinkSpent(Exception):
    """The link was used before, is too old, or never was one: the three are not told apart."""


class FrameLinkSpent(LinkSpent):
    """A link into a frame was spent. origins: whose pages may be told so inside them; none for an unknown link."""

    def __init__(self, origins: tuple[str, ...]) -> None:
        super().__init__("embed")
        self.origins = origins


class ReviewMoved(StateConflict):
    """Somebody else went on with the review meanwhile. Nothing was changed by the call."""


class SignInRefused(Exception):
    """Name, password and code do not fit together. Which of them is not said."""


class NotAllowed(Exception):
    """It is nobody of the own organisation, or it would leave that without an administrator. Said in one sentence."""


class EmailTaken(Exception):
    """Somebody has an account under this e-mail address already."""


class WrongBirthDate(Exception):
    """The date of birth does not fit the invitation."""

    def __init__(self, left: int) -> None:
        """left: how many more may be tried."""
        super().__init__(f"{left} more tries.")
        self.left = left


class TooManyTries(Exception):
    """Something that can be guessed was tried too often."""

    def __init__(self, seconds: int) -> None:
        """seconds: until it may be tried again."""
        super().__init__(f"Try again in {seconds} seconds.")
        self.seconds = seconds


class BodyNotFound(Exception):
    """There is no such reference body, or it is a patient's of another organisation: the two are not told apart."""


class StartedTooOften(Exception):
    """A job was taken up again and again and never came to an end."""
