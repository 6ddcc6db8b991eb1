"""The tool `wellspace`, which writes and reads the files that numpy does not."""

from __future__ import annotations

import errno
import json
import os
import pathlib
import subprocess
from collections.abc import Sequence
from typing import Any

from ._server import find_program
from .errors import InvalidArgumentError, MissingPackageError

_NAME, _VARIABLE = "wellspace", "WELLSPACE_TOOL_BINARY"
_WRONG_FILE = 2  # the exit status for files that are not valid

# The extensions of meshes that it writes, beside .npz.
MESH_FORMATS = frozenset(
    (
        *(".vtu", ".vtkhdf", ".hdf", ".vtk", ".xdmf", ".msh", ".mesh", ".su2", ".inp", ".node", ".ele"),
        *(".14", ".grd", ".gr3", ".2dm"),
    )
)


def find() -> str | None:
    """The program: $WELLSPACE_TOOL_BINARY, that of the wheel, or `wellspace` on the path; none if it is not there."""
    return find_program(_NAME, _VARIABLE)


def convert(
    source: str | os.PathLike[str], target: str | os.PathLike[str], order: int = 1, options: Sequence[str] = ()
) -> dict[str, Any]:
    """Writes the mesh of a file to another one, in the formats that their extensions say, with elements of `order`.

    Returns what the tool tells of it: its figures, and notes.

    Raises
    ------
    InvalidArgumentError
        The source is no mesh, or the target cannot have it: what the tool says.
    OSError
        The target cannot be written: the folder is not there, the disk is full.
    MissingPackageError
        There is no tool.
    """
    tool = find()
    if tool is None:
        raise MissingPackageError(
            f"the tool {_NAME} is needed to convert {pathlib.Path(source).suffix} to {pathlib.Path(target).suffix}; "
            f"it is neither on the path nor named by the variable {_VARIABLE}"
        )
    folder = pathlib.Path(os.path.abspath(target)).parent
    if not folder.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), os.fspath(target))
    command = [tool, "convert", os.path.abspath(source), os.path.abspath(target), "--output", "json"]
    if order != 1:
        command += ["--order", str(order)]
    command += options
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        message = _message_of(done.stderr) or f"{_NAME} ended with {done.returncode}"
        raise InvalidArgumentError(message, field="path") if done.returncode == _WRONG_FILE else OSError(message)
    figures: dict[str, Any] = json.loads(done.stdout)
    return figures


def _message_of(output: str) -> str:
    """The message of the error that the tool has printed last; empty if there is none."""
    for line in reversed(output.splitlines()):
        try:
            return str(json.loads(line)["error"]["message"])
        except (ValueError, KeyError, TypeError):
            continue
    return ""
