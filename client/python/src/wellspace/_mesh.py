"""A mesh as arrays."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _dual, _files, _periodic, _second_order, _view
from ._arrays import coordinates
from ._dual import DualCells
from ._located import Located
from ._locator import MeshLocator
from ._mesh_arrays import MeshArrays
from ._receiver import MeshReceiver
from ._second_order import SecondOrderMesh
from ._view import Plot
from .errors import InvalidArgumentError
from .statistics import statistics_of

# Of Mesh.vertex_origins, where the number of an input point does not stand.
STEINER, REPAIR, CORNER = -1, -2, -3


def _number_of(name: str | int, names: Mapping[int, str]) -> int | None:
    """The number of a name among `names`, or the number itself; None if it is not there."""
    if isinstance(name, (int, np.integer)) and not isinstance(name, bool):
        return int(name) if int(name) in names else None
    return next((number for number, other in names.items() if other == name), None)


@dataclasses.dataclass(frozen=True, eq=False)
class Mesh(MeshArrays):
    """A simplicial mesh of n vertices and m simplices in d dimensions.

    All numbers of vertices count from 0. Arrays of them are of int32, or of int64 where that is too small. Lengths are
    in the unit of the input points. The arrays about the boundary, from `facets` to `vertex_tags`, are empty if the
    mesh was asked for without it.

    Attributes
    ----------
    points : (n, d) float64
        The vertices. The distinct input points come first, in their order and with their bits unchanged.
    simplices : (m, d + 1) int
        Triangles in 2-D, tetrahedra in 3-D, and so on, each positively oriented.
    input_vertices : (p,) int
        For each input point the vertex that it became; -1 for one that lies in no face, or solid, which is meshed, and
        for most corners of triangles.
    facets : (f, d) int
        The facets of the boundary, edges in 2-D and triangles in 3-D. They look outward: in 2-D the mesh is on the left
        of an edge, in 3-D a triangle is counterclockwise seen from outside.
    facet_tags : (f,) int32
        The tag of each facet, above 0.
    facet_names : dict of int to str
        The name of each tag: ``"xmin"``, ``"xmax"``, ``"ymin"`` … of the box; of segments and triangles the name that
        was given to their marker, or ``"marker_7"`` or ``"unmarked"``.
    ridges : (r, 2) int
        Of a surface: the edges on its creases.
    regions : (m,) int32
        The region of each simplex.
    region_names : dict of int to str
        The name of each region: the one that was given, ``"domain"``, or ``"region_7"`` for the region 7 of a
        `RegionSeed` or `SolidSeed`.
    vertex_origins : (n,) int
        Where each vertex comes from: the number of the first input point that became it, or -1: the refinement, -2: the
        repair of slivers, -3: it is a corner of the box.
    vertex_tags : (n,) int32
        The least tag of a facet that each vertex is of; 0 inside.
    weights : (n,) float64, or None
        Of a regular triangulation: squared radii of spheres about the vertices.
    moved_vertices : (k,) int
        In a session: vertices that its last mesh had at another place. Ascending.
    box : (2, d) float64
        Low and high corner of the box that the simplices decompose; of a domain with segments or triangles the
        bounding box of the meshed part.
    statistics : Statistics or None
        Figures of the mesh and of the run that made it; None for a mesh from a file.
    revision : int
        Of the session's mesh; 0 for others.
    """

    def __repr__(self) -> str:
        return f"<wellspace.Mesh: {len(self.points)} vertices, {len(self.simplices)} simplices in {self.dimension}-D>"

    def tag(self, name: str | int) -> int:
        """The tag of the part of the boundary with this name, or the number itself if a part has it for a tag."""
        tag = _number_of(name, self.facet_names)
        if tag is None:
            there = ", ".join(f"{tag}: {name!r}" for tag, name in self.facet_names.items())
            raise InvalidArgumentError(
                f"no part of the boundary is called {name!r}; there are {there or 'none: the mesh has no boundary'}",
                field="name",
            )
        return tag

    def boundary(self, name: str | int | None = None) -> npt.NDArray[Any]:
        """The facets with this name, or tag, (k, d); without a name all."""
        return self.facets if name is None else self.facets[self.facet_tags == self.tag(name)]

    def boundary_vertices(self, name: str | int | None = None) -> npt.NDArray[Any]:
        """The vertices of these facets, ascending, each once."""
        return np.unique(self.boundary(name))

    def region(self, name: str | int) -> npt.NDArray[Any]:
        """The simplices of the region with this name, or number, (k, d + 1)."""
        number = _number_of(name, self.region_names)
        if number is None:
            there = ", ".join(f"{number}: {name!r}" for number, name in self.region_names.items())
            raise InvalidArgumentError(
                f"no region is called {name!r}; there are {there or 'none: the mesh was asked for without them'}",
                field="name",
            )
        return self.simplices[self.regions == number]

    def periodic_pairs(self, axis: int | str) -> npt.NDArray[Any]:
        """The pairs of vertices on the two sides of the box across an axis, along which the mesh is periodic.

        Parameters
        ----------
        axis : int or str
            0 or ``"x"``, 1 or ``"y"``, 2 or ``"z"``.

        Returns
        -------
        (k, 2) int
            In each row the vertex on the low side, ascending, and the one on the high side with the same other
            coordinates.

        Raises
        ------
        InvalidArgumentError
            The mesh has no such axis, or vertices on the two sides do not match.
        """
        return _periodic.pairs(self, _periodic.axis_of(axis))

    def dual_cells(self) -> DualCells:
        """The Voronoi cell of each vertex within the domain, as finite volumes need them. For 2-D and 3-D.

        Costs a few passes over the simplices. The mesh has to be Delaunay, as all are but those of `pump_weights`.
        """
        return _dual.dual_cells(self)

    def locate(self, points: Any, *, allow_outside: bool = False) -> Located:
        """The simplex of the mesh that each of `points`, (n, d), lies in, and its place there; without a server.

        The places are those of `Session.locate` but for ties: on faces that several simplices share, and there within
        rounding, it may name another of them. The first call makes a search tree, in O(m log m) for m simplices, which
        the mesh keeps; points and simplices are not to be changed after it. A point takes some microseconds in 2-D, and
        some ten in 3-D, of one core.

        Parameters
        ----------
        allow_outside : bool
            Points in no simplex, outside the domain or in a hole, are no error.

        Raises
        ------
        InvalidArgumentError
            Points that are not (n, d), finite and in the mesh, by their number.
        """
        return self._locator.locate(coordinates(points, "points", self.dimension), allow_outside, self.revision)

    def interpolate(self, points: Any, values: Any, *, allow_outside: bool = False) -> npt.NDArray[Any]:
        """A function with `values`, (n, …), at the vertices, and linear between them, at `points`, (k, d): (k, …).

        Exact for linear functions, but for rounding. NaN at points in no simplex, with `allow_outside`; see `locate`.
        """
        return self.locate(points, allow_outside=allow_outside).interpolate(values)

    @functools.cached_property
    def _locator(self) -> MeshLocator:
        return MeshLocator(self.points, self.simplices)

    def to_order(self, order: int) -> SecondOrderMesh:
        """The mesh with elements of second order: 6 nodes a triangle, 10 a tetrahedron, the edges straight.

        Parameters
        ----------
        order : int
            2; the mesh itself is of first order.

        Raises
        ------
        InvalidArgumentError
            Another order, or a mesh that is not in 2-D or 3-D.
        """
        if order != 2:
            raise InvalidArgumentError(f"order {order!r}; expected 2: the mesh itself is of order 1", field="order")
        return _second_order.second_order(self)

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        order: int = 1,
        periodic: str | Sequence[int | str] = (),
        **options: Any,
    ) -> None:
        """Writes the mesh to a file; the extension says in which format.

        ``.npz`` needs nothing else. ``.vtu``, ``.vtkhdf``, ``.hdf``, ``.vtk``, ``.xdmf``, ``.msh``, ``.mesh``,
        ``.su2``, ``.inp``, ``.node``, ``.ele``, ``.14``, ``.grd``, ``.gr3`` and ``.2dm`` are written by the tool
        `wellspace`, that of ``$WELLSPACE_TOOL_BINARY``, of the wheel or on the path: the bytes of
        ``wellspace convert``, with names of parts and regions.
        Other formats, those without the tool, and all with `options`, are those of `meshio.write`, in 2-D and 3-D.

        With ``order=2`` elements are of second order (`to_order`): ``.npz``, which has the arrays of `SecondOrderMesh`,
        and by the tool ``.vtu``, ``.vtkhdf``, ``.vtk``, ``.xdmf``, ``.msh``, ``.inp``, ``.node`` and ``.ele``.

        With ``periodic``, the axes along which the mesh is periodic, the file has the pairs of `periodic_pairs`:
        ``.npz`` in the arrays ``periodic_x`` and so on, ``.msh`` by the tool in ``$Periodic``.

        Raises
        ------
        InvalidArgumentError
            The format does not have such a mesh.
        MissingPackageError
            Neither the tool nor meshio is installed.
        OSError
            The file cannot be written; then it is not there.
        """
        _files.save(self, path, options, order, periodic=_periodic.axes_of(periodic))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Mesh:
        """Reads a mesh from a file: a ``.npz`` by itself, others that ``wellspace convert`` reads by the tool.

        Raises
        ------
        InvalidArgumentError
            The file is not a mesh of that format; with the place.
        MissingPackageError
            The tool is not installed, and is needed.
        """
        return cls(**_files.load(path))

    def to_meshio(self) -> Any:
        """The mesh as a `meshio.Mesh`, with the facets as cells, tags and regions as ``"wellspace:tag"`` of the cells.

        Tags and regions are physical groups of Gmsh, too. For 2-D and 3-D.
        """
        return _files.to_meshio(self)

    def to_pyvista(self) -> Any:
        """The simplices as a `pyvista.UnstructuredGrid`, with ``"region"`` of the cells and ``"tag"`` of the points.

        For 2-D and 3-D; in 2-D, z is 0.
        """
        return _files.to_pyvista(self)

    def plot(
        self, *, name: str = "mesh", up: str = "z", data: Mapping[str, Any] | None = None, height: int = 600
    ) -> Plot:
        """A page that shows the mesh, below the cell of a notebook or, by `Plot.save`, in a file. For 2-D and 3-D.

        Parameters
        ----------
        name : str
            The mesh's name on the page.
        up : str
            The axis that points upwards at first: ``"x"``, ``"y"`` or ``"z"``.
        data : dict of str to (n,) or (m,) array
            Numbers of the n vertices or of the m simplices, by their names: the page can colour by them. NaN stands for
            none. Where n is m, they are of the vertices.
        height : int
            In the notebook, in pixels.

        Raises
        ------
        InvalidArgumentError
            The mesh is of another dimension or has no simplices; `up` or `data` is not valid.
        LimitError
            An array of the mesh is larger than a browser can read: above 16 million tetrahedra.
        """
        return _view.plot(self, name, up, data, height)

    def _repr_html_(self) -> str:
        return _view.table(self)


def signed(values: npt.NDArray[Any], limit: int) -> npt.NDArray[Any]:
    """uint32 as int32, without a copy, where all below `limit` fit; the highest numbers become -1, -2, -3."""
    if limit <= 2**31:
        return values.view("<i4")
    wide = values.astype(np.int64)
    wide[values >= np.uint32(2**32 - 3)] -= 2**32
    return wide


def mesh_of(receiver: MeshReceiver) -> Mesh:
    """The mesh that has come."""
    return mesh_from(receiver.metadata, receiver.arrays, receiver.moved_vertices)


def mesh_from(m: Any, arrays: dict[str, npt.NDArray[Any]], moved: npt.NDArray[np.uint32]) -> Mesh:
    """The mesh of these metadata, arrays and moved vertices."""
    d, n = m.dimension, m.vertex_count
    counts = [part.facet_count for part in m.boundary]
    regions = arrays["simplex_regions"]
    if not m.has_simplex_regions:
        only = m.regions[0].id if m.regions else 0
        regions = np.full(m.simplex_count if m.regions else 0, only, np.int32)
    return Mesh(
        points=arrays["points"].reshape(n, d),
        simplices=signed(arrays["simplices"], n).reshape(-1, d + 1),
        input_vertices=signed(arrays["input_vertices"], n),
        facets=signed(arrays["facets"], n).reshape(-1, d),
        facet_tags=np.repeat(np.array([part.tag for part in m.boundary], np.int32), counts),
        facet_names={part.tag: part.name for part in m.boundary},
        regions=regions,
        region_names={region.id: region.name for region in m.regions},
        # Those of a part name input points of the whole mesh.
        vertex_origins=signed(arrays["vertex_origins"], max(m.input_point_count, m.statistics.input_points)),
        vertex_tags=arrays["vertex_tags"],
        weights=arrays["weights"] if m.has_weights else None,
        moved_vertices=signed(moved, n),
        box=np.array([list(m.domain.low), list(m.domain.high)]),
        statistics=statistics_of(m.statistics),
        revision=m.revision,
        ridges=signed(arrays["ridges"], n).reshape(-1, 2),
    )
