"""Sunder's one exception."""
from __future__ import annotations

CODES = ("ok", "bad_usage", "bad_input", "io", "numerical", "cancelled", "internal")


class Error(Exception):
    """What went wrong, where, and how to mend it.

    code       "bad_usage", "bad_input", "io", "numerical", "cancelled" or "internal"
    what       one sentence
    where      file, node, fragment, ...; may be ""
    mend       how to mend it; may be ""
    node       graph node concerned, or ""
    parameter  its parameter or socket concerned, or ""
    """

    def __init__(self, code: str, text: str, what: str = "", where: str = "", mend: str = "", node: str = "",
                 parameter: str = "") -> None:
        super().__init__(text)
        self.code, self.what, self.where, self.mend = code, what or text, where, mend
        self.node, self.parameter = node, parameter
