"""Sizes at points: the demands of an adaptive solver on a mesh."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, TypedDict

import numpy as np

from . import _api, _wire
from ._arrays import Floats, choice, coordinates, row_of_numbers
from ._calls import Calls, CallOptions
from ._retry import Attempt
from .errors import InvalidArgumentError

_SAMPLES_OF_A_REQUEST = 16_384

_UNITS = {"radius": 1, "edge": 2}  # of the service: SizeMeasure


class SizeArguments(TypedDict, total=False):
    """
    size_points : (m, d) float
        Points that have a size each, in the domain or outside of it. The bound on the circumradius of a simplex is the
        least, over all of them, of the size plus `gradation` times the distance of the circumcentre. In any order.
        Default: none.
    size_values : (m,) float
        Their sizes, above 0. In the unit of the points.
    size_unit : {"radius", "edge"}
        The measure of `size_values`: bounds on circumradii, or lengths of edges, see `edge_length`. Default "radius".
    """

    size_points: Any
    size_values: Any
    size_unit: str


@dataclasses.dataclass(frozen=True)
class SizeField:
    """Sizes, checked, and where they are; for messages."""

    points: Floats | None  # (m, d); None: the vertices of a session's mesh
    values: Floats  # (m,)
    unit: int

    def chunks(self) -> Iterator[bytes]:
        """Serialized SizeSamples, at least one; without points, VertexSizes."""
        for first in range(0, max(1, len(self.values)), _SAMPLES_OF_A_REQUEST):
            part = slice(first, first + _SAMPLES_OF_A_REQUEST)
            points = b"" if self.points is None else _wire.packed_field(1, self.points[part])
            yield points + _wire.packed_field(2, self.values[part]) + _wire.varint(3 << 3) + _wire.varint(self.unit)


def make_size_field(given: Mapping[str, Any], dimension: int) -> SizeField:
    """Checks the SizeArguments that are given.

    Raises
    ------
    InvalidArgumentError
        Its field is the argument, or the row of it.
    """
    for name, other in (("size_points", "size_values"), ("size_values", "size_points")):
        if name not in given:
            raise InvalidArgumentError(f"{other} without {name}; expected both", field=name)
    points = coordinates(given["size_points"], "size_points", dimension)
    return SizeField(
        points, check_sizes(given["size_values"], "size_values", len(points)), unit_of(given.get("size_unit"))
    )


def check_sizes(values: Any, name: str, count: int | None) -> Floats:
    """`values` as (count,) sizes above 0."""
    sizes = row_of_numbers(values, name, count)
    wrong = np.flatnonzero(sizes <= 0)
    if len(wrong):
        row = wrong[0]
        raise InvalidArgumentError(
            f"{name}[{row}] is {sizes[row]}; expected a number above 0", field=f"{name}[{row}]"
        )
    return sizes


def unit_of(unit: str | None) -> int:
    """The number of a `size_unit`."""
    return choice(unit or "radius", "size_unit", _UNITS)


def set_sizes(
    calls: Calls,
    session: str,
    field: SizeField,
    mesh_revision: int | None,
    expected_revision: int | None,
    options: CallOptions,
) -> int:
    """Replaces the sizes of a session; returns how many it has then. They are taken together, so repeating is safe.

    An attempt may have been taken though its answer was lost: the same sizes are no change, whatever the revision is.
    """

    def attempt_once(attempt: Attempt) -> Any:
        head = _api.message("SetSizesRequest")(name=session, expected_revision=expected_revision)
        if field.points is None:
            head.vertex_sizes.SetInParent()
            if mesh_revision is not None:
                head.vertex_sizes.mesh_revision = mesh_revision
        number = 3 if field.points is not None else 4
        requests = [head.SerializeToString(), *(_wire.message_field(number, chunk) for chunk in field.chunks())]
        return calls.attempt_upload("SessionService/SetSizes", requests, "SetSizesResponse", attempt)

    return int(calls.run(options, attempt_once).size_count)
