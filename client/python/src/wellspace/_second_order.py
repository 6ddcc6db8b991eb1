"""Meshes of second order: a node at the middle of every edge."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from ._mesh_arrays import MeshArrays
from .errors import InvalidArgumentError

# Of vertex_origins: the node is the middle of an edge.
MIDDLE = -4
# The corners of the edges of a tetrahedron in VTK's order; a triangle has the first three of them, an edge the first.
_EDGES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])


@dataclasses.dataclass(frozen=True, eq=False)
class SecondOrderMesh(MeshArrays):
    """A mesh whose elements have a node at the middle of each edge, behind their corners. The edges are straight.

    The vertices of the mesh are the first n nodes, as they were; the middles of its e edges follow. They are in the
    order of the lower end of their edges, then of the higher one. `facet_tags`, `facet_names`, `regions`,
    `region_names` and the others are those of the mesh.

    Attributes
    ----------
    points : (n + e, d) float64
        The nodes.
    simplices : (m, 6) or (m, 10) int
        The nodes of each simplex in VTK's order: the corners, then the middles of the edges 01, 12, 20 and, in 3-D, 03,
        13, 23. Abaqus has the same order; in Gmsh's the last two change places.
    facets : (f, 3) or (f, 6) int
        The nodes of each facet: its corners, then the middles of the edges 01 and, in 3-D, 12, 20.
    middle_ends : (e, 2) int
        The ends of the edge that node n + i is the middle of, the lower one first.
    vertex_origins : (n + e,) int
        As of `Mesh`; -4: the middle of an edge.
    vertex_tags : (n + e,) int32
        The least tag of a facet that each node is of; 0 inside. Between two vertices of the boundary it may be inside.
    weights : (n + e,) float64, or None
        Of middles the mean of the ends.
    """

    middle_ends: npt.NDArray[Any] = dataclasses.field(default_factory=lambda: np.empty((0, 2), np.int32))

    def __repr__(self) -> str:
        return (
            f"<wellspace.SecondOrderMesh: {len(self.points)} nodes, {len(self.simplices)} simplices "
            f"in {self.dimension}-D>"
        )

    def at_nodes(self, values: Any) -> npt.NDArray[Any]:
        """Values of the n vertices, (n,) or (n, k), at all nodes: at the middle of an edge the mean of its ends.

        Raises
        ------
        InvalidArgumentError
            There is not a value for each vertex.
        """
        values = np.asarray(values)
        n = len(self.points) - len(self.middle_ends)
        if values.shape[:1] != (n,):
            raise InvalidArgumentError(
                f"values of the shape {values.shape}; expected a row for each of {n} vertices", field="values"
            )
        return _with_middles(values, self.middle_ends)


def second_order(mesh: MeshArrays) -> SecondOrderMesh:
    """See Mesh.to_order."""
    d, n = mesh.dimension, len(mesh.points)
    if d not in (2, 3):
        raise InvalidArgumentError(
            f"elements of second order are triangles and tetrahedra; the mesh is in {d}-D", field="order"
        )
    keys = [_keys(mesh.simplices, n), _keys(mesh.facets.reshape(-1, d), n)]
    edges, numbers = np.unique(np.concatenate([part.reshape(-1) for part in keys]), return_inverse=True)
    numbers = numbers.reshape(-1)
    kind = np.int32 if n + len(edges) <= 2**31 else np.int64
    nodes = (numbers + n).astype(kind)
    of_simplices = nodes[: keys[0].size].reshape(keys[0].shape)
    of_facets = nodes[keys[0].size :].reshape(keys[1].shape)
    ends = np.stack([edges // np.uint64(max(n, 1)), edges % np.uint64(max(n, 1))], axis=1).astype(kind)
    tags, origins = mesh.vertex_tags, mesh.vertex_origins
    if len(tags):
        tags = np.concatenate([tags, _tags(of_facets - n, mesh.facet_tags, len(edges))])
        origins = np.concatenate([origins, np.full(len(edges), MIDDLE, origins.dtype)])
    given = {field.name: getattr(mesh, field.name) for field in dataclasses.fields(MeshArrays)}
    changed = {
        "points": _with_middles(mesh.points, ends),
        "simplices": np.concatenate([mesh.simplices, of_simplices], axis=1),
        "facets": np.concatenate([mesh.facets.reshape(-1, d), of_facets], axis=1),
        "vertex_tags": tags,
        "vertex_origins": origins,
        "weights": None if mesh.weights is None else _with_middles(mesh.weights, ends),
    }
    return SecondOrderMesh(**{**given, **changed}, middle_ends=ends)


def _keys(elements: npt.NDArray[Any], n: int) -> npt.NDArray[np.uint64]:
    """The edges of each element as numbers, which are in the order of the lower ends, then of the higher ones."""
    corners = elements.shape[1]
    ends = elements[:, _EDGES[: corners * (corners - 1) // 2]].astype(np.uint64)
    return ends.min(axis=2) * np.uint64(n) + ends.max(axis=2)


def _with_middles(values: npt.NDArray[Any], ends: npt.NDArray[Any]) -> npt.NDArray[Any]:
    low, high = values[ends[:, 0]], values[ends[:, 1]]
    with np.errstate(over="ignore"):
        middles = (low + high) / 2
    return np.concatenate([values, np.where(np.isinf(middles), low / 2 + high / 2, middles)])


def _tags(edges: npt.NDArray[Any], facet_tags: npt.NDArray[np.int32], count: int) -> npt.NDArray[np.int32]:
    """The least tag of a facet of each edge, of which facets have `edges`; 0 if there is none."""
    none = np.iinfo(np.int32).max
    tags = np.full(count, none, np.int32)
    np.minimum.at(tags, edges.reshape(-1), np.repeat(facet_tags, edges.shape[1]))
    return np.where(tags == none, np.int32(0), tags)
