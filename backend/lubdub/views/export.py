"""The finished result as one HTML file: turns in the hand, needs no server, opens no connection."""

from __future__ import annotations

from lubdub.results import Outcome
from lubdub.views.scene import show_outcome
from lubdub.views.servers import start_server

STATIC_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob: data:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; connect-src blob: data:; "
    "base-uri 'none'; form-action 'none'"
)
"""What the file may do wherever it is opened: draw itself, and nothing else."""

PANEL_HIDING = (
    ".mantine-Paper-root,.mantine-Notification-root,[data-testid='floating-panel'],#webgl-software-rendering"
    "{display:none!important}"
    "html,body,[style*='background-color: rgb(255, 255, 255)']{background-color:#FBF8F3!important}"
    "@media (prefers-color-scheme:dark){html,body,[style*='background-color: rgb(255, 255, 255)']"
    "{background-color:#1B2528!important}}"
)


def result_html(outcome: Outcome, age_years: float | None = None) -> str:
    """The result as a self-contained page. age_years sets the size of the drawn chestpiece.

    Raises ValueError when the outcome has no scan.
    """
    server = start_server()
    try:
        show_outcome(server, outcome, age_years)
        html = server.get_scene_serializer().as_html()
    finally:
        server.stop()
    return dressed(html, STATIC_POLICY)


def dressed(html: str, policy: str | None = None) -> str:
    """A viser page with its panel hidden and, for files that carry no headers, its policy written in."""
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">' if policy else ""
    head = html.index("<head>") + len("<head>")
    html = html[:head] + meta + html[head:]
    end = html.index("</head>")
    return html[:end] + f"<style>{PANEL_HIDING}</style><title>Lubdub</title>" + html[end:]
