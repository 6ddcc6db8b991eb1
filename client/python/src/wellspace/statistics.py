"""Figures of meshes, of estimates and of servers, as the service has them."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

from . import _api

T = TypeVar("T")


@dataclasses.dataclass(frozen=True)
class PhaseSeconds:
    """Wall-clock seconds of the phases, waiting and transfer not included."""

    tree: float
    refinement: float
    simplices: float
    slivers: float
    total: float


@dataclasses.dataclass(frozen=True)
class OperationCounters:
    """Counts of the operations of the query structure; see OperationCounters of the API."""

    tree_leaves: int
    cells_computed: int
    leaves_visited: int
    vertices_visited: int
    cuts: int
    max_leaves_visited: int
    stars_computed: int
    star_leaves_visited: int
    star_vertices_visited: int
    star_cuts: int
    max_star_leaves_visited: int
    exact_predicates: int
    perturbed_predicates: int


@dataclasses.dataclass(frozen=True)
class LeftSliver:
    """A sliver that could not be repaired: its four vertices, its smallest dihedral angle in degrees, and why.

    `reason` is ``"demands"``, ``"angle"`` or ``"work"``: a larger `rho` helps, a smaller `min_dihedral`, or a smaller
    `rho`.
    """

    vertices: tuple[int, ...]
    min_dihedral_deg: float
    reason: str


@dataclasses.dataclass(frozen=True)
class SliverStatistics:
    """Counts of the repair of slivers: tetrahedra with a dihedral angle below `min_dihedral`.

    `left` of those that were `found` could not be repaired; the three counts after it say why. `min_angle_before_deg`
    is in degrees.
    """

    found: int
    left: int
    left_by_demands: int
    left_by_angle: int
    left_by_work: int
    moves: int
    added_vertices: int
    weighted_vertices: int
    min_angle_before_deg: float
    operations: int
    flattest_left: tuple[LeftSliver, ...]


@dataclasses.dataclass(frozen=True)
class DomainStatistics:
    """Counts of the points and segments of a domain in the plane; see DomainStatistics of the API."""

    unmeshed_points: int
    segments: int
    subsegments: int
    dropped_segments: int
    touching_points: int
    crossings: int
    near_points: int
    exempt_simplices: int
    min_input_angle_deg: float
    unused_seeds: int
    first_unused_seed: int


@dataclasses.dataclass(frozen=True)
class SurfaceStatistics:
    """Counts of the triangles that bound a domain, and the fidelity of the mesh; see SurfaceStatistics of the API."""

    triangles: int
    welded_points: int
    dropped_triangles: int
    flipped_triangles: int
    unmeshed_points: int
    patches: int
    curves: int
    corners: int
    solids: int
    facets: int
    ridges: int
    lost_ridges: int
    exempt_simplices: int
    acute_curves: int
    tube_simplices: int
    min_angle_outside_deg: float
    unused_seeds: int
    first_unused_seed: int
    min_facet_angle_deg: float
    deviation_of_facets: float
    deviation_of_surface: float
    lost_area: float
    cut_triangles: int
    outside_triangles: int
    volumes: tuple[float, ...]


@dataclasses.dataclass(frozen=True)
class Statistics:
    """Figures of a mesh and of the run that made it.

    Attributes
    ----------
    input_points, duplicates, merged_points : int
        Points that were sent; of these, those equal to another one; those within `merge_distance` of another one.
    vertices, simplices : int
        Of the mesh.
    max_radius_edge : float
        Largest circumradius / shortest edge of a simplex.
    min_angle_deg : float
        Degrees: smallest angle of a triangle (2-D), smallest dihedral angle of a tetrahedron (3-D).
    triangulation : str
        ``"delaunay"`` or ``"regular"``.
    seconds : PhaseSeconds
    counters : OperationCounters
    peak_memory_bytes : int
        Most memory that the server's process has had.
    slivers : SliverStatistics or None
        None: nothing was asked for against slivers.
    domain : DomainStatistics or None
        Of a domain with segments.
    surface : SurfaceStatistics or None
        Of a domain that triangles bound.
    """

    input_points: int
    duplicates: int
    merged_points: int
    vertices: int
    simplices: int
    max_radius_edge: float
    min_angle_deg: float
    triangulation: str
    seconds: PhaseSeconds
    counters: OperationCounters
    peak_memory_bytes: int
    slivers: SliverStatistics | None
    domain: DomainStatistics | None
    surface: SurfaceStatistics | None


@dataclasses.dataclass(frozen=True)
class Estimate:
    """The size that a mesh would have. All numbers are estimates, 2**53 stands for that or more.

    `memory_bytes` is the most that meshing would take at once on the server.
    """

    vertices: int
    simplices: int
    memory_bytes: int
    tree_leaves: int


@dataclasses.dataclass(frozen=True)
class ServerInfo:
    """A server's version, limits and load; see GetServerInfoResponse of the API. Durations are in seconds."""

    version: str
    dimensions: tuple[int, ...]
    max_points: int
    max_vertices: int
    max_request_bytes: int
    workers: int
    max_queued_jobs: int
    running_jobs: int
    queued_jobs: int
    max_sessions: int
    max_sessions_per_tenant: int
    default_ttl: float
    max_ttl: float
    stall_limit: float
    max_memory_bytes: int
    max_stored_bytes_per_tenant: int
    stored_bytes: int


def seconds_of(duration: Any) -> float:
    """A google.protobuf.Duration or Timestamp as seconds."""
    return float(duration.seconds + duration.nanos * 1e-9)


def fill(kind: type[T], message: Any, **others: Any) -> T:
    """A dataclass of the fields of `message` with the names of its own; `others` are those that are made otherwise."""
    names = [field.name for field in dataclasses.fields(kind)]
    return kind(**{name: others[name] if name in others else getattr(message, name) for name in names})


def statistics_of(message: Any) -> Statistics:
    """Of a MeshStatistics."""
    slivers = domain = surface = None
    if message.HasField("slivers"):
        reasons = _api.enum_names("SliverReason")
        left = tuple(
            LeftSliver(tuple(sliver.vertices), sliver.min_dihedral_deg, reasons.get(sliver.reason, "unknown"))
            for sliver in message.slivers.flattest_left
        )
        slivers = fill(SliverStatistics, message.slivers, flattest_left=left)
    if message.HasField("domain"):
        domain = fill(DomainStatistics, message.domain)
    if message.HasField("surface"):
        surface = fill(SurfaceStatistics, message.surface, volumes=tuple(message.surface.volumes))
    return fill(
        Statistics,
        message,
        triangulation=_api.enum_names("Triangulation").get(message.triangulation, "unknown"),
        seconds=fill(PhaseSeconds, message.seconds),
        counters=fill(OperationCounters, message.counters),
        slivers=slivers,
        domain=domain,
        surface=surface,
    )


def info_of(message: Any) -> ServerInfo:
    """Of a GetServerInfoResponse."""
    durations = {name: seconds_of(getattr(message, name)) for name in ("default_ttl", "max_ttl", "stall_limit")}
    return fill(ServerInfo, message, dimensions=tuple(message.dimensions), **durations)
