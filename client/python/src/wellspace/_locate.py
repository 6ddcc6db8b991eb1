"""Points located in the mesh of a session."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _api, _wire
from ._arrays import Floats
from ._calls import Calls, CallOptions
from ._mesh import signed
from ._receiver import damaged
from ._retry import now
from .errors import InvalidArgumentError

_POINTS_OF_A_REQUEST = 1 << 14
_NONE = 2**32 - 1


@dataclasses.dataclass(frozen=True)
class Located:
    """Where n points lie in a mesh.

    Attributes
    ----------
    simplices : (n,) int
        The simplex that has each point; of several, as it is on a face of theirs, the one with the lowest number. -1
        for a point in none.
    vertices : (n, d + 1) int
        Its vertices.
    coordinates : (n, d + 1) float
        The barycentric coordinates of the point by these vertices: at least 0, and 0 if and only if the point is on the
        facet opposite to the vertex. All 0 for a point in none.
    revision : int
        Of the mesh.
    """

    simplices: npt.NDArray[Any]
    vertices: npt.NDArray[Any]
    coordinates: Floats
    revision: int

    def interpolate(self, values: Any) -> npt.NDArray[Any]:
        """A function with `values`, (vertices, …), at the vertices, and linear between them, at the points: (n, …).

        NaN at points in no simplex.
        """
        given = np.asarray(values)
        if given.ndim == 0 or self.vertices.max(initial=-1) >= len(given):
            raise InvalidArgumentError(
                f"values: an array of shape {given.shape}; expected a row for each vertex of the mesh", field="values"
            )
        found = np.einsum("nk,nk...->n...", self.coordinates, given[self.vertices])
        outside = self.simplices < 0
        if outside.any():
            found[outside] = np.nan
        return found


def locate(
    calls: Calls, session: str, cloud: Floats, revision: int, allow_outside: bool, options: CallOptions
) -> Located:
    """Locates points, some in each call, all in one mesh."""
    rows, dimension = cloud.shape
    simplices = np.empty(rows, np.int64)
    vertices = np.empty((rows, dimension + 1), np.uint32)
    coordinates = np.empty((rows, dimension + 1))
    deadline = math.inf if options.timeout is None else now() + options.timeout
    head = _api.message("LocateRequest")(name=session, revision=revision, allow_outside=allow_outside)
    for begin in range(0, max(1, rows), _POINTS_OF_A_REQUEST):
        part = slice(begin, min(rows, begin + _POINTS_OF_A_REQUEST))
        head.point_offset = begin
        request = head.SerializeToString() + _wire.packed_field(2, cloud[part])
        left = None if math.isinf(deadline) else max(0.0, deadline - now())
        answer = calls.unary_bytes("QueryService/Locate", request, CallOptions(timeout=left, cancel=options.cancel))
        fields = {field.number: field for field in _wire.fields(memoryview(answer))}
        targets: tuple[tuple[int, str, npt.NDArray[Any]], ...] = (
            (1, "<u4", simplices), (2, "<u4", vertices), (3, "<f8", coordinates)
        )
        for number, kind, target in targets:
            found = _wire.packed(fields[number], kind) if number in fields else np.empty(0, kind)
            if found.size != target[part].size:
                raise damaged(f"{found.size} numbers in field {number} for {part.stop - begin} points")
            target[part] = found.reshape(target[part].shape)
        head.revision = fields[4].value if 4 in fields else 0  # all parts are of one mesh
    simplices[simplices == _NONE] = -1
    return Located(simplices, signed(vertices, int(vertices.max(initial=0)) + 1), coordinates, head.revision)
