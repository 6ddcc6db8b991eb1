"""Files of points, domains, surfaces and meshes, whichever it is."""

from __future__ import annotations

import dataclasses
import errno
import os
import pathlib
import tempfile
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _files, _tool
from ._arrays import Floats, Indices
from ._mesh import Mesh
from ._plane import RegionPolygon, RegionSeed
from ._surface import SolidSeed
from ._surface_files import SurfaceFile, read_surface
from .errors import InvalidArgumentError

_ATTRIBUTE = "attribute_"  # what names of attributes begin with in a .npz
# The surfaces that are read without the tool.
_OWN_SURFACES = (".stl", ".obj", ".off")


@dataclasses.dataclass(frozen=True, eq=False)
class CloudFile:
    """Points as a file has them, for `wellspace.mesh`.

    Attributes
    ----------
    points : (n, d) float64
        In the order of the file.
    attributes : dict of str to (n,) float64
        What the points have beside coordinates, by its names; NaN where a point has none.
    notes : tuple of str
        What of the file was taken, and what not, a sentence each.
    """

    points: Floats
    attributes: dict[str, npt.NDArray[np.float64]]
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<wellspace.CloudFile: {len(self.points)} points in {self.points.shape[1]}-D>"


@dataclasses.dataclass(frozen=True, eq=False)
class DomainFile:
    """A domain in the plane as a file has it: ``wellspace.mesh(domain.points, **domain.arguments)`` meshes it.

    Attributes
    ----------
    points : (n, 2) float64
    arguments : dict of str to Any
        Of `wellspace.mesh`, as far as the file has them: `segments` and `markers`, `open_segments` and `open_markers`,
        `groups`, `faces`, `holes` and `regions`, `marker_names` and `region_names`.
    notes : tuple of str
        What of the file was changed, or not used, a sentence each.
    """

    points: Floats
    arguments: dict[str, Any]
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        segments = len(self.arguments["segments"]) + len(self.arguments.get("open_segments", ()))
        return f"<wellspace.DomainFile: {len(self.points)} points, {segments} segments>"


def read(
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    columns: Sequence[str | int] | None = None,
    skip_invalid: bool = False,
    segments: bool = False,
    triangles: bool | None = None,
) -> CloudFile | DomainFile | SurfaceFile | Mesh:
    """Reads a file of points, of a domain, of a surface or of a mesh, whichever its extension says.

    ``.npz`` is read by numpy, ``.stl`` as `read_surface` does, and all others by the tool `wellspace`: that
    of ``$WELLSPACE_TOOL_BINARY``, of the wheel or on the path.

    Parameters
    ----------
    path : path
        The file; ``.gz`` is unpacked.
    format : str
        The format of a file whose extension does not say it: ``"csv"``, ``"las"``, ``"geojson"`` and so on.
    columns : sequence of str or int
        The columns of a table that are the coordinates: their names, or numbers from 1.
    skip_invalid : bool
        Leaves out points that cannot be read, in place of an error.
    segments : bool
        Lines of ``.obj``, polylines of tables, and boundaries of ``.14`` are meant: a domain.
    triangles : bool
        Whether the faces of ``.stl``, ``.obj``, ``.ply`` and ``.off`` are meant, or their corners as points. Default:
        of ``.stl`` the faces, of the others the points.

    Returns
    -------
    CloudFile, DomainFile, SurfaceFile or Mesh

    Raises
    ------
    InvalidArgumentError
        The file is not of its format; with the place.
    MissingPackageError
        The tool is not installed, and is needed.
    OSError
        The file is not there, or cannot be read.
    """
    name = os.fspath(path)
    if not os.path.exists(name):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), name)
    suffix = _suffix(name)
    if suffix == ".npz" and format is None:
        found = _files.arrays_of(name)
        return Mesh.load(name) if "simplices" in found else _file_of(name, found, ())
    if triangles or (triangles is None and suffix == ".stl" and format is None and not columns and not skip_invalid):
        if suffix in _OWN_SURFACES and format is None:
            return read_surface(name)
        triangles = True
    options = ["--input-format", format] if format is not None else []
    options += ["--columns", ",".join(map(str, columns))] if columns else []
    flags = (("--skip-invalid", skip_invalid), ("--segments", segments), ("--triangles", bool(triangles)))
    options += [flag for flag, is_given in flags if is_given]
    with tempfile.TemporaryDirectory(prefix="wellspace-") as folder:
        arrays = pathlib.Path(folder) / "arrays.npz"
        figures = _tool.convert(name, arrays, options=options)
        if figures["kind"] == "mesh":
            return Mesh(**_files.load(arrays))
        return _file_of(name, _files.arrays_of(arrays), tuple(figures.get("notes", ())))


