"""Sizes at points: of one mesh, and of sessions."""

import unittest

import numpy as np
from support import Case, uniform, unit_box

import wellspace
from wellspace import ConflictError, InvalidArgumentError, WrongStateError


class SizesTest(Case):
    def test_a_mesh_keeps_to_sizes_at_points(self):
        where = uniform(40_000, 2, seed=4)
        sizes = 0.02 + 0.1 * np.abs(where[:, 0] - 0.5)
        arguments = dict(box=unit_box(2), gradation=0.2, size_points=where, size_values=sizes)
        mesh = wellspace.mesh(uniform(10, 2), **arguments)
        corners = mesh.points[mesh.simplices]
        a, b, c = (np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i, j in ((0, 1), (1, 2), (2, 0)))
        (ux, uy), (vx, vy) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
        radii = a * b * c / (2 * np.abs(ux * vy - uy * vx))
        centers = corners.mean(axis=1)
        # At the centroid, which is no farther than the radius from the circumcentre.
        bound = (sizes + 0.2 * np.linalg.norm(centers[::50, None] - where, axis=2)).min(axis=1)
        self.assertTrue((radii[::50] <= bound + 0.2 * radii[::50] + 1e-12).all())
        self.assertGreater(len(mesh.points), 400)
        shuffled = np.random.default_rng(1).permutation(len(where))
        arguments.update(size_points=where[shuffled], size_values=sizes[shuffled])
        np.testing.assert_array_equal(wellspace.mesh(uniform(10, 2), **arguments).points, mesh.points)
        self.assertGreater(wellspace.estimate(uniform(10, 2), **arguments).vertices, 250)

    def test_lengths_of_edges(self):
        mesh = wellspace.mesh(np.empty((0, 2)), box=unit_box(2), size_points=[[0.5, 0.5]], size_values=[0.02],
                              size_unit="edge", gradation=1e-6)
        edges = np.unique(np.sort(mesh.simplices[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
        lengths = np.linalg.norm(np.diff(mesh.points[edges], axis=1)[:, 0], axis=1)
        self.assertAlmostEqual(lengths.mean(), 0.02, delta=0.001)

    def test_bad_sizes_are_refused_by_their_row(self):
        def meshed(**arguments):
            return wellspace.mesh(uniform(10, 2), box=unit_box(2), **arguments)

        with self.fails(InvalidArgumentError, "size_values"):
            meshed(size_points=[[0, 0]])
        with self.fails(InvalidArgumentError, "size_points"):
            meshed(size_values=[1])
        with self.fails(InvalidArgumentError, "size_values"):
            meshed(size_points=[[0, 0]], size_values=[1, 2])
        with self.fails(InvalidArgumentError, "size_values[1]"):
            meshed(size_points=[[0, 0], [1, 1]], size_values=[1, 0])
        with self.fails(InvalidArgumentError, "size_points[0]"):
            meshed(size_points=[[0, np.nan]], size_values=[1])
        with self.fails(InvalidArgumentError, "size_unit"):
            meshed(size_points=[[0, 0]], size_values=[1], size_unit="area")
        # One outside counts from where it is.
        finer = meshed(size_points=[[1.1, 0.5]], size_values=[1e-3])
        self.assertGreater(len(finer.points), len(meshed().points))

    def test_a_session_keeps_to_the_sizes_at_its_vertices(self):
        with wellspace.Session(2, box=unit_box(2), size=0.1) as session:
            session.refine()
            for _ in range(3):
                mesh = session.download()
                sizes = 0.004 + 0.2 * np.abs(mesh.points[:, 1] - 0.5)
                self.assertEqual(session.sizes(sizes, mesh_revision=mesh.revision), len(sizes))
                self.assertTrue(session.refine(restart=True).restart)
            self.assertEqual(session.info().size_count, len(sizes))
            adapted = session.download()
            expected = wellspace.mesh(np.empty((0, 2)), box=unit_box(2), size=0.1, size_points=mesh.points,
                                      size_values=sizes)
            np.testing.assert_array_equal(adapted.points, expected.points)
            with self.fails(ConflictError, "", reason="REVISION_MISMATCH"):
                session.sizes(np.ones(len(adapted.points)), mesh_revision=mesh.revision)
            self.assertEqual(session.sizes([]), 0)
            session.refine(restart=True)
            self.assertLess(len(session.download().points), len(adapted.points) / 2)

    def test_a_spot_that_moves(self):
        """After each step the mesh is as small as a fresh one."""
        spots = np.linspace(0.2, 0.8, 5)
        with wellspace.Session(2, box=unit_box(2), size=0.2) as session:
            session.upload(uniform(50, 2))
            for x in spots:
                session.sizes([0.004], [[x, 0.5]])
                session.refine(restart=True)
            moved = len(session.download().points)
        with wellspace.Session(2, box=unit_box(2), size=0.2) as fresh:
            fresh.upload(uniform(50, 2))
            fresh.sizes([0.004], [[spots[-1], 0.5]])
            fresh.refine()
            self.assertEqual(len(fresh.download().points), moved)

    def test_sizes_that_a_session_does_not_take(self):
        with wellspace.Session(2, box=unit_box(2)) as session:
            session.upload(uniform(50, 2))
            with self.fails(WrongStateError, "", reason="MESH_NOT_READY"):
                session.sizes([1, 2, 3])
            session.refine()
            with self.fails(InvalidArgumentError, "vertex_sizes.sizes", reason="INVALID_SIZES"):
                session.sizes([1, 2, 3])
            with self.fails(InvalidArgumentError, "values[2]"):
                session.sizes([1, 2, -3])
            for values, text in (
                ([1, np.nan, 1], "values[1] is nan"),
                ([1, 1, np.inf], "values[2] is inf"),
                (np.ma.masked_array([1.0, 2, 3], mask=[0, 1, 0]), "values[1] is masked"),
                ([1, 2**53 + 1, 1], "values[1] has 9007199254740993"),
            ):
                with self.subTest(text), self.fails(InvalidArgumentError, text):
                    session.sizes(values)
            self.assertEqual(session.info().size_count, 0)


if __name__ == "__main__":
    unittest.main()
