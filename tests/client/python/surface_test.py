"""Surfaces in space: triangles, markers, holes, regions and rules, in one call, in sessions, and from files."""

import gzip
import pathlib
import struct
import tempfile
import unittest

import numpy as np
from support import ROOT, Case, volume

import wellspace
from wellspace import InvalidArgumentError, SolidSeed, WrongStateError, _surface

CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
SIDES = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
CUBE = np.array([row for a, b, c, d in SIDES for row in ((a, b, c), (a, c, d))])
MARKERS = np.repeat(np.arange(1, 7), 2)
# A small cube in the middle of the large one.
POINTS = np.vstack([CORNERS, 0.25 + CORNERS / 2])
BOTH = np.vstack([CUBE, CUBE + 8])


class SurfaceTest(Case):
    def test_a_cube(self):
        mesh = wellspace.mesh(CORNERS, triangles=CUBE, markers=MARKERS, facet_length=0.5)
        self.assertAlmostEqual(volume(mesh) / 6, 1)
        self.assertEqual(mesh.facet_names, {marker: f"marker_{marker}" for marker in range(1, 7)})
        self.assertTrue((mesh.points[mesh.boundary("marker_1")][:, :, 0] == 0).all())
        surface = mesh.statistics.surface
        self.assertEqual((surface.triangles, surface.curves, surface.corners, surface.solids), (12, 12, 8, 1))
        self.assertEqual(surface.ridges, len(mesh.ridges))
        self.assertEqual(surface.lost_ridges, 0)
        self.assertAlmostEqual(surface.volumes[0], 1)
        ends = mesh.points[mesh.ridges]
        self.assertAlmostEqual(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum(), 12)

    def test_rules_and_seeds(self):
        inner = [SolidSeed(0.5, 0.5, 0.5, region=7), (0.1, 0.1, 0.1, 3)]
        for given, expected in (
            ({}, {"domain": 1 - 1 / 8}),
            ({"solids": "holes", "holes": [[0.5, 0.5, 0.5]]}, {"domain": 1 - 1 / 8}),
            ({"solids": "holes", "regions": inner}, {"region_3": 1 - 1 / 8, "region_7": 1 / 8}),
        ):
            with self.subTest(given):
                mesh = wellspace.mesh(POINTS, triangles=BOTH, **given)
                found = {}
                for name in mesh.region_names.values():
                    corners = mesh.points[mesh.region(name)]
                    found[name] = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6
                self.assertEqual(set(found), set(expected))
                for name, size in expected.items():
                    self.assertAlmostEqual(found[name], size)

    def test_a_vertex_between_a_facet_and_the_surface_is_in_the_mesh(self):
        """One is in so fine a mesh of the bracket: outside of the part, amid tetrahedra of it."""
        part = wellspace.read_surface(ROOT / "examples" / "bracket.stl")
        diagonal = np.linalg.norm(np.ptp(part.points, axis=0))
        mesh = wellspace.mesh(part.points, triangles=part.triangles, weld=part.weld, facet_length=0.03 * diagonal,
                              tolerance=0.003 * diagonal, per_circle=26, min_dihedral=0)
        np.testing.assert_array_equal(np.unique(mesh.simplices), np.arange(len(mesh.points)))

    def test_sizes_of_the_surface_itself(self):
        plate = CORNERS * [1, 1, 0.2]
        plain = wellspace.mesh(plate, triangles=CUBE)
        layered = wellspace.mesh(plate, triangles=CUBE, layers=3)
        self.assertGreater(len(layered.points), 4 * len(plain.points))
        for name, field in (("layers", "thickness_layers"), ("per_circle", "curvature_elements")):
            with self.fails(InvalidArgumentError, field):
                wellspace.mesh(plate, triangles=CUBE, **{name: -1})

    def test_parts_that_overlap_are_united_by_winding(self):
        points, triangles = np.vstack([CORNERS, CORNERS + 0.5]), np.vstack([CUBE, CUBE + 8])
        with self.fails(InvalidArgumentError, "winding"):
            wellspace.mesh(points, triangles=triangles)
        mesh = wellspace.mesh(points, triangles=triangles, solids="winding", resolution=0.05)
        self.assertLess(abs(volume(mesh) / 6 - (2 - 1 / 8)), 0.1)
        for given, message in (({"solids": "winding", "resolution": 5}, "resolution"),
                               ({"resolution": 0.05}, "resolution"),
                               ({"solids": "winding", "per_circle": 9}, "curvature_elements")):
            with self.fails(InvalidArgumentError, message):
                wellspace.mesh(points, triangles=triangles, **given)

    def test_a_sheet_parts_a_box(self):
        sheet = np.array([[-1, -1, 0.25], [2, -1, 0.25], [2, 2, 0.25], [-1, 2, 0.25]])
        triangles = [[0, 1, 2], [0, 2, 3]]
        box = [[0, 0, 0], [1, 1, 1]]
        mesh = wellspace.mesh(sheet, triangles=triangles, markers=[9, 9], surface_box=box, min_dihedral=0)
        self.assertAlmostEqual(volume(mesh) / 6, 1, places=12)
        self.assertEqual(set(mesh.facet_names.values()),
                         {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax", "marker_9"})
        self.assertEqual(len(mesh.region_names), 2)
        for given, field in (({"surface_box": [[0, 0, 0], [1, 1, 0]]}, "surface_box"),
                             ({"surface_box": box, "solids": "holes"}, "surface.box"),
                             ({"solids": "box"}, "surface.box")):
            with self.fails(InvalidArgumentError, "box", field=field):
                wellspace.mesh(sheet, triangles=triangles, **given)

    def test_names(self):
        mesh = wellspace.mesh(CORNERS, triangles=CUBE, markers=["low"] * 2 + ["side"] * 10,
                              regions=[(0.5, 0.5, 0.5, "steel")])
        self.assertEqual(set(mesh.facet_names.values()), {"low", "side"})
        self.assertEqual(set(mesh.region_names.values()), {"steel"})
        with self.fails(InvalidArgumentError, "names.markers[3]", field="surface.names"):
            wellspace.mesh(CORNERS, triangles=CUBE, marker_names={3: ""})

    def test_points_of_the_surface_are_kept(self):
        mesh = wellspace.mesh(CORNERS, triangles=CUBE, facet_length=0.3, keep_points=True)
        np.testing.assert_array_equal(mesh.points[mesh.input_vertices], CORNERS)
        with self.fails(InvalidArgumentError, "keep_points"):
            wellspace.mesh(CORNERS, triangles=CUBE, solids="winding", keep_points=True)

    def test_wrong_input(self):
        for given, message, field in (
            ({"triangles": [[0, 1, 8]]}, "below 8", "triangles[0]"),
            ({"triangles": CUBE, "markers": [1]}, "12", "markers"),
            ({"triangles": CUBE, "crease_angle": 181}, "from 0 to 180", "crease_angle"),
            ({"triangles": CUBE, "weld": -1}, "at least 0", "weld"),
            ({"triangles": CUBE, "solids": "crate"}, "'holes', 'even-odd'", "solids"),
            ({"triangles": CUBE, "regions": [(1, 2)]}, "(x, y, z, region, max_volume)", "regions[0]"),
            ({"triangles": CUBE, "segments": [[0, 1]]}, "2-D only", "segments"),
            ({"markers": [1]}, "segments or triangles", "markers"),
            ({"tolerance": 1}, "triangles only", "tolerance"),
        ):
            with self.subTest(given), self.fails(InvalidArgumentError, message, field=field):
                wellspace.mesh(CORNERS, **given)
        with self.fails(InvalidArgumentError, "3-D only", field="triangles"):
            wellspace.mesh(CORNERS[:, :2], triangles=CUBE)
        with self.fails(InvalidArgumentError, "open edges", reason="INVALID_TRIANGLES"):
            wellspace.mesh(CORNERS, triangles=CUBE[:-1])

    def test_messages_have_all_in_pieces(self):
        rows = np.arange(3 * 40_000, dtype=np.uint32).reshape(-1, 3)
        made = _surface.make_surface({"triangles": rows, "markers": np.arange(40_000), "holes": np.ones((5_000, 3))})
        chunks = list(made.row_chunks())
        self.assertEqual([first for first, _ in chunks], [0, 16_384, 32_768])
        self.assertTrue(all(len(chunk) < 1 << 20 for _, chunk in chunks))
        self.assertEqual([first for first, _ in made.option_chunks()], [0, 4_096])


class SessionTest(Case):
    def test_triangles_in_pieces(self):
        with wellspace.Session(3) as session:
            session.add_triangles(triangles=CUBE[:5], markers=MARKERS[:5])
            session.upload(CORNERS)
            session.add_triangles(triangles=CUBE[5:], markers=MARKERS[5:], regions=[(0.5, 0.5, 0.5, 4)])
            info = session.info()
            self.assertEqual((info.point_count, info.triangle_count, info.seed_count), (8, 12, 1))
            session.add_triangles(
                triangles=CUBE[5:], markers=MARKERS[5:], regions=[(0.5, 0.5, 0.5, 4)], offset=(5, 0)
            )
            self.assertEqual(session.info().triangle_count, 12, "a repetition")
            session.refine(tolerance=0.1)
            self.assertEqual(session.info().parameters["tolerance"], 0.1)
            mesh = session.download()
            one = wellspace.mesh(
                CORNERS, triangles=CUBE, markers=MARKERS, regions=[(0.5, 0.5, 0.5, 4)], tolerance=0.1
            )
            np.testing.assert_array_equal(mesh.simplices, one.simplices)
            np.testing.assert_array_equal(mesh.ridges, one.ridges)
            with self.fails(WrongStateError, "", reason="DOMAIN_FIXED"):
                session.add_triangles(triangles=[[0, 3, 5]])
        with wellspace.Session(2) as session, self.fails(InvalidArgumentError, "in 2-D", field="triangles"):
            session.add_triangles(triangles=CUBE)


class FilesTest(Case):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, content):
        path = self.folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def expect_cube(self, surface):
        np.testing.assert_array_equal(surface.points[surface.triangles], CORNERS[CUBE])
        self.assertEqual(surface.points.shape, (8, 3))

    def test_formats(self):
        rows = [struct.pack("<12fH", 0, 0, 0, *CORNERS[row].ravel(), 0) for row in CUBE]
        binary = b"solid".ljust(80) + struct.pack("<I", len(rows)) + b"".join(rows)
        facets = ["facet normal 0 0 0\nouter loop\n"
                  + "".join("vertex {} {} {}\n".format(*CORNERS[corner]) for corner in row)
                  + "endloop\nendfacet\n" for row in CUBE]
        text = "solid left\n" + "".join(facets[:2]) + "endsolid\nSOLID the rest\n" + "".join(facets[2:]) + "endsolid\n"
        obj = "".join("v {} {} {}\n".format(*row) for row in CORNERS) + "g a b\n" + "".join(
            "f {} {} {}\n".format(*(row + 1)) for row in CUBE)
        off = "OFF 8 12 0\n" + "".join("{} {} {}\n".format(*row) for row in CORNERS) + "".join(
            "3 {} {} {} {}\n".format(*row, marker) for row, marker in zip(CUBE, MARKERS))
        for name, content in (("a.stl", binary), ("b.stl", text), ("c.obj", obj), ("d.off", off),
                              ("e.stl.gz", gzip.compress(binary))):
            with self.subTest(name):
                self.expect_cube(wellspace.read_surface(self.write(name, content)))
        self.assertEqual(wellspace.read_surface(self.folder / "b.stl").names, {1: "left", 2: "the rest"})
        self.assertEqual(wellspace.read_surface(self.folder / "b.stl").markers.tolist(), [1, 1] + [2] * 10)
        self.assertAlmostEqual(wellspace.read_surface(self.folder / "a.stl").weld, 1e-6 * 3**0.5)
        self.assertEqual(wellspace.read_surface(self.folder / "c.obj").names, {1: "a b"})
        self.assertEqual(wellspace.read_surface(self.folder / "d.off").markers.tolist(), MARKERS.tolist())
        part = wellspace.read_surface(self.folder / "a.stl")
        mesh = wellspace.mesh(part.points, triangles=part.triangles, markers=part.markers, weld=part.weld)
        self.assertAlmostEqual(volume(mesh) / 6, 1)

    def test_faces_of_more_corners_are_fans(self):
        sides = "OFF\n8 6 0\n" + "".join("{} {} {}\n".format(*row) for row in CORNERS) + "".join(
            "4 {} {} {} {}\n".format(*row) for row in SIDES)
        self.expect_cube(wellspace.read_surface(self.write("quads.off", sides)))

    def test_wrong_files(self):
        for name, content, message in (
            ("a.stl", "solid\nfacet\nvertex 1 2\n", "a.stl:3: expected vertex x y z"),
            ("b.stl", "hello", "expected an STL"),
            ("c.stl", "solid x\nendsolid\n", "no triangles"),
            ("d.obj", "v 0 0 0\nf 1 2 3\n", "d.obj:2: a corner that is no point"),
            ("e.obj", "v 0 0 x\n", "e.obj:1: expected coordinates"),
            ("f.off", "OFF\n3 1 0\n0 0 0\n", "expected 3 points, got 1"),
            ("g.off", "OFF\n1 1 0\n0 0 0\n2 0 0\n", "a face of 2 corners"),
            ("h.off", "OFF\n3 1 0\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n", "not finite"),
            ("i.xyz", "", "expected one of .stl, .obj, .off"),
        ):
            with self.subTest(name), self.fails(InvalidArgumentError, message, field="path"):
                wellspace.read_surface(self.write(name, content))


if __name__ == "__main__":
    unittest.main()
