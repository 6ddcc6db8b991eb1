"""The bounds of a domain, in the plane or in space: the common part of both kinds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol, TypedDict

import numpy as np

from ._arrays import number
from ._names import NameTable
from .errors import InvalidArgumentError

# Segments or triangles, and seeds, of one message: about 256 KiB.
ROWS_OF_A_REQUEST = 16_384
SEEDS_OF_A_REQUEST = 4_096


class DomainArguments(TypedDict, total=False):
    """
    markers : (m,) int or str
        A marker for each of `segments`, or of `triangles`, which tells parts of the boundary apart, or the name of its
        part: see `Mesh.facet_names`. Default: 0, and "" stands for it.
    marker_names : dict of int to str
        The names of parts by their markers. Default: ``"marker_7"`` and the like.
    holes : (h, d) float
        Points in faces, or in solids, that are not meshed.
    regions : sequence of RegionSeed, RegionPolygon, SolidSeed, or (x, y, region, max_area)
        Points in faces, or in solids, that are a region of their own, or that have a largest simplex; or polygons of
        faces. In 3-D (x, y, z, region, max_volume). Regions are numbers or names.
    region_names : dict of int to str
        The names of regions by their numbers. Default: ``"region_7"`` and the like.
    """

    markers: Any
    marker_names: Mapping[int, str]
    holes: Any
    regions: Any
    region_names: Mapping[int, str]


class Bounds(Protocol):
    """The bounds of a domain, checked; for messages."""

    request_fields: tuple[int, int]  # of MeshPointsRequest: the rows, and their options
    method: str  # of SessionService
    offset_field: str  # of its request
    count_field: str  # of Session

    @property
    def row_count(self) -> int:
        """How many segments or triangles."""

    def row_chunks(self) -> Iterator[tuple[int, bytes]]:
        """Serialized chunks of rows, and the number of the first row of each."""

    def option_chunks(self, rows_before: int = 0) -> Iterator[tuple[int, bytes]]:
        """Serialized options, at least one, and the number of the first seed of each."""


def whole(value: Any, name: str, what: str, low: int, high: int) -> int:
    """A whole number from `low` to below `high`."""
    if number(value, name) != int(number(value, name)) or not low <= value < high:
        raise InvalidArgumentError(
            f"{name} has the {what} {value!r}; expected a whole number from {low} to {high - 1}", field=name
        )
    return int(value)


def region_of(value: Any, name: str, names: NameTable) -> int:
    """The number of a region, which may be given by its name."""
    return names.number_of(value) if isinstance(value, str) else whole(value, name, "region", -(2**31), 2**31)


def name_tables(given: Mapping[str, Any], before: Any) -> tuple[NameTable, NameTable]:
    """The names of parts and those of regions; `before`: the PartNames of a session, or None."""
    return (
        NameTable(given.get("marker_names", {}), "marker_names", before and before.markers),
        NameTable(given.get("region_names", {}), "region_names", before and before.regions),
    )


def numbers_of_regions(regions: Sequence[Any], at: int) -> Iterator[int]:
    """The numbers among the regions of seeds, which are attributes, or stand at `at` in their rows."""
    for one in regions:
        row = one if isinstance(one, (tuple, list, np.ndarray)) else ()
        region = row[at] if len(row) > at else getattr(one, "region", 0)
        if isinstance(region, (int, np.integer)):
            yield int(region)


def bound_of(value: Any, name: str, what: str) -> float:
    """A largest area, or volume; infinite for none."""
    if not number(value, name) > 0:
        raise InvalidArgumentError(
            f"{name} has the {what} {value!r}; expected a number above 0, or nothing for no bound", field=name
        )
    return number(value, name)


def length_of(value: Any, name: str) -> float:
    """A finite length of at least 0."""
    length = number(value, name)
    if not 0 <= length < math.inf:
        raise InvalidArgumentError(f"{name} is {length}; expected a finite number of at least 0", field=name)
    return length
