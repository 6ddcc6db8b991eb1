"""The wheel of scripts/wheel: what is in it, and that it meshes, writes and reads files where nothing of ours, and no
library of ours, is installed.

The roots have Python, venv with pip, numpy, grpcio and protobuf of their distribution, which pip finds there: the wheel
wants the last three, and nothing asks a network. Wants root, debootstrap, unshare and a mirror; takes some minutes.
"""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import time
import unittest
import zipfile

import chroot
import numpy

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"]).parent
SUITES = ["bookworm", "trixie"]  # Debian 12, on which it is built, and 13
MOST_SECONDS = 60  # from `pip install` to the first mesh
PROGRAMS = "wellspace/_programs/"

PYTHON = """
import numpy, wellspace
points = numpy.loadtxt("/work/spot.csv", delimiter=",", skiprows=1)
mesh = wellspace.mesh(points)
assert (mesh.points[mesh.input_vertices] == points).all()
mesh.save("/work/spot.npz")
for name in ("vtu", "msh", "su2"):  # by the tool
    mesh.save(f"/work/spot.{name}")
    if name == "su2":  # which is only written
        continue
    again = wellspace.read(f"/work/spot.{name}")
    assert (again.points == mesh.points).all() and (again.simplices == mesh.simplices).all(), name
print(len(mesh.points), wellspace.__file__)
"""


def output_of(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True).stdout


