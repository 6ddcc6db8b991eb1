"""wellspace info on surfaces: the counts of known parts, every dirty part with its place, in any order of triangles."""

import json
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"]) / "wellspace"
DATA = pathlib.Path(__file__).resolve().parents[2] / "data" / "surfaces"

# Curves, corners and patches at creases of 30 degrees.
KNOWN = {
    "cube": (12, 8, 6), "lshape": (18, 12, 8), "cylinder": (2, 0, 3), "plate": (12, 8, 6), "spot": (10, 10, 4),
    "twocubes": (20, 12, 11), "cube_in_cube": (24, 16, 12), "layers3": (28, 16, 16), "junctions4": (36, 20, 21),
    "checker": (42, 23, 24), "fin_free": (16, 12, 7), "fin_wall": (18, 12, 8), "runout16": (17, 11, 8),
    "cusp16": (9, 6, 5),
}
# The volumes of the solids of the seven complexes.
VOLUMES = {
    "twocubes": [1, 1], "cube_in_cube": [0.027, 0.973], "layers3": [0.15, 0.3, 0.55],
    "junctions4": [0.125, 0.125, 0.25, 0.5], "checker": [0.125] * 4, "fin_free": [1], "fin_wall": [1],
}


def run(*arguments):
    return subprocess.run([PROGRAM, "info", *arguments], capture_output=True, text=True, timeout=100, check=False)


def read_off(path):
    lines = path.read_text().split("\n")
    points, faces = map(int, lines[1].split()[:2])
    return lines[2:2 + points], [line.split() for line in lines[2 + points:2 + points + faces]]


def write_off(path, points, faces):
    path.write_text(f"OFF\n{len(points)} {len(faces)} 0\n" + "\n".join(points) + "\n" +
                    "\n".join(" ".join(face) for face in faces) + "\n")


def shuffled(points, faces, seed):
    """The same in another order, with other first corners."""
    draw = random.Random(seed)
    order = list(range(len(points)))
    draw.shuffle(order)
    number = {old: str(new) for new, old in enumerate(order)}
    turned = []
    for face in faces:
        corners = [number[int(corner)] for corner in face[1:4]]
        first = draw.randrange(3)
        turned.append([face[0], *corners[first:], *corners[:first], *face[4:]])
    draw.shuffle(turned)
    return [points[old] for old in order], turned


def without_lines(value):
    """Figures without those that name lines of the file."""
    if isinstance(value, dict):
        return {key: without_lines(item) for key, item in value.items() if key not in ("triangles", "triangle", "file")
                or isinstance(item, int)}
    return [without_lines(item) for item in value] if isinstance(value, list) else value


