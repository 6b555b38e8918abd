"""What a browser and this service say to each other about a passkey (WebAuthn), checked by its library."""

from __future__ import annotations

import json
import secrets
from typing import Any
from urllib.parse import urlsplit

from webauthn import (
    generate_authentication_options,
    generate_registration_options,
    options_to_json,
    verify_authentication_response,
    verify_registration_response,
)
from webauthn.helpers import base64url_to_bytes
from webauthn.helpers.exceptions import WebAuthnException
from webauthn.helpers.structs import (
    AuthenticatorSelectionCriteria,
    PublicKeyCredentialDescriptor,
    ResidentKeyRequirement,
    UserVerificationRequirement,
)

from lubdub.cases.desk_values import Clinician, NewPasskey
from lubdub.cases.errors import SignInRefused
from lubdub.cases.passkeys import Passkeys
from lubdub.settings import Settings, is_loopback

NAME = "Lubdub"


class Ceremony:
    """Making and using passkeys for this very site. browser: the cookie of whoever asks; it ties question to answer.

    A passkey always asks for finger, face or PIN, so it is two factors at once.
    """

    def __init__(self, settings: Settings, passkeys: Passkeys) -> None:
        """For the site that the settings name."""
        self._site, self._origin = relying_party(settings)
        self._passkeys = passkeys

    def ask_to_make(self, browser: str, email: str, owner: Clinician | None = None) -> dict[str, Any]:
        """What the browser needs to make a passkey; the owner's present ones are not made again."""
        known = [] if owner is None else self._passkeys.list_of(owner)
        options = generate_registration_options(
            rp_id=self._site,
            rp_name=NAME,
            user_name=email,
            user_id=secrets.token_bytes(16) if owner is None else owner.id.encode(),
            challenge=self._passkeys.new_challenge(browser),
            authenticator_selection=AuthenticatorSelectionCriteria(
                resident_key=ResidentKeyRequirement.REQUIRED, user_verification=UserVerificationRequirement.REQUIRED
            ),
            exclude_credentials=[PublicKeyCredentialDescriptor(id=one.credential_id) for one in known],
        )
        return dict(json.loads(options_to_json(options)))

    def made(self, browser: str, credential: dict[str, Any], device: str) -> NewPasskey:
        """The passkey that the browser has made. Raises SignInRefused."""
        challenge = self._passkeys.take_challenge(browser)
        try:
            checked = verify_registration_response(
                credential=credential,
                expected_challenge=challenge,
                expected_rp_id=self._site,
                expected_origin=self._origin,
                require_user_verification=True,
            )
        except WebAuthnException as error:
            raise SignInRefused("passkey") from error
        return NewPasskey(checked.credential_id, checked.credential_public_key, checked.sign_count, device)

    def ask_to_use(self, browser: str) -> dict[str, Any]:
        """What the browser needs to offer the passkeys it has for this site."""
        options = generate_authentication_options(
            rp_id=self._site,
            challenge=self._passkeys.new_challenge(browser),
            user_verification=UserVerificationRequirement.REQUIRED,
        )
        return dict(json.loads(options_to_json(options)))

    def used(self, browser: str, credential: dict[str, Any]) -> Clinician:
        """Who signs in with it. Raises SignInRefused."""
        challenge = self._passkeys.take_challenge(browser)
        try:
            passkey, owner = self._passkeys.find(base64url_to_bytes(str(credential.get("id"))))
            checked = verify_authentication_response(
                credential=credential,
                expected_challenge=challenge,
                expected_rp_id=self._site,
                expected_origin=self._origin,
                credential_public_key=passkey.public_key,
                credential_current_sign_count=passkey.sign_count,
                require_user_verification=True,
            )
        except (WebAuthnException, ValueError) as error:
            raise SignInRefused("passkey") from error
        self._passkeys.note_use(passkey, checked.new_sign_count)
        return owner


def relying_party(settings: Settings) -> tuple[str, str]:
    """The name passkeys are bound to, and the origin of the pages. Browsers take no number for a name."""
    ours = urlsplit(settings.desk_address)
    host = ours.hostname or ""
    if is_loopback(host):
        return "localhost", f"{ours.scheme}://localhost:{ours.port}"
    return host, f"{ours.scheme}://{ours.netloc}"
