"""A mesh that is brought up to date by the differences of a stream, as client/grpc/delta_receiver.h is for C++."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from . import _wire
from ._api import message
from ._checksum import crc32c
from ._mesh import Mesh, mesh_from
from ._receiver import check_metadata, check_values, damaged, sizes_of, widths_of

Array = npt.NDArray[Any]

# The arrays of a mesh: the fields of MeshDelta that list rows which have changed, and that have values.
_CHANGED = {
    "points": (2, 3, "<f8"),
    "weights": (4, 5, "<f8"),
    "input_vertices": (8, 9, "<u4"),
    "vertex_origins": (11, 12, "<u4"),
    "vertex_tags": (13, 14, "<i4"),
    "simplex_regions": (15, 16, "<i4"),
}
# Those whose rows come by runs: the fields with these, and with the rows that are new.
_KEPT = {"simplices": (6, 7), "facets": (17, 18), "ridges": (19, 20)}
_INDEX, _MOVED = 1, 10
_TYPES = {field: dtype for _, field, dtype in _CHANGED.values()} | {field: "<u4" for _, field in _KEPT.values()}
_LISTS = {field for field, _, _ in _CHANGED.values()} | {_MOVED}
_RUNS = {field for field, _ in _KEPT.values()}
# Large enough for all numbers of rows; so differences and sums of the numbers do not overflow.
_MOST_ROWS = 2**40


class DeltaReceiver:
    """Takes for each difference its metadata, then its parts; with the last of them `mesh` is the mesh after it.

    Errors say that the answer is damaged, or that the mesh is not the one that the server has had at its revision.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.next_part = 0
        self.part_count = 0
        self._expects_metadata = True
        self._metadata: Any = None  # of the difference that is under way
        self._fields: dict[int, list[Array]] = {}
        self._runs: dict[tuple[int, int], list[Array]] = {}

    def resume(self) -> None:
        """The stream broke off, and another follows: the differences since `mesh.revision`, from `next_part` on."""
        self._expects_metadata = True

    @property
    def revision(self) -> int:
        """That the difference which is under way leads to; 0 for none."""
        return 0 if self._metadata is None else int(self._metadata.revision)

    def set_metadata(self, metadata: Any) -> None:
        """Takes a MeshMetadata with a `delta`."""
        if not self._expects_metadata:
            raise damaged("a difference of which parts are missing")
        check_metadata(metadata, self.mesh.dimension, None)
        base = metadata.delta.base_revision
        if base != self.mesh.revision:
            raise damaged(f"a difference from revision {base}; the mesh is of revision {self.mesh.revision}")
        if metadata.revision == base:
            if metadata.chunk_count:
                raise damaged(f"a difference of {metadata.chunk_count} parts from the mesh itself")
            return
        if self._metadata is not None and (metadata.revision, metadata.chunk_count) != (self.revision, self.part_count):
            raise damaged(f"a difference to revision {metadata.revision} goes on where one to {self.revision} ended")
        self._metadata = metadata
        self.part_count = metadata.chunk_count
        self._expects_metadata = False
        self._end()

    def add_part(self, serialized: memoryview) -> None:
        """Takes a MeshDelta."""
        index = 0
        parts: list[tuple[int, Array]] = []
        runs: list[tuple[tuple[int, int], Array]] = []
        for field in _wire.fields(serialized):
            if field.number == _INDEX:
                index = field.value
            elif field.number in _LISTS:
                parts.append((field.number, _wire.packed_varints(field)))
            elif field.number in _TYPES:
                parts.append((field.number, _wire.packed(field, _TYPES[field.number]).copy()))
            elif field.number in _RUNS and field.kind == _wire.BYTES:
                for one in _wire.fields(field.value):
                    if one.number in (1, 2, 3):
                        runs.append(((field.number, one.number), _wire.packed_varints(one)))
        if self._expects_metadata or index != self.next_part:
            raise damaged(f"part {index} of a difference where part {self.next_part} of {self.part_count} was expected")
        for number, values in parts:
            self._fields.setdefault(number, []).append(values)
        for place, values in runs:
            self._runs.setdefault(place, []).append(values)
        self._check_counts()
        self.next_part += 1
        self._end()

    def finish(self) -> None:
        """To be called once a stream has ended as it should."""
        if self._metadata is not None:
            raise damaged(f"{self.next_part} of {self.part_count} parts of a difference")

    def _check_counts(self) -> None:
        """Refuses more than the mesh that was announced can take."""
        sizes = sum(sizes_of(self._metadata).values())
        parts = [array for arrays in (*self._fields.values(), *self._runs.values()) for array in arrays]
        if sum(map(len, parts)) > 4 * sizes + len(self._metadata.boundary) + self._metadata.moved_vertex_count:
            raise damaged("a difference larger than the mesh that it makes")

    def _end(self) -> None:
        """Applies the difference if all of it is there."""
        if self.next_part < self.part_count:
            return
        metadata = self._metadata
        try:
            self.mesh = self._applied(metadata)
        finally:
            self._metadata, self._fields, self._runs, self.next_part = None, {}, {}, 0
            self._expects_metadata = True

    def _field(self, number: int, dtype: str = "<i8") -> Array:
        return np.concatenate([np.empty(0, dtype), *self._fields.get(number, [])])

    def _applied(self, metadata: Any) -> Mesh:
        sizes, widths = sizes_of(metadata), widths_of(metadata)
        arrays = {}
        sources = {}
        base = base_arrays(self.mesh)
        for name, (runs, values) in _KEPT.items():
            width = widths[name]
            added = self._field(values, "<u4")
            sources[name] = self._sources(name, runs, len(base[name]) // width, sizes[name] // width,
                                          len(added) // width)
            arrays[name] = _joined(base[name].reshape(-1, width), sources[name], added, width)
        for name, (changed, values, dtype) in _CHANGED.items():
            rows, width = sizes[name] // widths[name], widths[name]
            before = base[name].reshape(-1, width)
            numbers, new = _numbers(self._field(changed)), self._field(values, dtype)
            # Regions are those of the simplices that are kept, unless all come.
            if name == "simplex_regions" and len(numbers) + rows != len(new):
                source = sources["simplices"]
                if len(before) != len(base["simplices"]) // widths["simplices"]:
                    raise damaged("a difference with regions of other simplices")
            elif name == "simplex_regions":
                source = np.full(rows, -1)
            else:
                source = np.arange(rows)
                source[len(before) :] = -1
            arrays[name] = _changed(name, before, source, numbers, new)
        moved = _numbers(self._field(_MOVED))
        if len(moved) != metadata.moved_vertex_count or (len(moved) and moved[-1] >= metadata.vertex_count):
            raise damaged("a difference with other moved vertices than announced")
        checksums = metadata.delta.checksums
        for name, array in arrays.items():
            if crc32c(array) != getattr(checksums, name):
                raise damaged(f"a difference that makes other {name} than those of revision {metadata.revision}")
            if len(array):
                check_values(metadata, name, array)
        return mesh_from(metadata, arrays, moved.astype(np.uint32))

    def _sources(self, name: str, field: int, base_rows: int, rows: int, added: int) -> Array:
        """For each row the row of the array before, or -1 for one that is new."""
        parts = [np.concatenate([np.empty(0, np.int64), *self._runs.get((field, one), [])]) for one in (1, 2, 3)]
        zigzag, kept, new = parts
        if not len(zigzag) == len(kept) == len(new) or max((part.max(initial=0) for part in parts)) > _MOST_ROWS:
            raise damaged(f"a difference with other runs of {name} than can be")
        skipped = (zigzag >> 1) ^ -(zigzag & 1)
        begins = np.cumsum(skipped) + np.cumsum(kept) - kept
        if len(begins) and (begins.min() < 0 or (begins + kept).max() > base_rows):
            raise damaged(f"a difference that keeps {name} which are not there")
        total = int(kept.sum())
        if total > base_rows or new.sum() != added or total + added != rows:
            raise damaged(f"a difference that keeps {total} of {base_rows} {name} and has {added} new ones, of {rows}")
        source: Array = np.full(rows, -1, np.int64)
        before = np.cumsum(kept) - kept  # of each run: the kept rows of those before it
        steps = np.arange(total)
        places = np.repeat(np.cumsum(kept + new) - kept - new - before, kept) + steps
        source[places] = np.repeat(begins - before, kept) + steps
        return source


def _numbers(gaps: Array) -> Array:
    """Ascending numbers that are listed by the gaps between them."""
    numbers: Array = np.cumsum(gaps + 1) - 1
    return numbers


def _joined(before: Array, source: Array, added: Array, width: int) -> Array:
    if len(added) != int((source < 0).sum()) * width:
        raise damaged(f"a difference with {len(added)} numbers in rows of {width}")
    result: Array = before[np.maximum(source, 0)] if len(before) else np.empty((len(source), width), before.dtype)
    result[source < 0] = added.reshape(-1, width)
    return result.reshape(-1)


def _changed(name: str, before: Array, source: Array, changed: Array, values: Array) -> Array:
    """The rows of `before` that `source` says; those with the numbers `changed`, and new ones, of `values`."""
    width = before.shape[1]
    is_new = source < 0
    if len(values) != (len(changed) + int(is_new.sum())) * width or (len(changed) and changed[-1] >= len(source)):
        raise damaged(f"a difference with {len(values)} numbers of {name}")
    rows = values.reshape(-1, width)
    result: Array = np.empty((len(source), width), values.dtype)
    result[~is_new] = before[source[~is_new]]
    result[changed] = rows[: len(changed)]
    result[is_new] = rows[len(changed) :]
    return result.reshape(-1)


def base_arrays(mesh: Mesh) -> dict[str, Array]:
    """The arrays of a mesh as they were on the wire, without copies where numbers have 32 bits."""
    def unsigned(values: Array) -> Array:
        flat = np.ascontiguousarray(values).reshape(-1)
        return flat.view("<u4") if flat.dtype.itemsize == 4 else flat.astype("<u4")

    return {
        "points": np.ascontiguousarray(mesh.points, "<f8").reshape(-1),
        "weights": np.empty(0) if mesh.weights is None else np.ascontiguousarray(mesh.weights, "<f8"),
        "simplices": unsigned(mesh.simplices),
        "input_vertices": unsigned(mesh.input_vertices),
        "vertex_origins": unsigned(mesh.vertex_origins),
        "vertex_tags": np.ascontiguousarray(mesh.vertex_tags, "<i4"),
        "simplex_regions": np.ascontiguousarray(mesh.regions, "<i4"),
        "facets": unsigned(mesh.facets),
        "ridges": unsigned(mesh.ridges),
    }


def metadata_of(serialized: memoryview) -> Any:
    """A MeshMetadata."""
    try:
        return message("MeshMetadata").FromString(bytes(serialized))
    except Exception as error:
        raise damaged("no message") from error
