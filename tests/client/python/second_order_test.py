"""Meshes of second order: arrays, and files by numpy and by the tool."""

import os
import pathlib
import subprocess
import tempfile
import unittest
from unittest import mock

import meshio
import numpy as np
from support import PATIENCE, TOOL, Case, uniform, unit_box

import wellspace
from wellspace import MIDDLE, InvalidArgumentError, MissingPackageError

# The corners of the edges that nodes are the middles of, as the documentation of SecondOrderMesh has them.
EDGES = {2: [(0, 1), (1, 2), (2, 0)], 3: [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]}


def meshes():
    yield wellspace.mesh(uniform(60, 2), box=unit_box(2))
    yield wellspace.mesh(uniform(60, 3), box=unit_box(3), size=0.3)


class SecondOrderTest(Case):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_nodes_are_the_middles_of_edges(self):
        for mesh in meshes():
            d, n = mesh.dimension, len(mesh.points)
            second = mesh.to_order(2)
            np.testing.assert_array_equal(second.points[:n], mesh.points)
            np.testing.assert_array_equal(second.simplices[:, : d + 1], mesh.simplices)
            np.testing.assert_array_equal(second.facets[:, :d], mesh.facets)
            seen = {}
            for elements, edges in ((second.simplices, EDGES[d]), (second.facets, EDGES[2][: d * (d - 1) // 2])):
                corners = elements.shape[1] - len(edges)
                for k, (i, j) in enumerate(edges):
                    ends = np.sort(elements[:, [i, j]], axis=1)
                    for node, pair in zip(elements[:, corners + k].tolist(), map(tuple, ends.tolist())):
                        self.assertEqual(seen.setdefault(pair, node), node)
            # By the lower end, then the higher one.
            self.assertEqual([seen[pair] for pair in sorted(seen)], list(range(n, len(second.points))))
            np.testing.assert_array_equal(second.middle_ends, sorted(seen))
            low, high = mesh.points[second.middle_ends[:, 0]], mesh.points[second.middle_ends[:, 1]]
            np.testing.assert_array_equal(second.points[n:], (low + high) / 2)

    def test_origins_and_tags_of_middles(self):
        for mesh in meshes():
            n = len(mesh.points)
            second = mesh.to_order(2)
            self.assertTrue((second.vertex_origins[n:] == MIDDLE).all())
            np.testing.assert_array_equal(second.vertex_origins[:n], mesh.vertex_origins)
            # Tags 1, 2, ... are the faces xmin, xmax, ymin, ... of the unit box.
            expected = np.zeros(len(second.points), np.int32)
            for tag in range(2 * mesh.dimension, 0, -1):
                expected[second.points[:, (tag - 1) // 2] == (tag - 1) % 2] = tag
            np.testing.assert_array_equal(second.vertex_tags, expected)

    def test_values_at_nodes(self):
        mesh = next(meshes())
        second = mesh.to_order(2)
        np.testing.assert_array_equal(second.at_nodes(mesh.points), second.points)
        np.testing.assert_array_equal(second.at_nodes(mesh.points[:, 0]), second.points[:, 0])
        with self.fails(InvalidArgumentError, "a row for each of", field="values"):
            second.at_nodes(second.points)

    def test_a_mesh_without_boundary(self):
        mesh = wellspace.mesh(uniform(30, 3), boundary=False)
        second = mesh.to_order(2)
        self.assertEqual(second.facets.shape, (0, 6))
        self.assertEqual(second.simplices.shape, (len(mesh.simplices), 10))
        self.assertEqual((len(second.vertex_tags), len(second.vertex_origins)), (0, 0))

    def test_npz_has_the_arrays_of_the_tool(self):
        weighted = wellspace.mesh(uniform(100, 3), pump_weights=True, min_dihedral=0)
        for mesh in (*meshes(), weighted, wellspace.mesh(uniform(30, 2), boundary=False)):
            mesh.save(self.folder / "first.npz")
            mesh.save(self.folder / "second.npz", order=2)
            command = [TOOL, "convert", self.folder / "first.npz", self.folder / "tool.npz", "--order", "2"]
            subprocess.run(command, check=True, timeout=PATIENCE)
            with np.load(self.folder / "second.npz") as ours, np.load(self.folder / "tool.npz") as theirs:
                self.assertEqual(sorted(ours.files), sorted(theirs.files))
                for name in theirs.files:
                    np.testing.assert_array_equal(ours[name], theirs[name], name)
                    self.assertEqual(ours[name].dtype, theirs[name].dtype, name)

    def test_files_of_the_tool(self):
        for mesh, kind in zip(meshes(), ("triangle6", "tetra10")):
            second = mesh.to_order(2)
            mesh.save(self.folder / "mesh.vtu", order=2)
            read = meshio.read(self.folder / "mesh.vtu")
            np.testing.assert_array_equal(read.points[:, : mesh.dimension], second.points)
            np.testing.assert_array_equal(read.cells_dict[kind], second.simplices)
            np.testing.assert_array_equal(read.point_data["boundary"], second.vertex_tags)
            np.testing.assert_array_equal(read.point_data["origin"], second.vertex_origins)
            for suffix in (".vtkhdf", ".vtk", ".msh", ".inp", ".node"):
                mesh.save(self.folder / f"mesh{suffix}", order=2)

    def test_what_is_refused(self):
        mesh = next(meshes())
        for order in (1, 3, "2"):
            with self.fails(InvalidArgumentError, f"order {order!r}; expected 2", field="order"):
                mesh.to_order(order)
        with self.fails(InvalidArgumentError, "order 3; expected 1 or 2", field="order"):
            mesh.save(self.folder / "mesh.npz", order=3)
        with self.fails(InvalidArgumentError, "triangles and tetrahedra; the mesh is in 4-D", field="order"):
            wellspace.mesh(uniform(10, 4)).save(self.folder / "mesh.npz", order=2)
        with self.fails(InvalidArgumentError, "order 2 takes no options; got binary", field="binary"):
            mesh.save(self.folder / "mesh.vtu", order=2, binary=False)
        for suffix in (".su2", ".mesh", ".2dm"):
            with self.fails(InvalidArgumentError, "has no elements of second order", field="path"):
                mesh.save(self.folder / f"mesh{suffix}", order=2)
        with mock.patch.dict(os.environ, {"WELLSPACE_TOOL_BINARY": "/nowhere"}):
            with self.fails(MissingPackageError, "the tool wellspace is needed to convert .npz to .vtu"):
                mesh.save(self.folder / "mesh.vtu", order=2)
        self.assertEqual(list(self.folder.iterdir()), [])


if __name__ == "__main__":
    unittest.main()
