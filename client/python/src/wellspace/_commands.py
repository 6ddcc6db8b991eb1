"""The commands `wellspace` and `wellspaced` of a wheel that has the tool and the server."""

from __future__ import annotations

import os
import sys
from typing import NoReturn

from ._server import own_program


def wellspace() -> NoReturn:
    """Goes on as the tool, with the same arguments."""
    _go_on_as("wellspace")


def wellspaced() -> NoReturn:
    """Goes on as the server, with the same arguments."""
    _go_on_as("wellspaced")


def _go_on_as(name: str) -> NoReturn:
    program = own_program(name)
    if program is None:
        sys.exit(f"{name}: this package has no such program inside")
    os.execv(program, [name, *sys.argv[1:]])
