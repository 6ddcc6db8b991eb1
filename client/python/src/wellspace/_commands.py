"""The command `wellspaced` of a wheel that has the server."""

from __future__ import annotations

import os
import sys

from ._server import own_program


def wellspaced() -> None:
    """Goes on as the server, with the same arguments."""
    program = own_program("wellspaced")
    if program is None:
        sys.exit("wellspaced: this package has no server inside")
    os.execv(program, ["wellspaced", *sys.argv[1:]])
