"""wellspace mesh, estimate and upload of surfaces: the inside, options, names, seeds and errors."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"]) / "wellspace"
DATA = pathlib.Path(__file__).resolve().parents[2] / "data" / "surfaces"

CORNERS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
SIDES = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=100, check=False)


def stl(sides=SIDES, names=True):
    """A cube as an STL, each side a solid with a name."""
    text = []
    for number, (a, b, c, d) in enumerate(sides):
        text.append(f"solid side {number}" if names else "solid")
        for row in ((a, b, c), (a, c, d)):
            text += ["facet normal 0 0 0", "outer loop"]
            text += ["vertex {} {} {}".format(*CORNERS[corner]) for corner in row]
            text += ["endloop", "endfacet"]
        text.append("endsolid")
    return "\n".join(text) + "\n"


class MeshSurfaces(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.out = self.folder / "out.vtu"

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def figures(self, *arguments):
        done = run("mesh", *arguments, "--stats", "-", "-q")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return json.loads(done.stdout)

    def fails(self, message, *arguments, code=None):
        done = run("mesh", *arguments)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn(message, done.stderr)
        if code is not None:
            self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def boundary(self, path):
        return {part["name"]: part["facets"] for part in json.loads(run("info", path, "--json").stdout)["boundary"]}

    def test_an_stl_means_its_inside_and_names_its_boundary(self):
        part = self.write("part.stl", stl())
        surface = self.figures(part, "-o", self.out)["surface"]
        counts = [surface[name] for name in ("triangles", "curves", "corners", "patches")]
        self.assertEqual(counts, [12, 12, 8, 6])
        self.assertAlmostEqual(surface["volumes"][0], 1)
        self.assertEqual(surface["lost_ridges"], 0)
        self.assertEqual(set(self.boundary(self.out)), {f"side {number}" for number in range(6)})
        self.assertEqual(run("check", self.out).returncode, 0)

    def test_as_points_is_a_cloud(self):
        part = self.write("part.stl", stl())
        figures = self.figures(part, "-o", self.out, "--as-points")
        self.assertNotIn("surface", figures)
        self.assertEqual(figures["input_points"], 8)
        self.assertIn("xmin", self.boundary(self.out))

    def test_other_formats_want_triangles(self):
        part = DATA / "cube.off"
        self.assertNotIn("surface", self.figures(part, "-o", self.out))
        self.assertAlmostEqual(self.figures(part, "-o", self.out, "--triangles")["surface"]["volumes"][0], 1)

    def test_lengths_are_shares_of_the_diagonal(self):
        part = self.write("part.stl", stl())
        coarse = self.figures(part, "-o", self.out, "--facet-length", "30%")["vertices"]
        by_share = self.figures(part, "-o", self.out, "--facet-length", "10%")["vertices"]
        by_length = self.figures(part, "-o", self.out, "--facet-length", repr(0.1 * 3**0.5))["vertices"]
        self.assertLess(2 * coarse, by_share)
        self.assertLess(abs(by_share - by_length), 0.1 * by_length, "but for what is rounded")

    def test_cavities_and_materials(self):
        hollow = self.figures(DATA / "cube_hole.off", "--triangles", "-o", self.out)
        self.assertTrue(0.5 < hollow["surface"]["volumes"][0] < 0.999)
        both = self.figures(DATA / "twocubes.off", "--triangles", "--solids", "holes", "-o", self.out)
        self.assertEqual(len(both["surface"]["volumes"]), 2)
        seeds = self.write("seeds.csv", "x,y,z,region,max-volume\n0.5,0.5,0.5,hole\n1.5,0.5,0.5,7,0.01\n")
        one = self.figures(DATA / "twocubes.off", "--triangles", "--solids", "holes", "--seeds", seeds, "-o", self.out)
        self.assertEqual(len(one["surface"]["volumes"]), 1)
        self.assertAlmostEqual(one["surface"]["volumes"][0], 1)

    def test_seeds_that_are_wrong_name_their_line(self):
        part = self.write("part.stl", stl())
        for text, message in (("0,0,0\n", "seeds.csv:1: expected x,y,z,region"),
                              ("x,y,z,region\n0,0,zero,1\n", "seeds.csv:2: z: "),
                              ("0,0,0,1,-1\n", "seeds.csv:1: max-volume: "),
                              ("0,0,0,hole,1\n", "seeds.csv:1: max-volume: a hole"),
                              ("# nothing\n", "seeds.csv: no seeds")):
            with self.subTest(text):
                seeds = self.write("seeds.csv", text)
                self.fails(message, part, "-o", self.out, "--seeds", seeds)

    def test_a_fault_names_its_place_and_info(self):
        part = self.write("open.stl", stl(SIDES[:-1]))
        text = self.fails("open edges", part, "-o", self.out)
        self.assertIn(f"`wellspace info {part}` tells all faults", text)
        self.assertFalse(self.out.exists())

    def test_options_that_do_not_fit(self):
        part = self.write("part.stl", stl())
        cloud = self.write("cloud.csv", "0,0,0\n1,0,0\n0,1,0\n0,0,1\n")
        for message, arguments in (("--tolerance: IN has no triangles", [cloud, "--tolerance", "1"]),
                                   ("--solids: IN is read as", [cloud, "--solids", "holes"]),
                                   ("--seeds: IN is read as", [cloud, "--seeds", cloud]),
                                   ("--faces: IN has triangles", [part, "--faces", "box"]),
                                   ("--columns: ", [part, "--triangles", "--columns", "x,y,z"]),
                                   ("--min-facet-angle: ", [part, "--min-facet-angle", "40"]),
                                   ("--tolerance: expected a length", [part, "--tolerance", "x"]),
                                   ("--criterion: ", [part, "--criterion", "well-spaced"])):
            with self.subTest(message):
                self.fails(message, *arguments, "-o", self.out)

    def test_the_bracket(self):
        part = self.folder / "bracket.stl"
        subprocess.run([sys.executable, "-B", DATA / "make_bracket.py", "-o", part], capture_output=True, check=True)
        surface = self.figures(part, "-o", self.out, "--facet-length", "5%", "--tolerance", "0.3%")["surface"]
        self.assertEqual((surface["curves"], surface["corners"], surface["patches"]), (22, 6, 15))
        self.assertEqual(surface["lost_ridges"], 0)

    def test_several_files_are_one_surface(self):
        files = [self.write(f"{name}.stl", stl([side], names=False)) for name, side in zip("abcdef", SIDES)]
        surface = self.figures(*files, "-o", self.out)["surface"]
        self.assertAlmostEqual(surface["volumes"][0], 1)
        self.assertEqual(set(self.boundary(self.out)), set("abcdef"))
        checked = run("check", self.out, "--surface", *files)
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
        self.assertIn("6 patches", run("info", *files).stdout)
        missing = run("mesh", *files[:-1], "-o", self.folder / "open.vtu")
        self.assertIn(f"`wellspace info {' '.join(map(str, files[:-1]))}` tells all faults", missing.stderr)
        self.fails("b.csv", files[0], self.write("b.csv", "0,0,0\n"), "-o", self.out)
        cloud = self.write("cloud.csv", "0,0,0\n1,0,0\n0,1,0\n0,0,1\n")
        self.fails("several make up a surface", cloud, files[0], "-o", self.out)

    # Of the sides that both cubes have each is one facet, between two solids.
    def test_files_of_solids_that_touch(self):
        left = self.write("left.stl", stl(names=False))
        moved = stl(names=False).replace("vertex 1", "vertex 2").replace("vertex 0", "vertex 1")
        right = self.write("right.stl", moved)
        done = run("mesh", left, right, "-o", self.out, "--stats", "-")
        self.assertEqual(done.returncode, 0, done.stderr)
        surface = json.loads(done.stdout)["surface"]
        self.assertEqual((surface["triangles"], surface["solids"]), (22, 2))
        self.assertAlmostEqual(sum(surface["volumes"]), 2)
        self.assertIn("2 triangles are in several files", done.stderr)

    def test_creases_are_in_the_files_that_have_a_place_for_them(self):
        part = self.write("part.stl", stl())
        for name in ("out.mesh", "out.npz"):
            ridges = self.figures(part, "-o", self.folder / name)["surface"]["ridges"]
            self.assertGreater(ridges, 11)
            other = self.folder / ("again" + (".npz" if name == "out.mesh" else ".mesh"))
            self.assertEqual(run("convert", self.folder / name, other).returncode, 0)
            for path in (self.folder / name, other):
                checked = run("check", path, "--surface", part)
                self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
        text = other.read_text()
        self.assertEqual(int(text.split("Ridges\n")[1].split("\n")[0]), ridges)
        lost = text.replace(f"Ridges\n{ridges}\n1\n", f"Ridges\n{ridges - 1}\n")
        checked = run("check", self.write("lost.mesh", lost), "--surface", part)
        self.assertNotEqual(checked.returncode, 0)
        self.assertIn("no ridge runs along", checked.stdout + checked.stderr)

    def test_estimates(self):
        done = run("estimate", self.write("part.stl", stl()), "--output", "json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreater(json.loads(done.stdout)["vertices"], 0)


if __name__ == "__main__":
    unittest.main()
