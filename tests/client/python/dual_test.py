"""The dual of a mesh."""

import itertools
import unittest

import numpy as np
from support import Case, uniform, unit_box, volume

import wellspace
from wellspace import InvalidArgumentError


def shoelace(nodes):
    x, y = nodes.T
    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


class DualTest(Case):
    def check(self, mesh, tolerance=1e-12):
        """Checks the laws that hold for every mesh."""
        dual = mesh.dual_cells()
        self.assertAlmostEqual(dual.volumes.sum(), volume(mesh) / (2 if mesh.dimension == 2 else 6), delta=tolerance)
        self.assertGreater(dual.volumes.min(), 0)
        self.assertGreater(dual.areas.min(), -tolerance)
        on_boundary = np.bincount(mesh.facets.reshape(-1), dual.facet_areas.reshape(-1), len(mesh.points))
        self.assertGreater(on_boundary[mesh.facets].min(), 0)
        # Each cell is closed: the normals of its facets, by their areas, add up to nothing.
        flow = dual.areas[:, None] * (mesh.points[dual.edges[:, 1]] - mesh.points[dual.edges[:, 0]])
        flow /= dual.lengths[:, None]
        total = np.zeros_like(mesh.points)
        np.add.at(total, dual.edges[:, 0], flow)
        np.subtract.at(total, dual.edges[:, 1], flow)
        inside = np.ones(len(mesh.points), bool)
        inside[mesh.facets] = False
        self.assertGreater(inside.sum(), 0)
        np.testing.assert_allclose(total[inside], 0, atol=tolerance)
        return dual

    def test_cells_are_those_of_the_server(self):
        with wellspace.Session(2, box=unit_box(2)) as session:
            session.upload(uniform(100, 2))
            session.refine()
            mesh = session.download()
            dual = self.check(mesh)
            cells = session.cells()
            np.testing.assert_allclose(dual.volumes, [shoelace(cell.nodes) for cell in cells], atol=1e-14)
            neighbours = {(v, w) for v, cell in enumerate(cells) for w in cell.neighbours if v < w}
            self.assertEqual(neighbours, {tuple(e) for e, area in zip(dual.edges.tolist(), dual.areas) if area > 1e-14})

    def test_a_lattice_has_cubes(self):
        for dimension in (2, 3):
            points = np.array(list(itertools.product(range(5), repeat=dimension)), float)
            box = ([0] * dimension, [4] * dimension)
            mesh = wellspace.mesh(points, box=box, min_dihedral=0)
            self.assertEqual(len(mesh.points), len(points))
            dual = self.check(mesh)
            sides = np.where((points == 0) | (points == 4), 0.5, 1)
            np.testing.assert_allclose(dual.volumes, sides.prod(axis=1), atol=1e-13)
            straight = dual.lengths == 1
            along = np.abs(np.diff(points[dual.edges], axis=1)[:, 0]).argmax(axis=1)
            across = np.delete(np.arange(dimension), 0)
            widths = np.array([[sides[e[0], (a + k) % dimension] for k in across] for e, a in zip(dual.edges, along)])
            np.testing.assert_allclose(dual.areas, np.where(straight, widths.prod(axis=1), 0), atol=1e-13)

    def test_clouds_and_domains(self):
        for dimension, dihedral in ((2, 0), (3, 0), (3, 12)):
            mesh = wellspace.mesh(uniform(300, dimension), box=unit_box(dimension), min_dihedral=dihedral)
            dual = self.check(mesh, tolerance=1e-12)
            boundary = dual.facet_areas.sum()
            self.assertAlmostEqual(boundary, 4 if dimension == 2 else 6, delta=1e-12)
        square = np.array([[0, 0], [4, 0], [4, 4], [0, 4], [1, 1], [2, 1], [2, 2], [1, 2]], float)
        rings = [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4]]
        plate = wellspace.mesh(square, segments=rings, holes=[[1.5, 1.5]], min_angle=25, size=0.3)
        self.assertAlmostEqual(self.check(plate).volumes.sum(), 15, delta=1e-12)

    def test_a_scheme_of_two_point_fluxes_is_exact_for_linear_functions(self):
        mesh = wellspace.mesh(uniform(200, 3), box=unit_box(3))
        dual = mesh.dual_cells()
        values = mesh.points @ [1, 2, 3]
        flux = dual.areas / dual.lengths * (values[dual.edges[:, 1]] - values[dual.edges[:, 0]])
        balance = np.zeros(len(mesh.points))
        np.add.at(balance, dual.edges[:, 0], flux)
        np.subtract.at(balance, dual.edges[:, 1], flux)
        inside = np.ones(len(mesh.points), bool)
        inside[mesh.facets] = False
        np.testing.assert_allclose(balance[inside], 0, atol=1e-12)

    def test_what_has_no_dual_cells(self):
        with self.fails(InvalidArgumentError, "4-D"):
            wellspace.mesh(uniform(10, 4)).dual_cells()
        with self.fails(InvalidArgumentError, "pump_weights"):
            wellspace.mesh(uniform(50, 3), pump_weights=True, min_dihedral=0).dual_cells()
        self.assertEqual(wellspace.mesh(uniform(50, 2), boundary=False).dual_cells().facet_areas.shape, (0, 2))


if __name__ == "__main__":
    unittest.main()
