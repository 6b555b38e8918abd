"""The commands of `./lubdub`, one module each: check what was typed, call the room that does it, say one line."""
