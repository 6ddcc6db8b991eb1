"""The domain of a mesh and its quality: MeshParameters of the service, with the names of this package."""

from __future__ import annotations

import functools
import inspect
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypedDict, TypeVar

import numpy as np
import numpy.typing as npt

from . import _api, _periodic
from ._arrays import Floats, Number, WholeNumber, choice, count, number, row_of_numbers
from .errors import InvalidArgumentError

Function = TypeVar("Function", bound=Callable[..., Any])

# Of the service, and hence the argument.
_CRITERIA = _api.enum_numbers("Criterion")


class Parameters(TypedDict, total=False):
    """
    criterion : {"radius-edge", "well-spaced"}
        `rho` bounds circumradius / shortest edge of every simplex; or, for every vertex, the farthest node of its
        Voronoi cell / its nearest neighbour, which is stronger and takes about 2.5 times as many vertices. Default
        "radius-edge".
    rho : float
        The bound of `criterion`. Default: sqrt(2) in 2-D, 2 in 3-D, 2.9, 4.1 and 5.8 in 4-D to 6-D, for which
        refinement ends whatever the points.
    min_angle : float
        In 2-D, in the place of `rho`: no angle of a triangle is smaller. Degrees, above 0 and up to 33.7; above 20.7
        refinement need not end.
    size : float
        No simplex has a larger circumradius. Above 0, in the unit of the points. Default: no bound, as `math.inf` says,
        which takes back that of a session.
    size_boxes : sequence of (low, high, size)
        Boxes with `d` low and `d` high coordinates in which circumradii are smaller still; away from a box, sizes grow
        no faster than `gradation` times the distance from it. In the unit of the points. Default: none.
    edge_length : float
        Edges have this length, on average where points ask for no shorter ones: a `size` of 0.733 times as much in 2-D,
        0.747 in 3-D. Of both, the smaller holds. Above 0, in the unit of the points. Default: no bound, as `math.inf`
        says.
    gradation : float
        How fast sizes grow with the distance from `size_boxes` and from points that have a size: above 0 and at most 1.
        Default: 1 from boxes, 0.3 from points.
    min_dihedral : float
        In 3-D, no dihedral angle of a tetrahedron is smaller: vertices are moved, and some added, until that holds.
        Slivers left over are counted in ``statistics.slivers.left``. Degrees, from 0 to 18; 0 turns it off.
        Default: 12 in 3-D, 0 elsewhere.
    tolerance : float
        Of a surface: facets and the surface are nowhere farther apart, in either direction. Above 0, in the unit of the
        points. Default: 1e-3 of the diagonal of the surface's bounding box; with ``solids="winding"`` `resolution`.
    facet_length : float
        Of a surface: edges on it have this length, on average where nothing asks for shorter ones. Above 0, in the unit
        of the points. Default: no bound.
    min_facet_angle : float
        Of a surface: no facet on it has a smaller angle, but where the surface itself has. Degrees, from 0, which turns
        it off, to 30. Default 25.
    min_size : float
        Of a surface: nothing is added to it for its shape, or for `tolerance`, nearer to another vertex than this.
        Above 0, in the unit of the points. Default: half of `tolerance`.
    per_circle : float
        Of a surface: where it is curved, edges are so short that this many would go round a circle of its radius of
        curvature; from there sizes grow by `gradation`. Above 0. Not for scans, whose noise is curvature. Default:
        none.
    layers : float
        Of a surface: where a solid is thin, edges are so short that this many go across it; from there sizes grow by
        `gradation`. Above 0. Default: none.
    pump_weights : bool
        From 3-D on: give vertices weights, under which the worst simplices are best. The mesh is then the regular
        triangulation of its vertices with `Mesh.weights`, and `rho` does not hold. Default False.
    merge_distance : float
        Points no farther than this from another one become that one's vertex. In the unit of the points. In a session
        it cannot change. Default 0: equal points only.
    periodic : str or sequence of int
        Axes along which the box is periodic, as ``"xy"`` or ``[0, 1]``: for each vertex on one of two opposite sides
        there is one on the other, and the facets on both match; see `Mesh.periodic_pairs`. In 2-D and 3-D,
        without triangles and `pump_weights`. With segments, opposite sides of their bounding rectangle have to have
        the same ones. In a session it cannot change. Default: none.
    keep_vertices : bool
        In a session: vertices of its last mesh stay where they are, and the repair of slivers moves only new ones.
        Default False.
    box : (low, high)
        The box to mesh: `d` low and `d` high coordinates, in the unit of the points. In a session it cannot change.
        Default: the bounding box of the points, grown by `margin`.
    margin : float
        By how much that is grown on every side: a part of its longest side, at least 0. Not used with `box`. Default
        0.25.
    max_vertices : int
        Fail with `LimitError` before the mesh has more vertices. Default: the limit of the server, but not above 50
        million.
    threads : int
        Threads that mesh; the server takes fewer if it has fewer. The mesh does not depend on it. Default: as many as
        help, up to the processors of this machine; in a session 1.
    """

    criterion: str
    rho: Number
    min_angle: Number
    size: Number
    size_boxes: Iterable[tuple[npt.ArrayLike, npt.ArrayLike, Number]]
    edge_length: Number
    gradation: Number
    min_dihedral: Number
    tolerance: Number
    facet_length: Number
    min_facet_angle: Number
    min_size: Number
    per_circle: Number
    layers: Number
    pump_weights: bool
    merge_distance: Number
    periodic: str | Sequence[int | str]
    keep_vertices: bool
    box: npt.ArrayLike
    margin: Number
    max_vertices: WholeNumber
    threads: WholeNumber


