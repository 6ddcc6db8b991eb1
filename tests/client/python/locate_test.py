"""Points located in the mesh of a session."""

import dataclasses
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

class MeshLocateTest(Case):
    def test_places_are_those_of_the_server(self):
        for dimension, count in ((2, 30_000), (3, 10_000), (4, 1_000), (5, 100)):
            with wellspace.Session(dimension, box=unit_box(dimension), min_dihedral=0) as session:
                session.upload(uniform(60 if dimension < 5 else 3, dimension))
                session.refine()
                mesh = session.download()
                points = uniform(count, dimension, seed=9)
                expected, located = session.locate(points), mesh.locate(points)
                np.testing.assert_array_equal(located.simplices, expected.simplices)
                np.testing.assert_array_equal(located.vertices, expected.vertices)
                np.testing.assert_allclose(located.coordinates, expected.coordinates, atol=1e-12)
                self.assertEqual((located.revision, located.vertex_count), (mesh.revision, len(mesh.points)))
                np.testing.assert_allclose(mesh.interpolate(points, mesh.points), points, atol=1e-12)
                np.testing.assert_array_equal(mesh.interpolate(mesh.points, mesh.points), mesh.points)

    def test_points_on_faces_are_in_a_simplex(self):
        mesh = wellspace.mesh(uniform(300, 2), box=unit_box(2))
        edges = mesh.points[mesh.simplices[:, :2]]
        located = mesh.locate(edges.mean(axis=1))
        least = located.coordinates.min(axis=1)
        self.assertLess(least.max(), 1e-9)
        np.testing.assert_allclose(located.interpolate(mesh.points), edges.mean(axis=1), atol=1e-14)

    def test_points_outside(self):
        mesh = wellspace.mesh(uniform(20, 2), box=unit_box(2))
        with self.fails(InvalidArgumentError, "points[1] lies in no simplex", field="points"):
            mesh.locate([[0.5, 0.5], [2, 2]])
        located = mesh.locate([[0.5, 0.5], [2, 2], [-1e308, 1e308]], allow_outside=True)
        np.testing.assert_array_equal(located.simplices[1:], -1)
        np.testing.assert_array_equal(located.coordinates[1:], 0)
        found = mesh.interpolate([[0.5, 0.5], [2, 2]], np.ones(len(mesh.points)), allow_outside=True)
        self.assertTrue(np.isnan(found[1]))
        self.assertAlmostEqual(found[0], 1)
        with self.fails(InvalidArgumentError, "points[1]"):
            mesh.locate([[0.5, 0.5], [np.nan, 0]])
        with self.fails(InvalidArgumentError, "points of 3 coordinates"):
            mesh.locate([[0.5, 0.5, 0.5]])
        with self.fails(InvalidArgumentError, f"each of the {len(mesh.points)} vertices", field="values"):
            mesh.interpolate([[0.5, 0.5]], [1.0])
        self.assertEqual(mesh.locate(np.empty((0, 2))).coordinates.shape, (0, 3))

    def test_coordinates_of_every_exponent(self):
        unit = wellspace.mesh(uniform(20, 3), box=unit_box(3))
        points = uniform(50, 3, seed=4)
        expected = unit.locate(points)
        for exponent in range(-1000, 1024, 88):
            scale = 2.0**exponent
            mesh = dataclasses.replace(unit, points=unit.points * scale)
            located = mesh.locate(points * scale)
            np.testing.assert_array_equal(located.simplices, expected.simplices)
            np.testing.assert_array_equal(located.coordinates, expected.coordinates)
            self.assertLess(mesh.locate([[-2.0**1023] * 3], allow_outside=True).simplices[0], 0)

    def test_a_mesh_without_simplices_has_no_place(self):
        mesh = wellspace.mesh(uniform(20, 2), box=unit_box(2))
        empty = dataclasses.replace(mesh, simplices=mesh.simplices[:0])
        self.assertEqual(empty.locate([[0.5, 0.5]], allow_outside=True).simplices.tolist(), [-1])


if __name__ == "__main__":
    unittest.main()
