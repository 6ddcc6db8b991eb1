"""Meshes in files, and as objects of other packages."""

from __future__ import annotations

import contextlib
import errno
import importlib
import os
import pathlib
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from typing import IO, Any

import numpy as np

from . import _periodic, _tool
from ._mesh_arrays import MeshArrays
from ._second_order import second_order
from .errors import InvalidArgumentError, MissingPackageError

# By the dimension: the simplices and the facets of meshio.
_CELLS = {2: ("triangle", "line"), 3: ("tetra", "triangle")}
_VTK_TRIANGLE, _VTK_TETRA = 5, 10
# The arrays of a file that are not of whole numbers.
_REALS = {"points", "weights"}


def save(
    mesh: MeshArrays,
    path: str | os.PathLike[str],
    options: dict[str, Any],
    order: int = 1,
    members: dict[str, Any] | None = None,
    periodic: Sequence[int] = (),
) -> None:
    """See Mesh.save. A file that cannot be written to its end is not there. `members`: further arrays of a .npz."""
    target = pathlib.Path(path)
    if periodic and target.suffix not in (".npz", ".msh"):
        what = f"{target.suffix or 'a file without an extension'} has no place for pairs; expected .npz or .msh"
        raise InvalidArgumentError(what, field="periodic")
    for axis in periodic:
        _periodic.pairs(mesh, axis)  # told before a file is there
    if order == 2 or (periodic and target.suffix == ".msh"):
        _save_by_tool(mesh, target, options, order, periodic)
        return
    if order != 1:
        raise InvalidArgumentError(f"order {order!r}; expected 1 or 2", field="order")
    if target.suffix != ".npz":
        is_of_tool = target.suffix in _tool.MESH_FORMATS
        if is_of_tool and not options and _tool.find() is not None:
            with tempfile.TemporaryDirectory(prefix="wellspace-") as folder:
                source = pathlib.Path(folder) / "mesh.npz"
                save(mesh, source, {})
                _tool.convert(source, target)
            return
        purpose = f"to write {target.suffix or 'files without an extension'}"
        write = _package("meshio", f"or the tool wellspace on the path, {purpose}" if is_of_tool else purpose).write
        converted = to_meshio(mesh)
        if target.suffix == ".msh":  # of Gmsh, 2.2: meshio takes it for one of ANSYS, and has no entities for 4.1
            options = {"file_format": "gmsh22", **options}
            del converted.cell_data["wellspace:tag"]  # which physical groups are, and meshio could not read again
        write(target, converted, **options)
        return
    if options:
        raise InvalidArgumentError(f".npz takes no options; got {', '.join(options)}", field=next(iter(options)))
    with replacing(target) as file:
        np.savez(file, **_members(mesh), **_pairs(mesh, periodic), **(members or {}))


def _pairs(mesh: MeshArrays, periodic: Sequence[int]) -> dict[str, Any]:
    return {f"periodic_{_periodic.LETTERS[a]}": _periodic.pairs(mesh, a).astype(np.uint32) for a in periodic}


def _save_by_tool(
    mesh: MeshArrays, target: pathlib.Path, options: dict[str, Any], order: int, periodic: Sequence[int]
) -> None:
    if options:
        names, what = ", ".join(options), "order 2" if order == 2 else "periodic"
        raise InvalidArgumentError(f"{what} takes no options; got {names}", field=next(iter(options)))
    if target.suffix == ".npz" and not periodic:
        second = second_order(mesh)
        with replacing(target) as file:
            np.savez(file, **_members(second), middle_ends=second.middle_ends.astype(np.uint32, copy=False))
        return
    with tempfile.TemporaryDirectory(prefix="wellspace-") as folder:
        source = pathlib.Path(folder) / "mesh.npz"
        save(mesh, source, {})
        axes = ["--periodic", ",".join(_periodic.LETTERS[a] for a in periodic)] if periodic else []
        _tool.convert(source, target, order=order, options=axes)


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[IO[bytes]]:
    """A file that gets its name once all is written, and is not there otherwise."""
    target = pathlib.Path(path)
    handle, part = tempfile.mkstemp(prefix=target.name, suffix=".part", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(part, 0o666 & ~umask)
        os.replace(part, target)
    except BaseException:
        os.unlink(part)
        raise


def _members(mesh: MeshArrays) -> dict[str, Any]:
    """The arrays of the file: client/formats/numpy/npz.h has their names."""
    members: dict[str, Any] = {"points": mesh.points}
    if mesh.weights is not None:
        members["weights"] = mesh.weights
    members["simplices"] = mesh.simplices.astype(np.uint32, copy=False)
    if mesh.facet_names:
        members["vertex_origins"] = mesh.vertex_origins.astype(np.int64)
        members["vertex_tags"] = mesh.vertex_tags
        members["facets"] = mesh.facets.astype(np.uint32, copy=False)
        members["facet_tags"] = mesh.facet_tags
        if len(mesh.ridges):
            members["ridges"] = mesh.ridges.astype(np.uint32, copy=False)
        members["facet_names"] = np.array(list(mesh.facet_names.values()), "U")
        members["facet_name_tags"] = np.array(list(mesh.facet_names), np.int32)
    if mesh.region_names:
        members["regions"] = mesh.regions
        members["region_ids"] = np.array(list(mesh.region_names), np.int32)
        members["region_names"] = np.array(list(mesh.region_names.values()), "U")
    return members


def load(path: str | os.PathLike[str]) -> dict[str, Any]:
    """See Mesh.load: the attributes of the mesh."""
    if pathlib.Path(path).suffix != ".npz":
        if not os.path.exists(path):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), os.fspath(path))
        with tempfile.TemporaryDirectory(prefix="wellspace-") as folder:
            arrays = pathlib.Path(folder) / "mesh.npz"
            _tool.convert(path, arrays)
            return load(arrays)
    return attributes_of(arrays_of(path), path)


