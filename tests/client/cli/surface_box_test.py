"""Boxes that surfaces part: info, mesh and check with --box, and what is refused."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

PROGRAM = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"]) / "wellspace"
BOX = "--box=0,0,0,1,1,1"


def run(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=200, check=False)


def write_sheets(path, *heights):
    """Sheets from -0.5 to 1.5 at heights, with the tags 1, 2, …"""
    corners = [(-0.5, -0.5), (1.5, -0.5), (1.5, 1.5), (-0.5, 1.5)]
    points = [f"{x} {y} {z}" for z in heights for x, y in corners]
    faces = [f"3 {4 * i + a} {4 * i + b} {4 * i + c} {i + 1}" for i in range(len(heights))
             for a, b, c in ((0, 1, 2), (0, 2, 3))]
    path.write_text("\n".join(["OFF", f"{len(points)} {len(faces)} 0", *points, *faces]) + "\n")


class SurfaceBoxTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.sheets = self.folder / "sheets.off"
        write_sheets(self.sheets, 0.25, 0.75)

    def test_info(self):
        told = run("info", self.sheets, "--triangles", BOX, "--json")
        self.assertEqual(told.returncode, 0, told.stderr)
        figures = json.loads(told.stdout)
        for found, wanted in zip(sorted(figures["solids"]), (0.25, 0.25, 0.5), strict=True):
            self.assertAlmostEqual(found, wanted, places=12)
        self.assertEqual((figures["cut_triangles"], figures["outside_triangles"]), (4, 0))
        self.assertEqual((figures["curves"], figures["patches"]), (28, 16))
        self.assertIn("4 triangles at the sides of the box", run("info", self.sheets, "--triangles", BOX).stdout)

    def test_mesh_and_check(self):
        out = self.folder / "out.npz"
        made = run("mesh", self.sheets, "--triangles", BOX, "--edge-length", "0.3", "-o", out)
        self.assertEqual(made.returncode, 0, made.stderr)
        told = json.loads(run("info", out, "--json").stdout)
        self.assertEqual({part["name"] for part in told["boundary"]},
                         {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax", "marker_1", "marker_2"})
        self.assertEqual(len(told["regions"]), 3)
        good = run("check", out, "--surface", self.sheets, BOX)
        self.assertEqual(good.returncode, 0, good.stdout + good.stderr)
        other = self.folder / "other.off"
        write_sheets(other, 0.25, 0.7)
        self.assertEqual(run("check", out, "--surface", other, BOX).returncode, 1)
        self.assertEqual(run("check", out, "--surface", self.sheets, "--box=0,0,0,1,1,2").returncode, 1)

    def test_what_is_refused(self):
        for given, message in (
            (["--box=0,0,0,1,1"], "--box: there are 5 numbers"),
            (["--solids", "box"], "--solids box: needs --box"),
            ([BOX, "--solids", "holes"], "--box: not with --solids holes"),
            (["--box=0,0,0,1,1,0"], "every low one below its high one"),
            (["--box=8,8,8,9,9,9"], "none of the 4 has a part with an area in the box"),
        ):
            told = run("mesh", self.sheets, "--triangles", *given, "-o", self.folder / "bad.npz")
            self.assertNotEqual(told.returncode, 0)
            self.assertIn(message, told.stderr)
        cloud = self.folder / "cloud.csv"
        cloud.write_text("0,0,0\n1,1,1\n")
        self.assertIn("--box:", run("mesh", cloud, BOX, "-o", self.folder / "bad.npz").stderr)


if __name__ == "__main__":
    unittest.main()
