"""The whole life of a session from Python: Debian's grpcio, stubs made of the protos, and nothing else of this project."""
import random
import unittest

import grpc
import numpy

from wellspaced import PATIENCE, Wellspaced, api, crc32c, details

DIMENSION = 2


def uniform(count, seed):
    generator = random.Random(seed)
    return numpy.array([[generator.uniform(0.05, 0.95) for _ in range(DIMENSION)] for _ in range(count)])


def array_of(chunk):
    """Which array a chunk is of, and its values as they are on the wire."""
    for name, kind in (("points", "<f8"), ("simplices", "<u4"), ("input_vertices", "<u4")):
        values = getattr(chunk, name)
        if values:
            return name, numpy.array(values, kind)
    raise AssertionError("a chunk without content")


class Mesh:
    """The arrays of a mesh, put together of its chunks, each of which is checked."""

    def __init__(self, metadata, chunks):
        assert [chunk.index for chunk in chunks] == list(range(metadata.chunk_count))
        parts = {"points": [], "simplices": [], "input_vertices": []}
        for chunk in chunks:
            name, values = array_of(chunk)
            assert crc32c(values.tobytes()) == chunk.crc32c, chunk.index
            parts[name].append(values)
        self.points = numpy.concatenate(parts["points"]).reshape(metadata.vertex_count, DIMENSION)
        self.simplices = numpy.concatenate(parts["simplices"]).reshape(metadata.simplex_count, DIMENSION + 1)
        self.input_vertices = numpy.concatenate(parts["input_vertices"])

    def area(self):
        """Of all triangles; each must be positively oriented."""
        corners = self.points[self.simplices]
        areas = numpy.linalg.det(corners[:, 1:] - corners[:, :1]) / 2
        assert areas.min() > 0
        return areas.sum()


