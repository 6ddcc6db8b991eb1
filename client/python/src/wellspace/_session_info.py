"""The state of a session."""

from __future__ import annotations

import dataclasses
import datetime
from typing import Any

from . import _api
from ._arrays import number
from ._parameters import read
from ._receiver import MAX_DIMENSION, damaged
from .errors import InvalidArgumentError
from .statistics import seconds_of


@dataclasses.dataclass(frozen=True)
class SessionInfo:
    """The state of a session.

    Attributes
    ----------
    name : str
        ``"sessions/…"``
    state : str
        ``"open"``: takes points, and can be refined. ``"refining"``. ``"ready"``: its mesh is that of all its points.
    dimension : int
    parameters : dict
        Of the last refinement that succeeded, by the names of this package; defaults resolved.
    labels : dict
    ttl : float
        Seconds that the session lives without any use.
    create_time, expire_time : datetime
        In UTC.
    revision : int
        Grows with every change.
    point_count, segment_count, triangle_count, seed_count : int
        Rows that were uploaded, duplicates included.
    size_count : int
        Sizes at points, see `Session.sizes`.
    stored_bytes : int
        The bytes that count against `ServerInfo.max_stored_bytes_per_tenant`.
    vertex_count, simplex_count : int
        Of the last mesh; 0 before the first.
    last_operation : str
        Empty before the first.
    """

    name: str
    state: str
    dimension: int
    parameters: dict[str, Any]
    labels: dict[str, str]
    ttl: float
    create_time: datetime.datetime
    expire_time: datetime.datetime
    revision: int
    point_count: int
    segment_count: int
    triangle_count: int
    seed_count: int
    size_count: int
    stored_bytes: int
    vertex_count: int
    simplex_count: int
    last_operation: str


def info_of_session(message: Any) -> SessionInfo:
    """Of a Session."""
    def time(stamp: Any) -> datetime.datetime:
        try:
            return datetime.datetime.fromtimestamp(seconds_of(stamp), datetime.timezone.utc)
        except (OverflowError, ValueError, OSError) as error:
            raise damaged(f"a time {stamp.seconds} seconds after 1970") from error

    # Arrays are made by it. 0: not told.
    if not 0 <= message.parameters.dimension <= MAX_DIMENSION:
        raise damaged(f"a session in {message.parameters.dimension}-D")

    return SessionInfo(
        name=message.name,
        state=_api.enum_names("Session.State").get(message.state, "unknown"),
        dimension=message.parameters.dimension,
        parameters=read(message.parameters),
        labels=dict(message.labels),
        ttl=seconds_of(message.ttl),
        create_time=time(message.create_time),
        expire_time=time(message.expire_time),
        revision=message.revision,
        point_count=message.committed_points,
        segment_count=message.segment_count,
        triangle_count=message.triangle_count,
        seed_count=message.seed_count,
        size_count=message.size_count,
        stored_bytes=message.stored_bytes,
        vertex_count=message.vertex_count,
        simplex_count=message.simplex_count,
        last_operation=message.last_operation,
    )


def set_ttl(message: Any, seconds: float) -> None:
    """Sets a Duration to the `ttl` of a session."""
    value = number(seconds, "ttl")
    if not 0 <= value < 2**53:
        raise InvalidArgumentError(f"ttl is {seconds!r}; expected seconds", field="ttl")
    message.seconds = int(value)
    message.nanos = round((value - int(value)) * 1e9) % 10**9
