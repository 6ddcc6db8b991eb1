"""Points located in a mesh that is here: a tree of boxes over its simplices, in arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import Floats
from ._located import Located
from .errors import InvalidArgumentError

_FAN = 8  # children of a node
_POINTS_AT_ONCE = 1 << 14
_PAIRS_AT_ONCE = 1 << 18  # of points and boxes, unless one point has more
_EPSILON = 2.0**-53
# Products of numbers beyond it may be beyond the range of doubles.
_MOST = 2.0**100


class MeshLocator:
    """Finds the simplex of each point. Thread-safe.

    Boxes around the simplices, in the order of a space-filling curve, then around `_FAN` of those, and so on. Points go
    down all together, level by level. Takes O(m log m) for m simplices, and about O(log m) for each point.
    """

    def __init__(self, points: Floats, simplices: npt.NDArray[Any]) -> None:
        largest = np.abs(points).max(initial=0.0)
        # A power of two: it changes no bit, and differences stay in the range of doubles.
        self._scale = 2.0**-4 if largest > 2.0**1000 else 1.0
        self._points = points * self._scale
        self._simplices = simplices
        self._levels: list[tuple[Floats, Floats]] = []  # low and high corners, the leaves first
        if not len(simplices):
            return
        corners = self._points[simplices]
        low, high = corners.min(axis=1), corners.max(axis=1)
        self._order = np.argsort(_curve_places((low + high) / 2), kind="stable")
        low, high = low[self._order], high[self._order]
        self._levels.append((low, high))
        while len(low) > 1:
            begins = np.arange(0, len(low), _FAN)
            low, high = np.minimum.reduceat(low, begins), np.maximum.reduceat(high, begins)
            self._levels.append((low, high))

    def locate(self, cloud: Floats, allow_outside: bool, revision: int) -> Located:
        """The places of these points."""
        rows, dimension = cloud.shape
        found = np.full(rows, -1, np.int64)
        coordinates = np.zeros((rows, dimension + 1))
        for begin in range(0, rows, _POINTS_AT_ONCE):
            part = slice(begin, begin + _POINTS_AT_ONCE)
            self._locate_some(cloud[part] * self._scale, found[part], coordinates[part])
        outside = np.flatnonzero(found < 0)
        if len(outside) and not allow_outside:
            raise InvalidArgumentError(
                f"points[{outside[0]}] lies in no simplex: outside the domain, or in a hole; give points of the mesh, "
                "or set allow_outside",
                field="points",
            )
        vertices = np.zeros(coordinates.shape, self._simplices.dtype)
        inside = found >= 0
        vertices[inside] = self._simplices[found[inside]]
        return Located(found, vertices, coordinates, revision, len(self._points))

    def _locate_some(self, cloud: Floats, found: npt.NDArray[np.int64], coordinates: Floats) -> None:
        """Writes simplices and coordinates of some points."""
        pairs = self._candidates(cloud)
        if pairs is None:
            half = len(cloud) // 2
            for part in (slice(half), slice(half, None)):
                self._locate_some(cloud[part], found[part], coordinates[part])
            return
        rows, simplices = pairs
        if not len(rows):
            return
        volumes, bound = _volumes(self._points[self._simplices[simplices]], cloud[rows])
        least = volumes.min(axis=1)
        # On a face rounding may leave a point a little beside all simplices around it: the one that it is least beside.
        beside = np.where(least >= 0, 0.0, np.where(bound > 0, -least / np.where(bound > 0, bound, 1), np.inf))
        near = beside <= 1
        rows, simplices, volumes, beside = rows[near], simplices[near], volumes[near], beside[near]
        best = np.lexsort((simplices, beside, rows))
        rows, first = np.unique(rows[best], return_index=True)
        chosen = best[first]
        parts = np.maximum(volumes[chosen], 0)
        sums = parts.sum(axis=1, keepdims=True)
        found[rows] = simplices[chosen]
        coordinates[rows] = np.divide(parts, sums, out=np.full(parts.shape, 1 / parts.shape[1]), where=sums > 0)

    def _candidates(self, cloud: Floats) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]] | None:
        """Pairs of a row of `cloud` and a simplex whose box has the point; None: too many for one look."""
        rows = np.arange(len(cloud) if self._levels else 0)
        nodes = np.zeros(len(rows), np.intp)
        for depth in range(len(self._levels) - 1, -1, -1):
            low, high = self._levels[depth]
            if depth < len(self._levels) - 1:
                nodes = (nodes[:, np.newaxis] * _FAN + np.arange(_FAN)).ravel()
                rows = np.repeat(rows, _FAN)
                is_there = nodes < len(low)
                rows, nodes = rows[is_there], nodes[is_there]
            x = cloud[rows]
            has_point = ((x >= low[nodes]) & (x <= high[nodes])).all(axis=1)
            rows, nodes = rows[has_point], nodes[has_point]
            if len(rows) > _PAIRS_AT_ONCE and len(cloud) > 1:
                return None
        return rows, self._order[nodes] if len(nodes) else nodes


def _curve_places(points: Floats) -> npt.NDArray[np.uint64]:
    """The places of points on a Morton curve: bits of the axes by turns, the highest first."""
    dimension = points.shape[1]
    bits = 63 // dimension
    low, high = points.min(axis=0), points.max(axis=0)
    sides = np.where(high > low, high - low, 1.0)
    cells = np.minimum((points - low) / sides * 2.0**bits, 2.0**bits - 1).astype(np.uint64)
    places = np.zeros(len(points), np.uint64)
    for bit in range(bits - 1, -1, -1):
        for axis in range(dimension):
            places = (places << np.uint64(1)) | ((cells[:, axis] >> np.uint64(bit)) & np.uint64(1))
    return places


def _volumes(corners: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Volumes of the simplices that each point makes with the facets of its simplex, and a bound on their error.

    Times d!, by the corners opposite to the facets, (k, d + 1); of each row in a unit of its own.
    """
    rows = corners - x[:, np.newaxis, :]
    size = np.abs(rows).max(axis=(1, 2), initial=0.0)
    extreme = (size > _MOST) | ((size < 1 / _MOST) & (size > 0))
    if extreme.any():
        exponents = np.frexp(size[extreme])[1]
        rows[extreme] = np.ldexp(rows[extreme], -exponents[:, np.newaxis, np.newaxis])
        size[extreme] = np.ldexp(size[extreme], -exponents)
    dimension = x.shape[1]
    volumes = np.empty((len(x), dimension + 1))
    for corner in range(dimension + 1):
        others = np.delete(rows, corner, axis=1)
        volumes[:, corner] = (-1) ** corner * _determinants(others)
    # Shewchuk, 1997: 8 eps in the plane and 48 eps in space; by elimination, eps times the growth of its pivots.
    factor = {2: 8.0, 3: 48.0}.get(dimension, 8.0**dimension)
    return volumes, factor * _EPSILON * size**dimension


def _determinants(m: Floats) -> Floats:
    """Of matrices (k, d, d). With a row of zeros it is 0."""
    if m.shape[1] == 2:
        return m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0]
    if m.shape[1] == 3:
        return np.einsum("ki,ki->k", m[:, 0], np.cross(m[:, 1], m[:, 2]))
    found: Floats = np.linalg.det(m)
    return found
