"""Periodic boxes: axes by letters or numbers, and pairs of vertices on opposite sides."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ._mesh_arrays import MeshArrays
from .errors import InvalidArgumentError

LETTERS = "xyz"


def axis_of(value: Any, name: str = "axis") -> int:
    """The number of an axis that is given as such, or by its letter."""
    if isinstance(value, str) and len(value) == 1 and value in LETTERS:
        return LETTERS.index(value)
    if isinstance(value, (int, np.integer)) and not isinstance(value, bool) and 0 <= value < len(LETTERS):
        return int(value)
    raise InvalidArgumentError(f"{name} is {value!r}; expected 'x', 'y' or 'z', or 0, 1 or 2", field=name)


def axes_of(value: str | Sequence[int | str]) -> list[int]:
    """The numbers of the axes of "xy", "x,y", ["x", "y"] or [0, 1]."""
    items = value.replace(",", "") if isinstance(value, str) else value
    try:
        return [axis_of(item, "periodic") for item in items]
    except TypeError:
        raise InvalidArgumentError(
            f"periodic is {value!r}; expected axes, as 'xy' or [0, 1]", field="periodic"
        ) from None


def pairs(mesh: MeshArrays, axis: int) -> npt.NDArray[Any]:
    """See Mesh.periodic_pairs."""
    if axis >= mesh.dimension:
        raise InvalidArgumentError(f"axis is {axis}, and the mesh is in {mesh.dimension}-D", field="axis")
    others = np.delete(mesh.points, axis, axis=1)
    sides = []
    for bound in mesh.box[:, axis]:
        side = np.flatnonzero(mesh.points[:, axis] == bound)
        sides.append(side[np.lexsort(others[side].T[::-1])])
    low, high = sides
    if len(low) != len(high) or not np.array_equal(others[low], others[high]):
        raise InvalidArgumentError(
            f"axis is {LETTERS[axis]!r}, and vertices on the two sides across it do not match; "
            "expected a mesh that is periodic along it",
            field="axis",
        )
    order = np.argsort(low)
    return np.stack([low[order], high[order]], axis=1).astype(mesh.simplices.dtype, copy=False)
