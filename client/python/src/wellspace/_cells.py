"""Voronoi cells as arrays."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _wire
from ._mesh import signed
from ._receiver import damaged


@dataclasses.dataclass(frozen=True, eq=False)
class Cell:
    """The Voronoi cell of one vertex.

    Attributes
    ----------
    vertex : int
    nodes : (k, d) float64
        Its corners. In 2-D counterclockwise around the cell, from the one with the least coordinates on; above they
        ascend by coordinates.
    neighbours : (l,) int
        The vertices whose bisectors bound it, ascending.
    clip_radius : float
        Half the side of the cube by which it is clipped; infinite for a whole cell.
    is_clipped : bool
        Whether it reaches that cube; if not, it is whole.
    """

    vertex: int
    nodes: npt.NDArray[np.float64]
    neighbours: npt.NDArray[Any]
    clip_radius: float
    is_clipped: bool


@dataclasses.dataclass(frozen=True, eq=False)
class Cells:
    """Voronoi cells of c vertices, side by side in arrays; ``cells[i]`` is one `Cell`.

    Attributes
    ----------
    vertices : (c,) int
    node_offsets, neighbour_offsets : (c + 1,) int64
        The nodes of cell i are ``nodes[node_offsets[i]:node_offsets[i + 1]]``, and likewise its neighbours.
    nodes : (k, d) float64
    neighbours : (l,) int
    clip_radii : (c,) float64
    is_clipped : (c,) bool
    """

    vertices: npt.NDArray[Any]
    node_offsets: npt.NDArray[np.int64]
    nodes: npt.NDArray[np.float64]
    neighbour_offsets: npt.NDArray[np.int64]
    neighbours: npt.NDArray[Any]
    clip_radii: npt.NDArray[np.float64]
    is_clipped: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.vertices)

    def __getitem__(self, index: int) -> Cell:
        if not -len(self) <= index < len(self):
            raise IndexError(f"cell {index} of {len(self)}")
        index %= len(self)
        nodes = slice(*self.node_offsets[index : index + 2])
        neighbours = slice(*self.neighbour_offsets[index : index + 2])
        return Cell(
            vertex=int(self.vertices[index]),
            nodes=self.nodes[nodes],
            neighbours=self.neighbours[neighbours],
            clip_radius=float(self.clip_radii[index]),
            is_clipped=bool(self.is_clipped[index]),
        )

    def __iter__(self) -> Iterator[Cell]:
        return (self[index] for index in range(len(self)))


# The fields of VoronoiCellBatch.
_FIXED = {1: ("vertices", "<u4"), 2: ("clip_radii", "<f8"), 5: ("nodes", "<f8"), 7: ("neighbours", "<u4")}
_VARINTS = {3: "is_clipped", 4: "node_counts", 6: "neighbour_counts"}
_NAMES = [name for name, _ in _FIXED.values()] + list(_VARINTS.values())


class CellReader:
    """Takes serialized answers with a VoronoiCellBatch each."""

    def __init__(self, dimension: int) -> None:
        self._dimension = dimension
        self._parts: dict[str, list[npt.NDArray[Any]]] = {name: [] for name in _NAMES}

    def add(self, serialized: bytes) -> int:
        """Keeps the cells, and returns how many there are."""
        count = 0
        for field in _wire.fields(memoryview(serialized)):
            if field.number == 1:
                count += self._add_batch(field.value)
        return count

    def _add_batch(self, batch: memoryview) -> int:
        found: dict[str, list[npt.NDArray[Any]]] = {name: [] for name in _NAMES}
        for field in _wire.fields(batch):
            if field.number in _FIXED:
                name, dtype = _FIXED[field.number]
                found[name].append(_wire.packed(field, dtype))
            elif field.number in _VARINTS:
                found[_VARINTS[field.number]].append(_wire.packed_varints(field))
        sizes = {name: sum(map(len, parts)) for name, parts in found.items()}
        sums = {name: sum(int(part.sum()) for part in found[name]) for name in ("node_counts", "neighbour_counts")}
        count = sizes["vertices"]
        if (
            any(sizes[name] != count for name in ("clip_radii", "is_clipped", "node_counts", "neighbour_counts"))
            or sizes["nodes"] != sums["node_counts"] * self._dimension
            or sizes["neighbours"] != sums["neighbour_counts"]
        ):
            raise damaged(f"cells of {count} vertices whose counts do not add up")
        if any(np.isnan(part).any() for name in ("nodes", "clip_radii") for part in found[name]):
            raise damaged("a node or a radius of a cell is not a number")
        for name, parts in found.items():
            self._parts[name] += parts
        return count

    def cells(self) -> Cells:
        """All that were added."""
        def joined(name: str, dtype: Any) -> npt.NDArray[Any]:
            return np.concatenate([np.empty(0, dtype), *self._parts[name]]).astype(dtype, copy=False)

        def offsets(name: str) -> npt.NDArray[np.int64]:
            return np.concatenate([[0], np.cumsum(joined(name, np.int64))]).astype(np.int64)

        neighbours, vertices = joined("neighbours", np.uint32), joined("vertices", np.uint32)
        most = max((int(array.max()) for array in (neighbours, vertices) if len(array)), default=0)
        return Cells(
            vertices=signed(vertices, most + 1),
            node_offsets=offsets("node_counts"),
            nodes=joined("nodes", np.float64).reshape(-1, self._dimension),
            neighbour_offsets=offsets("neighbour_counts"),
            neighbours=signed(neighbours, most + 1),
            clip_radii=joined("clip_radii", np.float64),
            is_clipped=joined("is_clipped", np.int64).astype(bool),
        )
