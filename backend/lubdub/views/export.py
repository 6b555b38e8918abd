"""The finished result as one HTML file: turns in the hand, needs no server, opens no connection."""

from __future__ import annotations

import json
from pathlib import Path

from lubdub.results import Outcome
from lubdub.views.framing import Camera, close_to, framed
from lubdub.views.scene import VIEW, Sides, show_outcome
from lubdub.views.servers import start_server

STATIC_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob: data:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; connect-src blob: data:; "
    "base-uri 'none'; form-action 'none'"
)
"""What the file may do wherever it is opened: draw itself, and nothing else."""

PANEL_HIDING = (
    ".mantine-Paper-root,.mantine-Notification-root,[data-testid='floating-panel'],#webgl-software-rendering,noscript"
    "{display:none!important}"
    "html,body,[style*='background-color: rgb(255, 255, 255)']{background-color:#FBF8F3!important}"
    "@media (prefers-color-scheme:dark){html,body,[style*='background-color: rgb(255, 255, 255)']"
    "{background-color:#1B2528!important}}"
)


def result_html(outcome: Outcome, age_years: float | None = None, sides: Sides | None = None) -> str:
    """The result as a self-contained page. age_years sets the size of the drawn chestpiece,
    sides the words on the plates.

    Raises ValueError when the outcome has no scan.
    """
    server = start_server()
    try:
        show_outcome(server, outcome, age_years, sides)
        html = server.get_scene_serializer().as_html()
    finally:
        server.stop()
    return _turning(dressed(html, STATIC_POLICY), outcome)


def _turning(html: str, outcome: Outcome) -> str:
    """The page with the script that turns it to a place when the page around it asks, and where to stand for each."""
    if outcome.scan is None:
        return html
    whole = framed(outcome.scan, outcome.landmarks)
    views = {"all": _stand(whole)} | {name: _stand(close_to(area, whole)) for name, area in outcome.areas.items()}
    data = f'<script type="application/json" id="lubdub-views">{json.dumps(views)}</script>'
    return scripted(html, "turning.js", data)


def scripted(html: str, name: str, data: str = "") -> str:
    """A viser page with this script of ours, which may reach into it, and what the script reads."""
    scripts = [(Path(__file__).parent / one).read_text(encoding="utf-8") for one in ("inside.js", name)]
    end = html.rindex("</body>")
    return f"{html[:end]}{data}{''.join(f'<script>{script}</script>' for script in scripts)}{html[end:]}"


def _stand(camera: Camera) -> dict[str, list[float]]:
    return {
        name: (place * VIEW).round(5).tolist() for name, place in (("eye", camera.position), ("target", camera.look_at))
    }


def dressed(html: str, policy: str | None = None) -> str:
    """A viser page with its panel hidden and, for files that carry no headers, its policy written in."""
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">' if policy else ""
    head = html.index("<head>") + len("<head>")
    html = html[:head] + meta + html[head:]
    end = html.index("</head>")
    return html[:end] + f"<style>{PANEL_HIDING}</style><title>Lubdub</title>" + html[end:]
