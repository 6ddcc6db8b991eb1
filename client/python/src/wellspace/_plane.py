"""Segments between points in 2-D, and the faces that they bound."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _api, _wire
from ._arrays import Floats, Indices, Number, choice, coordinates, indices
from ._domain import (
    ROWS_OF_A_REQUEST,
    SEEDS_OF_A_REQUEST,
    DomainArguments,
    bound_of,
    length_of,
    name_tables,
    numbers_of_regions,
    region_of,
    whole,
)
from ._names import NameTable, names_message
from .errors import InvalidArgumentError

_FACES = _api.enum_numbers("FaceRule")
_CROSSINGS = _api.enum_numbers("CrossingRule")


@dataclasses.dataclass(frozen=True)
class RegionSeed:
    """A point that stands for the face which it lies in; it becomes no vertex.

    Parameters
    ----------
    x, y : float
        In the unit of the points. Not on a segment.
    region : int or str
        The region of the triangles there, see `Mesh.regions`: the name is ``"region_7"`` for 7. 0: that of faces
        without a seed.
    max_area : float
        No triangle there is larger. Above 0, in the unit of the points, squared. Default: no bound.
    """

    x: float
    y: float
    region: int | str = 0
    max_area: float = math.inf


@dataclasses.dataclass(frozen=True)
class RegionPolygon:
    """A polygon that names all faces inside of it, whatever else cuts it.

    Where polygons lie over each other, the one with the least area has the face; a `RegionSeed` comes before them.

    Parameters
    ----------
    first, count : int
        The rows of `segments` that are its rings: so many from the first on. Each ring is closed.
    region : int or str
        See `RegionSeed`.
    max_area : float
        See `RegionSeed`.
    """

    first: int
    count: int
    region: int | str = 0
    max_area: float = math.inf


@dataclasses.dataclass(frozen=True)
class Plane:
    """Segments, seeds and rules, checked; for messages."""

    ends: Indices  # (m, 2)
    markers: npt.NDArray[np.int32] | None  # (m,)
    first_open: int  # segments from this one on are part of no ring
    holes: Floats  # (k, 2)
    regions: tuple[RegionSeed | RegionPolygon, ...]
    faces: int
    crossings: int
    groups: npt.NDArray[np.uint32] | None  # (m,)
    snap_distance: float | None
    names: Any  # a PartNames; None: there are none

    request_fields = (4, 5)
    method = "AddSegments"
    offset_field = "segment_offset"
    count_field = "segment_count"

    @property
    def row_count(self) -> int:
        """How many segments."""
        return len(self.ends)

    def row_chunks(self) -> Iterator[tuple[int, bytes]]:
        """Serialized SegmentChunks, and the number of the first segment of each."""
        for begin, end, is_open in ((0, self.first_open, False), (self.first_open, len(self.ends), True)):
            for first in range(begin, end, ROWS_OF_A_REQUEST):
                last = min(first + ROWS_OF_A_REQUEST, end)
                message = _api.message("SegmentChunk")(open=is_open)
                if self.markers is not None:
                    message.markers.extend(self.markers[first:last].tolist())
                if self.groups is not None:
                    message.groups.extend(self.groups[first:last].tolist())
                yield first, _wire.packed_field(1, self.ends[first:last]) + message.SerializeToString()

    def option_chunks(self, rows_before: int = 0) -> Iterator[tuple[int, bytes]]:
        """Serialized FaceOptions, at least one, and the number of the first seed of each."""
        seed = _api.message("FaceSeed")
        seeds = [seed(x=x, y=y, hole=True) for x, y in self.holes.tolist()]
        for r in self.regions:
            bound = {} if math.isinf(r.max_area) else {"max_area": r.max_area}
            seeds.append(seed(region=r.region, **bound))
            if isinstance(r, RegionSeed):
                seeds[-1].x, seeds[-1].y = r.x, r.y
            else:
                seeds[-1].polygon.first, seeds[-1].polygon.count = rows_before + r.first, r.count
        for first in range(0, max(1, len(seeds)), SEEDS_OF_A_REQUEST):
            options = _api.message("FaceOptions")(faces=self.faces, crossings=self.crossings)
            if self.snap_distance is not None:
                options.snap_distance = self.snap_distance
            if first == 0 and self.names is not None:
                options.names.CopyFrom(self.names)
            options.seeds.extend(seeds[first : first + SEEDS_OF_A_REQUEST])
            yield first, options.SerializeToString()


class PlaneArguments(DomainArguments, total=False):
    """
    segments : (m, 2) int
        In 2-D: numbers of points. The mesh has each segment as a union of edges. Default: none.
    open_segments : (k, 2) int
        Segments that are part of no ring: `faces` "even-odd" and "union" pass over them.
    open_markers : (k,) int
        Their markers.
    faces : {"box", "holes", "even-odd", "union"}
        Which faces, into which segments cut the plane, are meshed: all in the box; all bounded ones; those that an odd
        number of segments separates from infinity; those of which that is so for the segments of at least one group.
        Faces with a hole never are. Default "holes", with `box` "box".
    groups : (m,) int
        For `faces` "union": a number for each of `segments`, from 0 to 2**32 - 1, the same for those of one group, as a
        feature of a map. Default: all are of one.
    crossings : {"refuse", "snap", "split"}
        The treatment of segments that cross, and of points too near to a segment. "refuse", the default: an error.
        "snap": segments are led through such points. "split": also, and crossings become vertices.
    snap_distance : float
        With `crossings` "snap" and "split": segments are led through points nearer than this, too. In the unit of the
        points. Default: distances that doubles cannot resolve.
    """

    segments: Any
    open_segments: Any
    open_markers: Any
    faces: str
    crossings: str
    groups: Any
    snap_distance: Number


def make_plane(
    given: Mapping[str, Any], point_count: int | None = None, has_box: bool = False, names_before: Any = None
) -> Plane:
    """Checks the PlaneArguments that are given; `point_count` is None where points may come later.

    `names_before`: a PartNames, the names that a session has already.
    """
    closed = indices(given.get("segments", []), "segments", 2, point_count)
    opened = indices(given.get("open_segments", []), "open_segments", 2, point_count)
    marker_names, region_names = name_tables(given, names_before)
    marked = None
    if "markers" in given or "open_markers" in given:
        parts = (("markers", len(closed)), ("open_markers", len(opened)))
        marked = np.concatenate(
            [marker_names.numbers_of(given.get(name, np.zeros(size, np.int32)), name, size) for name, size in parts]
        )
    rule = given.get("faces", "box" if has_box else "holes")
    snap_distance = given.get("snap_distance")
    regions = list(given.get("regions", ()))
    region_names.take(numbers_of_regions(regions, at=2))
    seeds = tuple(_seed(one, f"regions[{row}]", len(closed), region_names) for row, one in enumerate(regions))
    return Plane(
        ends=np.concatenate([closed, opened]),
        markers=marked,
        first_open=len(closed),
        holes=coordinates(given.get("holes", []), "holes", 2),
        regions=seeds,
        faces=choice(rule, "faces", _FACES),
        crossings=choice(given.get("crossings", "refuse"), "crossings", _CROSSINGS),
        groups=_groups(given.get("groups"), len(closed), len(opened)),
        snap_distance=None if snap_distance is None else length_of(snap_distance, "snap_distance"),
        names=names_message(marker_names, region_names),
    )


def _groups(given: Any, closed: int, opened: int) -> npt.NDArray[np.uint32] | None:
    """A group for each segment; open ones, which are of none, come last."""
    if given is None:
        return None
    numbers = np.asarray(given)
    if numbers.shape != (closed,) or not (np.issubdtype(numbers.dtype, np.integer) or numbers.size == 0):
        raise InvalidArgumentError(
            f"groups has shape {numbers.shape} and type {numbers.dtype}; expected {closed} whole numbers, one for each "
            "of segments",
            field="groups",
        )
    outside = np.flatnonzero((numbers < 0) | (numbers >= 2**32))
    if outside.size:
        raise InvalidArgumentError(
            f"groups[{outside[0]}] is {numbers[outside[0]]}; expected a whole number from 0 to {2**32 - 1}",
            field="groups",
        )
    return np.concatenate([numbers.astype(np.uint32), np.zeros(opened, np.uint32)])


def _polygon(given: RegionPolygon, name: str, segments: int, names: NameTable) -> RegionPolygon:
    first = whole(given.first, name, "first segment", 0, max(segments, 1))
    count = whole(given.count, name, "count of segments", 1, max(segments - first + 1, 2))
    region = region_of(given.region, name, names)
    return RegionPolygon(first, count, region, bound_of(given.max_area, name, "max_area"))


def _seed(value: Any, name: str, segments: int, names: NameTable) -> RegionSeed | RegionPolygon:
    """A RegionPolygon of so many segments, a RegionSeed, or (x, y[, region[, max_area]])."""
    if isinstance(value, RegionPolygon):
        return _polygon(value, name, segments, names)
    if isinstance(value, RegionSeed):
        value = dataclasses.astuple(value)
    row = list(value) if isinstance(value, (tuple, list, np.ndarray)) else []
    if not 2 <= len(row) <= 4:
        raise InvalidArgumentError(f"{name} is {value!r}; expected (x, y, region, max_area)", field=name)
    x, y, region, max_area = (*row, 0, math.inf)[:4] if len(row) < 3 else (*row, math.inf)[:4]
    place = coordinates([[x, y]], name, 2)[0].tolist()
    return RegionSeed(place[0], place[1], region_of(region, name, names), bound_of(max_area, name, "max_area"))
