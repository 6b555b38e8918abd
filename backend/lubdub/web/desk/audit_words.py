"""The audit trail's actions in plain words; who takes the trail out gets the codes."""

from __future__ import annotations

from collections.abc import Callable


def action_words(_: Callable[[str], str]) -> dict[str, str]:
    """Code of an action -> what was done."""
    return _about_cases(_) | _about_reviews(_) | _about_people(_) | _about_portals(_)


def _about_cases(_: Callable[[str], str]) -> dict[str, str]:
    return {
        "case.create": _("Opened a case"),
        "case.delete": _("Deleted a case with all that belonged to it"),
        "case.retention": _("Deleted a case whose time was over"),
        "case.hold": _("Put a legal hold on a case"),
        "case.release": _("Lifted a legal hold"),
        "case.deleted_since_backup": _("Deleted a case again that a backup had brought back"),
        "scan.receive": _("Sent a scan"),
        "scan.unit": _("Corrected the size of a scan"),
        "landmarks.place": _("Marked the points of a body"),
        "job.start": _("Began to work on a case"),
        "job.cancel": _("Stopped the work on a case"),
        "job.check": _("Checked a scan"),
        "job.locate": _("Looked for the four places"),
        "result.read": _("Read a result"),
        "surface.read": _("Took out the body's surface"),
        "sheet.read": _("Took out the printed sheet"),
        "view.read": _("Looked at a result in 3D"),
        "fhir.read": _("Took out a result as FHIR"),
        "handoff.offer": _("Made a code to move a case to another device"),
        "handoff.take": _("Moved a case to another device"),
        "sharing.agree": _("Agreed that a scan helps to improve Lubdub"),
        "sharing.take_back": _("Took that agreement back"),
        "sharing.use": _("Used a shared scan to improve Lubdub"),
        "reference.read": _("Looked at a reference body"),
        "reference.mark": _("Marked the places on a reference body"),
        "reference.withdraw": _("Took back marks on a reference body"),
    }


def _about_reviews(_: Callable[[str], str]) -> dict[str, str]:
    return {
        "review.send": _("Sent a result to the clinicians"),
        "review.take_back": _("Took a result back from the clinicians"),
        "review.read": _("Opened a case at the desk"),
        "review.look": _("Looked at a place"),
        "review.move": _("Moved a place"),
        "review.undo": _("Undid a move"),
        "review.landmarks": _("Moved a point and had the places looked for again"),
        "review.sign": _("Signed a result"),
        "review.return": _("Returned a case to the family"),
        "review.unusable": _("Said that a scan cannot be used"),
    }


def _about_people(_: Callable[[str], str]) -> dict[str, str]:
    return {
        "sign_in": _("Signed in"),
        "sign_in.refused": _("Was not let in: something did not fit"),
        "sign_out": _("Signed out"),
        "clinician.invite": _("Made a link for a colleague"),
        "clinician.uninvite": _("Took back a colleague's link"),
        "clinician.join": _("Made an account"),
        "clinician.role": _("Changed somebody's role"),
        "clinician.disable": _("Shut somebody out"),
        "clinician.enable": _("Let somebody in again"),
        "clinician.renew": _("Made a link for a new password or passkey"),
        "clinician.renewed": _("Chose a new password or passkey by a link"),
        "clinician.login": _("Signed in by the organisation's login for the first time"),
        "clinician.password": _("Changed the password"),
        "passkey.add": _("Added a passkey"),
        "passkey.remove": _("Removed a passkey"),
        "desk.first_link": _("Made the link for the first account"),
        "service.backup": _("Made a backup of the service"),
        "service.restore": _("Brought the service back from a backup"),
        "master_key.rotate": _("Replaced the key that seals everything"),
        "master_key.retire": _("Ended the old key that sealed everything"),
        "audit.export": _("Took out the audit trail"),
        "family.invite": _("Asked a family for a scan"),
        "family.invite_again": _("Made a family's link anew"),
        "family.uninvite": _("Took back a family's link"),
        "family.arrive": _("A family opened its link"),
        "family.wrong_birth_date": _("A family's date of birth did not fit"),
    }


def _about_portals(_: Callable[[str], str]) -> dict[str, str]:
    return {
        "key.create": _("Made a portal's key"),
        "key.rotate": _("Replaced a portal's key"),
        "key.revoke": _("Ended a portal's key"),
        "webhook.create": _("Set up an address that is told of changes"),
        "webhook.change": _("Changed an address that is told of changes"),
        "webhook.delete": _("Removed an address that is told of changes"),
        "webhook.rotate": _("Replaced the secret of an address that is told of changes"),
        "embedding.origins": _("Changed whose pages may show Lubdub in a frame"),
        "embed.offer": _("Made a link that shows a case in a portal's page"),
        "embed.take": _("Opened a case in a portal's page"),
    }
