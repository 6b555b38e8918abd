"""Each question in whole sentences, to a parent, to the person, or to who looks after one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lubdub.cases.values import Person
from lubdub.web.pages.questions import Gettext


@dataclass(frozen=True)
class Wording:
    """title: the question; hint: what helps to answer it; choices: value, words and a line of explanation, if any."""

    title: str
    hint: str
    choices: tuple[tuple[str, str, str], ...] = ()


def wording_of(name: str, person: Person, _: Gettext) -> Wording:
    """The words of a question. Raises KeyError for a question without words."""
    return WORDINGS[name](person, _)


def _who(person: Person, _: Gettext) -> Wording:
    choices = (
        ("child", _("My child"), ""),
        ("self", _("Me"), ""),
        ("other", _("Somebody else I look after"), ""),
    )
    return Wording(_("Whose heart will you listen to?"), _("So that we use the right words."), choices)


def _age(person: Person, _: Gettext) -> Wording:
    titles = {"child": _("How old is your child?"), "self": _("How old are you?")}
    hint = _("The heart sits higher in small children. For a baby write 0 years and the months.")
    return Wording(titles.get(person, _("How old is the person?")), hint)


def _sex(person: Person, _: Gettext) -> Wording:
    titles = {"child": _("Is your child a girl or a boy?"), "self": _("Are you female or male?")}
    hint = _("Sex at birth. Chests are built differently after puberty.")
    choices = (("female", _("girl or woman"), ""), ("male", _("boy or man"), ""))
    return Wording(titles.get(person, _("Is the person female or male?")), hint, choices)


def _heart(person: Person, _: Gettext) -> Wording:
    title = _("Has a doctor ever said that the heart lies on the right side?")
    return Wording(title, _("This is rare. If nobody ever said so, answer No."), _yes_no(_))


def _operation(person: Person, _: Gettext) -> Wording:
    title = _("Was there a chest operation, or is there a device or an unusual chest shape?")
    hint = _("For example a long scar, a pacemaker, a very bent back, or a breastbone that is sunken or sticks out.")
    return Wording(title, hint, _yes_no(_))


def _pregnancy(person: Person, _: Gettext) -> Wording:
    titles = {"self": _("Are you in the second half of a pregnancy?")}
    title = titles.get(person, _("Is she in the second half of a pregnancy?"))
    return Wording(title, _("Late in a pregnancy the heart lies in another place."), _yes_no(_))


def _posture(person: Person, _: Gettext) -> Wording:
    titles = {"child": _("How will your child be scanned?"), "self": _("How will you be scanned?")}
    hint = _("You will listen later in the same position.")
    choices = (
        ("supine", _("Lying on the back"), _("This works best.")),
        ("sitting", _("Sitting up"), _("Only if lying down is not possible. We can be less sure.")),
    )
    return Wording(titles.get(person, _("How will the person be scanned?")), hint, choices)


def _yes_no(_: Gettext) -> tuple[tuple[str, str, str], ...]:
    return (("no", _("No"), ""), ("yes", _("Yes"), ""), ("unsure", _("I do not know"), ""))


WORDINGS: dict[str, Callable[[Person, Gettext], Wording]] = {
    "who": _who,
    "age": _age,
    "sex": _sex,
    "heart_on_right": _heart,
    "chest_operation_or_device": _operation,
    "late_pregnancy": _pregnancy,
    "posture": _posture,
}