class PythonClient(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Wellspaced()
        cls.channel = grpc.insecure_channel(cls.server.address)
        cls.meshing = api().MeshingServiceStub(cls.channel)
        cls.sessions = api().SessionServiceStub(cls.channel)
        cls.operations = api().OperationServiceStub(cls.channel)
        cls.queries = api().QueryServiceStub(cls.channel)

    @classmethod
    def tearDownClass(cls):
        cls.channel.close()
        assert cls.server.stop() == 0

    def parameters(self, **others):
        box = api().Box(low=[0] * DIMENSION, high=[1] * DIMENSION)
        return api().MeshParameters(dimension=DIMENSION, domain=box, **others)

    def create(self, **others):
        request = api().CreateSessionRequest(parameters=self.parameters(), **others)
        return self.sessions.CreateSession(request, timeout=PATIENCE).session

    def get(self, name):
        return self.sessions.GetSession(api().GetSessionRequest(name=name), timeout=PATIENCE).session

    def delete(self, name):
        self.sessions.DeleteSession(api().DeleteSessionRequest(name=name), timeout=PATIENCE)

    def pieces(self, name, points, offset, rows):
        """The requests of an upload of points[offset:], so many rows in each."""
        for first in range(offset, len(points), rows):
            chunk = api().PointChunk(coordinates=points[first:first + rows].ravel())
            yield api().UploadPointsRequest(name=name, point_offset=first, points=chunk)

    def refine(self, name, **parameters):
        """Starts a refinement, watches it from its beginning to its end; the operation and its events."""
        request = api().StartRefinementRequest(name=name)
        if parameters:
            request.parameters.CopyFrom(self.parameters(**parameters))
        operation = self.operations.StartRefinement(request, timeout=PATIENCE).operation
        return self.watch(operation.name)

    def watch(self, operation, **after):
        events = []
        request = api().WatchOperationRequest(name=operation, **after)
        for response in self.operations.WatchOperation(request, timeout=PATIENCE):
            if response.WhichOneof("response") == "operation":
                return response.operation, events
            events.append(response.progress)
        raise AssertionError("the watch ended without the operation")

    def download(self, name, **others):
        """Metadata and chunks."""
        request = api().DownloadMeshRequest(name=name, **others)
        first, *rest = self.sessions.DownloadMesh(request, timeout=PATIENCE)
        return first.metadata, [response.chunk for response in rest]

    def assert_fails(self, code, call, *arguments, **keywords):
        """The details of the error that a call ends with."""
        with self.assertRaises(grpc.RpcError) as caught:
            answer = call(*arguments, timeout=PATIENCE, **keywords)
            list(answer)  # of a stream
        self.assertEqual(caught.exception.code(), code, caught.exception.details())
        return details(caught.exception)

    def assert_reason(self, found, reason):
        info = found["google.rpc.ErrorInfo"]
        self.assertEqual((info.domain, info.reason), ("wellspace.v1", "ERROR_REASON_" + reason))

    def upload_in_resumable_pieces(self, name, points):
        """One call that breaks off, then one that goes on where the server has got to, with some points twice."""
        sent = iter(self.pieces(name, points, 0, 100))
        first = next(sent)

        def a_part():
            yield first
            while self.get(name).committed_points < 100:
                pass
            call.cancel()
            yield next(sent)  # never arrives

        call = self.sessions.UploadPoints.future(a_part(), timeout=PATIENCE)
        with self.assertRaises(grpc.FutureCancelledError):
            call.result()
        committed = self.get(name).committed_points
        self.assertEqual(committed, 100)
        gap = self.pieces(name, points, committed + 1, 100)
        self.assert_reason(self.assert_fails(grpc.StatusCode.OUT_OF_RANGE, self.sessions.UploadPoints, gap), "UPLOAD_GAP")
        again = self.pieces(name, points, committed - 50, 333)
        uploaded = self.sessions.UploadPoints(again, timeout=PATIENCE)
        self.assertEqual(uploaded.committed_points, len(points))
        self.assertEqual(self.get(name).revision, uploaded.revision)

    def test_the_whole_life_of_a_session(self):
        points, more = uniform(3000, 1), uniform(20, 2)
        session = self.create(labels={"who": "python"}, request_id="python-1")
        name = session.name
        self.assertRegex(name, "^sessions/[^/]+$")
        self.assertEqual((session.state, session.revision), (api().Session.STATE_OPEN, 1))
        self.assertEqual(self.create(labels={"who": "python"}, request_id="python-1").name, name, "a repetition")

        self.upload_in_resumable_pieces(name, points)

        # Estimate.
        cloud = [api().EstimateMeshRequest(parameters=self.parameters(max_circumradius=0.0025)),
                 api().EstimateMeshRequest(points=api().PointChunk(coordinates=points.ravel()))]
        estimate = self.meshing.EstimateMesh(iter(cloud), timeout=PATIENCE)

        # Refine, and watch: from the start, late, and after a part of the events.
        operation, events = self.refine(name, max_circumradius=0.0025)
        self.assertEqual(operation.state, api().Operation.STATE_SUCCEEDED)
        self.assertEqual(events[-1].phase, api().PHASE_DONE)
        self.assertEqual(events[-1].fraction, 1)
        for before, after in zip(events, events[1:]):
            self.assertLess(before.sequence, after.sequence)
            for figure in ("phase", "vertices", "simplices", "fraction"):
                self.assertLessEqual(getattr(before, figure), getattr(after, figure))
        late, seen_late = self.watch(operation.name)
        self.assertEqual((late, seen_late[-1]), (operation, events[-1]))
        again, seen_again = self.watch(operation.name, after_sequence=events[-1].sequence)
        self.assertEqual((again, seen_again), (operation, []))

        # Download: all, then from a chunk on.
        metadata, chunks = self.download(name, revision=operation.mesh_revision)
        self.assertGreater(len(chunks), 3)
        mesh = Mesh(metadata, chunks)
        numpy.testing.assert_array_equal(mesh.points[mesh.input_vertices], points)
        self.assertAlmostEqual(mesh.area(), 1, places=12)
        self.assertLess(abs(numpy.log(estimate.vertices / metadata.vertex_count)), numpy.log(1.5))
        continued_metadata, continued = self.download(name, revision=metadata.revision, next_chunk=2)
        self.assertEqual(continued_metadata, metadata)
        self.assertEqual([chunk.SerializeToString(deterministic=True) for chunk in continued],
                         [chunk.SerializeToString(deterministic=True) for chunk in chunks[2:]])

        self.query(name, mesh)

        # Add vertices, each near one that there is, and refine again.
        near = mesh.simplices[:20, 0]
        added = self.queries.AddVertices(api().AddVerticesRequest(name=name, points=more.ravel(), near=near), timeout=PATIENCE)
        self.assertEqual(sorted(added.vertices), list(range(metadata.vertex_count, metadata.vertex_count + 20)))
        self.assertEqual(self.get(name).state, api().Session.STATE_OPEN)
        operation, _ = self.refine(name, max_circumradius=0.0025)
        self.assertEqual(operation.state, api().Operation.STATE_SUCCEEDED)
        self.assertEqual(self.get(name).state, api().Session.STATE_READY)
        finer = Mesh(*self.download(name))
        numpy.testing.assert_array_equal(finer.points[added.vertices], more)
        numpy.testing.assert_array_equal(finer.points[:metadata.vertex_count], mesh.points, "vertices keep their numbers")
        self.assertAlmostEqual(finer.area(), 1, places=12)
        listed = self.operations.ListOperations(api().ListOperationsRequest(parent=name), timeout=PATIENCE).operations
        self.assertEqual([one.state for one in listed], [api().Operation.STATE_SUCCEEDED] * 2)

        # Continue the old download: that mesh is no longer there. Delete.
        request = api().DownloadMeshRequest(name=name, revision=metadata.revision, next_chunk=2)
        found = self.assert_fails(grpc.StatusCode.FAILED_PRECONDITION, self.sessions.DownloadMesh, request)
        self.assert_reason(found, "REVISION_MISMATCH")
        self.delete(name)
        found = self.assert_fails(grpc.StatusCode.NOT_FOUND, self.sessions.GetSession, api().GetSessionRequest(name=name))
        self.assert_reason(found, "SESSION_NOT_FOUND")

    def query(self, name, mesh):
        """Every cell of the mesh in one stream of each kind."""
        count = len(mesh.points)
        request = api().ApproximateNearestNeighborsRequest(name=name)
        batches = list(self.queries.ApproximateNearestNeighbors(request, timeout=PATIENCE))
        nearest = numpy.concatenate([batch.distances for batch in batches])
        self.assertEqual(len(nearest), count)
        edges = mesh.points[mesh.simplices] - mesh.points[numpy.roll(mesh.simplices, 1, axis=1)]
        self.assertEqual(nearest.min(), numpy.sqrt((edges**2).sum(axis=2).min()), "the shortest edge of a Delaunay mesh")

        wanted = list(range(count - 1, -1, -1))
        request = api().ClippedVoronoiCellsRequest(name=name, vertices=wanted, beta=1.5)
        batches = [response.cells for response in self.queries.ClippedVoronoiCells(request, timeout=PATIENCE)]
        self.assertGreater(len(batches), 1)
        self.assertLess(len(batches), count / 100)
        self.assertEqual([vertex for batch in batches for vertex in batch.vertices], wanted)
        radii = numpy.concatenate([batch.clip_radii for batch in batches])
        numpy.testing.assert_array_equal(radii, 1.5 * nearest[::-1])

        few = [7, 0, count - 1]
        request = api().VoronoiCellsRequest(name=name, vertices=few)
        (cells,) = [response.cells for response in self.queries.VoronoiCells(request, timeout=PATIENCE)]
        self.assertEqual(list(cells.vertices), few)
        self.assertEqual(len(cells.nodes), DIMENSION * sum(cells.node_counts))
        first = set(cells.neighbours[:cells.neighbour_counts[0]])
        with_edge_to_7 = {vertex for simplex in mesh.simplices if 7 in simplex for vertex in simplex} - {7}
        self.assertLessEqual(first, with_edge_to_7)

        request = api().VoronoiCellsRequest(name=name, vertices=[0, count])
        found = self.assert_fails(grpc.StatusCode.OUT_OF_RANGE, self.queries.VoronoiCells, request)
        self.assert_reason(found, "VERTEX_OUT_OF_RANGE")
        self.assertEqual(found["google.rpc.BadRequest"].field_violations[0].field, "vertices[1]")

    def test_lists_have_pages_and_filters(self):
        names = [self.create(labels={"list": "python", "number": str(i)}).name for i in range(5)]
        pages, token = [], ""
        while token or not pages:
            request = api().ListSessionsRequest(page_size=2, page_token=token, labels={"list": "python"})
            response = self.sessions.ListSessions(request, timeout=PATIENCE)
            pages.append([session.name for session in response.sessions])
            token = response.next_page_token
        self.assertEqual(pages, [names[:2], names[2:4], names[4:]])
        request = api().ListSessionsRequest(labels={"list": "python", "number": "3"})
        self.assertEqual([one.name for one in self.sessions.ListSessions(request, timeout=PATIENCE).sessions], [names[3]])
        found = self.assert_fails(grpc.StatusCode.INVALID_ARGUMENT, self.sessions.ListSessions,
                                  api().ListSessionsRequest(page_token="nonsense"))
        self.assertEqual(found["google.rpc.BadRequest"].field_violations[0].field, "page_token")
        for name in names:
            self.delete(name)

    def test_errors_carry_their_details(self):
        request = api().CreateSessionRequest(parameters=api().MeshParameters(dimension=9))
        found = self.assert_fails(grpc.StatusCode.INVALID_ARGUMENT, self.sessions.CreateSession, request)
        self.assert_reason(found, "INVALID_PARAMETERS")
        (violation,) = found["google.rpc.BadRequest"].field_violations
        self.assertEqual(violation.field, "parameters.dimension")
        self.assertIn("9", violation.description)

        name = self.create().name
        update = api().UpdateSessionRequest(session=api().Session(name=name), expected_revision=99)
        self.assert_reason(self.assert_fails(grpc.StatusCode.ABORTED, self.sessions.UpdateSession, update), "REVISION_MISMATCH")
        self.refine(name, max_vertices=3)
        operation, _ = self.watch(self.get(name).last_operation)
        self.assertEqual(operation.state, api().Operation.STATE_FAILED)
        self.assertEqual(operation.error.code, grpc.StatusCode.RESOURCE_EXHAUSTED.value[0])
        info = api().ErrorInfo()
        self.assertTrue(operation.error.details[0].Unpack(info))
        self.assertEqual(info.reason, "ERROR_REASON_MESH_TOO_LARGE")
        self.delete(name)

    def test_all_in_one_call(self):
        points = uniform(300, 3)
        requests = [api().MeshPointsRequest(parameters=self.parameters())]
        requests += [api().MeshPointsRequest(points=api().PointChunk(coordinates=part.ravel())) for part in (points[:100], points[100:])]
        responses = list(self.meshing.MeshPoints(iter(requests), timeout=PATIENCE))
        kinds = [response.WhichOneof("response") for response in responses]
        self.assertEqual(kinds, sorted(kinds, key=["progress", "metadata", "chunk"].index))
        (metadata,) = [response.metadata for response in responses if response.WhichOneof("response") == "metadata"]
        mesh = Mesh(metadata, [response.chunk for response in responses if response.WhichOneof("response") == "chunk"])
        numpy.testing.assert_array_equal(mesh.points[:300], points)
        self.assertAlmostEqual(mesh.area(), 1, places=12)
        info = self.meshing.GetServerInfo(api().GetServerInfoRequest(), timeout=PATIENCE)
        self.assertEqual(list(info.dimensions), [2, 3, 4, 5, 6])


if __name__ == "__main__":
    unittest.main()
