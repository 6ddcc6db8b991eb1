"""Complaints about other meshers and remote meshing services, point by point, against the real server.

docs/acceptance.md has the list, and the tests that go deeper into each point.
"""
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import unittest

import grpc
import numpy

from remote import Fails, Mesh, Remote, cloud, content, pieces, place_of, smallest_dihedral_angle, uniform, unit_box
from wellspaced import BIN, PATIENCE, ROOT, Wellspaced, api

SANITIZED = bool(os.environ["WELLSPACE_SANITIZE"])
SOON = 10  # seconds, for answers that come within milliseconds where nothing else runs


class Acceptance(unittest.TestCase):
    """One server, and one session with a mesh of some 12 MiB, whose events are kept with their times."""

    @classmethod
    def setUpClass(cls):
        cls.server = Wellspaced("--workers", 2, "--max-threads", 4, "--stall-limit", 3)
        cls.remote = Remote(cls.server.address)
        cls.points = uniform(2000, 2, seed=1)
        cls.session = cls.remote.create(unit_box(2, max_circumradius=0.0013)).name
        cls.remote.upload(cls.session, cls.points)
        operation = cls.remote.start(cls.session)
        cls.events = []
        for response in cls.remote.responses(operation.name):
            cls.events.append((time.monotonic(), response.progress))
            cls.operation = response.operation
        cls.events.pop()
        assert cls.operation.state == api().Operation.STATE_SUCCEEDED, cls.operation

    @classmethod
    def tearDownClass(cls):
        cls.remote.close()
        assert cls.server.stop() == 0

    def start_server(self, *arguments):
        server = Wellspaced(*arguments)
        self.addCleanup(server.kill)
        return server, self.connect(server)

    def connect(self, server, credentials=None):
        remote = Remote(server.address, credentials)
        self.addCleanup(remote.close)
        return remote

    def folder(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        return pathlib.Path(folder.name)

    def until(self, condition):
        """Asks until it is so."""
        end = time.monotonic() + PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), end)

    def test_no_limit_of_4_mib(self):
        request = api().DownloadMeshRequest(name=self.session)
        sizes = [response.ByteSize() for response in self.remote.sessions.DownloadMesh(request, timeout=PATIENCE)]
        self.assertGreater(sum(sizes), 8 << 20)
        self.assertLessEqual(max(sizes), 1 << 20)
        request = api().VoronoiCellsRequest(name=self.session, vertices=range(100_000))
        sizes = [response.ByteSize() for response in self.remote.queries.VoronoiCells(request, timeout=PATIENCE)]
        self.assertGreater(sum(sizes), 8 << 20)
        self.assertLessEqual(max(sizes), 1 << 20)

        # Up, too: a cloud of 8 MB; in one message it is above the limit, which the server tells.
        points = uniform(500_000, 2, seed=2)
        name = self.remote.create(unit_box(2)).name
        self.assertLess(self.remote.info().max_request_bytes, points.nbytes)
        with Fails(self, grpc.StatusCode.RESOURCE_EXHAUSTED):
            self.remote.upload(name, points, rows=len(points))
        self.assertEqual(self.remote.upload(name, points).committed_points, len(points))
        self.remote.delete(name)

    def test_no_timeout_ends_what_makes_progress(self):
        limit = self.remote.info().stall_limit.seconds
        # A client that reads slowly for longer than the limit of a stalled one gets everything.
        begin, chunks = time.monotonic(), 0
        for _ in self.remote.sessions.DownloadMesh(api().DownloadMeshRequest(name=self.session)):
            chunks += 1
            time.sleep(1.1 * limit / 10)
        self.assertGreater(chunks, 10)
        self.assertGreater(time.monotonic() - begin, limit)
        # The deadline of a call that watches is that of the watch, not of the work.
        name = self.remote.create(unit_box(2, max_circumradius=0.0018)).name
        operation = self.remote.start(name)
        with Fails(self, grpc.StatusCode.DEADLINE_EXCEEDED):
            list(self.remote.responses(operation.name, timeout=0.2))
        ended, _ = self.remote.watch(operation.name)
        self.assertEqual(ended.state, api().Operation.STATE_SUCCEEDED)
        self.remote.delete(name)

    def test_progress_comes_and_does_not_jump(self):
        times = numpy.array([at for at, _ in self.events])
        events = [event for _, event in self.events]
        for figure in ("sequence", "vertices", "simplices", "fraction"):
            figures = [getattr(event, figure) for event in events]
            self.assertEqual(figures, sorted(figures), figure)
        places = [place_of(event.phase) for event in events]
        self.assertEqual(places, sorted(places))
        self.assertIn(api().PHASE_REFINEMENT, {event.phase for event in events})
        self.assertLessEqual(len(events), 10 * (times[-1] - times[0]) + 5)
        self.assertLess(numpy.diff(times).max(), 2 + SOON)
        self.assertLess(numpy.diff([event.fraction for event in events]).max(), 0.5)
        last = events[-1]
        self.assertEqual((last.phase, last.fraction), (api().PHASE_DONE, 1))
        vertices = self.remote.get(self.session).vertex_count
        self.assertEqual(last.vertices, vertices)
        estimates = [event.estimated_vertices for event in events if event.estimated_vertices > 0]
        self.assertLess(abs(numpy.log(estimates[0] / vertices)), numpy.log(1.5))

    def test_a_cancel_is_obeyed_in_every_phase(self):
        points = uniform(2_500_000, 2, seed=3)  # tree and simplices take longer than the time between two events
        name = self.remote.create(unit_box(2)).name
        self.remote.upload(name, points)
        for phase in (api().PHASE_TREE, api().PHASE_REFINEMENT, api().PHASE_SIMPLICES):
            with self.subTest(phase=api().Phase.Name(phase)):
                operation = self.remote.start(name).name
                watched = self.remote.responses(operation)
                reached = next(event.progress.phase for event in watched 
                               if place_of(event.progress.phase) >= place_of(phase))
                self.assertEqual(reached, phase)
                begin = time.monotonic()
                self.remote.cancel(operation)
                *_, last = watched
                self.assertLess(time.monotonic() - begin, SOON)
                self.assertEqual(last.operation.state, api().Operation.STATE_CANCELLED)
                self.assertEqual(last.operation.progress.phase, phase)
                session = self.remote.get(name)
                self.assertEqual((session.state, session.committed_points), (api().Session.STATE_OPEN, len(points)))

        # In the queue, while all workers have something to do.
        others = [self.remote.create(unit_box(2, max_circumradius=1e-4)).name for _ in range(2)]
        running = [self.remote.start(other).name for other in others]
        waiting = self.remote.start(name).name
        self.remote.cancel(waiting)
        self.assertEqual(self.remote.watch(waiting)[0].state, api().Operation.STATE_CANCELLED)
        for operation in running:
            self.remote.cancel(operation)
            self.assertEqual(self.remote.watch(operation)[0].state, api().Operation.STATE_CANCELLED)
        for one in (name, *others):
            self.remote.delete(one)

        # While points arrive and while the mesh is sent.
        meshing = self.remote.meshing.MeshPoints(iter(cloud(api().MeshPointsRequest, unit_box(2), points[:50_000])))
        next(response for response in meshing if response.WhichOneof("response") == "chunk")
        meshing.cancel()
        self.until(lambda: self.remote.info().running_jobs == 0)

    def test_refinement_ends_and_stays_within_its_memory(self):
        with Fails(self, grpc.StatusCode.INVALID_ARGUMENT, "INVALID_PARAMETERS") as error:
            self.remote.create(unit_box(2, rho=0.5))  # for which it might not end
        self.assertEqual(error.field, "parameters.rho")

        limit = 128 << 20
        server, remote = self.start_server("--max-memory", limit)
        name = remote.create(unit_box(3)).name
        remote.upload(name, uniform(1000, 3, seed=4))
        tiny = unit_box(3, max_circumradius=1e-5)
        operation, _ = remote.refine(name, tiny)  # predicted
        self.assertEqual(operation.error.code, grpc.StatusCode.RESOURCE_EXHAUSTED.value[0])
        self.assertRegex(operation.error.message, r"\d+ [KMG]iB|\d+ bytes|\d+ MB")
        self.assertEqual(remote.refine(name, unit_box(3))[0].state, api().Operation.STATE_SUCCEEDED)
        before = content(remote.download(name)[1])
        operation, _ = remote.refine(name, tiny)  # not predicted: it grows until it is stopped
        self.assertEqual(operation.error.code, grpc.StatusCode.RESOURCE_EXHAUSTED.value[0])
        session = remote.get(name)
        self.assertEqual((session.state, session.committed_points), (api().Session.STATE_READY, 1000))
        self.assertEqual(content(remote.download(name)[1]), before)
        operation, _ = remote.refine(name, unit_box(3, max_circumradius=1e-5, max_vertices=5000))
        self.assertEqual(operation.error.code, grpc.StatusCode.RESOURCE_EXHAUSTED.value[0])
        self.assertIn("5000", operation.error.message)
        status = pathlib.Path(f"/proc/{server.process.pid}/status").read_text()
        if not SANITIZED:  # sanitizers keep freed memory
            self.assertLess(int(re.search(r"VmHWM:\s+(\d+) kB", status)[1]) * 1024, limit)

    def test_the_same_mesh_from_run_to_run_and_for_any_number_of_threads(self):
        points = uniform(3000, 3, seed=5)
        _, other = self.start_server("--max-threads", 4)
        runs = [remote.mesh(unit_box(3, threads=threads), points) for remote, threads in
                ((self.remote, 1), (self.remote, 1), (self.remote, 3), (other, 4))]
        first, *others = (content(chunks) for _, chunks in runs)
        for chunks in others:
            self.assertEqual(chunks, first)

    def test_no_slivers(self):
        points = numpy.loadtxt(ROOT / "examples" / "spot.csv", delimiter=",", skiprows=1)
        angles = {}
        for demanded in (None, 0, 15):  # None: the default, for a client that asks for nothing
            parameters = api().MeshParameters(dimension=3, min_dihedral=demanded)
            metadata, chunks = self.remote.mesh(parameters, points)
            mesh = Mesh(metadata, chunks)
            angles[demanded] = smallest_dihedral_angle(mesh)
            self.assertAlmostEqual(angles[demanded], metadata.statistics.min_angle_deg, places=6)
            self.assertEqual(metadata.statistics.slivers.left, 0)
            numpy.testing.assert_array_equal(mesh.points[mesh.input_vertices], points)
        self.assertLess(angles[0], 2, "there would be some")
        self.assertGreaterEqual(angles[None], 12)
        self.assertGreaterEqual(angles[15], 15)

    def test_no_crash_of_three_points_duplicates_or_90000_points(self):
        grid = numpy.stack(numpy.meshgrid(*[numpy.arange(300) / 300 + 1 / 600] * 2), axis=-1).reshape(-1, 2)
        clouds = {
            "none": numpy.zeros((0, 2)),
            "one": numpy.full((1, 2), 0.5),
            "three in 2-D": uniform(3, 2, seed=6),
            "three in 3-D": uniform(3, 3, seed=6),
            "three on a line": numpy.array([[0.25, 0.25], [0.5, 0.5], [0.75, 0.75]]),
            "10 000 times the same": numpy.full((10_000, 3), 0.5),
            "each twice": numpy.repeat(uniform(500, 3, seed=7), 2, axis=0),
            "90 000 of a grid": grid,
            "a plane in 3-D": numpy.concatenate([grid[::45], numpy.full((2000, 1), 0.5)], axis=1),
        }
        # Another client's work goes on, in the same server.
        theirs = self.remote.create(unit_box(2, max_circumradius=1e-4)).name
        operation = self.remote.start(theirs).name
        for name, points in clouds.items():
            with self.subTest(name):
                d = points.shape[1]
                mesh = Mesh(*self.remote.mesh(unit_box(d), points))
                self.assertAlmostEqual(mesh.volume(), 1, places=10)
                numpy.testing.assert_array_equal(mesh.points[mesh.input_vertices], points)
        for bad in (numpy.nan, numpy.inf, 1e300, -1):
            with Fails(self, grpc.StatusCode.INVALID_ARGUMENT, "INVALID_POINTS") as error:
                self.remote.mesh(unit_box(2), numpy.array([[0.5, 0.5], [0.5, bad]]))
            self.assertIn("points[1]", error.message)
        self.assertTrue(self.server.is_running())
        self.remote.cancel(operation)
        self.assertEqual(self.remote.watch(operation)[0].state, api().Operation.STATE_CANCELLED)
        self.remote.delete(theirs)

    def test_clients_that_died_leave_nothing_behind(self):
        _, remote = self.start_server()
        environment = os.environ | {"WELLSPACE_SERVER": remote.address}
        # A client that is killed while its session is refined: the work may end, then the lease runs out.
        name = remote.create(unit_box(2, max_circumradius=0.003), ttl={"seconds": 1}).name
        with subprocess.Popen([BIN / "wellspace", "refine", name], env=environment,
                              stderr=subprocess.DEVNULL) as client:
            self.until(lambda: remote.list().sessions[0].state != api().Session.STATE_OPEN)
            client.kill()
        self.until(lambda: not remote.list().sessions)
        with Fails(self, grpc.StatusCode.NOT_FOUND, "SESSION_NOT_FOUND"):
            remote.get(name)
        # One that is killed while its own call works: the worker is free again.
        command = [BIN / "wellspace", "mesh", "-", "--dimension", "2", "--domain", "0,0,1,1", "--size", "1e-4", "-o",
                   "-"]
        with subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL) as client:
            client.stdin.close()
            self.until(lambda: remote.info().running_jobs == 1)
            client.send_signal(signal.SIGKILL)
        self.until(lambda: remote.info().running_jobs == 0)

    def test_everything_has_a_type(self):
        of_google = ("google.protobuf.Timestamp", "google.protobuf.Duration", "google.protobuf.FieldMask",
                     "google.rpc.Status")
        services = [stub.removesuffix("Stub") for stub in vars(api()) if re.fullmatch(r"\w+ServiceStub", stub)]
        self.assertEqual(len(services), 5)
        seen = set()

        def look_at(message):
            if message.full_name in seen or message.full_name in of_google:
                return
            seen.add(message.full_name)
            self.assertTrue(message.full_name.startswith("wellspace.v1."), message.full_name)
            for field in message.fields:
                self.assertNotEqual(field.type, field.TYPE_BYTES, field.full_name)
                if field.message_type is not None:
                    look_at(field.message_type)

        pool = api().Session.DESCRIPTOR.file.pool
        for service in services:
            for method in pool.FindServiceByName("wellspace.v1." + service).methods:
                look_at(method.input_type)
                look_at(method.output_type)
        self.assertGreater(len(seen), 50)
        # A message of no such type is refused, and not taken for something else.
        call = self.remote.channel.stream_stream("/wellspace.v1.MeshingService/MeshPoints")
        with Fails(self, grpc.StatusCode.INVALID_ARGUMENT, "MALFORMED_REQUEST"):
            list(call(iter([b'{"parameters": {"dimension": 3}}']), timeout=PATIENCE))

    def test_wrong_credentials_are_told_at_once(self):
        tokens = self.folder() / "tokens"
        lines = [subprocess.run([BIN / "wellspaced", "hash-token", tenant],
                                input=f"a-token-of-{tenant}-with-32-characters",
                                capture_output=True, text=True, check=True).stdout for tenant in ("ann", "bob")]
        tokens.write_text("".join(lines))
        _, remote = self.start_server("--token-file", tokens)

        def metadata(secret):
            return [("authorization", "Bearer " + secret)] if secret else []

        def endless():
            yield from pieces("sessions/x", uniform(10, 2, seed=8), 0, 10)
            while True:
                yield api().UploadPointsRequest()

        for secret in (None, "not-a-token-that-the-server-knows"):
            calls = {
                "one message": lambda: remote.sessions.ListSessions(api().ListSessionsRequest(),
                                                                    metadata=metadata(secret)),
                "up": lambda: remote.sessions.UploadPoints(endless(), metadata=metadata(secret)),
                "down": lambda: list(remote.sessions.DownloadMesh(api().DownloadMeshRequest(),
                                                                  metadata=metadata(secret))),
            }
            for name, call in calls.items():
                with self.subTest(name, secret=secret):
                    begin = time.monotonic()
                    with Fails(self, grpc.StatusCode.UNAUTHENTICATED, "UNAUTHENTICATED"):
                        call()  # without a deadline
                    self.assertLess(time.monotonic() - begin, SOON)
        # A user with a token sees his own sessions, and only those.
        ann, bob = (metadata(f"a-token-of-{tenant}-with-32-characters") for tenant in ("ann", "bob"))
        request = api().CreateSessionRequest(parameters=unit_box(2))
        session = remote.sessions.CreateSession(request, metadata=ann).session
        self.assertEqual(remote.sessions.GetSession(api().GetSessionRequest(name=session.name),
                                                    metadata=ann).session.name, session.name)
        with Fails(self, grpc.StatusCode.NOT_FOUND, "SESSION_NOT_FOUND"):
            remote.sessions.GetSession(api().GetSessionRequest(name=session.name), metadata=bob)

    def test_transport_security_is_part_of_it(self):
        folder = self.folder()
        subprocess.run(["openssl", "req", "-x509", "-days", "2", "-subj", "/CN=localhost", "-addext",
                        "subjectAltName=IP:127.0.0.1,DNS:localhost", "-newkey", "ec", "-pkeyopt",
                        "ec_paramgen_curve:P-256", "-nodes",
                        "-keyout", folder / "key.pem", "-out", folder / "cert.pem"], capture_output=True, check=True)
        # No plain-text port is opened to other machines by mistake.
        refused = subprocess.run([BIN / "wellspaced", "--listen", "0.0.0.0:0"], capture_output=True, text=True,
                                 timeout=PATIENCE, check=False)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("--tls-cert", refused.stderr)
        server, plain = self.start_server("--tls-cert", folder / "cert.pem", "--tls-key", folder / "key.pem")
        trusting = self.connect(server, grpc.ssl_channel_credentials((folder / "cert.pem").read_bytes()))
        mesh = Mesh(*trusting.mesh(unit_box(2), uniform(100, 2, seed=9)))
        self.assertAlmostEqual(mesh.volume(), 1, places=12)
        for other in (plain, self.connect(server, grpc.ssl_channel_credentials())):
            begin = time.monotonic()
            with Fails(self, grpc.StatusCode.UNAVAILABLE):
                other.info()
            self.assertLess(time.monotonic() - begin, SOON)

    def test_every_point_is_in_the_documentation(self):
        page = (ROOT / "docs" / "acceptance.md").read_text()
        named = set(re.findall(r"`acceptance_test\.py`: `(\w+)`", page))
        tests = {name for name in vars(Acceptance) if name.startswith("test_")} - {self._testMethodName}
        self.assertEqual(named, tests)


if __name__ == "__main__":
    unittest.main()
