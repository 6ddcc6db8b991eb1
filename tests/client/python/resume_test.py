"""Connections that break: interrupted calls are made again once, and go on where they were."""

import unittest

import numpy as np
from support import Break, BreakerCase, grpc, uniform, unit_box

import wellspace
from wellspace import DamagedAnswerError, UnavailableError, _api


class ResumeTest(BreakerCase):
    def break_answers(self, method, calls=1, at=0):
        """Breaks the first `calls` calls of the method before answer number `at`."""

        def on_answer(name, call, message, data):
            if name == method and call < calls and message == at:
                raise Break
            return data

        self.breaker.on_answer = on_answer

    def session(self, d=2, **others):
        session = wellspace.Session(d, server=self.client, box=unit_box(d), **others)
        self.addCleanup(session.__exit__, None)
        return session

    def test_unary_calls(self):
        self.break_answers("GetServerInfo", calls=2)
        self.client.info()
        self.assertEqual(self.breaker.count("GetServerInfo"), 3)

    def test_what_changes_something_is_done_once(self):
        """The answer is lost, not the request: the repetition has its request_id."""
        self.break_answers("CreateSession")
        session = self.session(labels={"once": "yes"})
        self.assertEqual([one.name for one in self.client.sessions({"once": "yes"})], [session.name])
        self.assertEqual(self.breaker.count("CreateSession"), 2)
        session.upload(uniform(100, 2))
        self.break_answers("StartRefinement")
        session.refine()
        self.assertEqual(len(session.operations()), 1)
        self.break_answers("AddVertices")
        session.add([[0.51, 0.52]])
        self.assertEqual(session.info().point_count, 101)

    def test_mesh_before_the_work_has_begun(self):
        points = uniform(100_000, 2)

        def on_request(name, call, message, data):
            if name == "MeshPoints" and call < 2 and message == 1:
                raise Break
            return data

        self.breaker.on_request = on_request
        mesh = self.client.mesh(points)
        np.testing.assert_array_equal(mesh.points[mesh.input_vertices], points)
        self.assertEqual(self.breaker.count("MeshPoints"), 3)

    def test_mesh_after_the_work_has_begun(self):
        """It is not done twice."""

        def on_answer(name, call, message, data):
            answer = _api.message("MeshPointsResponse").FromString(data)
            if answer.HasField("chunk"):
                raise Break
            return data

        self.breaker.on_answer = on_answer
        with self.fails(UnavailableError, "broken by the test"):
            self.client.mesh(uniform(1000, 2))
        self.assertEqual(self.breaker.count("MeshPoints"), 1)

    def test_download(self):
        session = self.session(size=0.0025)
        session.refine()
        whole = session.download()
        chunks = len(whole.simplices) * 12 // 2**20
        self.assertGreater(chunks, 1)
        resumed = []

        def on_request(name, call, message, data):
            if name == "DownloadMesh":
                resumed.append(_api.message("DownloadMeshRequest").FromString(data))
            return data

        def on_answer(name, call, message, data):
            # The first call brings metadata and one chunk, each further one a chunk more: nothing is sent twice.
            if name == "DownloadMesh" and message == 2:
                raise Break
            return data

        self.breaker.on_request, self.breaker.on_answer = on_request, on_answer
        again = session.download()
        for name in ("points", "simplices", "facets", "vertex_origins"):
            np.testing.assert_array_equal(getattr(again, name), getattr(whole, name))
        self.assertEqual([request.next_chunk for request in resumed], list(range(len(resumed))))
        self.assertEqual({request.revision for request in resumed[1:]}, {whole.revision})

    def test_a_break_after_the_last_chunk_costs_nothing(self):
        session = self.session()
        session.refine()
        answers = []

        def on_answer(name, call, message, data):
            if name == "DownloadMesh":
                answers.append(message)
            return data

        self.breaker.on_answer = on_answer
        whole = session.download()
        count = len(answers)

        def break_the_end(name, call, message, data):
            if name == "DownloadMesh" and message == count - 1:
                self.breaker.on_answer = lambda *others: others[-1]
                answers.append("last")
            return data

        self.breaker.on_answer = break_the_end
        np.testing.assert_array_equal(session.download().simplices, whole.simplices)

    def test_damage_is_not_repeated(self):
        session = self.session()
        session.upload(uniform(100, 2))
        session.refine()

        def on_answer(name, call, message, data):
            if name == "DownloadMesh" and message == 1:
                return data[:-1] + bytes([data[-1] ^ 1])
            return data

        self.breaker.on_answer = on_answer
        with self.fails(DamagedAnswerError, "CRC32C"):
            session.download()
        self.assertEqual(self.breaker.count("DownloadMesh"), 1)
        self.breaker.on_answer = lambda name, call, message, data: data[:-1] if name == "DownloadMesh" else data
        with self.fails(DamagedAnswerError, "no message"):
            session.download()

    def test_upload(self):
        points = uniform(300_000, 2)  # five requests
        rows = 1 << 16  # of a request
        session = self.session()
        offsets = []

        def on_request(name, call, message, data):
            if name == "UploadPoints":
                request = _api.message("UploadPointsRequest").FromString(data)
                if message == 0:
                    offsets.append((request.point_offset, request.HasField("checked_crc32c")))
                if call < 2 and message == 2:
                    self.wait_for_points(session.name, request.point_offset)
                    raise Break
            return data

        self.breaker.on_request = on_request
        self.assertEqual(session.upload(points), len(points))
        self.assertEqual(offsets[0], (0, False))
        self.assertEqual(offsets[1:], [(rows, True), (2 * rows, True)])
        session.refine()
        mesh = session.download()
        np.testing.assert_array_equal(mesh.points[mesh.input_vertices], points)

    def wait_for_points(self, name, count):
        """Until the server itself has as many: the points received stay."""
        session = wellspace.Session.attach(name, server=self.server)
        while session.info().point_count < count:
            pass

    def test_an_upload_whose_answer_is_lost(self):
        points = uniform(1000, 2)
        session = self.session()
        self.break_answers("UploadPoints")
        self.assertEqual(session.upload(points), 1000)
        self.assertEqual(session.info().point_count, 1000)

    def test_segments(self):
        points = np.array([[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]])
        session = self.session()
        session.upload(points)
        self.break_answers("AddSegments")
        session.add_segments(segments=[[0, 1], [1, 2], [2, 3], [3, 0]])
        self.assertEqual((session.info().segment_count, self.breaker.count("AddSegments")), (4, 2))

    def test_watch(self):
        session = self.session(size=0.003)
        asked = []

        def on_request(name, call, message, data):
            if name == "WatchOperation":
                request = _api.message("WatchOperationRequest").FromString(data)
                asked.append(request.after_sequence if request.HasField("after_sequence") else None)
            return data

        def on_answer(name, call, message, data):
            if name == "WatchOperation" and call < 3 and message == 1:
                raise Break
            return data

        self.breaker.on_request, self.breaker.on_answer = on_request, on_answer
        events = []
        self.assertEqual(session.refine(progress=events.append).state, "succeeded")
        sequences = [event.sequence for event in events]
        self.assertEqual(sequences, sorted(set(sequences)), "no event is told twice")
        self.assertEqual(asked[0], None)
        self.assertEqual(asked[1:], sequences[: len(asked) - 1])
        self.assertGreater(len(asked), 1)

    def test_queries(self):
        session = self.session(size=0.006)
        session.refine()
        whole = session.nearest()
        vertices = np.arange(len(whole))[::-1]
        requests = []

        def on_request(name, call, message, data):
            if name == "ClippedVoronoiCells":
                requests.append(len(_api.message("ClippedVoronoiCellsRequest").FromString(data).vertices))
            return data

        def on_answer(name, call, message, data):
            if name == "ClippedVoronoiCells" and message == 1:
                raise Break
            return data

        self.breaker.on_request, self.breaker.on_answer = on_request, on_answer
        cells = session.cells(vertices, beta=1)
        np.testing.assert_array_equal(cells.vertices, vertices)
        np.testing.assert_array_equal(cells.clip_radii, whole[::-1])
        self.assertGreater(len(requests), 1)
        self.assertEqual(requests, sorted(set(requests), reverse=True), "those that were answered are not asked again")
        with self.fails(UnavailableError):
            session.cells(beta=1)

    def test_gives_up(self):
        self.break_answers("GetServerInfo", calls=100)
        with self.fails(UnavailableError, "broken by the test"):
            self.client.info()
        self.assertEqual(self.breaker.count("GetServerInfo"), 3, "a server that never answered")
        self.client.is_serving()
        with self.fails(UnavailableError):
            self.client.info()
        self.assertEqual(self.breaker.count("GetServerInfo"), 12)

    def test_what_a_proxy_breaks_off(self):
        """gRPC has no better code for it than UNKNOWN."""

        def break_off(name, call, message, data):
            if call == 0:
                raise Break(grpc.StatusCode.UNKNOWN, "Stream removed")
            return data

        self.breaker.on_answer = break_off
        self.client.info()
        self.assertEqual(self.breaker.count("GetServerInfo"), 2)

    def test_what_is_not_worth_it(self):
        def refuse(name, call, message, data):
            raise Break(grpc.StatusCode.INTERNAL)

        self.breaker.on_answer = refuse
        with self.fails(wellspace.Error, "broken", code="INTERNAL"):
            self.client.info()
        self.assertEqual(self.breaker.count("GetServerInfo"), 1)


if __name__ == "__main__":
    unittest.main()
