"""The calls of a session that ask about its mesh, and change nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import coordinates, indices, number, revision_of
from ._calls import CallOptions, Calls
from ._cells import CellReader, Cells
from ._field_transfer import transfer
from ._locate import locate
from ._located import Located
from ._mesh import Mesh
from ._queries import nearest_distances, stream_cells
from ._retry import CancelToken


class SessionQueries:
    """A part of `Session`."""

    name: str
    dimension: int
    _calls: Calls

    def locate(
        self,
        points: Any,
        *,
        allow_outside: bool = False,
        revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> Located:
        """The simplex of the session's mesh that each of `points`, (n, d), lies in, and its place there.

        ``session.locate(points).interpolate(values)`` carries a function from the vertices of the mesh to the points.

        Parameters
        ----------
        allow_outside : bool
            Points in no simplex, outside the domain or in a hole, are no error.
        revision : int
            `Mesh.revision` of the last mesh, or of the one before it that was downloaded last, which the server keeps
            while its memory allows it; of others `ConflictError` is raised. Default: the last one.
        """
        cloud = coordinates(points, "points", self.dimension)
        options = CallOptions(timeout=timeout, cancel=cancel)
        return locate(self._calls, self.name, cloud, revision_of(revision, "revision"), allow_outside, options)

    def transfer(
        self,
        values: Any,
        from_mesh: Mesh | int,
        *,
        place: str = "vertices",
        conservative: bool = False,
        revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> npt.NDArray[np.float64]:
        """Carries a field from an earlier mesh of the session to its last one; the server computes it.

        Values of vertices are interpolated, exactly for linear functions; a vertex that both meshes have keeps its
        value to the bit. One outside of the earlier mesh gets the value at its nearest point. No value is beyond those
        that it is made of.

        Parameters
        ----------
        values : (n, …) float
            A row for each vertex, or simplex, of the earlier mesh: up to 64 finite numbers.
        from_mesh : Mesh or int
            That mesh, or its revision: the last one but one that was downloaded. The server keeps it while its memory
            allows it, and not over its end.
        place : {"vertices", "simplices"}
            What the values belong to. A new simplex has the value of the old one that its centroid is in.
        conservative : bool
            Of simplices, in 2-D and 3-D: a new one has the mean over it instead, by exact intersection with old ones,
            so that the sum of values times volumes is kept to 1e-12.
        revision : int
            `Mesh.revision` that the last mesh must have; should it be another, `ConflictError` is raised. Default: any.

        Returns
        -------
        (k, …) float
            A row for each vertex, or simplex, of the last mesh.

        Raises
        ------
        InvalidArgumentError
            Values that are NaN or infinite, by their row, or of another number than the mesh has.
        WrongStateError
            The earlier mesh is not kept: the reason is ``"MESH_NOT_KEPT"``.
        """
        of_last = revision_of(revision, "revision")
        options = CallOptions(timeout=timeout, cancel=cancel)
        return transfer(self._calls, self.name, values, from_mesh, place, conservative, of_last, options)

    def nearest(
        self, vertices: Any = None, *, timeout: float | None = None, cancel: CancelToken | None = None
    ) -> npt.NDArray[np.float64]:
        """The distance of each of `vertices`, by default of all, to its nearest other vertex; exact. Shape (c,)."""
        wanted = indices([] if vertices is None else vertices, "vertices")
        if vertices is not None and not len(wanted):
            return np.empty(0)
        return nearest_distances(self._calls, self.name, wanted, CallOptions(timeout=timeout, cancel=cancel))

    def cells(
        self,
        vertices: Any = None,
        *,
        beta: float | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> Cells:
        """The Voronoi cells of `vertices`, by default of all, in the box.

        With `beta`, at least 1, each is clipped by the cube about its vertex of which half the side is `beta` times the
        distance to the nearest other vertex.
        """
        wanted = indices([] if vertices is None else vertices, "vertices")
        reader = CellReader(self.dimension)
        if vertices is None or len(wanted):
            limit = None if beta is None else number(beta, "beta")
            stream_cells(self._calls, self.name, wanted, limit, reader, CallOptions(timeout=timeout, cancel=cancel))
        return reader.cells()