class SurfaceParts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.made = pathlib.Path(folder.name)
        for path in DATA.glob("*.off"):
            (cls.made / path.name).write_bytes(path.read_bytes())
        for script, arguments in (("make_parts.py", [cls.made, "--from", DATA / "spot.off"]),
                                  ("make_bracket.py", [word for end in ("stl", "stla", "obj", "off", "ply")
                                                       for word in ("-o", cls.made / f"bracket.{end}")])):
            command = [sys.executable, "-B", DATA / script, *arguments]
            subprocess.run(command, capture_output=True, timeout=100, check=True)
        (cls.made / "bracket.stla").rename(cls.made / "tagged.stl")

    def figures(self, name, *options, exit_code=0):
        done = run(self.made / name, "--json", *options)
        self.assertEqual(done.returncode, exit_code, done.stdout + done.stderr)
        return json.loads(done.stdout)

    def counts(self, name, *options, **kwargs):
        figures = self.figures(name, *options, **kwargs)
        return figures["curves"], figures["corners"], figures["patches"]

    def test_counts_of_known_parts(self):
        for name, expected in KNOWN.items():
            with self.subTest(name):
                self.assertEqual(self.counts(f"{name}.off", "--triangles", "--solids", "holes"), expected)

    def test_the_bracket_in_every_format(self):
        self.assertEqual(self.counts("bracket.stl"), (22, 6, 15))
        for name, options in (("tagged.stl", []), ("bracket.obj", ["--triangles"]), ("bracket.off", ["--triangles"]),
                              ("bracket.ply", ["--triangles"])):
            with self.subTest(name):
                figures = self.figures(name, *options)
                self.assertEqual((figures["curves"], figures["corners"], figures["patches"]), (48, 22, 25))
                self.assertEqual(len(figures["parts"]), 23)
                self.assertAlmostEqual(figures["volume"], 71828.149, delta=1e-3)
                names = sorted(part["name"] for part in figures["parts"])
                self.assertEqual("inner_fillet" in names, name in ("tagged.stl", "bracket.obj"))

    def test_volumes_of_complexes(self):
        for name, expected in VOLUMES.items():
            solids = sorted(self.figures(f"{name}.off", "--triangles", "--solids", "holes")["solids"])
            self.assertEqual(len(solids), len(expected), name)
            for got, wanted in zip(solids, expected):
                self.assertAlmostEqual(got, wanted, delta=1e-12 * wanted)

    def test_sharpest_angles(self):
        for degrees in (2, 3, 5, 10, 20, 30, 45, 60):
            figures = self.figures(f"wedge{degrees}.off", "--triangles")
            self.assertAlmostEqual(figures["sharpest_angle_deg"], degrees, delta=1e-6)

    def fault(self, name, kind, *options):
        figures = self.figures(name, "--triangles", *options, exit_code=1)
        faults = [fault for fault in figures["faults"] if fault["kind"] == kind]
        self.assertEqual(len(faults), 1, (name, figures["faults"]))
        self.assertTrue(faults[0]["accepted"])
        self.assertTrue(faults[0]["places"])
        for place in faults[0]["places"]:
            self.assertEqual(len(place["at"]), 3)
            self.assertRegex(place["triangles"][0], rf"{name}:\d+$")
        return faults[0]

    def test_dirty_parts_are_named_with_their_places(self):
        missing = self.fault("spot_missing1.off", "open_edges")
        self.assertEqual((missing["count"], missing["loops"]), (3, 1))
        self.assertAlmostEqual(missing["places"][0]["length"], 0.1487, delta=1e-4)
        points, faces = read_off(self.made / "spot.off")
        left = {tuple(face[1:4]) for face in read_off(self.made / "spot_missing1.off")[1]}
        gone, = [face for face in faces if tuple(face[1:4]) not in left]
        corners = [list(map(float, points[int(corner)].split())) for corner in gone[1:4]]
        middle = [0.5 * (min(column) + max(column)) for column in zip(*corners)]
        for got, wanted in zip(missing["places"][0]["at"], middle):
            self.assertAlmostEqual(got, wanted, delta=1e-12)
        self.assertEqual(self.fault("spot_missing.off", "open_edges")["loops"], 29)
        cracked = self.fault("spot_cracked.off", "open_edges")
        self.assertEqual((cracked["count"], cracked["loops"]), (17568, 5856))
        for name in ("spot_twice.off", "spot_wall.off", "overlap.off"):
            self.assertGreater(self.fault(name, "self_intersections")["count"], 100)
        for name, count in (("twocubes.off", 4), ("layers3.off", 8), ("junctions4.off", 18), ("fin_wall.off", 3)):
            self.assertEqual(self.fault(name, "odd_edges")["count"], count)
        self.assertEqual(self.fault("fin_free.off", "open_edges")["count"], 4)

    def test_what_changes_nothing_is_counted(self):
        plain = self.figures("spot.off", "--triangles")
        for name, figure, count in (("spot_flipped", "flipped", 117), ("spot_doubled", "equal", 117)):
            figures = self.figures(f"{name}.off", "--triangles")
            self.assertEqual(figures[f"{figure}_triangles"], count)
            self.assertRegex(figures[f"{figure}_example"]["triangle"], rf"{name}\.off:\d+$")
            self.assertEqual(figures["volume"], plain["volume"])
        self.assertTrue(self.figures("spot_reversed.off", "--triangles")["inside_out"])
        self.assertEqual(self.figures("spot_noisy.off", "--triangles")["faults"], [])
        welded = self.figures("spot_cracked.off", "--triangles", "--weld", "0.01%")
        self.assertEqual((welded["welded_points"], welded["points"]), (14638, 2930))

    def test_the_order_of_triangles_and_points_changes_no_byte(self):
        for name in ("spot", "spot_missing", "spot_twice", "junctions4", "runout16", "bracket"):
            points, faces = read_off(self.made / f"{name}.off")
            options = ["--triangles"]
            plain = run(self.made / f"{name}.off", "--json", *options)
            for seed in range(3):
                write_off(self.made / "shuffled.off", *shuffled(points, faces, seed))
                other = run(self.made / "shuffled.off", "--json", *options)
                self.assertEqual(other.returncode, plain.returncode)
                if plain.returncode == 0:
                    self.assertEqual(other.stdout.replace("shuffled.off", f"{name}.off"), plain.stdout)
                else:
                    self.assertEqual(without_lines(json.loads(other.stdout)), without_lines(json.loads(plain.stdout)))

    def test_text(self):
        done = run(self.made / "bracket.stl")
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stdout, r"(?m)^creases +22 curves, 6 corners, 15 patches$")
        self.assertRegex(done.stdout, r"(?m)^volume +71828\.1\d*$")
        self.assertRegex(done.stdout, r"(?m)^faults +none$")
        done = run(self.made / "spot_missing1.off", "--triangles")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"(?m)^fault +open edges: 3 in 1 loop\n"
                                      r" +at \(0\.240632, 0\.11321615, 0\.7041595\), a loop 0\.1487 long: .*off:\d+\n"
                                      r" +expected a closed surface; .*--weld.*--solids holes")

    def test_points_and_surfaces_are_told_apart(self):
        self.assertEqual(self.figures("bracket.stl", "--as-points")["kind"], "cloud")
        self.assertEqual(self.figures("bracket.stl", "--columns", "x,y,z")["kind"], "cloud")
        self.assertEqual(self.figures("bracket.obj")["kind"], "cloud")
        for options, message in ((["bracket.off", "--weld", "1"], "--weld: .* is read as a mesh or as points"),
                                 (["bracket.stl", "--weld", "x"], "--weld: expected a length"),
                                 (["bracket.off", "--triangles", "--columns", "x,y,z"], "--columns: .* is a surface"),
                                 (["bracket.off", "--triangles", "--as-points"], "--triangles excludes --as-points")):
            done = run(self.made / options[0], *options[1:])
            self.assertEqual(done.returncode, 2, options)
            self.assertRegex(done.stderr, message)


if __name__ == "__main__":
    unittest.main()
