"""A client of a server: meshes, estimates, and information about the server."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Union

from . import _api, _wire
from ._arrays import coordinates
from ._calls import Calls, CallOptions, Link, next_page, parse
from ._channel import Credentials, open_channel
from ._domain import Bounds, DomainArguments
from ._mesh import Mesh, mesh_of
from ._messages import messages_of, point_chunks, receive
from ._parameters import SURFACE_NUMBERS, Parameters, fill, helpful_threads, split, takes
from ._plane import PlaneArguments, make_plane
from ._owners import Owners
from ._progress import OnProgress, ProgressOption, progress_of, told
from ._receiver import MeshReceiver
from ._retry import Attempt, CancelToken, Retrier, RetryPolicy
from ._server import LocalServer, is_shared, shared_server
from ._session_info import SessionInfo, info_of_session
from ._sizes import SizeArguments, make_size_field
from ._surface import Surface, SurfaceArguments, TriangleArguments, make_surface
from .errors import InvalidArgumentError
from .statistics import Estimate, ServerInfo, info_of
from .statistics import fill as fill_dataclass

if TYPE_CHECKING:
    from typing_extensions import Unpack

_WAITING = 1  # PHASE_WAITING: the work has not begun


class MeshArguments(PlaneArguments, TriangleArguments, SizeArguments, Parameters, total=False):
    """The arguments of `mesh` and `estimate` besides points."""


class Client:
    """Talks to one server. Thread-safe.

    Calls are repeated after a lost connection, once each; uploads, watches and downloads go on where they were.

    Parameters
    ----------
    server : str, LocalServer or None
        ``"HOST:PORT"``. None: ``$WELLSPACE_SERVER`` if that is set, with ``$WELLSPACE_TOKEN``; else a server of this
        process's own, which is started if need be.
    credentials : Credentials
        Those to show the server, and those to be shown.
    retry : RetryPolicy
        The patience with the server.
    follow : bool
        Of several servers that share their sessions, calls on a session go to the one that has it, by the address that
        the others name, with the same credentials. False: to this one alone, behind which a proxy finds the right one.

    Attributes
    ----------
    address : str
        ``"HOST:PORT"`` of the server.
    """

    address: str

    def __init__(
        self,
        server: str | LocalServer | None = None,
        *,
        credentials: Credentials | None = None,
        retry: RetryPolicy | None = None,
        follow: bool = True,
    ) -> None:
        if server is None and "WELLSPACE_SERVER" not in os.environ:
            server = shared_server()
        self._lock = threading.Lock()
        self._own = server if isinstance(server, LocalServer) else None
        link = self._open(server, credentials)
        self._owners = Owners(self.address, link.credentials) if follow and self._own is None else None
        renews = self._own is not None and is_shared(self._own)
        self._calls = Calls(
            link,
            Retrier(retry or RetryPolicy()),
            self._renew if renews else None,
            self._owners.link_to if self._owners is not None else None,
        )

    def _open(self, server: str | LocalServer | None, credentials: Credentials | None) -> Link:
        self.address, shown = _address_of(server, credentials)
        self._channel = open_channel(self.address, shown)
        own = server if isinstance(server, LocalServer) else None
        return Link(self._channel, shown, lambda within: own is not None and own.has_ended(within), asked=self.address)

    def _renew(self, gone: Link) -> Link:
        """The way to the server that is started in the place of this process's own one, which has ended."""
        with self._lock:
            if self._calls._link is not gone:
                return self._calls._link  # another call was faster
            self._own = shared_server()
            self._own.client = self._own.client or self
            link = self._open(self._own, None)
            self._calls._link = link
            return link

    def close(self) -> None:
        """Closes the connection; calls that are under way end with `CancelledError`."""
        self._channel.close()
        if self._owners is not None:
            self._owners.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *exception: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<wellspace.Client of {'its own server' if self._own is not None else 'the server'} at {self.address}>"

    @takes(DomainArguments, PlaneArguments, TriangleArguments, SizeArguments, Parameters)
    def mesh(
        self,
        points: Any,
        *,
        boundary: bool = True,
        progress: ProgressOption = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
        **arguments: Unpack[MeshArguments],
    ) -> Mesh:
        """Meshes points, or a domain of segments or triangles between them; arguments are those of `wellspace.mesh`."""
        cloud = _Cloud(points, arguments, "mesh")
        with told(progress) as on_progress:
            return self._calls.run(
                CallOptions(timeout=timeout, cancel=cancel),
                lambda attempt: self._attempt_mesh(cloud, boundary, on_progress, attempt),
            )

    def _attempt_mesh(self, cloud: _Cloud, boundary: bool, on_progress: OnProgress, attempt: Attempt) -> Mesh:
        receiver = MeshReceiver(cloud.points.shape[1], len(cloud.points))
        has_begun = False  # the work, which is not done twice
        try:
            with self._calls.stream("MeshingService/MeshPoints", cloud.requests(boundary), attempt) as answers:
                for number, part in (field for answer in answers for field in messages_of(answer)):
                    if number == 1:
                        event = parse("ProgressEvent", bytes(part))
                        has_begun = has_begun or event.phase != _WAITING
                        on_progress(progress_of(event))
                    else:
                        has_begun = True
                        receive(receiver, number - 2, part)
        except Exception:
            attempt.is_final = has_begun and not attempt.cancel.is_cancelled
            raise
        receiver.finish()
        return mesh_of(receiver)

    @takes(DomainArguments, PlaneArguments, TriangleArguments, SizeArguments, Parameters)
    def estimate(
        self,
        points: Any,
        *,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
        **arguments: Unpack[MeshArguments],
    ) -> Estimate:
        """Says how large the mesh of the same arguments would be, without meshing. See `wellspace.mesh`."""
        cloud = _Cloud(points, arguments, "estimate")

        def attempt_once(attempt: Attempt) -> Any:
            requests = cloud.requests(boundary=False)
            return self._calls.attempt_upload("MeshingService/EstimateMesh", requests, "EstimateMeshResponse", attempt)

        return fill_dataclass(Estimate, self._calls.run(CallOptions(timeout=timeout, cancel=cancel), attempt_once))

    def info(self, *, timeout: float | None = None) -> ServerInfo:
        """The version of the server, its limits and its load."""
        request = _api.message("GetServerInfoRequest")()
        return info_of(
            self._calls.unary(
                "MeshingService/GetServerInfo", request, "GetServerInfoResponse", CallOptions(timeout=timeout)
            )
        )

    def is_serving(self, *, timeout: float | None = None) -> bool:
        """Whether the server takes work: False while it stops."""
        health = "grpc.health.v1.Health"
        request = _api.message("grpc.health.v1.HealthCheckRequest")()
        response = "grpc.health.v1.HealthCheckResponse"
        answer = self._calls.unary(f"/{health}/Check", request, response, CallOptions(timeout=timeout))
        return bool(answer.status == 1)

    def sessions(self, labels: Mapping[str, str] | None = None, *, timeout: float | None = None) -> list[SessionInfo]:
        """The caller's sessions that have all of `labels`, in the order of their creation."""
        request = _api.message("ListSessionsRequest")(labels=dict(labels or {}))
        found = []
        while True:
            page = self._calls.unary(
                "SessionService/ListSessions", request, "ListSessionsResponse", CallOptions(timeout=timeout)
            )
            found += [info_of_session(session) for session in page.sessions]
            if not page.next_page_token:
                return found
            request.page_token = next_page(request.page_token, page.next_page_token)


