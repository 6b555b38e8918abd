"""What a command says when it cannot go on."""

from __future__ import annotations


class CommandFault(Exception):
    """Wrong use, or a file that cannot be used. The text is one line for the person at the keyboard."""
