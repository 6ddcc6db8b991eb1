"""A mesh from the messages of a stream, with nothing that the server says believed unchecked.

As client/grpc/mesh_receiver.h is for C++. Each chunk is copied once, from the bytes of gRPC to its place in an array.
"""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _wire
from ._api import message
from ._checksum import crc32c
from .errors import DamagedAnswerError, Error, LimitError

# Vertices are numbered with 32 bits; larger counts cannot be true.
_MAX_VERTICES = 2**32 - 1
_MAX_SIMPLICES = 2**40
MAX_DIMENSION = 64

NO_VERTEX = 2**32 - 1
CORNER_ORIGIN = 2**32 - 3  # the least of the numbers that are no input points


@dataclasses.dataclass(frozen=True)
class _Array:
    """An array of MeshChunk: its name, the number of its field, and the type of its numbers."""

    name: str
    field: int
    dtype: str


# In the order in which they come.
_ARRAYS = (
    _Array("points", 3, "<f8"),
    _Array("weights", 6, "<f8"),
    _Array("vertex_origins", 8, "<u4"),
    _Array("vertex_tags", 9, "<i4"),
    _Array("simplex_regions", 10, "<i4"),
    _Array("simplices", 4, "<u4"),
    _Array("input_vertices", 5, "<u4"),
    _Array("facets", 11, "<u4"),
    _Array("ridges", 12, "<u4"),
    # Of a part of a larger mesh.
    _Array("vertex_ids", 13, "<u4"),
    _Array("vertex_owners", 14, "<u4"),
    _Array("vertex_rows", 15, "<u4"),
    _Array("simplex_ids", 16, "<u4"),
    _Array("simplex_owners", 17, "<u4"),
    _Array("facet_ids", 18, "<u4"),
)
_PLACES = {array.field: place for place, array in enumerate(_ARRAYS)}
_INDEX, _CRC, _MOVED = 1, 2, 7  # other fields of MeshChunk


def damaged(what: str) -> DamagedAnswerError:
    """The error for an answer that contradicts itself."""
    return DamagedAnswerError(f"the server's answer is damaged: {what}")


