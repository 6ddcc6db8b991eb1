"""The whole life of a session from Python: Debian's grpcio, stubs of the protos, and nothing else of this project."""
import threading
import unittest

import grpc
import numpy

from remote import Fails, Mesh, Remote, cloud, content, pieces, uniform, unit_box
from wellspaced import PATIENCE, Wellspaced, api


class PythonClient(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Wellspaced()
        cls.remote = Remote(cls.server.address)

    @classmethod
    def tearDownClass(cls):
        cls.remote.close()
        assert cls.server.stop() == 0

    def create(self, **others):
        return self.remote.create(unit_box(2), **others)

    def upload_in_resumable_pieces(self, name, points):
        """One call that breaks off, then one that goes on where the server has got to, with some points twice."""
        sent = pieces(name, points, 0, 100)
        is_known = threading.Event()  # `call`: requests are asked for before it is there

        def a_part():
            yield next(sent)
            while self.remote.get(name).committed_points < 100:
                pass
            is_known.wait()
            call.cancel()
            yield next(sent)  # never arrives

        call = self.remote.sessions.UploadPoints.future(a_part(), timeout=PATIENCE)
        is_known.set()
        with self.assertRaises(grpc.FutureCancelledError):
            call.result()
        committed = self.remote.get(name).committed_points
        self.assertEqual(committed, 100)
        with Fails(self, grpc.StatusCode.OUT_OF_RANGE, "UPLOAD_GAP"):
            self.remote.upload(name, points, offset=committed + 1)
        uploaded = self.remote.upload(name, points, offset=committed - 50, rows=333)
        self.assertEqual(uploaded.committed_points, len(points))
        self.assertEqual(self.remote.get(name).revision, uploaded.revision)

    def test_the_whole_life_of_a_session(self):
        points, more = uniform(3000, 2, seed=1), uniform(20, 2, seed=2)
        fine = unit_box(2, max_circumradius=0.0025)
        session = self.create(labels={"who": "python"}, request_id="python-1")
        name = session.name
        self.assertRegex(name, "^sessions/[^/]+$")
        self.assertEqual((session.state, session.revision), (api().Session.STATE_OPEN, 1))
        self.assertEqual(self.create(labels={"who": "python"}, request_id="python-1").name, name, "a repetition")

        self.upload_in_resumable_pieces(name, points)
        requests = cloud(api().EstimateMeshRequest, fine, points)
        estimate = self.remote.meshing.EstimateMesh(requests, timeout=PATIENCE)

        # Refine, and watch: from the start, late, and after a part of the events.
        operation, events = self.remote.refine(name, fine)
        self.assertEqual(operation.state, api().Operation.STATE_SUCCEEDED)
        self.assertEqual(events[-1].phase, api().PHASE_DONE)
        late, seen_late = self.remote.watch(operation.name)
        self.assertEqual((late, seen_late[-1]), (operation, events[-1]))
        again, seen_again = self.remote.watch(operation.name, after_sequence=events[-1].sequence)
        self.assertEqual((again, seen_again), (operation, []))

        # Download: all, then from a chunk on.
        metadata, chunks = self.remote.download(name, revision=operation.mesh_revision)
        self.assertGreater(len(chunks), 3)
        mesh = Mesh(metadata, chunks)
        numpy.testing.assert_array_equal(mesh.points[mesh.input_vertices], points)
        self.assertAlmostEqual(mesh.volume(), 1, places=12)
        self.assertLess(abs(numpy.log(estimate.vertices / metadata.vertex_count)), numpy.log(1.5))
        continued_metadata, continued = self.remote.download(name, revision=metadata.revision, next_chunk=2)
        self.assertEqual(continued_metadata, metadata)
        self.assertEqual(content(continued), content(chunks[2:]))

        self.query(name, mesh)

        # Add vertices, each near one that there is, and refine again.
        request = api().AddVerticesRequest(name=name, points=more.ravel(), near=mesh.simplices[:20, 0])
        added = self.remote.queries.AddVertices(request, timeout=PATIENCE)
        self.assertEqual(sorted(added.vertices), list(range(metadata.vertex_count, metadata.vertex_count + 20)))
        self.assertEqual(self.remote.get(name).state, api().Session.STATE_OPEN)
        operation, _ = self.remote.refine(name, fine)
        self.assertEqual(operation.state, api().Operation.STATE_SUCCEEDED)
        self.assertEqual(self.remote.get(name).state, api().Session.STATE_READY)
        finer = Mesh(*self.remote.download(name))
        numpy.testing.assert_array_equal(finer.points[added.vertices], more)
        numpy.testing.assert_array_equal(finer.points[:metadata.vertex_count], mesh.points,
                                         "vertices keep their numbers")
        self.assertAlmostEqual(finer.volume(), 1, places=12)
        request = api().ListOperationsRequest(parent=name)
        listed = self.remote.operations.ListOperations(request, timeout=PATIENCE).operations
        self.assertEqual([one.state for one in listed], [api().Operation.STATE_SUCCEEDED] * 2)

        # The old mesh is no longer there; then nothing is.
        with Fails(self, grpc.StatusCode.FAILED_PRECONDITION, "REVISION_MISMATCH"):
            self.remote.download(name, revision=metadata.revision, next_chunk=2)
        self.remote.delete(name)
        with Fails(self, grpc.StatusCode.NOT_FOUND, "SESSION_NOT_FOUND"):
            self.remote.get(name)

    def query(self, name, mesh):
        """Every cell of the mesh in one stream of each kind."""
        queries, count = self.remote.queries, len(mesh.points)
        request = api().ApproximateNearestNeighborsRequest(name=name)
        batches = list(queries.ApproximateNearestNeighbors(request, timeout=PATIENCE))
        nearest = numpy.concatenate([batch.distances for batch in batches])
        self.assertEqual(len(nearest), count)
        edges = mesh.points[mesh.simplices] - mesh.points[numpy.roll(mesh.simplices, 1, axis=1)]
        self.assertEqual(nearest.min(), numpy.sqrt((edges**2).sum(axis=2).min()),
                         "the shortest edge of a Delaunay mesh")

        wanted = list(range(count - 1, -1, -1))
        request = api().ClippedVoronoiCellsRequest(name=name, vertices=wanted, beta=1.5)
        batches = [response.cells for response in queries.ClippedVoronoiCells(request, timeout=PATIENCE)]
        self.assertGreater(len(batches), 1)
        self.assertLess(len(batches), count / 100)
        self.assertEqual([vertex for batch in batches for vertex in batch.vertices], wanted)
        radii = numpy.concatenate([batch.clip_radii for batch in batches])
        numpy.testing.assert_array_equal(radii, 1.5 * nearest[::-1])

        few = [7, 0, count - 1]
        request = api().VoronoiCellsRequest(name=name, vertices=few)
        (cells,) = [response.cells for response in queries.VoronoiCells(request, timeout=PATIENCE)]
        self.assertEqual(list(cells.vertices), few)
        self.assertEqual(len(cells.nodes), 2 * sum(cells.node_counts))
        neighbours = set(cells.neighbours[:cells.neighbour_counts[0]])
        has_edge_to_7 = set(mesh.simplices[(mesh.simplices == 7).any(axis=1)].ravel()) - {7}
        self.assertLessEqual(neighbours, has_edge_to_7)

        with Fails(self, grpc.StatusCode.OUT_OF_RANGE, "VERTEX_OUT_OF_RANGE") as error:
            list(queries.VoronoiCells(api().VoronoiCellsRequest(name=name, vertices=[0, count]), timeout=PATIENCE))
        self.assertEqual(error.field, "vertices[1]")

    def test_lists_have_pages_and_filters(self):
        names = [self.create(labels={"list": "python", "number": str(i)}).name for i in range(5)]
        pages, token = [], ""
        while token or not pages:
            response = self.remote.list(page_size=2, page_token=token, labels={"list": "python"})
            pages.append([session.name for session in response.sessions])
            token = response.next_page_token
        self.assertEqual(pages, [names[:2], names[2:4], names[4:]])
        filtered = self.remote.list(labels={"list": "python", "number": "3"}).sessions
        self.assertEqual([session.name for session in filtered], [names[3]])
        with Fails(self, grpc.StatusCode.INVALID_ARGUMENT) as error:
            self.remote.list(page_token="nonsense")
        self.assertEqual(error.field, "page_token")
        for name in names:
            self.remote.delete(name)

    def test_errors_carry_their_details(self):
        with Fails(self, grpc.StatusCode.INVALID_ARGUMENT, "INVALID_PARAMETERS") as error:
            self.remote.create(api().MeshParameters(dimension=9))
        self.assertEqual(error.field, "parameters.dimension")
        self.assertIn("9", error.message)

        name = self.create().name
        with Fails(self, grpc.StatusCode.ABORTED, "REVISION_MISMATCH"):
            update = api().UpdateSessionRequest(session=api().Session(name=name), expected_revision=99)
            self.remote.sessions.UpdateSession(update, timeout=PATIENCE)
        operation, _ = self.remote.refine(name, unit_box(2, max_vertices=3))
        self.assertEqual(operation.state, api().Operation.STATE_FAILED)
        self.assertEqual(operation.error.code, grpc.StatusCode.RESOURCE_EXHAUSTED.value[0])
        info = api().ErrorInfo()
        self.assertTrue(operation.error.details[0].Unpack(info))
        self.assertEqual(info.reason, "ERROR_REASON_MESH_TOO_LARGE")
        self.remote.delete(name)

    def assert_tiled(self, metadata, mesh):
        """The boundary of the unit box: of each face its facets, which cover it, and have the mesh behind them."""
        d = metadata.dimension
        names = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"][:2 * d]
        self.assertEqual([(part.tag, part.name) for part in metadata.boundary], list(enumerate(names, 1)))
        self.assertEqual([(region.id, region.name) for region in metadata.regions], [(1, "domain")])
        for face, part in enumerate(metadata.boundary):
            corners = mesh.points[mesh.facets[mesh.facet_tags == part.tag]]
            self.assertTrue((corners[:, :, face // 2] == face % 2).all())
            if d == 2:
                edges = corners[:, 1] - corners[:, 0]
                normals = numpy.stack([edges[:, 1], -edges[:, 0]], axis=1)
            else:
                normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
            outward = normals[:, face // 2] * (1 if face % 2 else -1)
            self.assertGreater(outward.min(), 0)
            self.assertAlmostEqual(outward.sum(), 1, places=12)
        on_boundary = numpy.zeros(len(mesh.points), bool)
        on_boundary[mesh.facets.ravel()] = True
        numpy.testing.assert_array_equal(mesh.vertex_tags != 0, on_boundary)
        inputs = numpy.flatnonzero(mesh.vertex_origins < 0xfffffffd)
        numpy.testing.assert_array_equal(mesh.input_vertices[mesh.vertex_origins[inputs]], inputs)

    def test_the_boundary_comes_to_those_that_ask(self):
        for d in (2, 3):
            with self.subTest(dimension=d):
                points = uniform(400, d, seed=4)
                session = self.remote.create(unit_box(d)).name
                self.remote.upload(session, points)
                self.remote.refine(session)
                plain_metadata, plain = self.remote.download(session)
                self.assertEqual((plain_metadata.facet_count, len(plain_metadata.boundary)), (0, 0))
                metadata, chunks = self.remote.download(session, with_boundary=True)
                mesh = Mesh(metadata, chunks)
                self.assert_tiled(metadata, mesh)
                numpy.testing.assert_array_equal(mesh.simplices, Mesh(plain_metadata, plain).simplices)
                for first in range(len(chunks) + 1):
                    _, rest = self.remote.download(session, with_boundary=True, next_chunk=first)
                    self.assertEqual(content(rest), content(chunks[first:]))
                with Fails(self, grpc.StatusCode.OUT_OF_RANGE, "CHUNK_OUT_OF_RANGE"):
                    self.remote.download(session, next_chunk=len(plain) + 1)

                # After an edit that splits facets, too.
                more = numpy.full((2, d), 0.4)
                more[0, 0] = 1
                request = api().AddVerticesRequest(name=session, points=more.ravel())
                added = self.remote.queries.AddVertices(request, timeout=PATIENCE).vertices
                self.remote.refine(session)
                metadata, chunks = self.remote.download(session, with_boundary=True)
                mesh = Mesh(metadata, chunks)
                self.assert_tiled(metadata, mesh)
                self.assertEqual(list(mesh.vertex_tags[added]), [2, 0])
                self.remote.delete(session)

                metadata, chunks = self.remote.mesh(unit_box(d), points, with_boundary=True)
                self.assert_tiled(metadata, Mesh(metadata, chunks))

    def test_all_in_one_call(self):
        points = uniform(300, 2, seed=3)
        metadata, chunks = self.remote.mesh(unit_box(2), points)
        mesh = Mesh(metadata, chunks)
        numpy.testing.assert_array_equal(mesh.points[:300], points)
        self.assertAlmostEqual(mesh.volume(), 1, places=12)
        self.assertEqual(list(self.remote.info().dimensions), [2, 3, 4, 5, 6])


if __name__ == "__main__":
    unittest.main()
