"""The arrays of a mesh: the part that all code on meshes may know."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from .statistics import Statistics


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MeshArrays:
    """The attributes of a `Mesh`, which has their meaning, without its methods.

    Dual cells, files and pages are made of these, and `Mesh` calls them; so they know this class, and not that one.
    """

    points: npt.NDArray[np.float64]
    simplices: npt.NDArray[Any]
    input_vertices: npt.NDArray[Any]
    facets: npt.NDArray[Any]
    facet_tags: npt.NDArray[np.int32]
    facet_names: dict[int, str]
    regions: npt.NDArray[np.int32]
    region_names: dict[int, str]
    vertex_origins: npt.NDArray[Any]
    vertex_tags: npt.NDArray[np.int32]
    weights: npt.NDArray[np.float64] | None
    moved_vertices: npt.NDArray[Any]
    box: npt.NDArray[np.float64]
    statistics: Statistics | None = None
    revision: int = 0
    ridges: npt.NDArray[Any] = dataclasses.field(default_factory=lambda: np.empty((0, 2), np.int32))

    @property
    def dimension(self) -> int:
        """Of the space: d."""
        return int(self.points.shape[1])
