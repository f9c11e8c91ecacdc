"""Sunder's Python package as it lies in this add-on, or the reason why it cannot be used.

Everything but making new frames works without the library: trees open, and what was baked plays.
"""
import importlib

from . import descriptions

_package = None


class Unusable(Exception):
    """The library is missing, broken, or not the one that belongs to this add-on."""


def sunder():
    """The package, loaded when first needed. Raises Unusable with a sentence that says what to do."""
    global _package
    if _package is None:
        try:
            package = importlib.import_module("..sunder", __package__)
        except Exception as error:  # whatever keeps the library from loading is the answer
            again = "" if getattr(error, "mend", "") else " Install the add-on's zip again."  # which mends no other lack
            raise Unusable(f"Sunder's library cannot be loaded: {error}.{again}") from error
        if package.version() != descriptions.VERSION:
            raise Unusable(
                f"Sunder's library has version {package.version()}, this add-on {descriptions.VERSION}. Install the "
                "add-on's zip again and restart Blender."
            )
        _package = package
    return _package


def problem():
    """Why the library cannot be used; empty if it can."""
    try:
        sunder()
    except Unusable as error:
        return str(error)
    return ""


class Refused(Exception):
    """Something in the scene is wrong; `node` is the graph name of the node concerned, or empty."""

    def __init__(self, sentence, node=""):
        super().__init__(sentence)
        self.node = node