# The parameters of the service that a number sets as it is.
_NUMBERS = {
    "rho": "rho",
    "size": "max_circumradius",
    "edge_length": "edge_length",
    "gradation": "gradation",
    "min_dihedral": "min_dihedral",
    "merge_distance": "merge_distance",
    "margin": "margin",
}


# The same, of SurfaceParameters.
SURFACE_NUMBERS = {
    "tolerance": "tolerance",
    "facet_length": "edge_length",
    "min_facet_angle": "min_facet_angle",
    "min_size": "min_size",
    "per_circle": "curvature_elements",
    "layers": "thickness_layers",
}


# Of these infinity stands for none.
_BOUNDS = {"size", "edge_length", "facet_length"}


def takes(*kinds: Any) -> Callable[[Function], Function]:
    """Has the signature and the docstring of a function, which takes the keys of `kinds` as **arguments, name them."""

    def change(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD]
        annotations = {name: annotation for kind in kinds for name, annotation in kind.__annotations__.items()}
        named = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=_text(annotation))
            for name, annotation in annotations.items()
        ]
        function.__signature__ = signature.replace(parameters=[*own, *named])  # type: ignore[attr-defined]
        function.__doc__ = naming(function.__doc__, *kinds)
        return function

    return change


def naming(document: str | None, *kinds: Any) -> str:
    """A docstring in the place of whose "**arguments" the keys of `kinds` stand."""
    lines = "\n".join(inspect.cleandoc(kind.__doc__ or "") for kind in kinds)
    return inspect.cleandoc(document or "").replace("**arguments", lines)


def _text(annotation: Any) -> Any:
    return getattr(annotation, "__forward_arg__", annotation)


def split(function: str, arguments: Mapping[str, Any], *kinds: Any) -> list[dict[str, Any]]:
    """`arguments` by the kind that has their names, without those that are None. Raises TypeError, as Python does."""
    for name in arguments:
        if not any(name in kind.__annotations__ for kind in kinds):
            raise TypeError(f"{function}() got an unexpected keyword argument {name!r}")
    given = {name: value for name, value in arguments.items() if value is not None}
    return [{name: value for name, value in given.items() if name in kind.__annotations__} for kind in kinds]


def fill(message: Any, dimension: int, given: Mapping[str, Any]) -> Any:
    """Sets the fields of a MeshParameters that `given` names; `split` has checked the names."""
    message.dimension = count(dimension, "dimension", 2**31 - 1)
    _set_numbers(message, _NUMBERS, given)
    if any(name in given for name in SURFACE_NUMBERS):
        _set_numbers(message.surface, SURFACE_NUMBERS, given)
    for name in ("pump_weights", "keep_vertices"):
        if name in given:
            setattr(message, name, bool(given[name]))
    if "periodic" in given:
        del message.periodic_axes[:]
        message.periodic_axes.extend(_periodic.axes_of(given["periodic"]))
    if "max_vertices" in given:
        message.max_vertices = count(given["max_vertices"], "max_vertices")
    if "threads" in given:
        message.threads = count(given["threads"], "threads", 2**31 - 1)
    if "criterion" in given:
        message.criterion = choice(given["criterion"], "criterion", _CRITERIA)
    if "min_angle" in given:
        if "rho" in given:
            raise InvalidArgumentError("both rho and min_angle; expected one of them", field="min_angle")
        message.rho = rho_of_angle(number(given["min_angle"], "min_angle"), dimension)
    if "box" in given:
        low, high = _box(given["box"], dimension, "box")
        message.ClearField("domain")
        message.domain.low.extend(low)
        message.domain.high.extend(high)
    if "size_boxes" in given:
        message.ClearField("size_boxes")
        for row, one in enumerate(given["size_boxes"]):
            _add_size_box(message.size_boxes.add(), one, dimension, f"size_boxes[{row}]")
    return message


