"""Queries about vertices of a session, which answer in streams."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _api, _wire
from ._arrays import Indices
from ._calls import Calls, CallOptions
from ._cells import CellReader
from ._receiver import damaged
from ._retry import Attempt, now
from .errors import Error

_VERTICES_OF_A_REQUEST = 1 << 17  # which then has half a MiB


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
