"""Surfaces in 3-D from files."""

from __future__ import annotations

import dataclasses
import gzip
import os
import pathlib
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import Floats, Indices
from ._surface import SolidSeed
from .errors import InvalidArgumentError

# Corners of an STL that are nearer to each other, as a share of the diagonal, have been rounded apart.
_WELD = 1e-6

_STL_HEADER, _STL_TRIANGLE = 84, 50
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclasses.dataclass(frozen=True, eq=False)
class SurfaceFile:
    """A surface as a file has it, for `wellspace.mesh`.

    Attributes
    ----------
    points : (n, 3) float64
    triangles : (m, 3) uint32
        Numbers of points.
    markers : (m,) int32
        Which part each triangle is of: 1, 2, … in the order of the names' first appearance; 0 without a name.
    names : dict of int to str
        The names of markers: of solids of an STL, of groups of an OBJ.
    weld : float
        Points no farther apart than this are meant to be one: of an STL 1e-6 of the diagonal, otherwise 0.
    solids : str
        Which solids are meant; see `wellspace.mesh`. ``"holes"`` of TetGen's files.
    holes : (h, 3) float64
        Of TetGen's files: points in solids that are not meant.
    regions : tuple of SolidSeed
        Of TetGen's files: points in solids that are a region of their own.
    """

    points: Floats
    triangles: Indices
    markers: npt.NDArray[np.int32]
    names: dict[int, str]
    weld: float
    solids: str = "even-odd"
    holes: Floats = dataclasses.field(default_factory=lambda: np.empty((0, 3)))
    regions: tuple[SolidSeed, ...] = ()

    @property
    def arguments(self) -> dict[str, Any]:
        """Of `wellspace.mesh`: ``wellspace.mesh(part.points, **part.arguments)`` meshes the inside."""
        given = {"triangles": self.triangles, "markers": self.markers, "solids": self.solids, "weld": self.weld}
        if names := {marker: name for marker, name in self.names.items() if _is_part_name(name)}:
            given["marker_names"] = names
        if len(self.holes):
            given["holes"] = self.holes
        if self.regions:
            given["regions"] = self.regions
        return given


def _is_part_name(name: str) -> bool:
    """Whether the service takes it for the name of a part: core/features/part_names.h says which."""
    is_default = re.fullmatch(r"(marker|region)_[-0-9]+|unmarked|domain", name) is not None
    return 0 < len(name.encode()) <= 255 and not is_default and not re.search(r"[\x00-\x1f\x7f]", name)


def read_surface(path: str | os.PathLike[str]) -> SurfaceFile:
    """Reads a surface in 3-D: .stl (text or binary), .obj or .off, and .gz of these.

    Faces of more than three corners, which are to be convex, become a fan of triangles. `wellspace.read` reads more
    formats, by the tool.

    The inside of ``part = read_surface("part.stl")`` is meshed by ``wellspace.mesh(part.points, **part.arguments)``.

    Raises
    ------
    InvalidArgumentError
        The file is not such a one; with the line, or the byte.
    """
    file = pathlib.Path(path)
    suffix = pathlib.Path(file.stem if file.suffix == ".gz" else file.name).suffix.lower()
    reader = _READERS.get(suffix)
    if reader is None:
        raise InvalidArgumentError(f"{path}: expected one of {', '.join(_READERS)}, or .gz of these", field="path")
    opened = gzip.open(file, "rb") if file.suffix == ".gz" else open(file, "rb")
    with opened as stream:
        try:
            content = stream.read()
        except (EOFError, gzip.BadGzipFile) as error:
            raise InvalidArgumentError(f"{path}: {error}", field="path") from error
    surface = reader(str(path), content)
    if not len(surface.triangles):
        raise InvalidArgumentError(f"{path}: no triangles; expected at least one", field="path")
    if not np.isfinite(surface.points).all():
        row = int(np.argwhere(~np.isfinite(surface.points))[0][0])
        raise InvalidArgumentError(f"{path}: point {row} is not finite", field="path")
    return surface


class _Parts:
    """Triangles as they come, and the markers of their names."""

    def __init__(self, path: str) -> None:
        self._path = path
        self.points: list[Sequence[float]] = []
        self.triangles: list[tuple[int, int, int]] = []
        self.markers: list[int] = []
        self._marker_of: dict[str, int] = {}

    def marker(self, name: str) -> int:
        return self._marker_of.setdefault(name, len(self._marker_of) + 1) if name else 0

    def wrong(self, line: int, what: str) -> InvalidArgumentError:
        return InvalidArgumentError(f"{self._path}:{line}: {what}", field="path")

    def numbers(self, line: int, fields: Sequence[bytes], what: str) -> list[float]:
        try:
            return [float(field) for field in fields]
        except ValueError as error:
            raise self.wrong(line, f"expected {what}: {error}") from error

    def add_face(self, line: int, corners: Sequence[int], marker: int) -> None:
        if len(corners) < 3:
            raise self.wrong(line, f"a face of {len(corners)} corners; expected three or more")
        bad = next((corner for corner in corners if not 0 <= corner < len(self.points)), None)
        if bad is not None:
            raise self.wrong(line, f"a corner that is no point; there are {len(self.points)} points before it")
        for second, third in zip(corners[1:], corners[2:]):
            self.triangles.append((corners[0], second, third))
            self.markers.append(marker)

    def surface(self, weld: float = 0) -> SurfaceFile:
        return SurfaceFile(
            points=np.array(self.points, np.float64).reshape(-1, 3),
            triangles=np.array(self.triangles, np.uint32).reshape(-1, 3),
            markers=np.array(self.markers, np.int32),
            names={marker: name for name, marker in self._marker_of.items()},
            weld=weld,
        )


