"""The dual of a mesh: Voronoi cells clipped by the domain, as finite volumes need them."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import Floats
from ._mesh_arrays import MeshArrays
from .errors import InvalidArgumentError


@dataclasses.dataclass(frozen=True)
class DualCells:
    """The Voronoi cell of each vertex, within the domain.

    A finite volume scheme with the flux of two points is ``flux = areas / lengths * (values[edges[:, 1]] -
    values[edges[:, 0]])``: the facet between two cells is orthogonal to the edge between their vertices.

    Attributes
    ----------
    volumes : (n,) float
        Of the cell of each vertex: areas in 2-D. Their sum is that of the simplices, but for rounding.
    edges : (e, 2) int
        The edges of the mesh, each once, the lower vertex first: the cells of the two are neighbours.
    areas : (e,) float
        Of the facet between the two cells: lengths in 2-D. At least 0 but for rounding; 0 where they meet in less.
    lengths : (e,) float
        Of the edges.
    facet_areas : (f, d) float
        For each of `Mesh.facets` its part of the area that the cells of its vertices have on the boundary. Of obtuse
        triangles it may be negative; the sum over all facets of a vertex is not. Empty if the mesh was asked for
        without the boundary.
    """

    volumes: Floats
    edges: npt.NDArray[Any]
    areas: Floats
    lengths: Floats
    facet_areas: Floats


def dual_cells(mesh: MeshArrays) -> DualCells:
    """See `Mesh.dual_cells`."""
    if mesh.dimension not in (2, 3):
        raise InvalidArgumentError(f"dual cells are for 2-D and 3-D; the mesh is in {mesh.dimension}-D", field="mesh")
    if mesh.weights is not None:
        raise InvalidArgumentError(
            "the mesh is a regular triangulation, whose dual are no Voronoi cells; mesh without pump_weights",
            field="mesh",
        )
    corners = mesh.points[mesh.simplices]
    pairs = list(itertools.combinations(range(mesh.dimension + 1), 2))
    parts = np.stack([_part(corners, i, j) for i, j in pairs], axis=1)  # of the facet of each edge, in each simplex
    ends = np.sort(mesh.simplices[:, pairs].reshape(-1, 2), axis=1)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    number = number.reshape(-1)
    areas = np.bincount(number, parts.reshape(-1), minlength=len(edges))
    lengths = np.linalg.norm(mesh.points[edges[:, 0]] - mesh.points[edges[:, 1]], axis=1)
    # A cell is made of the cones from its vertex over its facets: of half an edge's length each.
    cones = areas * lengths / (2 * mesh.dimension)
    volumes = sum(np.bincount(edges[:, k], cones, minlength=len(mesh.points)) for k in (0, 1))
    facets = mesh.points[mesh.facets] if len(mesh.facets) else np.empty((0, mesh.dimension, mesh.dimension))
    return DualCells(np.asarray(volumes, np.float64), edges, np.asarray(areas, np.float64), lengths, _shares(facets))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("...k,...k", a, b)


def _foot(corners: Floats, i: int, j: int, k: int) -> Floats:
    """In the triangle i, j, k: how far its circumcentre is from the edge i, j; negative beyond it, as seen from k."""
    a, b = corners[:, i] - corners[:, k], corners[:, j] - corners[:, k]
    # Half the edge times the cotangent of the angle at k.
    if corners.shape[2] == 2:
        double_area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    else:
        double_area = np.linalg.norm(np.cross(a, b), axis=1)
    return 0.5 * np.linalg.norm(a - b, axis=1) * _dot(a, b) / double_area


def _part(corners: Floats, i: int, j: int) -> Floats:
    """Of the facet that is dual to the edge i, j, the part in each simplex; parts beyond a face are negative."""
    others = [k for k in range(corners.shape[1]) if k not in (i, j)]
    if len(others) == 1:
        return _foot(corners, i, j, others[0])
    k, last = others
    of_k = _foot(corners, i, j, k) * _height(corners, (i, j, k), last)
    return 0.5 * (of_k + _foot(corners, i, j, last) * _height(corners, (i, j, last), k))


def _height(corners: Floats, face: tuple[int, int, int], opposite: int) -> Floats:
    """The distance of a tetrahedron's circumcentre from a face; negative beyond it, seen from the opposite corner."""
    a, b, c = (corners[:, k] - corners[:, face[0]] for k in (face[1], face[2], opposite))
    normal = np.cross(a, b)
    aa, bb, cc = _dot(a, a), _dot(b, b), _dot(c, c)
    determinant = _dot(normal, c)
    center = (cc[:, None] * normal + bb[:, None] * np.cross(c, a) + aa[:, None] * np.cross(b, c)) / (
        2 * determinant[:, None]
    )
    return _dot(center, normal) / np.linalg.norm(normal, axis=1) * np.sign(determinant)


def _shares(facets: Floats) -> Floats:
    """For each facet of the boundary, its part of the area of the cells of its vertices there."""
    count, corners = facets.shape[:2]
    if corners == 2:
        return np.repeat(0.5 * np.linalg.norm(facets[:, 1] - facets[:, 0], axis=1)[:, None], 2, axis=1)
    shares = np.zeros((count, corners))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cone = 0.25 * np.linalg.norm(facets[:, i] - facets[:, j], axis=1) * _foot(facets, i, j, k)
        shares[:, i] += cone
        shares[:, j] += cone
    return shares