def _suffix(name: str) -> str:
    """The extension, in lower case; of ``.csv.gz`` that of the table."""
    path = pathlib.Path(name)
    return pathlib.Path(path.stem if path.suffix == ".gz" else path.name).suffix.lower()


def _file_of(path: str, found: dict[str, Any], notes: tuple[str, ...]) -> CloudFile | DomainFile | SurfaceFile:
    """What the arrays of a .npz are: client/files/feature_arrays.h has the names of those of domains."""
    points = found.get("points")
    if points is None or points.ndim != 2 or points.dtype.kind not in "fiu":
        raise InvalidArgumentError(f"{path}: no array 'points' of numbers, of two dimensions", field="path")
    points = points.astype(np.float64, copy=False)
    try:
        if "segments" in found:
            return DomainFile(points, _arguments_of_domain(found), notes)
        if "triangles" in found:
            return _surface(points, found)
    except KeyError as error:
        raise InvalidArgumentError(f"{path}: no array {error}", field="path") from error
    attributes = {name[len(_ATTRIBUTE) :]: found[name] for name in found if name.startswith(_ATTRIBUTE)}
    return CloudFile(points, attributes, notes)


def _arguments_of_domain(found: dict[str, Any]) -> dict[str, Any]:
    segments: Indices = found["segments"]
    is_open = found.get("is_open", np.zeros(len(segments), np.uint8)).astype(bool)
    closed = ~is_open
    arguments: dict[str, Any] = {"segments": segments[closed], "faces": str(found["faces"][0])}
    if is_open.any():
        arguments["open_segments"] = segments[is_open]
    if "markers" in found:
        arguments["markers"] = found["markers"][closed]
        if is_open.any():
            arguments["open_markers"] = found["markers"][is_open]
    if "groups" in found:
        arguments["groups"] = found["groups"][closed]
    if len(found["holes"]):
        arguments["holes"] = found["holes"]
    # Rings of polygons are closed segments: their numbers among these.
    before = np.concatenate([[0], np.cumsum(closed)])
    regions: list[RegionSeed | RegionPolygon] = [
        RegionSeed(x, y, int(region), bound) for x, y, region, bound in found["seeds"].tolist()
    ]
    for first, count, region, bound in found["polygons"].tolist():
        regions.append(RegionPolygon(int(before[int(first)]), int(count), int(region), bound))
    if regions:
        arguments["regions"] = regions
    names = (("marker_names", _names(found, "marker")), ("region_names", _names(found, "region")))
    return {**arguments, **{name: given for name, given in names if given}}


def _names(found: dict[str, Any], part: str) -> dict[int, str]:
    if f"{part}_names" not in found:
        return {}
    return dict(zip(found[f"named_{part}s"].tolist(), found[f"{part}_names"].tolist()))


def _surface(points: Floats, found: dict[str, Any]) -> SurfaceFile:
    return SurfaceFile(
        points=points,
        triangles=found["triangles"],
        markers=found.get("markers", np.zeros(len(found["triangles"]), np.int32)),
        names=_names(found, "marker"),
        weld=float(found["weld"][0]),
        solids=str(found["solids"][0]),
        holes=found["holes"],
        regions=tuple(SolidSeed(x, y, z, int(region), bound) for x, y, z, region, bound in found["seeds"].tolist()),
    )
