"""CRC32C (Castagnoli, RFC 3720 appendix B.4) of arrays, in numpy.

A message is a polynomial over GF(2), and its checksum is that polynomial modulo P. P divides

    x^5685 + x^1362 + x^426 + 1,

and hence, since squaring is linear, the same with all exponents times s, for each power of two s. So the front of a
message may be taken off and added, with ``^``, at three places behind it, without a change of the checksum. With s a
multiple of 8 bits these are whole bytes, and numpy adds arrays of them at once. Few bytes are left; each bit of their
checksum is the parity of some of their bits, and a table has which. That makes 5 GB a second.

Intel's ISA-L has the checksum by instructions of the processor, at 50 GB a second. It is taken where it is installed
(Debian: libisal2), and right.
"""

from __future__ import annotations

import ctypes
import functools
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

_POLYNOMIAL = 0x82F63B78  # reflected: bit 31 - k is the coefficient of x^k
_ALL_ONES = 0xFFFFFFFF

# The distances behind a byte of the front at which it is added. Unit: s.
_DISTANCES = (5685 - 1362, 5685 - 426, 5685)
_BLOCK, _, _REACH = _DISTANCES  # a longer front than _BLOCK would be added to itself

_PIECE = 1 << 20  # bytes that are folded at once: they stay in the cache
_REST = -(-_REACH // 8) * 8  # bytes that are left: whole words

Octets = npt.NDArray[np.uint8]


def crc32c(data: Any, crc: int = 0) -> int:
    """The CRC32C of `data`, which goes on after data with the checksum `crc`.

    Parameters
    ----------
    data : bytes-like or numpy.ndarray
        Contiguous. Of an array, the bytes of its values are meant, in their order in memory.
    crc : int
        0 at the begin.
    """
    view = memoryview(data)
    octets = np.frombuffer(view.cast("B") if view.nbytes else b"", np.uint8)
    extend, piece = (_extend, _PIECE) if _compiled is None else (_compiled, _COMPILED_PIECE)
    for begin in range(0, len(octets), piece):
        crc = extend(crc, octets[begin : begin + piece])
    return crc


_COMPILED_PIECE = 1 << 30  # it counts by a C int
_CHECK = 0xE3069283  # of "123456789", as catalogues of checksums have it


def _load(name: str = "libisal.so.2") -> Callable[[int, Octets], int] | None:
    """The checksum of ISA-L; None where it is not installed, or says something else than it should."""
    try:
        function = ctypes.CDLL(name).crc32_iscsi
    except (OSError, AttributeError):
        return None
    function.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_uint]
    function.restype = ctypes.c_uint

    def extend(crc: int, octets: Octets) -> int:
        address = octets.__array_interface__["data"][0]
        return int(function(address, len(octets), crc ^ _ALL_ONES)) ^ _ALL_ONES

    return extend if extend(0, np.frombuffer(b"123456789", np.uint8)) == _CHECK else None


def _extend(crc: int, octets: Octets) -> int:
    register = crc ^ _ALL_ONES
    if len(octets) < 4:
        for octet in octets.tolist():
            register = _byte_table()[(register ^ octet) & 0xFF] ^ (register >> 8)
        return register ^ _ALL_ONES
    # The checksum of the bytes before is added to the first four.
    rest = _fold(octets, np.frombuffer(register.to_bytes(4, "little"), np.uint8))
    return _parities(rest.view(np.uint64)) ^ _ALL_ONES


def _fold(octets: Octets, register: Octets) -> Octets:
    """_REST bytes with the checksum of `octets`, to the first four of which `register` is added."""
    scratch = _scratch()
    scale = 1  # s in bytes
    while 2 * scale * _REACH < len(octets):
        scale *= 2
    block = min(_BLOCK * scale, len(octets) - _REACH * scale)
    if block < 4:
        rest = scratch[len(scratch) - len(octets) :]
        rest[:] = octets
        rest[:4] ^= register
    else:  # the first front need not be copied
        rest = scratch[len(scratch) - len(octets) + block :]
        rest[:] = octets[block:]
        _add(octets[:block], rest, scale, block)
        _add(register, rest, scale, block)
    while scale > 0:
        while (block := min(_BLOCK * scale, len(rest) - _REACH * scale)) > 0:
            front, rest = rest[:block], rest[block:]
            _add(front, rest, scale, block)
        scale //= 2
    # Zeros in front change nothing.
    whole = scratch[len(scratch) - _REST :]
    whole[: _REST - len(rest)] = 0
    return whole


def _add(front: Octets, rest: Octets, scale: int, block: int) -> None:
    """Adds `front`, the begin of `block` bytes that were taken off before `rest`."""
    for distance in _DISTANCES:
        begin = distance * scale - block
        target = rest[begin : begin + len(front)]
        np.bitwise_xor(target, front, target)


def _parities(words: npt.NDArray[np.uint64]) -> int:
    bits = np.bitwise_xor.reduce(words & _masks(), axis=1)
    for shift in (32, 16, 8, 4, 2, 1):
        bits ^= bits >> np.uint64(shift)
    return int(np.packbits((bits & np.uint64(1)).astype(np.uint8), bitorder="little").view("<u4")[0])


@functools.cache
def _masks() -> npt.NDArray[np.uint64]:
    """32 x (_REST / 8): which bits of the last words of a message make bit k of its checksum."""
    # The worth of each bit of the last byte; then of the byte before, which one more byte of zeros follows.
    worth = np.array([_byte_table()[1 << bit] for bit in range(8)], np.uint32)
    table = np.array(_byte_table(), np.uint32)
    worths = np.empty((_REST, 8), np.uint32)
    for place in range(_REST - 1, -1, -1):
        worths[place] = worth
        worth = table[worth & 0xFF] ^ (worth >> np.uint32(8))
    masks = [np.packbits(((worths >> np.uint32(k)) & 1).astype(np.uint8), axis=1, bitorder="little") for k in range(32)]
    return np.stack([mask.ravel().view("<u8") for mask in masks])


@functools.cache
def _byte_table() -> tuple[int, ...]:
    table = []
    for value in range(256):
        for _ in range(8):
            value = (value >> 1) ^ (_POLYNOMIAL if value & 1 else 0)
        table.append(value)
    return tuple(table)


_local = threading.local()


def _scratch() -> Octets:
    if not hasattr(_local, "octets"):
        _local.octets = np.empty(_PIECE // 8, np.uint64).view(np.uint8)
    octets: Octets = _local.octets
    return octets


_compiled = _load()
