"""Triangles between points in 3-D, and the solids that they bound."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt

from . import _api, _wire
from ._arrays import Floats, Indices, Number, choice, coordinates, indices, number
from ._domain import (
    ROWS_OF_A_REQUEST,
    SEEDS_OF_A_REQUEST,
    DomainArguments,
    bound_of,
    length_of,
    name_tables,
    numbers_of_regions,
    region_of,
)
from ._names import NameTable, names_message
from .errors import InvalidArgumentError

_SOLIDS = _api.enum_numbers("SolidRule")


@dataclasses.dataclass(frozen=True)
class SolidSeed:
    """A point that stands for the solid which it lies in; it becomes no vertex.

    Parameters
    ----------
    x, y, z : float
        In the unit of the points. Not on a triangle.
    region : int or str
        The region of the tetrahedra there, see `Mesh.regions`: the name is ``"region_7"`` for 7. 0: that of solids
        without a seed.
    max_volume : float
        No tetrahedron there is larger. Above 0, in the unit of the points, cubed. Default: no bound.
    """

    x: float
    y: float
    z: float
    region: int | str = 0
    max_volume: float = math.inf


@dataclasses.dataclass(frozen=True)
class Surface:
    """Triangles, seeds and options, checked; for messages."""

    corners: Indices  # (m, 3)
    markers: npt.NDArray[np.int32] | None  # (m,)
    holes: Floats  # (k, 3)
    regions: tuple[SolidSeed, ...]
    solids: int
    numbers: dict[str, float]  # crease_angle, weld and such, as far as they are given
    keep_points: bool
    box: tuple[list[float], list[float]] | None  # low and high corner; of solids by box alone
    names: Any  # a PartNames; None: there are none

    request_fields = (7, 8)
    method = "AddTriangles"
    offset_field = "triangle_offset"
    count_field = "triangle_count"

    @property
    def row_count(self) -> int:
        """How many triangles."""
        return len(self.corners)

    def row_chunks(self) -> Iterator[tuple[int, bytes]]:
        """Serialized TriangleChunks, and the number of the first triangle of each."""
        for first in range(0, len(self.corners), ROWS_OF_A_REQUEST):
            last = first + ROWS_OF_A_REQUEST
            message = _api.message("TriangleChunk")()
            if self.markers is not None:
                message.markers.extend(self.markers[first:last].tolist())
            yield first, _wire.packed_field(1, self.corners[first:last]) + message.SerializeToString()

    def option_chunks(self, rows_before: int = 0) -> Iterator[tuple[int, bytes]]:  # noqa: ARG002
        """Serialized SurfaceOptions, at least one, and the number of the first seed of each."""
        seed = _api.message("SolidSeed")
        seeds = [seed(x=x, y=y, z=z, hole=True) for x, y, z in self.holes.tolist()]
        for r in self.regions:
            bound = {} if math.isinf(r.max_volume) else {"max_volume": r.max_volume}
            seeds.append(seed(x=r.x, y=r.y, z=r.z, region=r.region, **bound))
        for first in range(0, max(1, len(seeds)), SEEDS_OF_A_REQUEST):
            options = _api.message("SurfaceOptions")(
                solids=self.solids, keep_points=self.keep_points, **self.numbers
            )
            if self.box is not None:
                options.box.low.extend(self.box[0])
                options.box.high.extend(self.box[1])
            if first == 0 and self.names is not None:
                options.names.CopyFrom(self.names)
            options.seeds.extend(seeds[first : first + SEEDS_OF_A_REQUEST])
            yield first, options.SerializeToString()


class TriangleArguments(TypedDict, total=False):
    """
    triangles : (m, 3) int
        In 3-D: numbers of points. Their solids are meshed, and the mesh meets them within `tolerance`; their corners
        are no vertices, unless `keep_points` says so. The orientation of a triangle means nothing, but with
        ``solids="winding"``. See `wellspace.read_surface`. Default: none.
    solids : {"even-odd", "holes", "winding", "box"}
        Which solids, into which triangles cut space, are meshed: those that an odd number of triangles separates from
        infinity; all bounded ones, as of several materials; or the places that triangles go around, which need not
        bound anything: holes are closed, overlaps united, and creases rounded off by `resolution`; or all of
        `surface_box`, which sheets that reach its sides or go beyond them cut. Solids with a hole never are. Default
        "box" with a `surface_box`, else "even-odd".
    surface_box : (2, 3) float
        With ``solids="box"``: the low and the high corner of what is meshed. Triangles are cut at its sides, which are
        parts of the boundary by the names ``"xmin"``, ``"xmax"`` and so on. In the unit of the points.
    crease_angle : float
        Edges whose triangles have normals farther apart than this are creases, which the mesh keeps. Degrees, from 0 to
        180, which is none. Default 30.
    weld : float
        Points no farther apart than this become one. In the unit of the points. Default: equal ones only.
    min_patch : float
        A part of the surface between creases that is smaller than the square of this joins a neighbour. In the unit of
        the points. Default: 1 % of the diagonal of the surface's bounding box.
    resolution : float
        With ``solids="winding"``: the side of the cells in which what is meshed is looked for. In the unit of the
        points, at most 10 % of the diagonal. Default: 0.5 % of it.
    keep_points : bool
        Whether corners of triangles are vertices, with their numbers in `input_vertices`, as points inside are. For
        surfaces that are good meshes: long triangles take far more vertices then. Default: false.
    """

    triangles: Any
    solids: str
    crease_angle: Number
    weld: Number
    min_patch: Number
    resolution: Number
    surface_box: Any
    keep_points: bool


class SurfaceArguments(DomainArguments, TriangleArguments, total=False):
    """The arguments of a domain in space."""


def make_surface(
    given: Mapping[str, Any], point_count: int | None = None, names_before: Any = None
) -> Surface:
    """Checks the SurfaceArguments that are given; `point_count` is None where points may come later.

    `names_before`: a PartNames, the names that a session has already.
    """
    marker_names, region_names = name_tables(given, names_before)
    regions = list(given.get("regions", ()))
    region_names.take(numbers_of_regions(regions, at=3))
    corners = indices(given.get("triangles", []), "triangles", 3, point_count)
    numbers = {name: length_of(given[name], name) for name in ("weld", "min_patch", "resolution") if name in given}
    if "crease_angle" in given:
        numbers["crease_angle"] = number(given["crease_angle"], "crease_angle")
        if not 0 <= numbers["crease_angle"] <= 180:
            raise InvalidArgumentError(
                f"crease_angle is {numbers['crease_angle']}; expected degrees from 0 to 180", field="crease_angle"
            )
    return Surface(
        corners=corners,
        markers=marker_names.numbers_of(given["markers"], "markers", len(corners)) if "markers" in given else None,
        holes=coordinates(given.get("holes", []), "holes", 3),
        regions=tuple(_seed(one, f"regions[{row}]", region_names) for row, one in enumerate(regions)),
        solids=choice(given.get("solids", "box" if "surface_box" in given else "even-odd"), "solids", _SOLIDS),
        numbers=numbers,
        keep_points=bool(given.get("keep_points", False)),
        box=_corners_of(given["surface_box"]) if "surface_box" in given else None,
        names=names_message(marker_names, region_names),
    )


def _corners_of(box: Any) -> tuple[list[float], list[float]]:
    """The low and the high corner of a box."""
    corners = coordinates(box, "surface_box", 3)
    if len(corners) != 2 or not (corners[0] < corners[1]).all():
        raise InvalidArgumentError(
            f"surface_box is {corners.tolist()}; expected its low and its high corner, low numbers below high ones",
            field="surface_box",
        )
    return corners[0].tolist(), corners[1].tolist()


def _seed(value: Any, name: str, names: NameTable) -> SolidSeed:
    """A SolidSeed, or (x, y, z[, region[, max_volume]])."""
    if isinstance(value, SolidSeed):
        value = dataclasses.astuple(value)
    row = list(value) if isinstance(value, (tuple, list, np.ndarray)) else []
    if not 3 <= len(row) <= 5:
        raise InvalidArgumentError(f"{name} is {value!r}; expected (x, y, z, region, max_volume)", field=name)
    x, y, z, region, max_volume = (*row, 0, math.inf)[:5] if len(row) < 4 else (*row, math.inf)[:5]
    x, y, z = coordinates([[x, y, z]], name, 3)[0].tolist()
    return SolidSeed(x, y, z, region_of(region, name, names), bound_of(max_volume, name, "max_volume"))
