"""Points located in the mesh of a session."""

import time
import unittest

import numpy as np
from support import Case, uniform, unit_box

import wellspace
from wellspace import ConflictError, InvalidArgumentError, WrongStateError


class LocateTest(Case):
    def test_linear_functions_are_carried_exactly(self):
        for dimension in (2, 3, 4):
            with wellspace.Session(dimension, box=unit_box(dimension), min_dihedral=0) as session:
                session.upload(uniform(100, dimension))
                session.refine()
                mesh = session.download()
                points = uniform(40_000, dimension, seed=9)  # several calls
                located = session.locate(points, revision=mesh.revision)
                self.assertEqual(located.revision, mesh.revision)
                np.testing.assert_array_equal(located.vertices, mesh.simplices[located.simplices])
                self.assertTrue((located.coordinates >= 0).all())
                np.testing.assert_allclose(located.coordinates.sum(axis=1), 1)
                np.testing.assert_allclose(located.interpolate(mesh.points), points, atol=1e-12)
                np.testing.assert_allclose(located.interpolate(mesh.points.sum(axis=1)), points.sum(axis=1), atol=1e-12)

    def test_vertices_and_points_outside(self):
        with wellspace.Session(2, box=unit_box(2)) as session:
            session.upload(uniform(50, 2))
            session.refine()
            mesh = session.download()
            located = session.locate(mesh.points)
            np.testing.assert_array_equal(located.coordinates.max(axis=1), 1)
            np.testing.assert_array_equal(located.interpolate(mesh.points), mesh.points)
            points = np.vstack([uniform(20_000, 2), [[2, 2]]])
            with self.fails(InvalidArgumentError, "points[20000] lies in no simplex", reason="INVALID_POINTS"):
                session.locate(points)
            located = session.locate(points, allow_outside=True)
            self.assertEqual(list(np.flatnonzero(located.simplices < 0)), [20_000])
            found = located.interpolate(np.ones(len(mesh.points)))
            self.assertTrue(np.isnan(found[-1]))
            np.testing.assert_allclose(found[:-1], 1)
            with self.fails(InvalidArgumentError, "values"):
                located.interpolate([1, 2])
            with self.fails(InvalidArgumentError, f"each of the {len(mesh.points)} vertices", field="values"):
                located.interpolate(np.ones(len(mesh.points) + 1))
            self.assertEqual(session.locate(np.empty((0, 2))).vertices.shape, (0, 3))

    def test_the_mesh_has_to_be_there(self):
        with wellspace.Session(2, box=unit_box(2)) as session:
            with self.fails(WrongStateError, "no mesh yet", reason="MESH_NOT_READY"):
                session.locate([[0.5, 0.5]])
            session.refine()
            with self.fails(ConflictError, "", reason="REVISION_MISMATCH"):
                session.locate([[0.5, 0.5]], revision=77)
            with self.fails(InvalidArgumentError, "points[1]"):
                session.locate([[0.5, 0.5], [np.nan, 0]])

    def test_a_function_goes_from_mesh_to_mesh(self):
        with wellspace.Session(2, box=unit_box(2), size=0.1) as session:
            session.refine()
            coarse = session.download()
            values = np.sin(coarse.points[:, 0])
            session.add([[0.3, 0.4]])  # the mesh is the last one until it is refined again
            fine_points = uniform(1000, 2)
            carried = session.locate(fine_points).interpolate(values)
            self.assertLess(np.abs(carried - np.sin(fine_points[:, 0])).max(), 0.01)
            # A larger mesh has a value for each vertex that is named, and they are those of other vertices.
            old = session.locate(fine_points)
            session.refine(size=0.02)
            finer = session.download()
            self.assertGreater(len(finer.points), len(coarse.points))
            with self.fails(InvalidArgumentError, f"each of the {len(coarse.points)} vertices", field="values"):
                old.interpolate(finer.points[:, 0])
            np.testing.assert_allclose(old.interpolate(coarse.points[:, 0], revision=coarse.revision),
                                       fine_points[:, 0], atol=1e-12)
            with self.fails(ConflictError, f"of the mesh of revision {finer.revision}", field="revision"):
                old.interpolate(coarse.points[:, 0], revision=finer.revision)
            with self.fails(InvalidArgumentError, "revision is 0", field="revision"):
                old.interpolate(coarse.points[:, 0], revision=0)  # as that of a mesh of no session is
            self.assertGreater(session.locate([[0.5, 0.5]]).revision, coarse.revision)

    def test_many_points_take_little_time(self):
        """The search tree is there after the first call. The bound is one that noise does not reach."""
        with wellspace.Session(3, box=unit_box(3), size=0.1) as session:
            session.refine()
            session.locate([[0.5, 0.5, 0.5]])
            points = uniform(200_000, 3)
            start = time.monotonic()
            session.locate(points)
            self.assertLess(time.monotonic() - start, 10)


if __name__ == "__main__":
    unittest.main()
