"""Quality simplicial meshes of points, domains and surfaces: a client of wellspaced.

>>> import numpy, wellspace
>>> mesh = wellspace.mesh(numpy.random.rand(1000, 3), size=0.2)
>>> mesh.points, mesh.simplices
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import errors, statistics
from ._cells import Cell, Cells
from ._channel import Credentials
from ._client import Client, MeshArguments, Server, client_of
from ._domain import DomainArguments
from ._dual import DualCells
from ._located import Located
from ._mesh import CORNER, REPAIR, STEINER, Mesh
from ._operations import Operation
from ._parameters import Parameters, takes
from ._part import MeshPart
from ._plane import PlaneArguments, RegionPolygon, RegionSeed
from ._progress import Progress, ProgressOption
from ._read import CloudFile, DomainFile, read
from ._retry import CancelToken, RetryPolicy
from ._second_order import MIDDLE, SecondOrderMesh
from ._server import LocalServer
from ._session_info import SessionInfo
from ._sessions import Session
from ._sizes import SizeArguments
from ._surface import SolidSeed, TriangleArguments
from ._surface_files import SurfaceFile, read_surface
from ._version import __version__
from ._view import Plot
from .errors import (
    CancelledError,
    ConflictError,
    CredentialsError,
    DamagedAnswerError,
    DeadlineError,
    Error,
    InvalidArgumentError,
    LimitError,
    MissingPackageError,
    NotFoundError,
    OutOfRangeError,
    ServerNotInstalledError,
    UnavailableError,
    WrongStateError,
)
from .statistics import Estimate, ServerInfo, Statistics

if TYPE_CHECKING:
    from typing_extensions import Unpack


@takes(DomainArguments, PlaneArguments, TriangleArguments, SizeArguments, Parameters)
def mesh(
    points: Any,
    *,
    server: Server = None,
    boundary: bool = True,
    progress: ProgressOption = None,
    timeout: float | None = None,
    cancel: CancelToken | None = None,
    **arguments: Unpack[MeshArguments],
) -> Mesh:
    """Meshes points, or the domain that segments in 2-D or triangles in 3-D bound.

    Each point becomes a vertex, with its bits unchanged, but for corners of triangles, and vertices are added until
    every simplex is as good as asked for. The mesh depends neither on the order of the points nor on the number of
    threads.

    Parameters
    ----------
    points : (n, d) array
        In 2 to 6 dimensions; finite. Any unit of length, the same on every axis. No points are fine with `box`.
    server : str, LocalServer, Client or None
        ``"HOST:PORT"``, or a `Client`. None: ``$WELLSPACE_SERVER`` if that is set; else a server of this process's own.
    boundary : bool
        False leaves facets, regions and origins of vertices out of the mesh.
    progress : function or bool
        Called with `Progress`; True shows a bar.
    timeout : float
        Seconds after which the call ends with `DeadlineError`.
    cancel : CancelToken
        Ends the call from another thread. Ctrl-C does, too.
    **arguments

    Returns
    -------
    Mesh

    Raises
    ------
    InvalidArgumentError
        A parameter, a point, a segment or a triangle is not valid; its `field` says which.
    LimitError
        The mesh would have more vertices than `max_vertices`, or need more memory than there is.
    UnavailableError, DeadlineError, CancelledError, CredentialsError, ServerNotInstalledError
    """
    return client_of(server).mesh(
        points, boundary=boundary, progress=progress, timeout=timeout, cancel=cancel, **arguments
    )


@takes(DomainArguments, PlaneArguments, TriangleArguments, SizeArguments, Parameters)
def estimate(
    points: Any,
    *,
    server: Server = None,
    timeout: float | None = None,
    cancel: CancelToken | None = None,
    **arguments: Unpack[MeshArguments],
) -> Estimate:
    """Says how large the mesh of the same arguments would be, without meshing. See `mesh`.

    At the default `rho` that is right within a factor of 1.5 in 2-D and 3-D, and an order of magnitude above.
    """
    return client_of(server).estimate(points, timeout=timeout, cancel=cancel, **arguments)


__all__ = [
    "CORNER",
    "MIDDLE",
    "REPAIR",
    "STEINER",
    "CancelToken",
    "CancelledError",
    "Cell",
    "Cells",
    "Client",
    "CloudFile",
    "ConflictError",
    "Credentials",
    "CredentialsError",
    "DamagedAnswerError",
    "DeadlineError",
    "DomainFile",
    "DualCells",
    "Error",
    "Estimate",
    "InvalidArgumentError",
    "LimitError",
    "LocalServer",
    "Located",
    "Mesh",
    "MeshPart",
    "MissingPackageError",
    "NotFoundError",
    "Operation",
    "OutOfRangeError",
    "Plot",
    "Progress",
    "RegionPolygon",
    "RegionSeed",
    "RetryPolicy",
    "SecondOrderMesh",
    "ServerInfo",
    "ServerNotInstalledError",
    "Session",
    "SessionInfo",
    "SolidSeed",
    "Statistics",
    "SurfaceFile",
    "UnavailableError",
    "WrongStateError",
    "__version__",
    "errors",
    "estimate",
    "mesh",
    "read",
    "read_surface",
    "statistics",
]
