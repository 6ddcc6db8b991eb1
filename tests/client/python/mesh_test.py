"""Meshes in one call: results are right, and the demands hold."""

import unittest

import numpy as np
from support import Case, spot, uniform, unit_box, volume, volumes

import wellspace
from wellspace import InvalidArgumentError, LimitError


def circumradius_over_edge(mesh):
    """Of each simplex: circumradius, shortest edge."""
    corners = mesh.points[mesh.simplices]
    edges = corners[:, 1:] - corners[:, :1]
    centres = np.linalg.solve(edges, (edges**2).sum(axis=2)[..., None] / 2)[..., 0]
    differences = corners[:, :, None] - corners[:, None]
    lengths = np.sqrt((differences**2).sum(axis=3))
    lengths[:, np.arange(lengths.shape[1]), np.arange(lengths.shape[1])] = np.inf
    return np.sqrt((centres**2).sum(axis=1)), lengths.min(axis=(1, 2))


class MeshTest(Case):
    def test_spot(self):
        points = spot()
        mesh = wellspace.mesh(points)
        np.testing.assert_array_equal(mesh.points[mesh.input_vertices].view(np.uint64), points.view(np.uint64))
        self.assertEqual((mesh.dimension, mesh.simplices.dtype, mesh.revision), (3, np.int32, 0))
        self.assertEqual(mesh.statistics.vertices, len(mesh.points))
        self.assertEqual(mesh.statistics.simplices, len(mesh.simplices))
        self.assertGreater(volumes(mesh).min(), 0)
        self.assertAlmostEqual(volume(mesh) / 6, np.prod(mesh.box[1] - mesh.box[0]), places=9)
        radii, edges = circumradius_over_edge(mesh)
        self.assertAlmostEqual((radii / edges).max(), mesh.statistics.max_radius_edge, places=9)
        self.assertLessEqual(mesh.statistics.max_radius_edge, 2)
        self.assertGreaterEqual(mesh.statistics.min_angle_deg, 12)
        self.assertEqual(mesh.statistics.slivers.left, 0)
        self.assertIsNone(mesh.statistics.domain)
        self.assertEqual(mesh.statistics.triangulation, "delaunay")
        self.assertIn(f"{len(mesh.points)} vertices", repr(mesh))

    def test_every_dimension(self):
        for d, count in ((2, 100), (3, 50), (4, 10), (5, 3), (6, 1)):
            with self.subTest(d):
                points = uniform(count, d)
                mesh = wellspace.mesh(points, box=unit_box(d))
                np.testing.assert_array_equal(mesh.points[:count], points)
                self.assertEqual(mesh.simplices.shape[1], d + 1)
                self.assertGreater(volumes(mesh).min(), 0)
                self.assertAlmostEqual(volume(mesh), np.prod(np.arange(1, d + 1)), places=9)

    def test_parameters_hold(self):
        points = uniform(200, 2)
        plain = wellspace.mesh(points, box=unit_box(2))
        small = wellspace.mesh(points, box=unit_box(2), size=0.03, size_boxes=[([0.4, 0.4], [0.6, 0.6], 0.01)])
        radii, _ = circumradius_over_edge(small)
        self.assertLessEqual(radii.max(), 0.03)
        centres = small.points[small.simplices].mean(axis=1)
        middle = (abs(centres - 0.5) <= 0.1).all(axis=1)
        self.assertLessEqual(radii[middle].max(), 0.01)
        self.assertGreater(len(small.points), 2 * len(plain.points))
        self.assertGreaterEqual(wellspace.mesh(points, min_angle=28).statistics.min_angle_deg, 28)
        spaced = wellspace.mesh(points, box=unit_box(2), criterion="well-spaced")
        self.assertGreater(len(spaced.points), 1.5 * len(plain.points))
        grown = wellspace.mesh(points, margin=1)
        sides = np.ptp(points, axis=0)
        np.testing.assert_allclose(grown.box[1] - grown.box[0], sides + 2 * sides.max())

    def test_points_are_merged(self):
        points = np.array([[0.2, 0.2], [0.8, 0.8], [0.2, 0.2], [0.2, 0.2 + 1e-9]])
        mesh = wellspace.mesh(points, merge_distance=1e-6)
        self.assertEqual(list(mesh.input_vertices), [0, 1, 0, 0])
        self.assertEqual((mesh.statistics.duplicates, mesh.statistics.merged_points), (1, 1))
        self.assertEqual(list(mesh.vertex_origins[:2]), [0, 1])

    def test_weights(self):
        points = uniform(400, 3)
        self.assertIsNone(wellspace.mesh(points).weights)
        mesh = wellspace.mesh(points, pump_weights=True, min_dihedral=0)
        self.assertEqual((mesh.weights.shape, mesh.statistics.triangulation), ((len(mesh.points),), "regular"))
        self.assertGreater(mesh.weights.max(), 0)
        self.assertEqual(mesh.statistics.slivers.weighted_vertices, np.count_nonzero(mesh.weights))

    def test_boundary(self):
        for d in (2, 3):
            mesh = wellspace.mesh(uniform(300, d), box=unit_box(d))
            names = ["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"][:2 * d]
            self.assertEqual(mesh.facet_names, dict(enumerate(names, 1)))
            for face, name in enumerate(names):
                corners = mesh.points[mesh.boundary(name)]
                self.assertTrue((corners[:, :, face // 2] == face % 2).all())
                np.testing.assert_array_equal(mesh.boundary_vertices(name), np.unique(mesh.boundary(name)))
            self.assertEqual(len(mesh.boundary()), len(mesh.facet_tags))
            on_boundary = np.zeros(len(mesh.points), bool)
            on_boundary[mesh.facets.ravel()] = True
            np.testing.assert_array_equal(mesh.vertex_tags != 0, on_boundary)
            self.assertEqual((mesh.region_names, set(mesh.regions)), ({1: "domain"}, {1}))
            np.testing.assert_array_equal(mesh.region("domain"), mesh.simplices)
            origins = set(mesh.vertex_origins[300:])
            self.assertLessEqual({wellspace.CORNER, wellspace.STEINER}, origins)
            self.assertLessEqual(origins, {wellspace.CORNER, wellspace.STEINER, wellspace.REPAIR})
            np.testing.assert_array_equal(mesh.vertex_origins[:300], np.arange(300))

    def test_without_boundary(self):
        points = uniform(300, 2)
        full, bare = wellspace.mesh(points), wellspace.mesh(points, boundary=False)
        np.testing.assert_array_equal(bare.simplices, full.simplices)
        self.assertEqual([len(a) for a in (bare.facets, bare.facet_tags, bare.regions, bare.vertex_tags)], [0] * 4)
        with self.fails(InvalidArgumentError, "none: the mesh has no boundary"):
            bare.boundary("xmin")
        with self.fails(InvalidArgumentError, "there are 1: 'xmin', 2: 'xmax', 3: 'ymin', 4: 'ymax'", field="name"):
            full.boundary("left")
        with self.fails(InvalidArgumentError, "there are 1: 'domain'"):
            full.region("steel")

    def test_one_mesh_for_one_input(self):
        points = uniform(3000, 3)
        one = wellspace.mesh(points, threads=1)
        two = wellspace.mesh(points.tolist(), threads=2)
        for name in ("points", "simplices", "facets", "vertex_origins"):
            np.testing.assert_array_equal(getattr(one, name), getattr(two, name))

    def test_more_points_than_fit_into_a_request(self):
        points = uniform(150_000, 2)  # 2.3 MiB
        mesh = wellspace.mesh(points)
        np.testing.assert_array_equal(mesh.points[mesh.input_vertices], points)

    def test_no_points_in_a_box(self):
        mesh = wellspace.mesh(np.empty((0, 3)), box=unit_box(3), size=0.5)
        self.assertAlmostEqual(volume(mesh) / 6, 1)

    def test_progress(self):
        seen = []
        mesh = wellspace.mesh(uniform(20_000, 2), progress=seen.append)
        self.assertEqual((seen[-1].phase, seen[-1].fraction), ("done", 1))
        self.assertEqual(seen[-1].vertices, len(mesh.points))
        fractions = [event.fraction for event in seen]
        self.assertEqual(fractions, sorted(fractions))

    def test_errors_of_the_server(self):
        points = uniform(100, 2)
        with self.fails(InvalidArgumentError, "(argument rho)", reason="INVALID_PARAMETERS", field="parameters.rho",
                        argument="rho", code="INVALID_ARGUMENT", retry_after=None):
            wellspace.mesh(points, rho=0.1)
        with self.fails(InvalidArgumentError, "(argument size)", argument="size"):
            wellspace.mesh(points, size=-1)
        with self.fails(InvalidArgumentError, "point", reason="INVALID_POINTS"):
            wellspace.mesh(points, box=([0, 0], [0.5, 1]))
        with self.fails(LimitError, "", reason="MESH_TOO_LARGE"):
            wellspace.mesh(points, max_vertices=50)
        with self.fails(LimitError, "", reason="DEMANDS_TOO_FINE"):
            wellspace.mesh(points, size=1e-9)
        with self.fails(InvalidArgumentError, "", argument="dimension"):
            wellspace.mesh(uniform(7, 7))
        with self.assertRaises(ValueError):
            wellspace.mesh(points, rho=0.1)


class EstimateTest(Case):
    def test_is_near_the_mesh(self):
        points = uniform(5000, 3)
        estimate, mesh = wellspace.estimate(points, size=0.1), wellspace.mesh(points, size=0.1)
        self.assertLess(abs(np.log(estimate.vertices / len(mesh.points))), np.log(1.5))
        self.assertLess(abs(np.log(estimate.simplices / len(mesh.simplices))), np.log(1.5))
        self.assertGreater(estimate.memory_bytes, mesh.points.nbytes)

    def test_errors(self):
        with self.fails(InvalidArgumentError, "(argument rho)"):
            wellspace.estimate(uniform(10, 2), rho=0.1)


if __name__ == "__main__":
    unittest.main()
