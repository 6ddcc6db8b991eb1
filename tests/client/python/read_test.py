"""Files of points, surfaces and meshes by one call."""

import gzip
import os
import pathlib
import subprocess
import tempfile
import unittest
from unittest import mock

import numpy as np
from support import PATIENCE, TOOL, Case, uniform, unit_box

import wellspace
from wellspace import CloudFile, DomainFile, InvalidArgumentError, Mesh, MissingPackageError, SurfaceFile

TABLE = "id,x,y,heat\n7,0,0,0.5\n8,1,0.25,\n9,0.5,1,2\n"
POINTS = [[0, 0], [1, 0.25], [0.5, 1]]
CORNERS = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
STL = f"solid cap\nfacet normal 0 0 1\nouter loop\n{CORNERS}endloop\nendfacet\nendsolid\n"


class ReadTest(Case):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def test_points_with_what_they_have_beside_coordinates(self):
        cloud = wellspace.read(self.write("scan.csv", TABLE))
        self.assertIsInstance(cloud, CloudFile)
        np.testing.assert_array_equal(cloud.points, POINTS)
        self.assertEqual(list(cloud.attributes), ["id", "heat"])
        np.testing.assert_array_equal(cloud.attributes["id"], [7, 8, 9])
        np.testing.assert_array_equal(cloud.attributes["heat"], [0.5, np.nan, 2])
        self.assertEqual(repr(cloud), "<wellspace.CloudFile: 3 points in 2-D>")
        (self.folder / "scan.csv.gz").write_bytes(gzip.compress(TABLE.encode()))
        np.testing.assert_array_equal(wellspace.read(self.folder / "scan.csv.gz").points, POINTS)

    def test_how_points_are_to_be_read(self):
        path = self.write("scan.txt2", TABLE)
        np.testing.assert_array_equal(wellspace.read(path, format="csv").points, POINTS)
        cloud = wellspace.read(self.write("scan.csv", TABLE), columns=["heat", 3], skip_invalid=True)
        np.testing.assert_array_equal(cloud.points, [[0.5, 0], [2, 1]])
        self.assertTrue(cloud.notes, cloud)

    def test_a_mesh_of_any_format(self):
        mesh = wellspace.mesh(uniform(40, 3), box=unit_box(3))
        for name in ("mesh.npz", "mesh.vtu", "mesh.msh", "mesh.mesh", "mesh.node"):
            with self.subTest(name):
                mesh.save(self.folder / name)
                read = wellspace.read(self.folder / name)
                self.assertIsInstance(read, Mesh)
                np.testing.assert_array_equal(read.points, mesh.points)
                np.testing.assert_array_equal(read.simplices, mesh.simplices)
                if name.endswith(("npz", "vtu")):
                    np.testing.assert_array_equal(read.vertex_origins, mesh.vertex_origins)
        points = wellspace.read(self.folder / "mesh.vtu", format="vtu")
        self.assertIsInstance(points, CloudFile)
        np.testing.assert_array_equal(points.points, mesh.points)

    def test_npz_needs_no_tool(self):
        np.savez(self.folder / "points.npz", points=np.array(POINTS, np.float32), attribute_heat=[1.0, 2.0, 3.0])
        mesh = wellspace.mesh(uniform(10, 2))
        mesh.save(self.folder / "mesh.npz")
        with mock.patch.dict(os.environ, {"WELLSPACE_TOOL_BINARY": "/nowhere"}):
            cloud = wellspace.read(self.folder / "points.npz")
            np.testing.assert_array_equal(wellspace.read(self.folder / "mesh.npz").simplices, mesh.simplices)
            with self.fails(MissingPackageError, "WELLSPACE_TOOL_BINARY"):
                wellspace.read(self.write("scan.csv", TABLE))
        self.assertEqual(cloud.points.dtype, np.float64)
        np.testing.assert_array_equal(cloud.points, POINTS)
        np.testing.assert_array_equal(cloud.attributes["heat"], [1, 2, 3])

    def test_names_of_parts(self):
        np.savez(self.folder / "lake.npz", points=[[0.0, 0], [1, 0], [0, 1]], segments=[[0, 1], [1, 2], [2, 0]],
                 markers=[5, 5, 6], faces=["holes"], holes=np.empty((0, 2)), seeds=[[0.2, 0.2, 7, np.inf]],
                 polygons=np.empty((0, 4)), marker_names=["inlet", "wall"], named_markers=[5, 6],
                 region_names=["water"], named_regions=[7])
        domain = wellspace.read(self.folder / "lake.npz")
        self.assertEqual(domain.arguments["marker_names"], {5: "inlet", 6: "wall"})
        mesh = wellspace.mesh(domain.points, **domain.arguments)
        self.assertEqual((mesh.facet_names, mesh.region_names), ({5: "inlet", 6: "wall"}, {7: "water"}))

    def test_surfaces(self):
        path = self.write("part.stl", STL)
        surface = wellspace.read(path)
        self.assertIsInstance(surface, SurfaceFile)
        self.assertEqual((len(surface.triangles), surface.names), (1, {1: "cap"}))
        self.assertEqual(surface.arguments["marker_names"], {1: "cap"})
        default = wellspace.read(self.write("other.stl", STL.replace("solid cap", "solid marker_7")))
        self.assertEqual(default.names, {1: "marker_7"})
        self.assertNotIn("marker_names", default.arguments)  # the service leaves such names to numbers
        self.assertEqual(len(wellspace.read(path, triangles=False).points), 3)
        path = self.write("part.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 1\n3 0 1 2\n")
        self.assertIsInstance(wellspace.read(path), CloudFile)
        self.assertEqual(len(wellspace.read(path, triangles=True).triangles), 1)

    def test_files_that_are_wrong(self):
        with self.assertRaises(FileNotFoundError):
            wellspace.read(self.folder / "none.csv")
        with self.fails(InvalidArgumentError, "scan.csv:3", field="path"):
            wellspace.read(self.write("scan.csv", "x,y\n0,0\n1,y\n"))
        with self.fails(InvalidArgumentError, "wrong.npz: expected .npz", field="path"):
            wellspace.read(self.write("wrong.npz", "text"))
        np.savez(self.folder / "wrong.npz", other=[1])
        with self.fails(InvalidArgumentError, "no array 'points' of numbers", field="path"):
            wellspace.read(self.folder / "wrong.npz")

    def mesh_by_tool(self, path, *options):
        command = [TOOL, "mesh", path, "-o", self.folder / "tool.npz", "--quiet", *options]
        subprocess.run(command, check=True, timeout=PATIENCE)
        return Mesh.load(self.folder / "tool.npz")

    def assert_same_mesh(self, mesh, path, *options):
        theirs = self.mesh_by_tool(path, *options)
        for name in ("points", "simplices", "facets", "facet_tags", "regions"):
            np.testing.assert_array_equal(getattr(mesh, name), getattr(theirs, name), name)

    def test_domains_make_the_mesh_of_the_tool(self):
        lines = '{"type": "LineString", "coordinates": [[1, 1], [2, 2]]}'
        outer = "[[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]"
        inner = "[[2.5, 0.5], [3.5, 0.5], [3.5, 1.5], [2.5, 1.5], [2.5, 0.5]]"
        features = ", ".join(
            f'{{"type": "Feature", "properties": {{}}, "geometry": {geometry}}}'
            for geometry in (lines, f'{{"type": "Polygon", "coordinates": [{outer}, {inner}]}}')
        )
        land = self.write("land.geojson", f'{{"type": "FeatureCollection", "features": [{features}]}}')
        poly = "4 2 0 0\n1 0 0\n2 2 0\n3 2 1\n4 0 1\n4 1\n1 1 2 5\n2 2 3 6\n3 3 4 5\n4 4 1 0\n0\n1\n1 1 .5 7 0.05\n"
        for path in (land, self.write("box.poly", poly), self.write("shore.wkt", "POLYGON ((0 0, 3 0, 1 2, 0 0))")):
            with self.subTest(path.name):
                domain = wellspace.read(path)
                self.assertIsInstance(domain, DomainFile)
                self.assert_same_mesh(wellspace.mesh(domain.points, **domain.arguments), path)
        domain = wellspace.read(land)
        self.assertEqual(len(domain.arguments["open_segments"]), 1)
        self.assertEqual(repr(domain), "<wellspace.DomainFile: 10 points, 9 segments>")
        table = self.write("lines.csv", "0,0\n1,0\n1,1\n\n0.25,0.75\n0.5,0.75\n")
        domain = wellspace.read(table, segments=True)
        self.assert_same_mesh(wellspace.mesh(domain.points, **domain.arguments), table, "--segments")
        self.assertEqual(len(wellspace.read(self.write("x", poly), format="poly").arguments["regions"]), 1)

    def test_surfaces_of_tetgen_make_the_mesh_of_the_tool(self):
        corners = [(x, y, z) for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)]
        faces = [(0, 2, 3, 1), (4, 5, 7, 6), (8, 9, 11, 10)]
        for low in (0, 4):
            faces += [(low, low + 1, low + 5, low + 4), (low + 1, low + 3, low + 7, low + 5),
                      (low + 3, low + 2, low + 6, low + 7), (low + 2, low, low + 4, low + 6)]
        text = "12 3 0 0\n" + "".join(f"{i} {x} {y} {z}\n" for i, (x, y, z) in enumerate(corners))
        text += f"{len(faces)} 1\n" + "".join(f"4 {' '.join(map(str, face))} {i + 1}\n" for i, face in enumerate(faces))
        path = self.write("two.smesh", text + "0\n2\n0 .5 .5 .5 7\n1 .5 .5 1.5 8\n")
        surface = wellspace.read(path)
        self.assertIsInstance(surface, SurfaceFile)
        self.assertEqual((surface.solids, [seed.region for seed in surface.regions]), ("holes", [7, 8]))
        self.assert_same_mesh(wellspace.mesh(surface.points, **surface.arguments), path)


if __name__ == "__main__":
    unittest.main()
