"""Downloads of the differences from a mesh: the same mesh to the bit, by a small part of the bytes."""

import asyncio
import dataclasses
import unittest

import numpy as np
from support import Break, BreakerCase, uniform, unit_box

import wellspace
import wellspace.aio
from wellspace import InvalidArgumentError, _api

ARRAYS = ("points", "simplices", "input_vertices", "facets", "facet_tags", "regions", "vertex_origins", "vertex_tags",
          "moved_vertices", "box")


class DeltaTest(BreakerCase):
    def setUp(self):
        super().setUp()
        self.random = np.random.default_rng(5)
        self.requests, self.bytes = [], 0
        self.breaker.on_request, self.breaker.on_answer = self.note_request, self.note_answer

    def note_request(self, method, call, message, data):
        if method == "DownloadMesh":
            self.requests.append(_api.message("DownloadMeshRequest").FromString(data))
        return data

    def note_answer(self, method, call, message, data):
        if method == "DownloadMesh":
            self.bytes += len(data) + 5
        return data

    def refined(self, points, d, **others):
        session = wellspace.Session(d, server=self.client, box=unit_box(d), **others)
        self.addCleanup(session.__exit__, None)
        session.upload(points)
        session.refine()
        return session

    def add(self, session, count):
        session.upload(self.random.uniform(0.05, 0.95, (count, session.dimension)))
        session.refine()

    def counted(self, call, **arguments):
        """The result of a download, its bytes, and the number of its calls."""
        self.bytes, self.requests = 0, []
        return call(**arguments), self.bytes, len(self.requests)

    def assert_same(self, mesh, other):
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(mesh, name), getattr(other, name), name)
            self.assertEqual(getattr(mesh, name).dtype, getattr(other, name).dtype, name)
        self.assertEqual(mesh.points.tobytes(), other.points.tobytes())
        for name in ("facet_names", "region_names", "revision", "statistics"):
            self.assertEqual(getattr(mesh, name), getattr(other, name), name)
        if other.weights is not None:
            self.assertEqual(mesh.weights.tobytes(), other.weights.tobytes())

    def test_ten_points_take_three_percent(self):
        for d, count in ((2, 8000), (3, 2000)):
            session = self.refined(uniform(count, d), d)
            before = session.download()
            self.assertGreater(len(before.simplices), 18_000)
            self.add(session, 10)
            whole, whole_bytes, _ = self.counted(session.download)
            mesh, delta_bytes, calls = self.counted(session.download, since=before)
            self.assertEqual(calls, 1)
            self.assert_same(mesh, whole)
            self.assertLess(delta_bytes, 0.03 * whole_bytes)
            print(f"{d}-D: {len(before.simplices)} simplices, {delta_bytes} of {whole_bytes} bytes: "
                  f"{delta_bytes / whole_bytes:.2%}")

    def test_a_chain(self):
        session = self.refined(uniform(2000, 2), 2)
        first = mesh = session.download()
        for _ in range(20):
            self.add(session, 3)
            mesh, _, calls = self.counted(session.download, since=mesh)
            self.assertEqual(calls, 1)
        whole = session.download()
        self.assert_same(mesh, whole)
        mesh, _, calls = self.counted(session.download, since=first)
        self.assertEqual(calls, 1)
        self.assert_same(mesh, whole)

    def test_a_mesh_that_has_not_changed(self):
        session = self.refined(uniform(300, 3), 3)
        mesh = session.download()
        again, sent, calls = self.counted(session.download, since=mesh)
        self.assert_same(again, mesh)
        self.assertEqual(calls, 1)
        self.assertLess(sent, 3000)

    def test_without_boundary(self):
        session = self.refined(uniform(1000, 2), 2)
        before = session.download(boundary=False)
        self.add(session, 2)
        mesh, _, calls = self.counted(session.download, since=before, boundary=False)
        self.assertEqual(calls, 1)
        self.assert_same(mesh, session.download(boundary=False))
        # A mesh without it does not become one with it by differences.
        mesh, _, calls = self.counted(session.download, since=before)
        self.assertFalse(self.requests[0].since_revision)
        self.assert_same(mesh, session.download())

    def test_regions_and_weights(self):
        session = wellspace.Session(2, server=self.client)
        self.addCleanup(session.__exit__, None)
        session.upload([[0, 0], [2, 0], [2, 1], [0, 1], [1, 0], [1, 1]])
        session.add_segments(
            segments=[[0, 4], [4, 1], [1, 2], [2, 5], [5, 3], [3, 0], [4, 5]],
            regions=[wellspace.RegionSeed(0.5, 0.5, region=3), wellspace.RegionSeed(1.5, 0.5, region=5)],
        )
        session.refine(size=0.02)
        before = session.download()
        self.assertEqual(set(before.regions), set(before.region_names))
        session.upload([[0.31, 0.47], [1.61, 0.53]])
        session.refine()
        mesh = session.download(since=before)
        self.assert_same(mesh, session.download())
        session = self.refined(uniform(300, 3), 3, pump_weights=True, min_dihedral=0)
        before = session.download()
        self.assertIsNotNone(before.weights)
        self.add(session, 2)
        mesh = session.download(since=before)
        self.assert_same(mesh, session.download())

    def test_what_is_not_kept_is_downloaded_whole(self):
        session = self.refined(uniform(1000, 2), 2)
        before = session.download()
        session.refine(restart=True, size=0.05)
        mesh, _, calls = self.counted(session.download, since=before)
        self.assertEqual([request.since_revision for request in self.requests], [before.revision, 0])
        self.assertEqual(calls, 2)
        self.assert_same(mesh, session.download())

    def test_a_mesh_that_is_not_what_it_was(self):
        session = self.refined(uniform(1000, 2), 2)
        before = session.download()
        self.add(session, 2)
        whole = session.download()
        points = before.points.copy()
        points[17] += 1
        for other in (dataclasses.replace(before, points=points), dataclasses.replace(before, points=points[:-1]),
                      dataclasses.replace(before, simplices=before.simplices[::-1]),
                      dataclasses.replace(before, simplices=before.simplices[:5]),
                      dataclasses.replace(before, revision=0)):
            self.assert_same(session.download(since=other), whole)

    def test_a_download_that_breaks_off_goes_on(self):
        session = self.refined(uniform(2000, 2), 2)
        before = session.download()
        for _ in range(3):
            self.add(session, 2)
        whole = session.download()
        self.requests = []

        def on_answer(method, call, message, data):
            # Each call brings metadata and one part: there are two parts for each of the three differences.
            if method == "DownloadMesh" and message == 2:
                raise Break
            return data

        self.breaker.on_answer = on_answer
        mesh = session.download(since=before)
        self.assert_same(mesh, whole)
        self.assertGreater(len(self.requests), 3)
        self.assertTrue(all(request.since_revision for request in self.requests))
        self.assertIn(1, [request.next_chunk for request in self.requests])

    def test_arguments(self):
        session = self.refined(uniform(100, 2), 2)
        mesh = session.download()
        with self.fails(InvalidArgumentError, "exclude each other", field="revision"):
            session.download(since=mesh, revision=mesh.revision)
        with self.fails(InvalidArgumentError, "since_revision is", reason="INVALID_REQUEST", field="since_revision"):
            session.download(since=dataclasses.replace(mesh, revision=mesh.revision + 1))

    def test_asyncio(self):
        async def run():
            async with await wellspace.aio.Session.create(2, server=self.server, box=unit_box(2)) as session:
                await session.upload(uniform(500, 2))
                await session.refine()
                before = await session.download()
                await session.upload([[0.512, 0.371]])
                await session.refine()
                self.assert_same(await session.download(since=before), await session.download())

        asyncio.run(run())


if __name__ == "__main__":
    unittest.main()