def _set_numbers(message: Any, fields: Mapping[str, str], given: Mapping[str, Any]) -> None:
    for name, field in fields.items():
        if name in given:
            value = number(given[name], name)
            if name in _BOUNDS and value == math.inf:
                message.ClearField(field)
            else:
                setattr(message, field, value)  # 0, too: the service refuses it where it can be no value


def rho_of_angle(degrees: float, dimension: int) -> float:
    """The bound on circumradius / shortest edge of triangles without smaller angles."""
    if dimension != 2:
        what = f"min_angle is for 2-D, and the points are in {dimension}-D; use rho"
        raise InvalidArgumentError(what, field="min_angle")
    if not 0.001 <= degrees <= 33.7:
        raise InvalidArgumentError(f"min_angle is {degrees}; expected degrees from 0.001 to 33.7", field="min_angle")
    return 0.5 / math.sin(math.radians(degrees))


def _box(value: Any, dimension: int, name: str) -> tuple[list[float], list[float]]:
    try:
        low, high = value
    except (TypeError, ValueError):
        raise InvalidArgumentError(f"{name} is {value!r}; expected (low, high)", field=name) from None
    sides = row_of_numbers(low, f"{name}.low", dimension), row_of_numbers(high, f"{name}.high", dimension)
    return sides[0].tolist(), sides[1].tolist()


def _add_size_box(message: Any, value: Any, dimension: int, name: str) -> None:
    try:
        low, high, size = value
    except (TypeError, ValueError):
        raise InvalidArgumentError(f"{name} is {value!r}; expected (low, high, size)", field=name) from None
    low, high = _box((low, high), dimension, name)
    message.low.extend(low)
    message.high.extend(high)
    message.max_circumradius = number(size, f"{name}.size")


def helpful_threads(points: Floats, parameters: Mapping[str, Any]) -> int:
    """How many threads shorten the meshing of `points`: each has at least some vertices to look after."""
    rows, dimension = points.shape
    vertices = 2.0 * rows
    size = parameters.get("size")
    if size and rows:
        sides = points.max(axis=0) - points.min(axis=0)
        if parameters.get("box") is not None:
            low, high = _box(parameters["box"], dimension, "box")
            sides = np.array(high) - np.array(low)
        with np.errstate(over="ignore", divide="ignore"):
            vertices = max(vertices, float(np.prod(sides / number(size, "size"))))
    for_each = 10_000 if dimension <= 3 else 1_000
    most = os.cpu_count() or 1
    return int(max(1, min(most, vertices / for_each)))


@functools.cache
def _criterion_names() -> dict[int, str]:
    return _api.enum_names("Criterion") | {0: "radius-edge"}  # the default


def read(message: Any) -> dict[str, Any]:
    """A MeshParameters by the names of this package; unset fields are left out."""
    found: dict[str, Any] = {}
    for part, fields in ((message, _NUMBERS), (message.surface, SURFACE_NUMBERS)):
        for name, field in fields.items():
            if part.HasField(field):
                found[name] = getattr(part, field)
    found["criterion"] = _criterion_names().get(message.criterion, "unknown")
    for name in ("pump_weights", "keep_vertices", "max_vertices", "threads"):
        if getattr(message, name):
            found[name] = getattr(message, name)
    if message.periodic_axes:
        found["periodic"] = "".join(_periodic.LETTERS[axis] for axis in message.periodic_axes)
    if message.HasField("domain"):
        found["box"] = (tuple(message.domain.low), tuple(message.domain.high))
    if message.size_boxes:
        found["size_boxes"] = [(tuple(b.low), tuple(b.high), b.max_circumradius) for b in message.size_boxes]
    return found
