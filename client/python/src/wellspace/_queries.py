"""Queries about vertices of a session, which answer in streams; vertices that are added."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _api, _wire
from ._arrays import Floats, Indices, indices
from ._calls import Calls, CallOptions
from ._cells import CellReader
from ._mesh import signed
from ._receiver import damaged
from ._retry import Attempt, now
from .errors import Error, InvalidArgumentError

_VERTICES_OF_A_REQUEST = 1 << 17  # which then has half a MiB
_BYTES_OF_AN_ADDITION = 3 << 20  # of points, in one request: three quarters of a server's limit


def stream_answers(
    calls: Calls, method: str, head: bytes, vertices: Indices, take: Callable[[bytes], int], options: CallOptions
) -> None:
    """Makes as many calls as the vertices take, and goes on after the last that was answered.

    Answers of a call about all vertices, which is one without any, are not counted beforehand: it is repeated only as
    long as nothing has come. `take` keeps an answer and says how many vertices it was about.
    """
    answered = 0
    deadline = math.inf if options.timeout is None else now() + options.timeout

    def attempt_once(attempt: Attempt) -> None:
        nonlocal answered
        part = vertices[answered : begin + _VERTICES_OF_A_REQUEST]
        end = answered + len(part)
        if len(vertices) and not len(part):
            return  # a request without vertices would ask about all
        request = head + _wire.packed_field(2, part)
        try:
            with calls.stream(method, request, attempt) as answers:
                for answer in answers:
                    answered += take(answer)
                    attempt.progressed = True
                    if len(vertices) and answered > end:
                        raise attempt.final(damaged(f"answers about more than {end} vertices"))
        except Error as error:
            if len(vertices) and answered == end and error.code != "DATA_LOSS":
                return  # a connection that breaks after the last answer costs nothing
            attempt.is_final = not len(vertices) and answered > 0 and not attempt.cancel.is_cancelled
            raise
        if len(vertices) and answered != end:
            raise attempt.final(damaged(f"answers about {answered} of {end} vertices"))

    for begin in range(0, max(1, len(vertices)), _VERTICES_OF_A_REQUEST):
        left = None if math.isinf(deadline) else max(0.0, deadline - now())
        calls.run(CallOptions(timeout=left, cancel=options.cancel), attempt_once)


def nearest_distances(calls: Calls, session: str, vertices: Indices, options: CallOptions) -> npt.NDArray[np.float64]:
    """The distances of the vertices to their nearest ones."""
    parts: list[npt.NDArray[Any]] = [np.empty(0)]

    def take(answer: bytes) -> int:
        found = [_wire.packed(f, "<f8") for f in _wire.fields(memoryview(answer)) if f.number == 1]
        if any((~(part >= 0)).any() for part in found):
            raise damaged("a distance that is negative or not a number")
        parts.extend(found)
        return sum(map(len, found))

    head = _api.message("ApproximateNearestNeighborsRequest")(name=session).SerializeToString()
    stream_answers(calls, "QueryService/ApproximateNearestNeighbors", head, vertices, take, options)
    return np.concatenate(parts)


def stream_cells(
    calls: Calls, session: str, vertices: Indices, beta: float | None, reader: CellReader, options: CallOptions
) -> None:
    """The cells of the vertices, to `reader`; clipped ones with `beta`."""
    if beta is None:
        method, head = "QueryService/VoronoiCells", _api.message("VoronoiCellsRequest")(name=session)
    else:
        method = "QueryService/ClippedVoronoiCells"
        head = _api.message("ClippedVoronoiCellsRequest")(name=session, beta=beta)
    stream_answers(calls, method, head.SerializeToString(), vertices, reader.add, options)


def hints_of(near: Any, points: int) -> Indices:
    """The vertex near each of the points, where they are given."""
    hints = indices([] if near is None else near, "near")
    if near is not None and len(hints) != points:
        raise InvalidArgumentError(f"near: {len(hints)} vertices for {points} points", field="near")
    return hints


def add_vertices(
    calls: Calls, session: str, cloud: Floats, near: Indices, expected_revision: int | None, options: CallOptions
) -> npt.NDArray[Any]:
    """Adds vertices at the points, in as many requests as they take; returns their numbers."""
    most = _BYTES_OF_AN_ADDITION // (8 * cloud.shape[1] + 4)
    deadline = math.inf if options.timeout is None else now() + options.timeout
    request_id = options.id_or_new()
    vertices = np.empty(len(cloud), np.uint32)
    head = _api.message("AddVerticesRequest")(name=session, expected_revision=expected_revision)
    for begin in range(0, max(1, len(cloud)), most):
        part = slice(begin, min(len(cloud), begin + most))
        head.request_id = f"{request_id}/{begin}" if begin else request_id
        request = head.SerializeToString() + _wire.packed_field(2, cloud[part]) + _wire.packed_field(3, near[part])
        left = None if math.isinf(deadline) else max(0.0, deadline - now())
        try:
            answer = calls.unary_bytes("QueryService/AddVertices", request, CallOptions(left, options.cancel))
        except Error as error:
            if not begin:
                raise
            raise _after_others(error, begin, len(cloud)) from None
        found, revision = _added(answer)
        if len(found) != part.stop - begin:
            raise damaged(f"{len(found)} vertices for {part.stop - begin} points")
        vertices[part] = found
        if head.HasField("expected_revision"):
            head.expected_revision = revision
    return signed(vertices, int(vertices.max(initial=0)) + 1)


def _added(answer: bytes) -> tuple[npt.NDArray[Any], int]:
    """The vertices and the revision of an AddVerticesResponse."""
    parts: list[npt.NDArray[Any]] = [np.empty(0, np.uint32)]
    revision = 0
    for field in _wire.fields(memoryview(answer)):
        if field.number == 1:
            parts.append(_wire.packed(field, "<u4"))
        elif field.number == 2:
            revision = int(field.value)
    return np.concatenate(parts), revision


def _after_others(error: Error, added: int, count: int) -> Error:
    """`error` of a request behind others: its points are counted from the first of the call."""
    message = re.sub(r"\b(points|near)\[(\d+)", lambda found: f"{found[1]}[{int(found[2]) + added}", error.message)
    return error.with_message(f"{message}; the first {added} of {count} points were added before")
