"""viser scenes, their loopback servers, the proxy's message rules, and the static export."""
