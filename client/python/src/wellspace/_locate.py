"""Points located in the mesh of a session."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _api, _wire
from ._arrays import Floats
from ._calls import Calls, CallOptions
from ._located import Located
from ._mesh import signed
from ._receiver import damaged
from ._retry import now

_POINTS_OF_A_REQUEST = 1 << 14
_NONE = 2**32 - 1


def locate(
    calls: Calls, session: str, cloud: Floats, revision: int | None, allow_outside: bool, options: CallOptions
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
        found_revision, vertex_count = (int(fields[number].value) if number in fields else 0 for number in (4, 5))
        if not found_revision or (head.HasField("revision") and found_revision != head.revision):
            raise damaged(f"points in the mesh of revision {found_revision}, not {head.revision}")
        _check(simplices[part], vertices[part], coordinates[part], vertex_count, allow_outside)
        head.revision = found_revision  # all parts are of one mesh
    simplices[simplices == _NONE] = -1
    return Located(simplices, signed(vertices, vertex_count), coordinates, head.revision, vertex_count)


def _check(
    simplices: npt.NDArray[Any], vertices: npt.NDArray[Any], coordinates: Floats, count: int, allow_outside: bool
) -> None:
    """Whether points can lie so in a mesh of `count` vertices."""
    inside = simplices != _NONE
    if not (allow_outside or inside.all()):
        raise damaged("a point in no simplex, which was not allowed")
    if vertices[inside].max(initial=0) >= max(1, count):
        raise damaged(f"a point at vertex {vertices[inside].max()} of {count}")
    most = np.where(inside, 1 + 1e-9, 0.0)[:, np.newaxis]  # but for rounding
    if not ((coordinates >= 0) & (coordinates <= most)).all():
        raise damaged("barycentric coordinates below 0, above 1, or not numbers")
    vertices[~inside] = 0
