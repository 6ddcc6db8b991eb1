"""Fields that a server carries from an earlier mesh of a session to the last one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _api, _wire
from ._arrays import Floats, choice, coordinates, revision_of, row_of_numbers
from ._calls import Calls, CallOptions, parse
from ._mesh_arrays import MeshArrays
from ._receiver import damaged
from ._retry import Attempt
from .errors import InvalidArgumentError

_PLACES = {"vertices": 1, "simplices": 2}  # of the service: FieldPlace
_VALUES_OF_A_REQUEST = 1 << 17  # which then has a MiB, if its rows are whole
_MOST_COMPONENTS = 64


def transfer(
    calls: Calls,
    session: str,
    values: Any,
    from_mesh: MeshArrays | int,
    place: str,
    conservative: bool,
    revision: int | None,
    options: CallOptions,
) -> npt.NDArray[np.float64]:
    """The field on the last mesh of the session, (rows, …). Changes nothing, so repeating is safe."""
    number = choice(place, "place", _PLACES)
    given = np.asarray(values)
    rows = _rows_of(given, from_mesh, place)
    components = math.prod(given.shape[1:])
    if not 1 <= components <= _MOST_COMPONENTS:
        raise InvalidArgumentError(
            f"values: an array of shape {given.shape}, with {components} numbers in a row; expected 1 to "
            f"{_MOST_COMPONENTS}",
            field="values",
        )
    if components == 1:
        table = row_of_numbers(given.reshape(rows), "values").reshape(rows, 1)
    else:
        table = coordinates(given.reshape(rows, components), "values")
    head = _api.message("TransferValuesRequest")()
    head.start.name = session
    head.start.from_revision = _revision_of_mesh(from_mesh)
    head.start.place = number
    head.start.components = components
    head.start.conservative = conservative
    if revision is not None:
        head.start.revision = revision

    def attempt_once(attempt: Attempt) -> Floats:
        requests = _requests(head.SerializeToString(), table)
        with calls.stream("QueryService/TransferValues", requests, attempt) as answers:
            return _receive(answers, components, revision)

    found = calls.run(options, attempt_once)
    return found.reshape(-1, *given.shape[1:])


def _revision_of_mesh(mesh: MeshArrays | int) -> int:
    revision = revision_of(mesh.revision if isinstance(mesh, MeshArrays) else mesh, "from_mesh")
    if revision is None:
        raise InvalidArgumentError("from_mesh is None; expected a mesh of the session, or its revision",
                                   field="from_mesh")
    return revision


def _rows_of(values: npt.NDArray[Any], mesh: MeshArrays | int, place: str) -> int:
    """How many rows `values` has: as many as the mesh needs, if that is here."""
    wanted = None
    if isinstance(mesh, MeshArrays):
        wanted = len(mesh.points) if place == "vertices" else len(mesh.simplices)
    if values.ndim == 0 or wanted not in (None, len(values)):
        rows = "a row" if wanted is None else f"{wanted} rows, one"
        raise InvalidArgumentError(
            f"values: an array of shape {values.shape}; expected {rows} for each of the {place} of from_mesh",
            field="values",
        )
    return len(values)


def _requests(head: bytes, table: Floats) -> Iterator[bytes]:
    """The start, then the rows."""
    yield head
    rows = max(1, _VALUES_OF_A_REQUEST // table.shape[1])
    for begin in range(0, len(table), rows):
        yield _wire.message_field(2, _wire.packed_field(1, table[begin : begin + rows]))


def _receive(answers: Iterator[bytes], components: int, revision: int | None) -> Floats:
    """The values of the answers, of which the first says how many there are."""
    first = next(answers, None)
    start = None if first is None else parse("TransferValuesResponse", first)
    if start is None or not start.HasField("start"):
        raise damaged("values without a start")
    if start.start.revision == 0 or revision not in (None, start.start.revision):
        raise damaged(f"values on the mesh of revision {start.start.revision}, not {revision}")
    wanted = start.start.row_count * components
    parts: list[npt.NDArray[Any]] = [np.empty(0)]
    count = 0
    for answer in answers:
        for field in _wire.fields(memoryview(answer)):
            if field.number != 2 or field.kind != _wire.BYTES:
                raise damaged("a part that has no values")
            found = [_wire.packed(inner, "<f8") for inner in _wire.fields(field.value) if inner.number == 1]
            parts += found
            count += sum(map(len, found))
        if count > wanted:
            raise damaged(f"more than {wanted} values")
    values = np.concatenate(parts)
    if len(values) != wanted or not np.isfinite(values).all():
        raise damaged(f"{len(values)} of {wanted} values, or some that are not finite")
    return values
