"""Windows of a browser, as large as a phone's or a desk's."""

from __future__ import annotations

from playwright.sync_api import Browser, BrowserContext

SIZES = {"phone": (390, 844), "tablet": (1024, 768), "desk": (1280, 800)}
DRAW_SELDOM = """
if (location.pathname.includes("/view/")) {
  const draw = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (then) => setTimeout(() => draw(then), 80);
  window.cancelAnimationFrame = clearTimeout;
}
"""
"""The 3D view draws as often as it may. Without a graphics card that takes all processors there are, for nothing: ten
pictures a second show the same."""


def new_window(browser: Browser, base_url: str, size: str, **more: object) -> BrowserContext:
    """A fresh window; it holds no cookie yet. more: as Playwright's `new_context` takes it."""
    width, height = SIZES[size]
    context = browser.new_context(
        base_url=base_url,
        viewport={"width": width, "height": height},
        has_touch=size == "phone",
        **more,  # type: ignore[arg-type]
    )
    context.add_init_script(DRAW_SELDOM)
    return context