def _lines(content: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """The fields of lines that have any, without comments, and their numbers from 1 on."""
    for number, line in enumerate(content.splitlines(), 1):
        fields = re.split(rb"(?:^|\s)#", line, maxsplit=1)[0].split()
        if fields:
            yield number, fields


def _joined(corners: Floats, markers: Sequence[int] | npt.NDArray[np.int32], names: dict[int, str]) -> SurfaceFile:
    """Triangles with corners of their own, (3 m, 3), of which those that are equal become one point."""
    corners = corners + 0.0  # -0 is 0
    _, first, inverse = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # in the order of their first appearance
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    points = corners[first[order]]
    diagonal = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0))) if len(points) else 0.0
    return SurfaceFile(
        points=points,
        triangles=rank[inverse.reshape(-1)].reshape(-1, 3).astype(np.uint32),
        markers=np.asarray(markers, np.int32),
        names=names,
        weld=_WELD * diagonal,
    )


def _read_stl(path: str, content: bytes) -> SurfaceFile:
    if len(content) >= _STL_HEADER:
        count = int.from_bytes(content[80:84], "little")
        if len(content) == _STL_HEADER + count * _STL_TRIANGLE:
            rows = np.frombuffer(content, _TRIANGLE, count, _STL_HEADER)
            return _joined(rows["corners"].reshape(-1, 3).astype(np.float64), np.zeros(count, np.int32), {})
    if not content.lstrip()[:5].lower() == b"solid":
        raise InvalidArgumentError(
            f"{path}: expected an STL: \"solid\", or a header of 84 bytes and 50 for each triangle it announces, got "
            f"{len(content)} bytes",
            field="path",
        )
    return _read_text_stl(path, content)


def _read_text_stl(path: str, content: bytes) -> SurfaceFile:
    parts = _Parts(path)
    marker = 0
    corners = 0  # of the facet that has begun
    names: dict[str, int] = {}
    for number, line in enumerate(content.splitlines(), 1):
        fields = line.split()
        word = fields[0].lower() if fields else b""
        if word == b"solid":
            name = b" ".join(fields[1:]).decode("utf-8", "replace")
            marker = names.setdefault(name, len(names) + 1) if name else 0
        elif word == b"vertex":
            if len(fields) != 4:
                raise parts.wrong(number, f"expected vertex x y z, got {len(fields) - 1} numbers")
            parts.points.append(parts.numbers(number, fields[1:], "coordinates"))
            corners += 1
        elif word == b"endfacet":
            if corners != 3:
                raise parts.wrong(number, f"a facet of {corners} corners; expected three")
            parts.markers.append(marker)
            corners = 0
    if corners:
        raise InvalidArgumentError(f"{path}: the file ends in a facet", field="path")
    points = np.array(parts.points, np.float64).reshape(-1, 3)
    return _joined(points, parts.markers, {marker: name for name, marker in names.items()})


def _read_obj(path: str, content: bytes) -> SurfaceFile:
    parts = _Parts(path)
    group = body = ""
    for number, fields in _lines(content):
        word = fields[0]
        if word == b"v":
            if len(fields) < 4:
                raise parts.wrong(number, f"expected v x y z, got {len(fields) - 1} numbers")
            parts.points.append(parts.numbers(number, fields[1:4], "coordinates"))
        elif word in (b"g", b"o"):
            name = b" ".join(fields[1:]).decode("utf-8", "replace")
            group, body = (name, body) if word == b"g" else (group, name)
        elif word == b"f":
            try:
                given = [int(field.split(b"/")[0]) for field in fields[1:]]
            except ValueError as error:
                raise parts.wrong(number, f"expected numbers of vertices: {error}") from error
            corners = [one - 1 if one > 0 else len(parts.points) + one if one < 0 else -1 for one in given]
            parts.add_face(number, corners, parts.marker(group or body))
    return parts.surface()


def _read_off(path: str, content: bytes) -> SurfaceFile:
    parts = _Parts(path)
    lines = _lines(content)
    number, fields = next(lines, (1, [b""]))
    if fields[0] != b"OFF":
        raise parts.wrong(number, "expected OFF at the start of the file")
    if len(fields) == 1:
        number, fields = next(lines, (number, [b""]))
    else:
        fields = fields[1:]
    counts = parts.numbers(number, fields[:2], "the numbers of points and faces")
    if len(counts) != 2 or any(one < 0 or one != int(one) for one in counts):
        raise parts.wrong(number, "expected the numbers of points and faces")
    for _ in range(int(counts[0])):
        number, fields = next(lines, (number, list[bytes]()))
        if len(fields) < 3:
            raise parts.wrong(number, f"expected {int(counts[0])} points, got {len(parts.points)}")
        parts.points.append(parts.numbers(number, fields[:3], "coordinates"))
    for face in range(int(counts[1])):
        number, fields = next(lines, (number, list[bytes]()))
        try:
            size, *rest = (int(field) for field in fields)
        except ValueError as error:
            raise parts.wrong(number, f"expected face {face} of {int(counts[1])}: {error}") from error
        if len(rest) < size:
            raise parts.wrong(number, f"a face of {size} corners has {len(rest)}")
        parts.add_face(number, rest[:size], rest[size] if len(rest) == size + 1 else 0)
    return parts.surface()


_READERS: dict[str, Callable[[str, bytes], SurfaceFile]] = {".stl": _read_stl, ".obj": _read_obj, ".off": _read_off}
