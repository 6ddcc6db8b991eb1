"""Uploads and downloads of sessions, which go on where a connection broke off."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from . import _api, _wire
from ._arrays import Floats
from ._calls import Calls, CallOptions
from ._checksum import crc32c
from ._delta import DeltaReceiver, metadata_of
from ._domain import Bounds
from ._mesh import Mesh, mesh_of
from ._messages import messages_of, point_chunks, receive
from ._part import part_of
from ._progress import OnProgress, Progress
from ._receiver import MeshReceiver, damaged
from ._retry import Attempt
from .errors import Error


def _part_of(phase: str, done: int, total: int) -> Progress:
    return Progress(phase, 0, 0, 0, done / total if total else 1.0)


class Upload:
    """One upload of points, in as many streams as it takes."""

    def __init__(
        self,
        calls: Calls,
        session: str,
        cloud: Floats,
        offset: int | None,
        expected_revision: int | None,
        on_progress: OnProgress,
    ) -> None:
        self._calls = calls
        self._session = session
        self._cloud = cloud
        self._offset = offset
        self._expected_revision = expected_revision
        self._on_progress = on_progress
        self._committed = 0  # as far as is known
        self._attempts = 0

    def run(self, options: CallOptions) -> int:
        """Uploads, and returns how many points the session has then."""
        return self._calls.run(options, self._attempt)

    def _attempt(self, attempt: Attempt) -> int:
        get = _api.message("GetSessionRequest")(name=self._session)
        method = "SessionService/GetSession"
        committed = self._calls.attempt_unary(method, get, "GetSessionResponse", attempt).session.committed_points
        if committed > self._committed:
            self._committed = committed
            attempt.progressed = True
        if self._offset is None:
            self._offset = committed
        # Points from the offset on have to be these: the server compares.
        first = min(max(self._offset, committed) - self._offset, len(self._cloud))
        expected = self._expected_revision
        head = _api.message("UploadPointsRequest")(name=self._session, expected_revision=expected)
        # The commits of the attempts before this one have changed the revision.
        self._expected_revision = None
        if first > 0:
            head.checked_from = self._offset
            head.checked_crc32c = crc32c(self._cloud[:first])
        self._attempts += 1
        try:
            requests = self._requests(head, self._offset, first)
            upload = self._calls.attempt_upload
            answer = upload("SessionService/UploadPoints", requests, "UploadPointsResponse", attempt)
        except Error as error:
            if error.address:
                self._expected_revision = expected  # a server that has not the session commits nothing
            # The server may not have noticed yet that the last attempt broke off.
            attempt.is_worth_repeating = self._attempts > 1 and error.reason == "SESSION_BUSY"
            raise
        if answer.committed_points < self._offset + len(self._cloud):
            raise attempt.final(
                damaged(f"{answer.committed_points} points after points up to {self._offset + len(self._cloud)} came")
            )
        return int(answer.committed_points)

    def _requests(self, head: Any, offset: int, first: int) -> Iterator[bytes]:
        head.point_offset = offset + first
        yield head.SerializeToString()  # says which session it is
        later = type(head)()
        for begin, end, chunk in point_chunks(self._cloud, first):
            later.point_offset = offset + begin
            yield later.SerializeToString() + _wire.message_field(3, chunk)
            self._on_progress(_part_of("upload", end, len(self._cloud)))


class Addition:
    """Segments or triangles, and seeds, for a session, after those of `offset`."""

    def __init__(
        self, calls: Calls, session: str, bounds: Bounds, offset: tuple[int, int], expected_revision: int | None
    ) -> None:
        self._calls = calls
        self._session = session
        self._bounds = bounds
        self._rows, self._seeds = offset
        self._expected_revision = expected_revision

    def run(self, options: CallOptions) -> None:
        """Adds them. The server compares rows of an earlier attempt when they come again."""
        self._calls.run(options, self._attempt)

    def _attempt(self, attempt: Attempt) -> None:
        requests = list(self._requests())
        expected = self._expected_revision
        # The commits of an attempt before this one have changed the revision.
        self._expected_revision = None
        method = self._bounds.method
        try:
            self._calls.attempt_upload(f"SessionService/{method}", requests, f"{method}Response", attempt)
        except Error as error:
            if error.address:
                self._expected_revision = expected  # a server that has not the session commits nothing
            raise

    def _requests(self) -> Iterator[bytes]:
        bounds = self._bounds
        request = _api.message(f"{bounds.method}Request")
        head = request(name=self._session, expected_revision=self._expected_revision, seed_offset=self._seeds)
        for first, chunk in bounds.row_chunks():
            setattr(head, bounds.offset_field, self._rows + first)
            yield head.SerializeToString() + _wire.message_field(3, chunk)
        setattr(head, bounds.offset_field, self._rows + bounds.row_count)
        for first, chunk in bounds.option_chunks(self._rows):
            head.seed_offset = self._seeds + first
            yield head.SerializeToString() + _wire.message_field(5, chunk)


class Download:
    """One download of a mesh or, with a MeshPartition, of a part of it, in as many streams as it takes."""

    def __init__(
        self,
        calls: Calls,
        session: str,
        boundary: bool,
        revision: int | None,
        on_progress: OnProgress,
        partition: Any = None,
    ) -> None:
        self._calls = calls
        self._request = _api.message("DownloadMeshRequest")(
            name=session, revision=revision, with_boundary=boundary, partition=partition
        )
        self._receiver = MeshReceiver(partition=partition)
        self._on_progress = on_progress

    def run(self, options: CallOptions) -> Mesh:
        """Downloads the mesh, or the part: a MeshPart."""
        return self._calls.run(options, self._attempt)

    def _attempt(self, attempt: Attempt) -> Mesh:
        receiver, request = self._receiver, self._request
        if receiver.metadata is not None:
            request.revision = receiver.metadata.revision
        request.next_chunk = receiver.next_chunk
        receiver.resume()
        try:
            with self._calls.stream("SessionService/DownloadMesh", request.SerializeToString(), attempt) as answers:
                for number, part in (field for answer in answers for field in messages_of(answer)):
                    receive(receiver, number - 1, part)
                    attempt.progressed = attempt.progressed or number == 2
                    self._on_progress(_part_of("download", receiver.next_chunk, receiver.metadata.chunk_count))
        except Error as error:
            # A connection that breaks after the last chunk costs nothing.
            if error.code == "DATA_LOSS" or not receiver.has_all_chunks:
                raise
        receiver.finish()
        return part_of(receiver) if request.HasField("partition") else mesh_of(receiver)


class Update:
    """One download of the differences from a mesh, or of the whole mesh where that is of no use."""

    def __init__(self, calls: Calls, session: str, since: Mesh, boundary: bool, on_progress: OnProgress) -> None:
        self._calls = calls
        self._session = session
        self._boundary = boundary
        self._on_progress = on_progress
        self._deltas = DeltaReceiver(since)
        self._whole: MeshReceiver | None = None
        if since.revision == 0 or boundary != bool(since.facet_names):
            self._whole = MeshReceiver()

    def run(self, options: CallOptions) -> Mesh:
        """Returns the session's mesh."""
        return self._calls.run(options, self._attempt)

    def _attempt(self, attempt: Attempt) -> Mesh:
        if self._whole is None:
            try:
                return self._stream(attempt)
            except Error as error:
                # Also a mesh that is not as it was: the server's is not damaged then.
                if error.reason != "DELTA_NOT_KEPT" and error.code != "DATA_LOSS":
                    raise
                self._whole = MeshReceiver()
        return self._stream(attempt)

    def _request(self) -> bytes:
        request = _api.message("DownloadMeshRequest")(name=self._session, with_boundary=self._boundary)
        if self._whole is None:
            request.since_revision = self._deltas.mesh.revision
            if self._deltas.revision:
                request.revision = self._deltas.revision
            request.next_chunk = self._deltas.next_part
        else:
            if self._whole.metadata is not None:
                request.revision = self._whole.metadata.revision
            request.next_chunk = self._whole.next_chunk
        return bytes(request.SerializeToString())

    def _stream(self, attempt: Attempt) -> Mesh:
        self._deltas.resume()
        if self._whole is not None:
            self._whole.resume()
        try:
            with self._calls.stream("SessionService/DownloadMesh", self._request(), attempt) as answers:
                for number, part in (field for answer in answers for field in messages_of(answer)):
                    self._take(number, part)
                    attempt.progressed = attempt.progressed or number > 1
        except Error as error:
            if error.code == "DATA_LOSS" or self._whole is None or not self._whole.has_all_chunks:
                raise
        if self._whole is None:
            self._deltas.finish()
            return self._deltas.mesh
        self._whole.finish()
        return mesh_of(self._whole)

    def _take(self, number: int, part: memoryview) -> None:
        if number == 1 and self._whole is None:
            metadata = metadata_of(part)
            if metadata.HasField("delta"):
                self._deltas.set_metadata(metadata)
                return
            self._whole = MeshReceiver()  # a server that is too old for differences
        if self._whole is not None:
            receive(self._whole, number - 1, part)
            self._on_progress(_part_of("download", self._whole.next_chunk, self._whole.metadata.chunk_count))
        elif number == 3:
            self._deltas.add_part(part)
            self._on_progress(_part_of("download", self._deltas.next_part, self._deltas.part_count))