def arrays_of(path: str | os.PathLike[str]) -> dict[str, Any]:
    """All arrays of a .npz, by their names."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (zipfile.BadZipFile, ValueError, AttributeError) as error:
        raise InvalidArgumentError(f"{path}: expected .npz, with arrays of numbers: {error}", field="path") from error


def attributes_of(found: dict[str, Any], path: str | os.PathLike[str]) -> dict[str, Any]:
    """The attributes of the mesh of these arrays, which are checked."""
    points, simplices = _checked(found, path)
    d, kind = points.shape[1], np.int32 if len(points) <= 2**31 else np.int64
    none = np.empty(0, np.int32)
    if len(points):
        box = np.array([points.min(axis=0), points.max(axis=0)])
    else:
        box = np.zeros((2, d))
    regions = found.get("regions", none)
    ids = found["region_ids"].tolist() if "region_ids" in found else np.unique(regions).tolist()
    names = found["region_names"].tolist() if "region_names" in found else [_region_name(number) for number in ids]
    return {
        "points": points,
        "simplices": simplices.astype(kind),
        "input_vertices": none,
        "facets": found.get("facets", none.reshape(0, d)).astype(kind),
        "facet_tags": found.get("facet_tags", none),
        "ridges": found.get("ridges", none.reshape(0, 2)).astype(kind),
        "facet_names": dict(zip(found.get("facet_name_tags", none).tolist(), found.get("facet_names", none).tolist())),
        "regions": regions,
        "region_names": dict(zip(ids, names)),
        "vertex_origins": found.get("vertex_origins", none),
        "vertex_tags": found.get("vertex_tags", none),
        "weights": found.get("weights"),
        "moved_vertices": none,
        "box": box,
    }


def _checked(found: dict[str, Any], path: Any) -> tuple[Any, Any]:
    """The points and simplices of a file whose arrays fit each other: none names a vertex or a part that is not there.

    Raises
    ------
    InvalidArgumentError
        It names the array, the row and its value.
    """

    def wrong(what: str) -> InvalidArgumentError:
        return InvalidArgumentError(f"{path}: {what}", field="path")

    for name in ("points", "simplices"):
        if name not in found or found[name].ndim != 2:
            raise wrong(f"no array {name!r} of two dimensions")
    points, simplices = found["points"], found["simplices"]
    n, d = points.shape
    if d < 1 or simplices.shape[1] != d + 1:
        raise wrong(f"simplices of {simplices.shape[1]} vertices in {d}-D")
    m, f = len(simplices), len(found.get("facets", ()))
    shapes = {"points": (n, d), "weights": (n,), "simplices": (m, d + 1), "facets": (f, d), "facet_tags": (f,),
              "ridges": (len(found.get("ridges", ())), 2),
              "vertex_origins": (n,), "vertex_tags": (n,), "regions": (m,),
              "facet_name_tags": (len(found.get("facet_names", ())),),
              "region_ids": (len(found.get("region_names", ())),)}
    for name, shape in shapes.items():
        array = found.get(name)
        if array is None:
            continue
        if array.shape != shape:
            raise wrong(f"{name} has the shape {array.shape}; expected {shape}")
        if array.size and array.dtype.kind not in ("fiu" if name in _REALS else "iu"):
            raise wrong(f"{name} is of {array.dtype}; expected {'numbers' if name in _REALS else 'whole numbers'}")
        bad = ~np.isfinite(array) if name in _REALS else np.zeros(shape, bool)
        expected = "a finite number"
        if name in ("simplices", "facets", "ridges"):
            bad, expected = (array < 0) | (array >= n), f"a vertex from 0, below {n}"
        elif name == "facet_tags" and "facet_name_tags" in found:
            bad, expected = ~np.isin(array, found["facet_name_tags"]), "a tag that has a name"
        elif name == "vertex_tags" and "facet_name_tags" in found:
            bad, expected = ~np.isin(array, [0, *found["facet_name_tags"]]), "0, or a tag that has a name"
        elif name == "regions" and "region_ids" in found:
            bad, expected = ~np.isin(array, found["region_ids"]), "a region that has a name"
        elif name == "vertex_origins":
            bad, expected = array < -3, "the number of a point, or -1, -2 or -3"
        if bad.any():
            place = tuple(np.argwhere(bad)[0].tolist())
            raise wrong(f"{name}[{place[0]}] has {array[place]}; expected {expected}")
    return points, simplices


def _region_name(number: int) -> str:
    return "domain" if number == 1 else f"region_{number}"


def to_meshio(mesh: MeshArrays) -> Any:
    """See Mesh.to_meshio."""
    meshio = _package("meshio", "for to_meshio")
    simplex, facet = _cells_of(mesh)
    points = _spatial(mesh) if mesh.dimension == 2 else mesh.points
    blocks = [(simplex, mesh.simplices, mesh.regions if len(mesh.regions) else np.zeros(len(mesh.simplices), np.int32))]
    if len(mesh.facets):
        blocks.append((facet, mesh.facets, mesh.facet_tags))
    tags = [tags for _, _, tags in blocks]
    data: dict[str, Any] = {"wellspace:tag": tags, "gmsh:physical": tags, "gmsh:geometrical": tags}
    point_data: dict[str, Any] = {}
    if len(mesh.vertex_origins):
        point_data = {"wellspace:origin": mesh.vertex_origins, "wellspace:tag": mesh.vertex_tags}
    if mesh.weights is not None:
        point_data["wellspace:weight"] = mesh.weights
    names = {name: np.array([tag, mesh.dimension - 1]) for tag, name in mesh.facet_names.items()}
    names |= {name: np.array([tag, mesh.dimension]) for tag, name in mesh.region_names.items()}
    cells = [(kind, rows) for kind, rows, _ in blocks]
    return meshio.Mesh(points, cells, point_data=point_data, cell_data=data, field_data=names)


def to_pyvista(mesh: MeshArrays) -> Any:
    """See Mesh.to_pyvista."""
    pyvista = _package("pyvista", "for to_pyvista")
    _cells_of(mesh)
    kind = _VTK_TRIANGLE if mesh.dimension == 2 else _VTK_TETRA
    width = mesh.dimension + 1
    cells = np.empty((len(mesh.simplices), width + 1), np.int64)
    cells[:, 0] = width
    cells[:, 1:] = mesh.simplices
    grid = pyvista.UnstructuredGrid(cells.ravel(), np.full(len(cells), kind, np.uint8), _spatial(mesh))
    if len(mesh.regions):
        grid.cell_data["region"] = mesh.regions
    if len(mesh.vertex_tags):
        grid.point_data["tag"] = mesh.vertex_tags
        grid.point_data["origin"] = mesh.vertex_origins
    if mesh.weights is not None:
        grid.point_data["weight"] = mesh.weights
    return grid


def _spatial(mesh: MeshArrays) -> Any:
    """The vertices with three coordinates."""
    if mesh.dimension == 3:
        return mesh.points
    return np.column_stack([mesh.points, np.zeros(len(mesh.points))])


def _cells_of(mesh: MeshArrays) -> tuple[str, str]:
    if mesh.dimension not in _CELLS:
        raise InvalidArgumentError(
            f"a mesh in {mesh.dimension}-D; meshio and pyvista have 2-D and 3-D, save takes .npz", field="mesh"
        )
    return _CELLS[mesh.dimension]


def _package(name: str, purpose: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise MissingPackageError(f"{name} is needed {purpose}, and is not installed: pip install {name}") from error
