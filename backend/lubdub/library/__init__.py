"""(3) The reference bodies: loading them, comparing them with a scan, choosing among them."""
