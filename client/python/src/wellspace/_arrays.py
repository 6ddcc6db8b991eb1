"""The arguments of users, as arrays that are right, or an error that names the row."""

from __future__ import annotations

from typing import Any, SupportsFloat, SupportsIndex

import numpy as np
import numpy.typing as npt

from .errors import InvalidArgumentError

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.uint32]
Number = SupportsFloat  # of Python or of numpy
WholeNumber = SupportsIndex

_MOST_AXES = 6  # the service says which dimensions it takes; here more are a sign of an array that is transposed


def coordinates(values: Any, name: str, dimension: int | None = None) -> Floats:
    """`values` as (n, d) finite doubles, contiguous; not copied if they are so already.

    Raises
    ------
    InvalidArgumentError
        Its field is `name`, or ``name[row]``.
    """
    array = _numbers(_unmasked(values, name, "a number on every axis"), name)
    if array.ndim != 2:
        if array.size == 0 and array.ndim == 1 and dimension is not None:
            return np.empty((0, dimension))
        raise InvalidArgumentError(
            f"{name}: an array of shape {array.shape}; expected (n, d): a row for each point", field=name
        )
    rows, axes = array.shape
    if rows == dimension != axes or dimension is None and 2 <= rows <= _MOST_AXES < axes:
        taken = f"at most {_MOST_AXES}" if dimension is None else str(dimension)
        raise _transposed(name, array.shape, f"(n, d): a row for each point, with {taken} coordinates")
    if dimension is not None and axes != dimension:
        raise InvalidArgumentError(
            f"{name}: points of {axes} coordinates; expected {dimension}", field=name
        )
    result = np.ascontiguousarray(array, "<f8")
    finite = np.isfinite(result)
    if not finite.all():
        row, axis = np.argwhere(~finite)[0]
        raise _row_error(name, row, f"coordinate {axis} is {result[row, axis]}; expected a finite number")
    _check_kept(array, result, name)
    return result


def row_of_numbers(values: Any, name: str, count: int | None = None) -> Floats:
    """`values` as (count,) finite doubles."""
    array = _numbers(_unmasked(values, name, "a number"), name)
    if array.ndim != 1 or count not in (None, len(array)):
        expected = "numbers" if count is None else f"{count} numbers"
        raise InvalidArgumentError(f"{name}: an array of shape {array.shape}; expected {expected}", field=name)
    result = np.ascontiguousarray(array, "<f8")
    if not np.isfinite(result).all():
        axis = np.flatnonzero(~np.isfinite(result))[0]
        raise _row_error(name, axis, f"is {result[axis]}; expected a finite number")
    _check_kept(array, result, name)
    return result


def indices(values: Any, name: str, columns: int | None = None, end: int | None = None) -> Indices:
    """`values` as numbers of points or vertices from 0 up to `end`; shape (n,), or (n, columns)."""
    array = np.asarray(values)
    if array.size == 0:
        return np.empty((0,) if columns is None else (0, columns), np.uint32)
    shape = "(n,)" if columns is None else f"(n, {columns})"
    if array.dtype.kind not in "iu":
        raise InvalidArgumentError(f"{name}: an array of {array.dtype}; expected whole numbers", field=name)
    if array.ndim == 2 and array.shape[0] == columns != array.shape[1]:
        raise _transposed(name, array.shape, f"{shape}: a row for each")
    if array.ndim != (1 if columns is None else 2) or columns not in (None, array.shape[-1]):
        raise InvalidArgumentError(f"{name}: an array of shape {array.shape}; expected {shape}", field=name)
    wrong = (array < 0) | (array >= (2**32 if end is None else end))
    if wrong.any():
        place = tuple(np.argwhere(wrong)[0])
        below = "2**32" if end is None else str(end)
        raise _row_error(name, place[0], f"names {array[place]}; expected numbers from 0, below {below}")
    return np.ascontiguousarray(array, "<u4")


