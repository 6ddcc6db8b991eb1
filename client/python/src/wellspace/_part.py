"""One part of a mesh, for a solver on many ranks."""

from __future__ import annotations

import dataclasses
import os
import pathlib
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _files
from ._api import message
from ._arrays import count
from ._mesh import Mesh, mesh_of, signed
from ._receiver import MeshReceiver
from .errors import InvalidArgumentError

_MOST_PARTS = 2**20
_MOST_GHOST_LAYERS = 16


def _none() -> npt.NDArray[Any]:
    return np.empty(0, np.int32)


@dataclasses.dataclass(frozen=True, eq=False)
class MeshPart(Mesh):
    """A part of a mesh that is cut for solvers on many ranks: of `Session.download` with `part`, or of a file.

    It is a mesh with numbers of its own, from 0 on. First come the vertices and simplices that the part owns, then
    copies of others', its ghosts; it owns all of its facets. Over all parts each vertex, simplex and facet of the whole
    mesh is owned once: a simplex by its part, a vertex or facet by the lowest part that has a simplex there.

    Attributes beside those of `Mesh`, of which `input_vertices`, `ridges` and `moved_vertices` are empty; `box` and
    `statistics` are those of the whole mesh, and `vertex_origins` name its input points.

    Attributes
    ----------
    part, parts : int
        The number of the part, from 0 on, and how many there are.
    own_vertices, own_simplices : int
        How many of the first vertices and simplices the part owns.
    vertex_ids : (n,) int
        The number of each vertex in the whole mesh.
    vertex_owners : (n,) int
        The part that owns it.
    vertex_rows : (n,) int
        Its number where the vertices of part 0 come first, then those of part 1, and so on: solvers have their rows in
        that order. The part's own ones are consecutive.
    simplex_ids, simplex_owners : (m,) int
        The same of the simplices.
    facet_ids : (f,) int
        The number of each facet in the whole mesh.
    whole_vertices, whole_simplices, whole_facets : int or None
        Of the whole mesh; None for a part from a file, which does not tell.
    """

    part: int = 0
    parts: int = 1
    own_vertices: int = 0
    own_simplices: int = 0
    vertex_ids: npt.NDArray[Any] = dataclasses.field(default_factory=_none)
    vertex_owners: npt.NDArray[Any] = dataclasses.field(default_factory=_none)
    vertex_rows: npt.NDArray[Any] = dataclasses.field(default_factory=_none)
    simplex_ids: npt.NDArray[Any] = dataclasses.field(default_factory=_none)
    simplex_owners: npt.NDArray[Any] = dataclasses.field(default_factory=_none)
    facet_ids: npt.NDArray[Any] = dataclasses.field(default_factory=_none)
    whole_vertices: int | None = None
    whole_simplices: int | None = None
    whole_facets: int | None = None

    def __repr__(self) -> str:
        return (
            f"<wellspace.MeshPart: {self.part} of {self.parts}, {self.own_vertices} own of {len(self.points)} vertices,"
            f" {self.own_simplices} own of {len(self.simplices)} simplices in {self.dimension}-D>"
        )

    def save(self, path: str | os.PathLike[str], *, order: int = 1, **options: Any) -> None:
        """Writes the part to a ``.npz``, as ``wellspace partition`` does: with the arrays above, by their names.

        Other formats, and elements of second order, have no place for them.
        """
        if pathlib.Path(path).suffix != ".npz" or order != 1:
            raise InvalidArgumentError(
                f"{path}: a part is written to .npz, in order 1; the tool's `wellspace download` writes .vtu, too",
                field="path",
            )
        numbers = {name: getattr(self, name).astype(np.uint32, copy=False) for name in _ARRAYS}
        of_part = np.array([self.part, self.parts, self.own_vertices, self.own_simplices], np.uint64)
        _files.save(self, path, options, members={**numbers, "part": of_part})

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> MeshPart:
        """Reads a part from a ``.npz`` of `save`, ``wellspace partition`` or ``wellspace download``.

        Raises
        ------
        InvalidArgumentError
            The file has no part of a mesh.
        """
        found = _files.arrays_of(path)
        attributes = _files.attributes_of(found, path)
        n, m, f = (len(attributes[name]) for name in ("points", "simplices", "facets"))
        sizes = dict(zip(_ARRAYS, (n, n, n, m, m, f)))
        if "part" not in found or found["part"].shape != (4,):
            raise InvalidArgumentError(f"{path}: expected a part of a mesh, with an array 'part' of 4 numbers",
                                       field="path")
        for name, size in sizes.items():
            if name not in found or found[name].shape != (size,) or found[name].dtype.kind not in "iu":
                raise InvalidArgumentError(f"{path}: expected an array {name!r} of {size} whole numbers", field="path")
            attributes[name] = found[name].astype(np.int64 if found[name].max(initial=0) >= 2**31 else np.int32)
        part, parts, own_vertices, own_simplices = map(int, found["part"])
        if part >= parts or own_vertices > n or own_simplices > m:
            raise InvalidArgumentError(f"{path}: part {part} of {parts} that owns {own_vertices} of {n} vertices and "
                                       f"{own_simplices} of {m} simplices", field="path")
        return cls(**attributes, part=part, parts=parts, own_vertices=own_vertices, own_simplices=own_simplices)


# Of its numbers, in the order in which they come.
_ARRAYS = ("vertex_ids", "vertex_owners", "vertex_rows", "simplex_ids", "simplex_owners", "facet_ids")


def partition_of(part: Any, parts: Any, ghost_layers: Any, contiguous: bool) -> Any:
    """A MeshPartition, or None where no part is asked for."""
    if part is None and parts is None:
        return None
    if part is None or parts is None:
        missing = "part" if part is None else "parts"
        raise InvalidArgumentError("part and parts go together: the number of the part, and how many there are",
                                   field=missing)
    if count(parts, "parts", _MOST_PARTS) == 0:
        raise InvalidArgumentError(f"parts is 0; expected 1 to {_MOST_PARTS}", field="parts")
    return message("MeshPartition")(
        parts=int(parts),
        part=count(part, "part", int(parts) - 1),
        ghost_layers=count(ghost_layers, "ghost_layers", _MOST_GHOST_LAYERS),
        contiguous=bool(contiguous),
    )


def part_of(receiver: MeshReceiver) -> MeshPart:
    """The part that has come."""
    mesh, arrays, info = mesh_of(receiver), receiver.arrays, receiver.metadata.part
    limits = {"vertex_ids": info.whole_vertex_count, "vertex_rows": info.whole_vertex_count,
              "simplex_ids": info.whole_simplex_count, "facet_ids": info.whole_facet_count}
    of_mesh: dict[str, Any] = {field.name: getattr(mesh, field.name) for field in dataclasses.fields(mesh)}
    numbers: dict[str, Any] = {name: signed(arrays[name], limits.get(name, 0)) for name in _ARRAYS}
    return MeshPart(
        **of_mesh,
        part=info.part,
        parts=info.parts,
        own_vertices=info.own_vertex_count,
        own_simplices=info.own_simplex_count,
        **numbers,
        whole_vertices=info.whole_vertex_count,
        whole_simplices=info.whole_simplex_count,
        whole_facets=info.whole_facet_count,
    )
