"""The places of points in a mesh."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import Floats, revision_of
from .errors import ConflictError, InvalidArgumentError


@dataclasses.dataclass(frozen=True)
class Located:
    """The places of n points in a mesh.

    Attributes
    ----------
    simplices : (n,) int
        The simplex that has each point; of several, as it is on a face of theirs, the one with the lowest number. -1
        for a point in none.
    vertices : (n, d + 1) int
        Its vertices.
    coordinates : (n, d + 1) float
        The barycentric coordinates of the point by these vertices: at least 0, and 0 if and only if the point is on the
        facet opposite to the vertex. All 0 for a point in none.
    revision : int
        Of the mesh.
    vertex_count : int
        Vertices of the mesh.
    """

    simplices: npt.NDArray[Any]
    vertices: npt.NDArray[Any]
    coordinates: Floats
    revision: int
    vertex_count: int

    def interpolate(self, values: Any, *, revision: int | None = None) -> npt.NDArray[Any]:
        """A function with `values`, (vertices, …), at the vertices, and linear between them, at the points: (n, …).

        NaN at points in no simplex.

        Parameters
        ----------
        values : (vertices, …)
            A row for each vertex of the mesh that the points were located in.
        revision : int
            `Mesh.revision` of the mesh that has these values; `ConflictError` is raised if that is another mesh.
            Default: not checked.
        """
        wanted = revision_of(revision, "revision")
        if wanted is not None and wanted != self.revision:
            raise ConflictError(
                f"the values are of the mesh of revision {wanted}, and the points were located in that of revision "
                f"{self.revision}; locate them anew",
                field="revision",
            )
        given = np.asarray(values)
        if given.ndim == 0 or len(given) != self.vertex_count:
            raise InvalidArgumentError(
                f"values: an array of shape {given.shape}; expected a row for each of the {self.vertex_count} vertices "
                f"of the mesh of revision {self.revision}, which the points were located in",
                field="values",
            )
        found = np.einsum("nk,nk...->n...", self.coordinates, given[self.vertices])
        outside = self.simplices < 0
        if outside.any():
            found[outside] = np.nan
        return found
