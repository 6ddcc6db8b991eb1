"""docs/sizes.md: its commands run, make the pictures that it shows, and give the figures below them."""

import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
PROGRAMS = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"])
IMAGES = ROOT / "docs" / "images"
PAGE = (ROOT / "docs" / "sizes.md").read_text(encoding="utf-8")
FIGURES = re.compile(r"([\d ]+) vertices, ([\d ]+) (?:triangles|tetrahedra), smallest (?:dihedral )?angle ([\d.]+)°")


def extent(picture):
    """Width and height of a PNG, by its first chunk."""
    data = picture.read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n"), picture
    return struct.unpack(">II", data[16:24])


def number(text):
    return float(re.sub("[ ,]", "", text))


class SizesPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.made = pathlib.Path(folder.name)
        command = [sys.executable, "-B", IMAGES / "make_sizes", "--programs", PROGRAMS, "--into", cls.made, "--keep"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=200, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        cls.shown = re.findall(r"\(images/([\w-]+)\.png\)", PAGE)

    def test_pictures_are_those_that_the_commands_make(self):
        self.assertGreaterEqual(len(self.shown), 10)
        self.assertEqual(sorted(self.shown), sorted(path.stem for path in self.made.glob("*.png")))
        self.assertEqual(sorted(self.shown), sorted(path.stem for path in IMAGES.glob("sizes-*.png")))
        for name in self.shown:
            picture = f"{name}.png"
            self.assertEqual(extent(self.made / picture), extent(IMAGES / picture), picture)

    def test_figures_are_those_of_the_meshes(self):
        told = FIGURES.findall(PAGE)
        self.assertEqual(len(told), len(self.shown))
        for name, figures in zip(self.shown, told):
            text = subprocess.run([PROGRAMS / "wellspace", "check", self.made / f"{name}.vtu"], capture_output=True,
                                  text=True, timeout=100, check=True).stdout
            found = re.search(r"vertices +([\d,]+)\n(?:triangles|tetrahedra) +([\d,]+)\n(?s:.*?)\n"
                              r"smallest (?:dihedral )?angle +([\d.]+)°", text)
            vertices, simplices, angle = map(number, found.groups())
            self.assertEqual((vertices, simplices, round(angle, 1)), tuple(map(number, figures)), name)

    def test_sizes_do_what_the_page_says(self):
        """The bounds of the commands hold, and those of their neighbours do not."""
        box, field = "1.9,1.2,2.5,1.8,0.03", ROOT / "examples" / "plate-sizes.csv"
        for name, options, holds in (
                ("radius", ["--size", 0.2], True), ("radius", ["--size", 0.18], False),
                ("angle", ["--rho", 0.919], True), ("default", ["--rho", 0.919], False),
                ("gentle", ["--size-box", box, "--gradation", 0.2], True),
                ("steep", ["--size-box", box, "--gradation", 1], True),
                ("steep", ["--size-box", box, "--gradation", 0.2], False),
                ("field", ["--size-field", field, "--gradation", 0.3], True),
                ("field", ["--size-field", field, "--gradation", 0.1], False),
                ("repaired", ["--min-dihedral", 12], True), ("slivers", ["--min-dihedral", 12], False)):
            command = [PROGRAMS / "wellspace", "check", self.made / f"sizes-{name}.vtu", *options]
            done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=100, check=False)
            self.assertEqual(done.returncode == 0, holds, f"{name} {options}\n{done.stdout}{done.stderr}")


if __name__ == "__main__":
    unittest.main()