class MeshReceiver:
    """Takes metadata, then chunks in their order; keeps the arrays.

    Parameters
    ----------
    dimension, input_points : int or None
        The known properties of the mesh.
    partition : MeshPartition or None
        The part that was asked for; None: the whole mesh was.
    """

    def __init__(self, dimension: int | None = None, input_points: int | None = None, partition: Any = None) -> None:
        self._dimension = dimension
        self._input_points = input_points
        self._partition = partition
        self._expects_metadata = True
        self.metadata: Any = None
        self.next_chunk = 0
        self.arrays: dict[str, npt.NDArray[Any]] = {}
        self._received = [0] * len(_ARRAYS)  # numbers
        self._moved: list[npt.NDArray[np.uint32]] = []

    def resume(self) -> None:
        """The stream broke off, and another follows: the same metadata, then the chunks from `next_chunk` on."""
        self._expects_metadata = True

    @property
    def has_all_chunks(self) -> bool:
        """Whether the mesh is there."""
        return self.metadata is not None and self.next_chunk == self.metadata.chunk_count

    def set_metadata(self, serialized: memoryview) -> None:
        """Takes a MeshMetadata."""
        if not self._expects_metadata:
            raise damaged("a second metadata message")
        self._expects_metadata = False
        try:
            metadata = message("MeshMetadata").FromString(bytes(serialized))
        except Exception as error:
            raise damaged("no message") from error
        check_metadata(metadata, self._dimension, self._input_points, self._partition)
        if self.metadata is not None:
            if _identity(metadata) != _identity(self.metadata):
                raise damaged(f"a continued download of another mesh: revision {metadata.revision} after "
                              f"{self.metadata.revision}")
            return
        self.metadata = metadata
        for array, size in zip(_ARRAYS, self._sizes()):
            try:
                # Pages are taken as they are written to, not as they are announced.
                self.arrays[array.name] = np.empty(size, array.dtype)
            except MemoryError as error:
                raise LimitError(f"this machine has no memory for {size} numbers of {array.name}") from error

    def add_chunk(self, serialized: memoryview) -> None:
        """Takes a MeshChunk."""
        if self._expects_metadata:
            raise damaged("a chunk before the metadata")
        index, crc, moved, found = 0, 0, None, []
        for field in _wire.fields(serialized):
            if field.number == _INDEX:
                index = field.value
            elif field.number == _CRC:
                crc = field.value
            elif field.number == _MOVED:
                moved = _wire.packed(field, "<u4")
            elif field.number in _PLACES:
                found.append(field)
        if index != self.next_chunk or index >= self.metadata.chunk_count:
            raise damaged(f"chunk {index} where chunk {self.next_chunk} of {self.metadata.chunk_count} was expected")
        if len(found) != 1:
            raise damaged(f"chunk {index} has {len(found)} arrays; expected one")
        place = _PLACES[found[0].number]
        values = _wire.packed(found[0], _ARRAYS[place].dtype)
        self._check_order(place, len(values))
        first = self._received[place]
        part = self.arrays[_ARRAYS[place].name][first : first + len(values)]
        part[:] = values  # and is in the cache from here on
        checksum = crc32c(part)
        if checksum != crc:
            raise damaged(f"chunk {index} has the CRC32C {checksum:08x}, not {crc:08x} as sent")
        check_values(self.metadata, _ARRAYS[place].name, part)
        if self.metadata.HasField("part"):
            check_part_values(self.metadata, _ARRAYS[place].name, first, part)
        if moved is not None:
            rows = [count // self.metadata.dimension if place == 0 else 0 for count in (first, first + len(values))]
            self._check_moved(index, moved, *rows)
        self._received[place] += len(values)
        self.next_chunk += 1

    def finish(self) -> None:
        """To be called once the last stream has ended."""
        if self.metadata is None:
            raise damaged("no mesh")
        if not self.has_all_chunks:
            raise damaged(f"{self.next_chunk} of {self.metadata.chunk_count} chunks")
        for array, received, size in zip(_ARRAYS, self._received, self._sizes()):
            if received != size:
                raise damaged(f"{received} of {size} numbers of {array.name}")
        if len(self.moved_vertices) != self.metadata.moved_vertex_count:
            raise damaged(f"{len(self.moved_vertices)} of {self.metadata.moved_vertex_count} moved vertices")

    @property
    def moved_vertices(self) -> npt.NDArray[np.uint32]:
        """Of all chunks."""
        return np.concatenate([np.empty(0, np.uint32), *self._moved])

    def _sizes(self) -> list[int]:
        return list(sizes_of(self.metadata).values())

    def _widths(self) -> list[int]:
        return list(widths_of(self.metadata).values())

    def _check_order(self, place: int, count: int) -> None:
        sizes, name = self._sizes(), _ARRAYS[place].name
        for before in range(place):
            if self._received[before] != sizes[before]:
                raise damaged(f"{name} after {self._received[before]} of {sizes[before]} numbers of "
                              f"{_ARRAYS[before].name}")
        for after in range(place + 1, len(_ARRAYS)):
            if self._received[after] != 0:
                raise damaged(f"{name} after {_ARRAYS[after].name}")
        if count == 0 or count % self._widths()[place] != 0:
            raise damaged(f"a chunk of {name} has {count} numbers, no multiple of {self._widths()[place]}")
        if self._received[place] + count > sizes[place]:
            raise damaged(f"more than the announced {sizes[place]} numbers of {name}")

    def _check_moved(self, index: int, moved: npt.NDArray[np.uint32], begin: int, end: int) -> None:
        """Vertices that have moved come with their points, which are those from `begin` up to `end`."""
        steps = np.diff(moved.astype(np.int64))
        if len(moved) and (moved[0] < begin or moved[-1] >= end or (steps <= 0).any()):
            raise damaged(f"chunk {index} has moved vertices that are not ascending, or not from {begin} up to {end}")
        if len(self.moved_vertices) + len(moved) > self.metadata.moved_vertex_count:
            raise damaged(f"more than the announced {self.metadata.moved_vertex_count} moved vertices")
        self._moved.append(moved.copy())


def sizes_of(m: Any) -> dict[str, int]:
    """Of the arrays of a mesh with these metadata: how many numbers they have."""
    marks = m.vertex_count if m.has_vertex_marks else 0
    return {
        "points": m.vertex_count * m.dimension,
        "weights": m.vertex_count if m.has_weights else 0,
        "vertex_origins": marks,
        "vertex_tags": marks,
        "simplex_regions": m.simplex_count if m.has_simplex_regions else 0,
        "simplices": m.simplex_count * (m.dimension + 1),
        "input_vertices": m.input_point_count,
        "facets": m.facet_count * m.dimension,
        "ridges": m.ridge_count * 2,
        "vertex_ids": m.vertex_count if m.HasField("part") else 0,
        "vertex_owners": m.vertex_count if m.HasField("part") else 0,
        "vertex_rows": m.vertex_count if m.HasField("part") else 0,
        "simplex_ids": m.simplex_count if m.HasField("part") else 0,
        "simplex_owners": m.simplex_count if m.HasField("part") else 0,
        "facet_ids": m.facet_count if m.HasField("part") else 0,
    }


def widths_of(m: Any) -> dict[str, int]:
    """How many numbers their rows have."""
    wide = {"points": m.dimension, "simplices": m.dimension + 1, "facets": m.dimension, "ridges": 2}
    return {array.name: wide.get(array.name, 1) for array in _ARRAYS}


def check_metadata(m: Any, dimension: int | None, input_points: int | None, partition: Any = None) -> None:
    """Raises an error unless there can be such a mesh, by its known properties."""
    if (
        not 1 <= m.dimension <= MAX_DIMENSION
        or dimension not in (None, m.dimension)
        or not len(m.domain.low) == len(m.domain.high) == m.dimension
    ):
        raise damaged(f"a mesh of dimension {m.dimension} in a box of {len(m.domain.low)} low and "
                      f"{len(m.domain.high)} high coordinates; expected {dimension or 'one dimension'}")
    if (
        m.vertex_count > _MAX_VERTICES
        or max(m.simplex_count, m.input_point_count, m.facet_count, m.ridge_count) > _MAX_SIMPLICES
    ):
        raise damaged(f"{m.vertex_count} vertices, {m.simplex_count} simplices, {m.facet_count} facets and "
                      f"{m.input_point_count} points are more than can be")
    if input_points not in (None, m.input_point_count):
        raise damaged(f"a mesh of {m.input_point_count} points; {input_points} were sent")
    low, high = np.array(m.domain.low), np.array(m.domain.high)
    if not (np.isfinite(low) & np.isfinite(high) & (low <= high)).all():
        raise damaged(f"a mesh in a box from {low} to {high}")
    for sliver in m.statistics.slivers.flattest_left:
        if max(sliver.vertices, default=0) >= m.vertex_count:
            raise damaged(f"a sliver names vertex {max(sliver.vertices)} of {m.vertex_count}")
    _check_names(m)
    _check_part(m, partition)


def _check_part(m: Any, wanted: Any) -> None:
    """A part is the one that was asked for, and no larger than the whole."""
    if not m.HasField("part"):
        if wanted is not None:
            raise Error("the server is too old for parts: it sends the whole mesh", code="UNIMPLEMENTED")
        return
    part = m.part
    if wanted is None or (part.parts, part.part) != (wanted.parts, wanted.part):
        raise damaged(f"part {part.part} of {part.parts}, which was not asked for")
    if (
        not part.own_vertex_count <= m.vertex_count <= part.whole_vertex_count <= _MAX_VERTICES
        or not part.own_simplex_count <= m.simplex_count <= part.whole_simplex_count <= _MAX_SIMPLICES
        or not m.facet_count <= part.whole_facet_count <= _MAX_SIMPLICES
    ):
        raise damaged(f"a part of {m.vertex_count} vertices and {m.simplex_count} simplices, which owns "
                      f"{part.own_vertex_count} and {part.own_simplex_count}, of {part.whole_vertex_count} and "
                      f"{part.whole_simplex_count}")


def check_values(m: Any, name: str, values: npt.NDArray[Any]) -> None:
    """Whether the values can be those of the array: finite, vertices that there are, tags that were announced."""
    if name in ("points", "weights"):
        wrong = values[~np.isfinite(values) | ((values < 0) if name == "weights" else False)]
        if len(wrong):
            raise damaged(f"{name} have the number {wrong[0]}")
    elif name in ("simplices", "facets", "ridges"):
        if values.max() >= m.vertex_count:
            raise damaged(f"{name} name vertex {values.max()} of {m.vertex_count}")
    elif name == "input_vertices":
        _check_below(name, "vertex", values, m.vertex_count, NO_VERTEX)
    elif name == "vertex_origins" and not m.HasField("part"):  # which does not tell how many input points there are
        _check_below(name, "input point", values, m.input_point_count, CORNER_ORIGIN)
    elif name == "vertex_tags":
        _check_known(name, "tag", values, [0, *(part.tag for part in m.boundary)])
    elif name == "simplex_regions":
        _check_known(name, "region", values, [region.id for region in m.regions])


def check_part_values(m: Any, name: str, first: int, values: npt.NDArray[Any]) -> None:
    """Whether the values can be numbers of a part, of which `first` came before these.

    They are those of vertices, simplices, facets and parts that there are; of what is owned, and of nothing else, the
    owner is the part itself.
    """
    part = m.part
    ends = {"vertex_ids": part.whole_vertex_count, "vertex_rows": part.whole_vertex_count,
            "simplex_ids": part.whole_simplex_count, "facet_ids": part.whole_facet_count,
            "vertex_owners": part.parts, "simplex_owners": part.parts}
    if name not in ends:
        return
    wrong = values[values >= ends[name]]
    if len(wrong):
        raise damaged(f"{name} name {wrong[0]} of {ends[name]}")
    own = {"vertex_owners": part.own_vertex_count, "simplex_owners": part.own_simplex_count}.get(name)
    if own is not None:
        is_own = np.arange(first, first + len(values)) < own
        if ((values == part.part) != is_own).any():
            raise damaged(f"{name} of part {part.part}, which owns the first {own}, tell other owners")


def _check_below(name: str, what: str, values: npt.NDArray[Any], count: int, least_other: int) -> None:
    """Whether each of `values` is below `count`, or stands for something else."""
    wrong = values[(values >= count) & (values < least_other)]
    if len(wrong):
        raise damaged(f"{name} name {what} {wrong[0]} of {count}")


def _check_known(name: str, what: str, values: npt.NDArray[Any], known: list[int]) -> None:
    wrong = values[~np.isin(values, known)]
    if len(wrong):
        raise damaged(f"{name} name the {what} {wrong[0]}, which there is not")


def _check_names(m: Any) -> None:
    """Tags and regions are above 0, each once; names go to terminals and to files of text."""
    for what, numbers in (("part of the boundary", [part.tag for part in m.boundary]),
                          ("region", [region.id for region in m.regions])):
        if len(set(numbers)) != len(numbers) or any(number <= 0 for number in numbers):
            raise damaged(f"a {what} with a number that is not above 0, or with that of another")
    for part in [*m.boundary, *m.regions]:
        if not re.fullmatch(r"[^\x00-\x1f\x7f-\x9f]{1,256}", part.name):
            raise damaged(f"a part of the mesh with the name {part.name[:20]!r}")
    if sum(part.facet_count for part in m.boundary) != m.facet_count:
        raise damaged(f"parts of the boundary have other facets than {m.facet_count} in all")


def _identity(m: Any) -> bytes:
    """The metadata that a continued download must not change: all but the figures."""
    copy = type(m)()
    copy.CopyFrom(m)
    copy.ClearField("statistics")
    return bytes(copy.SerializeToString(deterministic=True))
