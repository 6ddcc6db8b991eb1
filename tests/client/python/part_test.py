"""Parts of meshes of sessions, for solvers on many ranks."""

import asyncio
import pathlib
import subprocess
import tempfile
from concurrent import futures

import numpy as np
from support import PATIENCE, TOOL, Break, BreakerCase, uniform, unit_box

import wellspace
import wellspace.aio
from wellspace import DamagedAnswerError, InvalidArgumentError, MeshPart, _api

NUMBERS = ("vertex_ids", "vertex_owners", "vertex_rows", "simplex_ids", "simplex_owners", "facet_ids")


class PartTest(BreakerCase):
    def refined(self, count=300, d=3, **others):
        session = wellspace.Session(d, server=self.client, box=unit_box(d), **others)
        self.addCleanup(session.__exit__, None)
        session.upload(uniform(count, d))
        session.refine()
        return session

    def check_part(self, part, whole, number):
        ids = part.vertex_ids
        np.testing.assert_array_equal(part.points, whole.points[ids])
        np.testing.assert_array_equal(part.vertex_tags, whole.vertex_tags[ids])
        np.testing.assert_array_equal(part.vertex_origins, whole.vertex_origins[ids])
        np.testing.assert_array_equal(ids[part.simplices], whole.simplices[part.simplex_ids])
        np.testing.assert_array_equal(part.regions, whole.regions[part.simplex_ids])
        np.testing.assert_array_equal(ids[part.facets], whole.facets[part.facet_ids])
        np.testing.assert_array_equal(part.facet_tags, whole.facet_tags[part.facet_ids])
        self.assertEqual(part.facet_names, whole.facet_names)
        self.assertEqual(part.revision, whole.revision)
        self.assertEqual((part.whole_vertices, part.whole_simplices, part.whole_facets),
                         (len(whole.points), len(whole.simplices), len(whole.facets)))
        self.assertEqual((part.vertex_owners == number).tolist(),
                         [True] * part.own_vertices + [False] * (len(ids) - part.own_vertices))
        self.assertEqual((part.simplex_owners == number).sum(), part.own_simplices)

    def test_parts_add_up_to_the_mesh(self):
        session = self.refined()
        whole = session.download()
        with futures.ThreadPoolExecutor(6) as ranks:
            parts = list(ranks.map(lambda r: session.download(part=r, parts=6, revision=whole.revision), range(6)))
        for number, part in enumerate(parts):
            self.assertIsInstance(part, MeshPart)
            self.check_part(part, whole, number)
        for name, end, count in (("vertex_ids", "own_vertices", len(whole.points)),
                                 ("vertex_rows", "own_vertices", len(whole.points)),
                                 ("simplex_ids", "own_simplices", len(whole.simplices)),
                                 ("facet_ids", None, len(whole.facets))):
            owned = [getattr(part, name)[: getattr(part, end) if end else None] for part in parts]
            np.testing.assert_array_equal(np.sort(np.concatenate(owned)), np.arange(count))
        rows = np.concatenate([part.vertex_rows[: part.own_vertices] for part in parts])
        np.testing.assert_array_equal(rows, np.arange(len(whole.points)))

    def test_without_the_boundary_and_without_ghosts(self):
        part = self.refined().download(part=1, parts=3, ghost_layers=0, boundary=False)
        self.assertEqual(len(part.simplices), part.own_simplices)
        self.assertEqual(len(part.facets) + len(part.facet_ids) + len(part.vertex_tags), 0)
        self.assertIn("1 of 3", repr(part))

    def test_files_are_those_of_the_tool(self):
        session = self.refined(count=50)
        with tempfile.TemporaryDirectory() as folder:
            mesh, own = (pathlib.Path(folder) / name for name in ("mesh.npz", "own.npz"))
            session.download().save(mesh)
            part = session.download(part=1, parts=4, ghost_layers=2)
            part.save(own)
            subprocess.run([TOOL, "partition", mesh, "-n", "4", "--ghost-layers", "2", "-o", "cut.npz"], cwd=folder,
                           check=True, capture_output=True, timeout=PATIENCE)
            found, expected = np.load(own), np.load(pathlib.Path(folder) / "cut_1.npz")
            self.assertEqual(set(found.files), set(expected.files))
            for name in expected.files:
                np.testing.assert_array_equal(found[name], expected[name])
            loaded = MeshPart.load(own)
            for name in ("points", "simplices", "facets", "part", "parts", "own_vertices", "own_simplices", *NUMBERS):
                np.testing.assert_array_equal(getattr(loaded, name), getattr(part, name))
            with self.fails(InvalidArgumentError, "expected a part of a mesh"):
                MeshPart.load(mesh)
            with self.fails(InvalidArgumentError, "a part is written to .npz"):
                part.save(own.with_suffix(".vtu"))

    def test_a_broken_connection_goes_on(self):
        session = self.refined()
        expected = session.download(part=0, parts=2)
        starts = []

        def on_request(name, call, message, data):
            request = _api.message("DownloadMeshRequest").FromString(data)
            if name == "DownloadMesh":
                starts.append((request.next_chunk, request.partition.parts, request.revision))
            return data

        def on_answer(name, call, message, data):
            if name == "DownloadMesh" and len(starts) < 4 and message == 3:
                raise Break
            return data

        self.breaker.on_request, self.breaker.on_answer = on_request, on_answer
        part = session.download(part=0, parts=2)
        self.assertEqual([start[0] for start in starts], [0, 2, 4, 6])
        self.assertEqual({start[1:] for start in starts[1:]}, {(2, expected.revision)})
        for name in ("points", "simplices", *NUMBERS):
            np.testing.assert_array_equal(getattr(part, name), getattr(expected, name))

    def test_what_cannot_be_is_refused(self):
        session = self.refined(count=5, d=2)
        mesh = session.download()
        for options, field in (({"part": 1}, "parts"), ({"parts": 1}, "part"), ({"part": 2, "parts": 2}, "part"),
                               ({"part": -1, "parts": 2}, "part"), ({"part": 0, "parts": 0}, "parts"),
                               ({"part": 0, "parts": 2**21}, "parts"), ({"part": 0.5, "parts": 2}, "part"),
                               ({"part": 0, "parts": 2, "ghost_layers": 17}, "ghost_layers"),
                               ({"part": 0, "parts": 2, "since": mesh}, "part")):
            with self.fails(InvalidArgumentError, field=field):
                session.download(**options)
        with self.fails(InvalidArgumentError, "each part has at least one", field="partition.parts"):
            session.download(part=0, parts=len(mesh.simplices) + 1)

    def test_a_damaged_answer_is_told(self):
        session = self.refined()
        for change, words in ((lambda m: m.ClearField("part"), "too old for parts"),
                              (lambda m: setattr(m.part, "part", 0), "not asked for"),
                              (lambda m: setattr(m.part, "own_vertex_count", 10**6), "which owns"),
                              (lambda m: setattr(m.part, "own_simplex_count", 1), "tell other owners"),
                              (lambda m: setattr(m.part, "whole_facet_count", m.facet_count), "facet_ids name")):
            def on_answer(name, call, message, data, change=change):
                answer = _api.message("DownloadMeshResponse").FromString(data)
                if name == "DownloadMesh" and answer.HasField("metadata"):
                    change(answer.metadata)
                return answer.SerializeToString()

            self.breaker.on_answer = on_answer
            with self.fails((DamagedAnswerError, wellspace.Error), words):
                session.download(part=1, parts=2)

    def test_awaited(self):
        session = self.refined(count=50)

        async def parts():
            awaited = await wellspace.aio.Session.attach(session.name, server=self.client)
            return await asyncio.gather(*(awaited.download(part=rank, parts=3) for rank in range(3)))

        self.assertEqual(sum(part.own_vertices for part in asyncio.run(parts())), len(session.download().points))


if __name__ == "__main__":
    import unittest

    unittest.main()
