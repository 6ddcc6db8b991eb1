"""Names of parts of a mesh, and the numbers that stand for them in messages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _api
from ._arrays import whole_numbers
from .errors import InvalidArgumentError


class NameTable:
    """Names by number. A name that has none gets the lowest number from 1 on that is free."""

    def __init__(self, given: Any, field: str, before: Mapping[int, str] | None = None) -> None:
        if not isinstance(given, Mapping):
            raise InvalidArgumentError(f"{field} is {given!r}; expected a dict of numbers to names", field=field)
        self.names = dict(before or {})
        self._taken = set(self.names)
        numbers = whole_numbers(list(given), field, len(given)).tolist()
        for number, name in zip(numbers, given.values()):
            if not isinstance(name, str):
                raise InvalidArgumentError(
                    f"{field}[{number}] is {name!r}; expected a name, as text", field=f"{field}[{number}]"
                )
            self.names[number] = name
        self._taken |= set(numbers)

    def take(self, numbers: Iterable[int]) -> None:
        """Keeps names from getting these numbers."""
        self._taken.update(numbers)

    def number_of(self, name: str) -> int:
        """The number of a name, which gets one if it has none; 0 for the empty one."""
        if name == "":
            return 0
        for number, other in self.names.items():
            if other == name:
                return number
        number = next(k for k in range(1, len(self._taken) + 2) if k not in self._taken)
        self.names[number] = name
        self._taken.add(number)
        return number

    def numbers_of(self, values: Any, field: str, count: int) -> npt.NDArray[np.int32]:
        """`values`, (count,) whole numbers or names, as numbers."""
        array = np.asarray(values)
        if array.shape != (count,) or array.dtype.kind != "U":
            return whole_numbers(values, field, count)
        distinct, first, row_of = np.unique(array, return_index=True, return_inverse=True)
        numbers = np.zeros(len(distinct), np.int32)
        for k in np.argsort(first):
            numbers[k] = self.number_of(str(distinct[k]))
        return numbers[row_of]


def names_message(markers: NameTable, regions: NameTable) -> Any:
    """A PartNames; None where there are no names."""
    if not markers.names and not regions.names:
        return None
    return _api.message("PartNames")(markers=markers.names, regions=regions.names)
