"""The life of a session: uploads, refinements, additions, queries and downloads."""

import datetime
import math
import unittest

import numpy as np
from support import Case, uniform, unit_box, volume

import wellspace
from wellspace import (
    ConflictError,
    InvalidArgumentError,
    LimitError,
    NotFoundError,
    OutOfRangeError,
    WrongStateError,
)


def shortest_edge(mesh):
    edges = mesh.points[mesh.simplices] - mesh.points[np.roll(mesh.simplices, 1, axis=1)]
    return np.sqrt((edges**2).sum(axis=2).min())


class SessionTest(Case):
    def test_from_points_to_a_finer_mesh(self):
        points, more = uniform(2000, 2), uniform(20, 2, seed=2)
        with wellspace.Session(2, box=unit_box(2), labels={"test": "life"}) as session:
            self.assertRegex(session.name, "^sessions/[^/]+$")
            self.assertEqual(session.info().state, "open")
            self.assertEqual(session.upload(points[:500]), 500)
            self.assertEqual(session.upload(points[500:]), 2000)
            operation = session.refine()
            self.assertEqual((operation.state, operation.error), ("succeeded", None))
            mesh = session.download()
            self.assertEqual(mesh.revision, operation.mesh_revision)
            one = wellspace.mesh(points, box=unit_box(2))
            np.testing.assert_array_equal(mesh.simplices, one.simplices)

            near = mesh.simplices[:20, 0]
            vertices = session.add(more, near=near)
            self.assertEqual(sorted(vertices), list(range(len(mesh.points), len(mesh.points) + 20)))
            self.assertEqual(session.info().state, "open")
            session.refine(size=0.01)
            finer = session.download()
            np.testing.assert_array_equal(finer.points[vertices], more)
            np.testing.assert_array_equal(finer.points[: len(mesh.points)], mesh.points)
            self.assertGreater(len(finer.points), 1.2 * len(mesh.points))
            self.assertAlmostEqual(volume(finer) / 2, 1)
            self.assertEqual([one.state for one in session.operations()], ["succeeded"] * 2)
            with self.fails(WrongStateError, "", reason="REVISION_MISMATCH"):
                session.download(revision=mesh.revision)
        with self.fails(NotFoundError, "", reason="SESSION_NOT_FOUND"):
            session.info()

    def test_points_are_removed_by_the_numbers_of_their_vertices(self):
        points, more = uniform(300, 2), uniform(30, 2, seed=2)
        with wellspace.Session(2, box=unit_box(2)) as session:
            session.upload(points)
            session.refine()
            vertices = session.add(more)
            session.refine()
            mesh = session.download()
            self.assertEqual(session.remove(mesh.vertex_origins[vertices[:20]]), 310)
            self.assertEqual(session.info().state, "open")
            session.refine()
            left = session.download()
            self.assertEqual(left.points[:310].tolist(), np.concatenate([points, more[20:]]).tolist())
            with self.fails(InvalidArgumentError, "points has 310, and no", reason="INVALID_POINTS", field="points"):
                session.remove([310])
            with self.fails(InvalidArgumentError, "points: an array of float64", field="points"):
                session.remove([0.5])
            self.assertEqual(session.remove([]), 310)

    def test_parameters_stay_unless_they_are_named(self):
        with wellspace.Session(2, box=unit_box(2), rho=2) as session:
            session.upload(uniform(200, 2))
            session.refine(size=0.05, size_boxes=[([0, 0], [0.1, 0.1], 0.01)])
            parameters = session.info().parameters
            self.assertEqual((parameters["rho"], parameters["size"]), (2, 0.05))
            self.assertEqual(parameters["size_boxes"], [((0, 0), (0.1, 0.1), 0.01)])
            session.refine(rho=1.5)
            parameters = session.info().parameters
            self.assertEqual((parameters["rho"], parameters["size"]), (1.5, 0.05))
            self.assertEqual(parameters["box"], ((0, 0), (1, 1)))
            session.refine(size=math.inf, size_boxes=[])
            self.assertNotIn("size", session.info().parameters)
            self.assertNotIn("size_boxes", session.info().parameters)

    def test_moved_vertices(self):
        with wellspace.Session(3, box=unit_box(3)) as session:
            session.upload(uniform(500, 3))
            session.refine()
            before = session.download()
            self.assertEqual(len(before.moved_vertices), 0)
            session.add(uniform(50, 3, seed=2))
            session.refine()
            after = session.download()
            moved = (after.points[: len(before.points)] != before.points).any(axis=1)
            np.testing.assert_array_equal(np.flatnonzero(moved), after.moved_vertices)
            session.add(uniform(50, 3, seed=3))
            session.refine(keep_vertices=True)
            kept = session.download()
            np.testing.assert_array_equal(kept.points[: len(after.points)], after.points)

    def test_queries(self):
        with wellspace.Session(2, box=unit_box(2)) as session:
            session.upload(uniform(300, 2))
            session.refine()
            mesh = session.download()
            nearest = session.nearest()
            self.assertEqual(nearest.shape, (len(mesh.points),))
            self.assertEqual(nearest.min(), shortest_edge(mesh))
            np.testing.assert_array_equal(session.nearest([5, 0, 5]), nearest[[5, 0, 5]])
            self.assertEqual(len(session.nearest([])), 0)

            cells = session.cells()
            self.assertEqual(len(cells), len(mesh.points))
            area = 0
            for cell in cells:
                x, y = cell.nodes.T
                area += (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
            self.assertAlmostEqual(area, 1)
            self.assertFalse(cells.is_clipped.any() or np.isfinite(cells.clip_radii).any())
            pairs = np.vstack([mesh.simplices[:, [0, 1]], mesh.simplices[:, [1, 2]], mesh.simplices[:, [2, 0]]])
            edges = set(map(tuple, np.sort(pairs, axis=1).tolist()))
            found = {tuple(sorted((cell.vertex, int(other)))) for cell in cells for other in cell.neighbours}
            self.assertLessEqual(found, edges)

            clipped = session.cells([7, 3], beta=1.5)
            self.assertEqual(list(clipped.vertices), [7, 3])
            np.testing.assert_array_equal(clipped.clip_radii, 1.5 * nearest[[7, 3]])
            self.assertEqual([cell.vertex for cell in clipped], [7, 3])
            self.assertEqual(clipped[-1].vertex, 3)
            with self.assertRaises(IndexError):
                clipped[2]
            self.assertEqual(len(session.cells([])), 0)
            with self.fails(OutOfRangeError, "", reason="VERTEX_OUT_OF_RANGE", field="vertices[1]"):
                session.cells([0, len(mesh.points)])
            with self.fails(InvalidArgumentError, "", field="beta"):
                session.cells([0], beta=0.5)

    def test_more_vertices_than_fit_into_a_request(self):
        with wellspace.Session(2, box=unit_box(2), size=0.0025) as session:
            session.refine()
            count = session.info().vertex_count
            wanted = np.tile(np.arange(count), 2)[: (1 << 17) + 1000]
            self.assertGreater(len(wanted), 1 << 17)
            np.testing.assert_array_equal(session.nearest(wanted), session.nearest()[wanted])
            self.assertEqual(len(session.cells(wanted, beta=1)), len(wanted))

    def test_repeated_uploads(self):
        points = uniform(300, 2)
        with wellspace.Session(2) as session:
            session.upload(points)
            self.assertEqual(session.upload(points, offset=0), 300, "a repetition")
            self.assertEqual(session.upload(np.vstack([points, points[:5]]), offset=0), 305, "goes on")
            self.assertEqual(session.upload(points[:100], offset=0), 305, "a part of what is there")
            with self.fails(WrongStateError, "", reason="UPLOAD_MISMATCH"):
                session.upload(points[::-1], offset=0)
            with self.fails(OutOfRangeError, "", reason="UPLOAD_GAP"):
                session.upload(points, offset=306)
            with self.fails(InvalidArgumentError, "3 coordinates; expected 2"):
                session.upload(uniform(3, 3))
            with self.fails(ConflictError, "", reason="REVISION_MISMATCH"):
                session.upload(points, expected_revision=1)

    def test_progress_of_everything(self):
        with wellspace.Session(2) as session:
            events = []
            session.upload(uniform(100_000, 2), progress=events.append)
            session.refine(progress=events.append)
            session.download(progress=events.append)
            phases = [event.phase for event in events]
            for phase in ("upload", "done", "download"):
                self.assertEqual(max(event.fraction for event in events if event.phase == phase), 1)
            self.assertEqual((phases[0], phases[-1]), ("upload", "download"))

    def test_operations(self):
        with wellspace.Session(2) as session:
            with self.fails(NotFoundError, "no operation"):
                session.watch()
            session.upload(uniform(100, 2))
            started = session.start_refinement()
            self.assertIn(started.state, ("queued", "running", "succeeded"))
            ended = session.watch()
            self.assertEqual((ended.name, ended.state), (started.name, "succeeded"))
            self.assertEqual(session.cancel_operation().state, "succeeded", "it has ended already")
            with self.fails(LimitError, "", reason="DEMANDS_TOO_FINE", code="RESOURCE_EXHAUSTED"):
                session.refine(max_vertices=200, size=0.01)
            self.assertEqual(session.operations()[-1].error.reason, "DEMANDS_TOO_FINE")
            with self.fails(InvalidArgumentError, "(argument box)"):
                session.refine(box=unit_box(2))

    def test_what_a_session_says(self):
        with wellspace.Session(2, labels={"a": "b"}, ttl=90.5) as session:
            info = session.info()
            self.assertEqual((info.name, info.dimension, info.labels, info.ttl), (session.name, 2, {"a": "b"}, 90.5))
            self.assertEqual(info.expire_time - info.create_time > datetime.timedelta(seconds=90), True)
            self.assertEqual(session.update(labels={"c": "d"}).labels, {"c": "d"})
            self.assertEqual(session.update(ttl=60).ttl, 60)
            self.assertEqual(session.info().labels, {"c": "d"})
            with self.fails(InvalidArgumentError, "", argument="ttl"):
                wellspace.Session(2, ttl=-1)

    def test_lists(self):
        label = {"list": "sessions"}
        sessions = [wellspace.Session(2, labels={**label, "number": str(n)}) for n in range(3)]
        client = sessions[0].client
        self.assertEqual([one.name for one in client.sessions(label)], [one.name for one in sessions])
        self.assertEqual([one.name for one in client.sessions({**label, "number": "1"})], [sessions[1].name])
        again = wellspace.Session.attach(sessions[2].name)
        self.assertEqual((again.dimension, again.info().labels["number"]), (2, "2"))
        for session in sessions:
            session.delete()
        self.assertEqual(client.sessions(label), [])

    def test_the_block_deletes_whatever_happens(self):
        with self.assertRaisesRegex(RuntimeError, "of the test"), wellspace.Session(2) as session:
            raise RuntimeError("of the test")
        with self.fails(NotFoundError):
            session.info()
        with wellspace.Session(2) as session:
            session.delete()

    def test_a_closed_session_stays_on_the_server(self):
        with wellspace.Session(2) as session:
            self.assertNotIn("closed", repr(session))
            session.upload(uniform(10, 2))
            session.close()
            session.close()
            self.assertEqual(repr(session), f"<wellspace.Session: {session.name} in 2-D at "
                                            f"{session.client.address}, closed>")
            for call in (session.info, session.refine, session.delete, lambda: session.upload(uniform(3, 2))):
                with self.fails(WrongStateError, "this Session was closed; Session.attach('sessions/"):
                    call()
        with wellspace.Session.attach(session.name) as again:
            self.assertEqual(again.info().point_count, 10)
        with self.fails(NotFoundError):
            again.info()

    def test_added_points_that_are_wrong(self):
        with wellspace.Session(2, box=unit_box(2)) as session:
            with self.fails(WrongStateError, "", reason="MESH_NOT_READY"):
                session.add([[0.5, 0.5]])
            session.upload(uniform(10, 2))
            session.refine()
            with self.fails(InvalidArgumentError, "", reason="INVALID_POINTS"):
                session.add([[0.5, 0.5], [2, 2]])
            with self.fails(InvalidArgumentError, "1 vertices for 2 points", field="near"):
                session.add([[0.5, 0.5], [0.6, 0.6]], near=[0])
            self.assertEqual(len(session.add(np.empty((0, 2)))), 0)


class ZeroTest(Case):
    """A 0 does not stand for a number that is not given."""

    def test_parameters(self):
        for name in ("rho", "size", "edge_length", "gradation", "max_vertices", "threads"):
            field = "parameters." + ("max_circumradius" if name == "size" else name)
            with self.subTest(name), self.fails(InvalidArgumentError, "0 is not allowed; expected", field=field):
                wellspace.mesh(uniform(10, 2), **{name: 0})
        self.assertEqual(len(wellspace.mesh(uniform(10, 2), margin=0, merge_distance=0).points[0]), 2)
        same = wellspace.mesh(uniform(10, 2), size=math.inf, edge_length=math.inf)
        np.testing.assert_array_equal(same.points, wellspace.mesh(uniform(10, 2)).points)

    def test_revisions(self):
        loose = wellspace.mesh(uniform(10, 2))  # of no session: its revision is 0
        with wellspace.Session(2, box=unit_box(2)) as session:
            session.upload(uniform(10, 2))
            session.refine()
            mesh = session.download()
            for call in (
                lambda: session.sizes(np.ones(len(mesh.points)), mesh_revision=loose.revision),
                lambda: session.download(revision=loose.revision),
                lambda: session.locate([[0.5, 0.5]], revision=loose.revision),
                lambda: session.upload(uniform(1, 2), expected_revision=0),
                lambda: session.add([[0.5, 0.5]], expected_revision=0),
                lambda: session.remove([0], expected_revision=0),
                lambda: session.refine(expected_revision=0),
                lambda: session.update(ttl=100, expected_revision=0),
                lambda: session.delete(expected_revision=0),
                lambda: session.sizes([], expected_revision=0),
            ):
                with self.fails(InvalidArgumentError, "revision is 0; expected a revision, which is at least 1"):
                    call()
            self.assertEqual(session.info().revision, mesh.revision)

    def test_more_points_than_a_request_has(self):
        side = np.linspace(0.01, 0.99, 400)
        cloud = np.stack(np.meshgrid(side, side), -1).reshape(-1, 2)  # 160 000 points take two requests
        with wellspace.Session(2, box=unit_box(2)) as session:
            session.refine()
            before = session.info().revision
            vertices = session.add(cloud, expected_revision=before)
            self.assertEqual(len(np.unique(vertices)), len(cloud))
            self.assertEqual(session.info().revision, before + 2)
            wrong = cloud + 0.0003
            wrong[-1] = 2
            with self.fails(InvalidArgumentError, "points[159999] = (2, 2) lies outside") as told:
                session.add(wrong)
            self.assertIn("of 160000 points were added before", str(told.exception))
            wrong[-1] = wrong[0]
            again = session.add(wrong)  # those of the first request are vertices already
            self.assertEqual(len(np.unique(again)), len(cloud) - 1)
            self.assertEqual(again[-1], again[0])
            session.refine()
            mesh = session.download()
            self.assertTrue((mesh.points[vertices] == cloud).all())
            self.assertTrue((mesh.points[again] == wrong).all())
            with self.fails(ConflictError, reason="REVISION_MISMATCH"):
                session.add(cloud, expected_revision=before)


if __name__ == "__main__":
    unittest.main()