@unittest.skipUnless(shutil.which("patchelf"), "wants patchelf")
@unittest.skipUnless((BUILD / "build.ninja").exists(), "wants a build by Ninja")
@unittest.skipIf(os.environ.get("WELLSPACE_SANITIZE"), "what ships has no sanitizers")
class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="wellspace-wheel-test-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        chroot.run_here(ROOT / "scripts" / "wheel", "--build", BUILD, cls.folder)
        (cls.wheel,) = cls.folder.glob("*.whl")
        with zipfile.ZipFile(cls.wheel) as file:
            cls.names = file.namelist()
            cls.modes = {one.filename: one.external_attr >> 16 for one in file.infolist()}
            file.extractall(cls.folder / "unpacked")
        cls.unpacked = cls.folder / "unpacked"
        (cls.info,) = cls.unpacked.glob("*.dist-info")

    def test_name_and_size(self):
        self.assertRegex(self.wheel.name, r"^wellspace-\d+\.\d+\.\d+-py3-none-manylinux_2_36_x86_64\.whl$")
        self.assertLessEqual(self.wheel.stat().st_size, 25_000_000)
        text = (self.info / "WHEEL").read_text()
        self.assertIn("Root-Is-Purelib: false\n", text)
        self.assertEqual(re.findall(r"^Tag: (.*)$", text, re.MULTILINE), ["py3-none-manylinux_2_36_x86_64"])

    def test_programs_find_their_libraries_beside_themselves(self):
        """All but those of glibc; and by a path that LD_LIBRARY_PATH does not come before."""
        libraries = {path.name for path in (self.unpacked / PROGRAMS / "lib").iterdir()}
        self.assertGreater(len(libraries), 60)
        self.assertNotIn("libcairo.so.2", libraries)  # it is loaded when it is first used, with X11
        for name in self.names:
            if name.startswith(PROGRAMS):
                self.assertTrue(self.modes[name] & 0o111, name)
            if name.startswith(PROGRAMS) and not name.endswith("/wellspaced"):  # which is a script
                dynamic = output_of("readelf", "-d", self.unpacked / name)
                needed = set(re.findall(r"\(NEEDED\) .*\[(.*)\]", dynamic))
                outside = needed - libraries
                self.assertTrue(all(re.match(r"lib(c|m|dl|rt|pthread|resolv)\.so|ld-linux", one) for one in outside),
                                outside)
                expected = "$ORIGIN/../lib" if "/bin/" in name else "$ORIGIN"
                self.assertEqual(re.findall(r"\((RPATH|RUNPATH)\).*\[(.*)\]", dynamic), [("RPATH", expected)], name)

    def test_licences_of_all_that_is_taken_in(self):
        folder = self.info / "licenses" / "third_party"
        packages = {path.name for path in folder.iterdir()} - {"VERSIONS", "THIRD_PARTY.md"}
        taken = {"libgrpc29", "libstdc++6", "libssl3", "libabsl20220623", "libcli11-dev", "libhdf5-dev"}
        self.assertLessEqual(taken, packages)
        for other in ("libc6", "libcairo2", "libx11-6"):  # of the system
            self.assertNotIn(other, packages)
        versions = (folder / "VERSIONS").read_text().splitlines()[2:]
        self.assertEqual({line.split()[0] for line in versions}, packages)
        for path in (self.unpacked / PROGRAMS / "lib").iterdir():
            source = os.path.realpath(f"/usr/lib/x86_64-linux-gnu/{path.name}")
            names = [source, source.removeprefix("/usr")]  # on a merged /usr, either may be registered
            found = subprocess.run(["dpkg-query", "--search", *names], capture_output=True, text=True,
                                   check=False).stdout
            self.assertIn(found.split(":")[0], packages, path.name)
        self.assertTrue(all((folder / package).stat().st_size > 100 for package in packages))

    def install_and_mesh(self, suite):
        root = chroot.Root(self.folder / suite, suite)
        self.addCleanup(shutil.rmtree, root.path)
        root.apt("install", "python3", "python3-venv", "python3-pip", "python3-numpy", "python3-grpcio",
                 "python3-protobuf")
        shutil.copy(self.wheel, root.path / "work")
        shutil.copy(ROOT / "examples" / "spot.csv", root.path / "work")
        root.run("python3", "-m", "venv", "--system-site-packages", "/work/venv")
        start = time.monotonic()
        root.run("/work/venv/bin/pip", "install", "--no-index", f"/work/{self.wheel.name}")
        output = root.run("/work/venv/bin/python", "-c", PYTHON)
        self.assertLessEqual(time.monotonic() - start, MOST_SECONDS)
        self.assertRegex(output, r"^\d{4} /work/venv/lib/python3\.\d+/site-packages/wellspace/__init__\.py\n$")
        # The same bits as from the programs of the build.
        chroot.run_here(BUILD / "bin/wellspace", "mesh", ROOT / "examples/spot.csv", "-o", self.folder / "spot.npz",
                        "--quiet")
        here, there = numpy.load(self.folder / "spot.npz"), numpy.load(root.path / "work/spot.npz")
        for name in ("points", "simplices"):
            numpy.testing.assert_array_equal(here[name], there[name])
        for name in ("spot.vtu", "spot.msh", "spot.su2"):
            chroot.run_here(BUILD / "bin/wellspace", "convert", self.folder / "spot.npz", self.folder / name)
            self.assertEqual((self.folder / name).read_bytes(), (root.path / "work" / name).read_bytes(), name)
        self.check_commands(root)
        self.assertNotIn("wellspace", root.run("dpkg-query", "--show"))
        root.run("/work/venv/bin/pip", "uninstall", "-y", "wellspace")
        left = root.run("find", "/work/venv", "-name", "*wellspace*")
        self.assertEqual(left, "")

    def check_commands(self, root):
        self.assertRegex(root.run("/work/venv/bin/wellspace", "--version"), r"^wellspace \d")
        self.assertRegex(root.run("/work/venv/bin/wellspaced", "--version"), r"^wellspaced \d")
        (site,) = (root.path / "work/venv/lib").glob("python3*/site-packages/wellspace")
        root.run("ln", "-s", f"/{site.relative_to(root.path)}/_programs/bin/wellspaced", "/work/server")
        self.assertRegex(root.run("/work/server", "--version"), r"^wellspaced \d")
        # Pictures want the system's Cairo.
        render = ["/work/venv/bin/wellspace", "render", "/work/spot.vtu", "-o", "/work/spot.png"]
        done = subprocess.run(root.command(*render), capture_output=True, text=True, check=False)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("package libcairo2", done.stderr)
        root.apt("install", "libcairo2")
        root.run(*render)
        self.assertTrue((root.path / "work/spot.png").read_bytes().startswith(b"\x89PNG"))

    def test_in_other_systems(self):
        if not chroot.is_possible():
            self.skipTest("wants root, debootstrap and unshare")
        for suite in SUITES:
            with self.subTest(suite):
                if not pathlib.Path("/usr/share/debootstrap/scripts", suite).exists():
                    self.skipTest(f"debootstrap does not know {suite}")
                self.install_and_mesh(suite)


if __name__ == "__main__":
    unittest.main(verbosity=2)
