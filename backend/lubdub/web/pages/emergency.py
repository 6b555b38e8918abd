"""Which numbers call for help: by the country the browser speaks of, always beside the others."""

from __future__ import annotations

from fastapi import Request

EVERYWHERE = ("112", "911", "999", "119", "000")
NUMBERS: dict[str, tuple[str, ...]] = {
    "GB": ("999", "112"),
    "IE": ("112", "999"),
    "US": ("911",),
    "CA": ("911",),
    "MX": ("911",),
    "AU": ("000", "112"),
    "NZ": ("111",),
    "JP": ("119",),
    "KR": ("119",),
    "TW": ("119",),
    "CN": ("120",),
    "IN": ("112",),
    "ZA": ("112",),
    "BR": ("192",),
    "AR": ("107", "911"),
    "CL": ("131",),
    "CO": ("123",),
    "PE": ("106",),
    "ES": ("112",),
    "FR": ("15", "112"),
    "DE": ("112",),
    "AT": ("144", "112"),
    "CH": ("144", "112"),
    "IT": ("112",),
    "PT": ("112",),
    "NL": ("112",),
    "BE": ("112",),
    "SE": ("112",),
    "DK": ("112",),
    "FI": ("112",),
    "NO": ("113",),
    "PL": ("112",),
}
"""Country -> the numbers that bring an ambulance there, the most usual first. Check before adding one."""

USUAL_COUNTRY = {"ja": "JP", "ko": "KR", "de": "DE", "fr": "FR", "it": "IT", "nl": "NL", "pl": "PL", "sv": "SE"}
"""Where a language without a country is nearly always spoken. English, Spanish and Portuguese are not among them."""


def emergency_numbers(request: Request) -> tuple[str, ...]:
    """The numbers to show first. Unknown countries get those that most of the world uses."""
    for word in request.headers.get("accept-language", "").split(","):
        language, *more = word.split(";")[0].strip().split("-")
        country = more[-1].upper() if more else USUAL_COUNTRY.get(language.lower(), "")
        if country in NUMBERS:
            return NUMBERS[country]
    return EVERYWHERE[:3]
