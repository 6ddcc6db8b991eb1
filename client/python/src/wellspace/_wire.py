"""Messages with large arrays, read and written without protobuf's objects.

protobuf makes a Python object of each number of a packed field: 64 bytes for 4, and most of the time of a download.
On the wire the numbers of a packed field lie side by side, little-endian, which is what numpy calls an array. So the
few fields of such messages are walked over here, and arrays are views of the bytes that gRPC has received.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .errors import DamagedAnswerError

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5


def malformed(what: str) -> DamagedAnswerError:
    """The error for bytes that are no message."""
    return DamagedAnswerError(f"the server's answer is damaged: no message: {what}")


class Field(NamedTuple):
    """A field of a message: its number, its type on the wire and its value, a number or a view of bytes."""

    number: int
    kind: int
    value: Any


def read_varint(data: memoryview, at: int) -> tuple[int, int]:
    """The number at `at`, and where it ends."""
    result = shift = 0
    while True:
        if at >= len(data) or shift > 63:
            raise malformed("a number without an end")
        byte = data[at]
        at += 1
        result |= (byte & 0x7F) << shift
        if byte < 0x80:
            return result & 0xFFFFFFFFFFFFFFFF, at
        shift += 7


def fields(data: memoryview) -> Iterator[Field]:
    """The fields of a message in their order. Costs O(1) each, however long they are."""
    at = 0
    while at < len(data):
        tag, at = read_varint(data, at)
        number, kind = tag >> 3, tag & 7
        if number == 0:
            raise malformed("a field without a number")
        if kind == VARINT:
            value, at = read_varint(data, at)
            yield Field(number, kind, value)
            continue
        if kind == BYTES:
            length, at = read_varint(data, at)
        elif kind in (FIXED32, FIXED64):
            length = 4 if kind == FIXED32 else 8
        else:
            raise malformed(f"a field of the unknown type {kind}")
        if length > len(data) - at:
            raise malformed(f"a field of {length} bytes where {len(data) - at} are left")
        part = data[at : at + length]
        at += length
        yield Field(number, kind, part if kind == BYTES else int.from_bytes(part, "little"))


def packed(field: Field, dtype: str) -> npt.NDArray[Any]:
    """The numbers of a packed field of a fixed width, as a view that may be unaligned."""
    width = np.dtype(dtype).itemsize
    if field.kind != BYTES:  # a single number may come alone
        expected = FIXED32 if width == 4 else FIXED64
        if field.kind != expected:
            raise malformed(f"field {field.number} has the type {field.kind}; expected {BYTES} or {expected}")
        return np.frombuffer(int(field.value).to_bytes(width, "little"), dtype)
    if len(field.value) % width != 0:
        raise malformed(f"field {field.number} has {len(field.value)} bytes; expected a multiple of {width}")
    return np.frombuffer(field.value, dtype)


def packed_varints(field: Field) -> npt.NDArray[np.int64]:
    """The numbers of a packed field of varints below 2^32, or flags."""
    if field.kind == VARINT:
        if field.value >= 1 << 35:
            raise malformed(f"field {field.number} has a number above 2^32")
        return np.array([field.value], np.int64)
    if field.kind != BYTES:
        raise malformed(f"field {field.number} has the type {field.kind}; expected {BYTES} or {VARINT}")
    octets = np.frombuffer(field.value, np.uint8)
    is_last = octets < 0x80
    if len(octets) and not is_last[-1]:
        raise malformed(f"field {field.number} ends within a number")
    if is_last.all():
        return octets.astype(np.int64)
    ends = np.flatnonzero(is_last)
    begins = np.concatenate([[0], ends[:-1] + 1])
    if (ends - begins).max() >= 5:
        raise malformed(f"field {field.number} has a number above 2^32")
    place = np.arange(len(octets)) - np.repeat(begins, ends - begins + 1)
    return np.add.reduceat((octets & 0x7F).astype(np.int64) << (7 * place), begins)


def varint(value: int) -> bytes:
    """`value`, at least 0, as it is on the wire."""
    octets = bytearray()
    while value >= 0x80:
        octets.append(value & 0x7F | 0x80)
        value >>= 7
    octets.append(value)
    return bytes(octets)


def packed_field(number: int, values: npt.NDArray[Any]) -> bytes:
    """A packed field with the bytes of an array, which is contiguous and little-endian; nothing for an empty one."""
    raw = values.data.cast("B") if values.size else memoryview(b"")
    return b"".join([varint(number << 3 | BYTES), varint(raw.nbytes), raw]) if raw.nbytes else b""


def message_field(number: int, *parts: bytes) -> bytes:
    """A field that is a message with these serialized fields."""
    return b"".join([varint(number << 3 | BYTES), varint(sum(map(len, parts))), *parts])