# The values that the functions of the package take for a server.
Server = Union[str, LocalServer, Client, None]


def _address_of(server: str | LocalServer | None, credentials: Credentials | None) -> tuple[str, Credentials]:
    if isinstance(server, LocalServer):
        return server.address, server.credentials
    token = os.environ.get("WELLSPACE_TOKEN") if server is None else None
    address = os.environ["WELLSPACE_SERVER"] if server is None else server
    if not isinstance(address, str):
        raise InvalidArgumentError(f"server is {address!r}; expected 'HOST:PORT'", field="server")
    return address, credentials or Credentials(token=token)


_clients: dict[tuple[str, Credentials], Client] = {}
_lock = threading.Lock()


def client_of(server: Server) -> Client:
    """The client of a server, one for each address."""
    if isinstance(server, Client):
        return server
    if server is None and "WELLSPACE_SERVER" not in os.environ:
        server = shared_server()
    with _lock:
        if isinstance(server, LocalServer):
            server.client = server.client or Client(server)
            return server.client
        address, credentials = _address_of(server, None)
        if (address, credentials) not in _clients:
            _clients[address, credentials] = Client(address, credentials=credentials)
        return _clients[address, credentials]


def _forget_clients() -> None:
    global _lock
    _lock = threading.Lock()
    _clients.clear()  # a channel of the parent is of no use in a forked child


os.register_at_fork(after_in_child=_forget_clients)


class _Cloud:
    """Points, and the features of a domain, with the demands on their mesh; checked."""

    def __init__(self, points: Any, arguments: Mapping[str, Any], function: str) -> None:
        kinds = (PlaneArguments, SurfaceArguments, SizeArguments, Parameters)
        plane, surface, sizes, parameters = split(function, arguments, *kinds)
        self.points = coordinates(points, "points")
        self.bounds = self._bounds_of(plane, surface, "box" in parameters)
        self.sizes = make_size_field(sizes, self.points.shape[1]) if sizes else None
        self.message = fill(_api.message("MeshParameters")(), self.points.shape[1], parameters)
        if self.message.HasField("surface") and not isinstance(self.bounds, Surface):
            name = next(name for name in SURFACE_NUMBERS if name in parameters)
            raise InvalidArgumentError(f"{name}: for triangles only; none are given", field=name)
        if "threads" not in parameters:
            self.message.threads = helpful_threads(self.points, parameters)

    def _bounds_of(self, plane: dict[str, Any], surface: dict[str, Any], has_box: bool) -> Bounds | None:
        """The bounds of the domain: in the plane or in space, as the points are."""
        dimension = self.points.shape[1]
        for kind, given, other in ((2, plane, surface), (3, surface, plane)):
            name = next((name for name in given if name not in other), None)
            if name is not None and dimension != kind:
                raise InvalidArgumentError(
                    f"{name}: for points in {kind}-D only; these are in {dimension}-D", field=name
                )
        if not plane and not surface:
            return None
        if dimension == 2:
            return make_plane(plane, len(self.points), has_box)
        name = next(iter(surface))  # both kinds have it
        if "triangles" not in surface:
            raise InvalidArgumentError(f"{name}: for segments or triangles only; none are given", field=name)
        return make_surface(surface, len(self.points))

    def requests(self, boundary: bool) -> Iterator[bytes]:
        """Serialized requests of MeshPoints, and of EstimateMesh."""
        first = _wire.message_field(1, self.message.SerializeToString())
        yield first + (_wire.varint(3 << 3) + b"\1" if boundary else b"")
        if self.sizes is not None:
            for chunk in self.sizes.chunks():
                yield _wire.message_field(6, chunk)
        for _, _, chunk in point_chunks(self.points):
            yield _wire.message_field(2, chunk)
        if self.bounds is not None:
            rows, options = self.bounds.request_fields
            for _, chunk in self.bounds.row_chunks():
                yield _wire.message_field(rows, chunk)
            for _, chunk in self.bounds.option_chunks():
                yield _wire.message_field(options, chunk)
