"""Sessions: points, segments or triangles and a mesh over them, kept by the server between calls."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import numpy.typing as npt

from . import _api
from ._arrays import coordinates, indices, number, revision_of
from ._calls import CallOptions, next_page
from ._client import Client, Server, client_of
from ._domain import Bounds, DomainArguments
from ._mesh import Mesh
from ._operations import Operation, operation_of, watch
from ._parameters import Parameters, fill, naming, split, takes
from ._part import MeshPart, partition_of
from ._plane import PlaneArguments, make_plane
from ._progress import ProgressOption, told
from ._queries import add_vertices, hints_of
from ._retry import Attempt, CancelToken
from ._session_info import SessionInfo, info_of_session, set_ttl
from ._session_queries import SessionQueries
from ._sizes import SizeField, check_sizes, set_sizes, unit_of
from ._surface import SurfaceArguments, TriangleArguments, make_surface
from ._transfers import Addition, Download, Update, Upload
from .errors import CancelledError, Error, InvalidArgumentError, NotFoundError, printable

if TYPE_CHECKING:
    from typing_extensions import Unpack

_SECONDS_TO_CANCEL = 5.0


class Session(SessionQueries):
    """A session of a server. Thread-safe.

    As a context manager it is deleted at the end of the block, on the server, with its points and its mesh. Without
    ``with`` it stays there until `delete`, or until no call has used it for its `ttl`; `close` ends the use of this
    object alone, and `attach` comes back to the session.

    Calls take `timeout`, in seconds for all attempts together, and most of them `cancel`. Those that change the session
    take `expected_revision`: at another revision they raise `ConflictError` and change nothing.

    Parameters
    ----------
    dimension : int
        Of the space.
    server : str, LocalServer, Client or None
        Where; see `Client`.
    labels : dict
        At most 64; `Client.sessions` finds sessions by them.
    ttl : float
        Seconds that the session lives without any use. Default: the server's.
    **arguments

    Attributes
    ----------
    name : str
        ``"sessions/…"``, by which the server knows it; `attach` takes it.
    dimension : int
        Of the space.
    client : Client
        By which it talks to the server.

    Examples
    --------
    >>> with wellspace.Session(3, size=0.2) as session:
    ...     session.upload(points)
    ...     session.refine()
    ...     mesh = session.download()
    """

    client: Client
    name: str
    dimension: int

    @takes(Parameters)
    def __init__(
        self,
        dimension: int,
        *,
        server: Server = None,
        labels: Mapping[str, str] | None = None,
        ttl: float | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
        **arguments: Unpack[Parameters],
    ) -> None:
        """Creates a session without points."""
        (parameters,) = split("Session", arguments, Parameters)
        options = CallOptions(timeout=timeout, cancel=cancel)
        request = _api.message("CreateSessionRequest")(labels=dict(labels or {}), request_id=options.id_or_new())
        fill(request.parameters, dimension, parameters)
        if ttl is not None:
            set_ttl(request.ttl, ttl)
        client = client_of(server)
        answer = client._calls.unary("SessionService/CreateSession", request, "CreateSessionResponse", options)
        self._attach(client, answer.session.name, dimension)

    def _attach(self, client: Client, name: str, dimension: int) -> None:
        self.client = client
        self.name = name
        self.dimension = dimension
        self._was_interrupted = False  # a call that changes the session; the server may be at it
        self._calls = client._calls.of_session(name)

    @classmethod
    def attach(cls, name: str, *, server: Server = None, timeout: float | None = None) -> Session:
        """The session called `name`, which is there already. Outside of a ``with`` nothing deletes it."""
        session = cls.__new__(cls)
        session._attach(client_of(server), name, 0)
        session.dimension = session.info(timeout=timeout).dimension
        return session

    def __enter__(self) -> Session:
        return self

    def __exit__(self, kind: Any, *exception: Any) -> None:
        if self._calls.are_closed:
            return
        try:
            self.delete(timeout=_SECONDS_TO_CANCEL if kind is not None else None)
        except NotFoundError:
            pass
        except Error:
            if kind is None:
                raise

    def __repr__(self) -> str:
        closed = ", closed" if self._calls.are_closed else ""
        return f"<wellspace.Session: {printable(self.name)} in {self.dimension}-D at {self.client.address}{closed}>"

    def info(self, *, timeout: float | None = None, cancel: CancelToken | None = None) -> SessionInfo:
        """The state of the session. Renews its lease."""
        return info_of_session(self._get(CallOptions(timeout=timeout, cancel=cancel)))

    def _get(self, options: CallOptions) -> Any:
        request = _api.message("GetSessionRequest")(name=self.name)
        return self._calls.unary("SessionService/GetSession", request, "GetSessionResponse", options).session

    def update(
        self,
        *,
        labels: Mapping[str, str] | None = None,
        ttl: float | None = None,
        expected_revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> SessionInfo:
        """Replaces the labels, sets the `ttl` in seconds, or both."""
        options = CallOptions(timeout=timeout, cancel=cancel)
        request = _api.message("UpdateSessionRequest")(
            request_id=options.id_or_new(), expected_revision=revision_of(expected_revision, "expected_revision")
        )
        request.session.name = self.name
        request.update_mask.SetInParent()
        if labels is not None:
            request.session.labels.update(labels)
            request.update_mask.paths.append("labels")
        if ttl is not None:
            set_ttl(request.session.ttl, ttl)
            request.update_mask.paths.append("ttl")
        answer = self._calls.unary("SessionService/UpdateSession", request, "UpdateSessionResponse", options)
        return info_of_session(answer.session)

    def delete(
        self, *, expected_revision: int | None = None, timeout: float | None = None, cancel: CancelToken | None = None
    ) -> None:
        """Deletes the session with its points and its mesh; an operation that is under way is cancelled.

        The end of a ``with`` does so, too. Without one, a session that is not deleted stays until its `ttl` has passed.
        Calls on it raise `NotFoundError` from then on. Meshes that were downloaded stay whole.
        """
        options = CallOptions(timeout=timeout, cancel=cancel)
        request = _api.message("DeleteSessionRequest")(
            name=self.name,
            request_id=options.id_or_new(),
            expected_revision=revision_of(expected_revision, "expected_revision"),
        )
        self._calls.unary("SessionService/DeleteSession", request, "DeleteSessionResponse", options)

    def close(self) -> None:
        """Ends the use of this object, without a call: the session stays on the server, and its work goes on.

        Its `name` leads back to it, by `attach`, from another process, too, until it is deleted or its `ttl` has passed
        without use. Further calls by this object raise `WrongStateError`, and the end of a ``with`` does nothing.
        """
        self._calls.close(f"this Session was closed; Session.attach({printable(self.name)!r}) goes on with it")

    def upload(
        self,
        points: Any,
        *,
        offset: int | None = None,
        progress: ProgressOption = None,
        expected_revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> int:
        """Adds points, (n, d), to the session; returns how many it has now.

        `offset` is the number of the session's points before the first of these. Points there from it on are compared
        by a checksum and not sent again, so that an upload that broke off is simply repeated with the same offset.
        Default: after the points that are there.
        """
        cloud = coordinates(points, "points", self.dimension)
        with told(progress) as on_progress:
            expected = revision_of(expected_revision, "expected_revision")
            upload = Upload(self._calls, self.name, cloud, offset, expected, on_progress)
            with self._noting_interruption():
                return upload.run(CallOptions(timeout=timeout, cancel=cancel))

    @takes(DomainArguments, PlaneArguments)
    def add_segments(
        self,
        *,
        offset: tuple[int, int] | None = None,
        expected_revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
        **arguments: Unpack[PlaneArguments],
    ) -> None:
        """Adds segments, holes and regions to a session in 2-D, and sets the rules, before its first refinement.

        Segments are numbers of the session's points, which may come later.

        Parameters
        ----------
        offset : (segments, seeds)
            How many the session has before these; see `upload`. Default: after those that are there.
        **arguments
        """
        if self.dimension != 2:
            raise InvalidArgumentError(f"segments are for 2-D; the session is in {self.dimension}-D", field="segments")
        (given,) = split("add_segments", arguments, PlaneArguments)
        options = CallOptions(timeout=timeout, cancel=cancel)
        session = self._get(options)
        bounds = make_plane(given, has_box=session.parameters.HasField("domain"), names_before=session.names)
        self._add_bounds(bounds, session, offset, expected_revision, options)

    @takes(DomainArguments, TriangleArguments)
    def add_triangles(
        self,
        *,
        offset: tuple[int, int] | None = None,
        expected_revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
        **arguments: Unpack[SurfaceArguments],
    ) -> None:
        """Adds triangles, holes and regions to a session in 3-D, and sets the rules, before its first refinement.

        Triangles are numbers of the session's points, which may come later.

        Parameters
        ----------
        offset : (triangles, seeds)
            How many the session has before these; see `upload`. Default: after those that are there.
        **arguments
        """
        if self.dimension != 3:
            raise InvalidArgumentError(
                f"triangles are for 3-D; the session is in {self.dimension}-D", field="triangles"
            )
        (given,) = split("add_triangles", arguments, SurfaceArguments)
        options = CallOptions(timeout=timeout, cancel=cancel)
        session = self._get(options)
        bounds = make_surface(given, names_before=session.names)
        self._add_bounds(bounds, session, offset, expected_revision, options)

    def _add_bounds(
        self,
        bounds: Bounds,
        session: Any,
        offset: tuple[int, int] | None,
        expected_revision: int | None,
        options: CallOptions,
    ) -> None:
        begin = offset if offset is not None else (getattr(session, bounds.count_field), session.seed_count)
        expected = revision_of(expected_revision, "expected_revision")
        Addition(self._calls, self.name, bounds, begin, expected).run(options)

    def sizes(
        self,
        values: Any,
        points: Any = None,
        *,
        unit: str = "radius",
        mesh_revision: int | None = None,
        expected_revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> int:
        """Replaces the sizes at points that the next refinements keep to; returns how many there are.

        They hold until others come; an empty list takes them back.

        Parameters
        ----------
        values : (m,) float
            Sizes above 0; see `size_values` of `wellspace.mesh`.
        points : (m, d) float
            Where they are. Default: at the vertices of the session's mesh, one for each, as an adaptive solver has
            them. Between points a size grows by `gradation`, so that it is larger there.
        unit : {"radius", "edge"}
            The measure of the values: bounds on circumradii, or lengths of edges.
        mesh_revision : int
            Without points: that of the mesh whose vertices they are, `Mesh.revision`; should the session have another
            one by then, `ConflictError` is raised. Default: the last mesh.
        """
        options = CallOptions(timeout=timeout, cancel=cancel)
        if points is None and np.size(values) == 0:
            points = []
        where = None if points is None else coordinates(points, "points", self.dimension)
        sizes = check_sizes(values, "values", None if where is None else len(where))
        field = SizeField(where, sizes, unit_of(unit))
        of_mesh = revision_of(mesh_revision, "mesh_revision")
        expected = revision_of(expected_revision, "expected_revision")
        return set_sizes(self._calls, self.name, field, of_mesh, expected, options)

    @takes(Parameters)
    def refine(
        self,
        *,
        restart: bool = False,
        progress: ProgressOption = None,
        expected_revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
        **arguments: Unpack[Parameters],
    ) -> Operation:
        """Makes the mesh of the uploaded points, or brings it to other parameters, and waits for it.

        The first time all is meshed, later only changes. Vertices keep their numbers. Parameters that are
        not named stay as they were. Ctrl-C and `cancel` cancel the work, and leave the session as it was; when
        `timeout` has passed, the work goes on.

        Parameters
        ----------
        restart : bool
            Make the mesh anew, from the session's points, segments and sizes alone: it becomes coarser where sizes have
            grown. Vertices get new numbers.
        progress : function or bool
            Called with `Progress`; True shows a bar.
        **arguments
        """
        options = CallOptions(timeout=timeout, cancel=cancel)
        request = self._refinement(restart, expected_revision, options, arguments)
        started: Operation | None = None
        try:
            started = self._start(request, options)
            ended = self.watch(started.name, progress=progress, timeout=timeout, cancel=cancel)
        except (KeyboardInterrupt, CancelledError):
            self._was_interrupted = True
            self._end_quietly(request, started)
            raise
        if ended.error is not None:
            raise ended.error
        return ended

    @takes(Parameters)
    def start_refinement(
        self,
        *,
        restart: bool = False,
        expected_revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
        **arguments: Unpack[Parameters],
    ) -> Operation:
        """As `refine`, but does not wait: `watch` does, and `cancel_operation` ends the work."""
        options = CallOptions(timeout=timeout, cancel=cancel)
        return self._start(self._refinement(restart, expected_revision, options, arguments), options)

    def _refinement(
        self, restart: bool, expected_revision: int | None, options: CallOptions, arguments: Mapping[str, Any]
    ) -> Any:
        """A StartRefinementRequest."""
        (changes,) = split("refine", arguments, Parameters)
        request = _api.message("StartRefinementRequest")(
            name=self.name,
            request_id=options.id_or_new(),
            expected_revision=revision_of(expected_revision, "expected_revision"),
            restart=restart,
        )
        if changes:
            request.parameters.CopyFrom(self._get(options).parameters)
            fill(request.parameters, self.dimension, changes)
        return request

    def _start(self, request: Any, options: CallOptions) -> Operation:
        method = "OperationService/StartRefinement"

        def attempt_once(attempt: Attempt) -> Any:
            try:
                return self._calls.attempt_unary(method, request, "StartRefinementResponse", attempt)
            except Error as error:
                # The server may still be ending an operation that was given up before.
                attempt.is_worth_repeating = self._was_interrupted and error.reason == "SESSION_BUSY"
                raise

        operation = operation_of(self._calls.run(options, attempt_once).operation)
        self._was_interrupted = False
        return operation

    @contextlib.contextmanager
    def _noting_interruption(self) -> Iterator[None]:
        try:
            yield
        except (KeyboardInterrupt, CancelledError):
            self._was_interrupted = True
            raise

    def watch(
        self,
        operation: str | None = None,
        *,
        progress: ProgressOption = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> Operation:
        """Waits until an operation has ended, by default the session's last, and returns it: with its error in it."""
        options = CallOptions(timeout=timeout, cancel=cancel)
        name = operation or self._get(options).last_operation
        if not name:
            raise NotFoundError(f"{self.name} has had no operation", field="operation")
        with told(progress) as on_progress:
            return watch(self._calls, name, on_progress, options)

    def cancel_operation(self, operation: str | None = None, *, timeout: float | None = None) -> Operation:
        """Cancels an operation, by default the session's last; it ends within 100 ms. No error if it has ended."""
        options = CallOptions(timeout=timeout)
        name = operation or self._get(options).last_operation
        request = _api.message("CancelOperationRequest")(name=name)
        method = "OperationService/CancelOperation"
        return operation_of(self._calls.unary(method, request, "CancelOperationResponse", options).operation)

    def operations(self, *, timeout: float | None = None) -> list[Operation]:
        """The session's operations, the oldest first; it keeps the last 100."""
        request = _api.message("ListOperationsRequest")(parent=self.name)
        method, found = "OperationService/ListOperations", []
        while True:
            page = self._calls.unary(method, request, "ListOperationsResponse", CallOptions(timeout=timeout))
            found += [operation_of(one) for one in page.operations]
            if not page.next_page_token:
                return found
            request.page_token = next_page(request.page_token, page.next_page_token)

    def _end_quietly(self, request: Any, started: Operation | None) -> None:
        """Cancels the operation of `request`, and waits for its end: then the session takes the next call.

        Where the call was given up before it had an answer, its repetition tells whether the work was started.
        """
        options = CallOptions(timeout=_SECONDS_TO_CANCEL)
        try:
            name = (started or self._start(request, options)).name
            self.cancel_operation(name, timeout=_SECONDS_TO_CANCEL)
            self.watch(name, timeout=_SECONDS_TO_CANCEL)
        except Error:
            pass  # the work, if there is any, goes on

    @overload
    def download(
        self,
        *,
        since: Mesh | None = None,
        boundary: bool = True,
        revision: int | None = None,
        progress: ProgressOption = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> Mesh: ...

    @overload
    def download(
        self,
        *,
        part: int,
        parts: int,
        ghost_layers: int = 1,
        contiguous: bool = False,
        boundary: bool = True,
        revision: int | None = None,
        progress: ProgressOption = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> MeshPart: ...

    def download(
        self,
        *,
        since: Mesh | None = None,
        part: int | None = None,
        parts: int | None = None,
        ghost_layers: int = 1,
        contiguous: bool = False,
        boundary: bool = True,
        revision: int | None = None,
        progress: ProgressOption = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> Mesh:
        """The session's mesh, or a part of it: that of `revision`, by default the last one.

        `boundary` False leaves facets, regions and origins of vertices out.

        `since` is a mesh that was downloaded before: where the server knows the differences since then, they alone are
        sent. The result is the same to the bit, and a mesh of its own; `since` stays as it is.

        With `part` and `parts` it is a `MeshPart`, for a solver on as many ranks of which each asks for its own:
        ``session.download(part=comm.rank, parts=comm.size, revision=...)``. The server cuts the mesh once for all. The
        same mesh and numbers always give the same parts; to have those of one mesh, ranks agree on its `revision`.

        Parameters
        ----------
        part, parts : int
            The number of the part, from 0 on, and how many there are.
        ghost_layers : int
            Of a part: layers of simplices of other parts around it, 0 to 16; a layer has the simplices with a vertex in
            common with those before.
        contiguous : bool
            Each part hangs together by facets, if the mesh does; parts may then be less even than by 3 %.
        """
        wanted = revision_of(revision, "revision")
        partition = partition_of(part, parts, ghost_layers, contiguous)
        if since is not None and partition is not None:
            raise InvalidArgumentError("part and since exclude each other: there are no differences of parts",
                                       field="part")
        if since is not None and wanted is not None:
            raise InvalidArgumentError("revision and since exclude each other: what has changed leads to the last mesh",
                                       field="revision")
        with told(progress) as on_progress:
            if since is not None:
                update = Update(self._calls, self.name, since, boundary, on_progress)
                return update.run(CallOptions(timeout=timeout, cancel=cancel))
            download = Download(self._calls, self.name, boundary, wanted, on_progress, partition)
            return download.run(CallOptions(timeout=timeout, cancel=cancel))

    def add(
        self,
        points: Any,
        *,
        near: Any = None,
        expected_revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> npt.NDArray[Any]:
        """Adds vertices at points, (k, d), of a session that was refined; returns their numbers, (k,).

        `near` has a vertex near each, from which the place is found in O(1). The session is then to be refined again,
        which costs their surroundings.

        The points are sent in requests with at most 3 MiB of them, 10⁵ points in 3-D. Those of each become vertices
        all or, on an error, none, and each makes a revision. On an error vertices of the requests before stay, and
        the message says how many points it is. A repetition of the call is safe, as a point that is a vertex already is
        given its number. With `expected_revision` a change in between raises `ConflictError`, too.
        """
        cloud = coordinates(points, "points", self.dimension)
        hints = hints_of(near, len(cloud))
        expected = revision_of(expected_revision, "expected_revision")
        with self._noting_interruption():
            return add_vertices(
                self._calls, self.name, cloud, hints, expected, CallOptions(timeout=timeout, cancel=cancel)
            )

    def remove(
        self,
        points: Any,
        *,
        expected_revision: int | None = None,
        timeout: float | None = None,
        cancel: CancelToken | None = None,
    ) -> int:
        """Takes points out of the session, uploaded and added ones alike; returns how many are left.

        `points` are their numbers, (k,): `Mesh.vertex_origins` has that of each vertex. Points behind them move down.
        The session is then to be refined again, which makes the mesh anew, as `refine(restart=True)` does; until then
        its mesh is the last one.
        """
        numbers = indices(points, "points")
        options = CallOptions(timeout=timeout, cancel=cancel)
        request = _api.message("RemovePointsRequest")(
            name=self.name,
            points=numbers.tolist(),
            request_id=options.id_or_new(),
            expected_revision=revision_of(expected_revision, "expected_revision"),
        )
        answer = self._calls.unary("SessionService/RemovePoints", request, "RemovePointsResponse", options)
        return int(answer.committed_points)


Session.__doc__ = naming(Session.__doc__, Parameters)
