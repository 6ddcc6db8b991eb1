"""Streams of messages with points and meshes: those that several calls send, and receive."""

from __future__ import annotations

from collections.abc import Iterator

from . import _wire
from ._arrays import Floats
from ._receiver import MeshReceiver

_BYTES_OF_A_REQUEST = 1 << 20


def point_chunks(cloud: Floats, first: int = 0) -> Iterator[tuple[int, int, bytes]]:
    """Serialized PointChunks of the points from number `first` on, with the numbers of their first and last point."""
    rows = max(1, _BYTES_OF_A_REQUEST // max(8, 8 * cloud.shape[1]))
    for begin in range(first, len(cloud), rows):
        part = cloud[begin : begin + rows]
        yield begin, begin + len(part), _wire.packed_field(1, part)


def messages_of(answer: bytes) -> Iterator[tuple[int, memoryview]]:
    """The fields of an answer, which are messages."""
    return ((field.number, field.value) for field in _wire.fields(memoryview(answer)) if field.kind == _wire.BYTES)


def receive(receiver: MeshReceiver, number: int, part: memoryview) -> None:
    """Field 0 is metadata, 1 a chunk."""
    if number == 0:
        receiver.set_metadata(part)
    elif number == 1:
        receiver.add_chunk(part)