def whole_numbers(values: Any, name: str, count: int) -> npt.NDArray[np.int32]:
    """`values` as (count,) whole numbers of 32 bits."""
    array = np.asarray(values)
    if array.shape != (count,) or (count and array.dtype.kind not in "iu"):
        raise InvalidArgumentError(
            f"{name}: an array of {array.dtype} and shape {array.shape}; expected {count} whole numbers", field=name
        )
    wrong = np.flatnonzero((array < -(2**31)) | (array >= 2**31)) if count else np.empty(0, np.intp)
    if len(wrong):
        raise _row_error(name, wrong[0], f"is {array[wrong[0]]}; expected a whole number of 32 bits")
    return array.astype(np.int32)


def number(value: Any, name: str) -> float:
    """`value` as a double; the service says which ones it takes."""
    try:
        if isinstance(value, (str, bytes)):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise InvalidArgumentError(f"{name} is {value!r}; expected a number", field=name) from None


def count(value: Any, name: str, most: int = 2**63 - 1) -> int:
    """`value` as a whole number from 0 up to `most`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 0 <= value <= most:
        raise InvalidArgumentError(f"{name} is {value!r}; expected a whole number from 0 to {most}", field=name)
    return int(value)


def revision_of(value: Any, name: str) -> int | None:
    """`value` as a revision, of which 1 is the first; None for none."""
    if value is None:
        return None
    if count(value, name, 2**64 - 1) == 0:
        raise InvalidArgumentError(
            f"{name} is 0; expected a revision, which is at least 1 (a mesh of no session has none), or None for any",
            field=name,
        )
    return int(value)


def choice(value: Any, name: str, choices: dict[str, int]) -> int:
    """The number of `value` among `choices`."""
    if value not in choices:
        raise InvalidArgumentError(f"{name} is {value!r}; expected one of {', '.join(map(repr, choices))}", field=name)
    return choices[value]


def _numbers(values: Any, name: str) -> npt.NDArray[Any]:
    try:
        array = np.asarray(values)
    except ValueError:  # rows of several lengths
        array = np.array(["rows"])
    if array.dtype.kind in "fiu":
        return array
    if array.size == 0:
        return array.astype(np.float64)
    if isinstance(values, (list, tuple)) or array.dtype.kind in "OUSc" and array.ndim > 1:
        for row, value in enumerate(values):
            if not _is_like(value, values[0]):
                raise _row_error(name, row, f"is {value!r}; expected as many numbers as in each row")
    raise InvalidArgumentError(f"{name}: an array of {array.dtype}; expected numbers", field=name)


def _unmasked(values: Any, name: str, expected: str) -> Any:
    """`values`, of which none may be masked."""
    if not isinstance(values, np.ma.MaskedArray) or values.ndim == 0:
        return values
    mask = np.broadcast_to(np.asarray(values.mask), values.shape)
    masked = np.flatnonzero(mask.reshape(len(values), -1).any(axis=1))
    if len(masked):
        raise _row_error(name, masked[0], f"is masked; expected {expected}")
    return values.data


def _check_kept(array: npt.NDArray[Any], result: Floats, name: str) -> None:
    """Refuses whole numbers that no double is."""
    if array.dtype.kind not in "iu" or array.dtype.itemsize < 8:
        return
    with np.errstate(invalid="ignore"):  # beyond the integers it is another number, too
        rounded = np.argwhere(result.astype(array.dtype) != array)
    if len(rounded):
        row = tuple(rounded[0])
        raise _row_error(name, row[0], f"has {array[row]}, which no double is; expected whole numbers up to 2**53, or "
                                       "doubles")


def _is_like(row: Any, first: Any) -> bool:
    """Whether a row is one of numbers, as many as in the first."""
    try:
        array = np.asarray(row)
    except ValueError:
        return False
    return array.dtype.kind in "fiu" and array.shape == np.shape(first)


def _transposed(name: str, shape: tuple[int, ...], expected: str) -> InvalidArgumentError:
    return InvalidArgumentError(
        f"{name}: an array of shape {shape}, which looks transposed; expected {expected}; {name}.T has them", field=name
    )


def _row_error(name: str, row: Any, what: str) -> InvalidArgumentError:
    return InvalidArgumentError(f"{name}[{row}] {what}", field=f"{name}[{row}]")
