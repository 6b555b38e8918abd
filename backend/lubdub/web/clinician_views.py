"""What live views that each clinician has of their own share: who has what open, and when it is stopped."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection

from lubdub.cases.reviewing import Reviewer
from lubdub.views.servers import OpenView
from lubdub.web.following import Content, RegisteredViews


class ClinicianViews(RegisteredViews[Content], ABC):
    """One view for each clinician and subject, which is the id of a case or of a body."""

    def running(self, subject: str, by: Reviewer) -> OpenView[Content] | None:
        """The clinician's view of the subject if it is open."""
        return self._registry.get(key_of(subject, by))

    def is_watched(self, subject: str, by: Reviewer, window: str) -> bool:
        """Whether this window of a browser is attached to the clinician's view."""
        return self._registry.is_watched(key_of(subject, by), window)

    def watched(self, subject: str, by: Reviewer, change: int, window: str) -> None:
        """A browser's window came or went."""
        self._registry.watched(key_of(subject, by), change, window)

    def look_again(self) -> None:
        """Stop views of what is there no more, whichever process took it away. Off the event loop only."""
        shown = self._registry.ids()
        living = self._living({_subject_of(key) for key in shown}) if shown else ()
        for key in shown:
            if _subject_of(key) not in living:
                self._registry.close(key)

    @abstractmethod
    def _living(self, subjects: set[str]) -> Collection[str]:
        """Those of the subjects that may still be shown, perhaps among others."""


def key_of(subject: str, by: Reviewer) -> str:
    """The name under which the registry keeps the clinician's view."""
    return f"{subject}.{by.actor.id}"


def _subject_of(key: str) -> str:
    return key.partition(".")[0]
