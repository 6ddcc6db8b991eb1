"""Debian's packages of this build on a fresh Debian: installed, used, and gone again.

Wants root, debootstrap, unshare and a mirror of Debian; takes some ten minutes, most of it for downloads. Everything is
in a folder of its own, and programs run in it by chroot.
"""
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import chroot

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"]).parent
PACKAGES = ["wellspace", "wellspaced", "libwellspace-dev", "libwellspace-core-dev", "python3-wellspace",
            "wellspace-doc"]

PYTHON = """
import sys, numpy, wellspace
points = numpy.loadtxt("/work/spot.csv", delimiter=",", skiprows=1)
mesh = wellspace.mesh(points, **({"server": sys.argv[1]} if len(sys.argv) > 1 else {}))
assert (mesh.points[mesh.input_vertices] == points).all()
import importlib.metadata
print(len(mesh.points), wellspace.__file__, importlib.metadata.version("wellspace"))
"""


@unittest.skipUnless(chroot.is_possible("lintian"), "wants root, debootstrap, unshare and lintian")
@unittest.skipIf(os.environ.get("WELLSPACE_SANITIZE"), "what ships has no sanitizers")
class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="wellspace-packages-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.root = chroot.Root(cls.folder / "root")
        cls.work = cls.root.path / "work"
        chroot.run_here(ROOT / "scripts" / "package", "--build", BUILD, cls.work)
        shutil.copy(ROOT / "examples" / "spot.csv", cls.work)
        cls.root.apt("install", "man-db", *(f"/work/{path.name}" for path in cls.work.glob("*.deb")
                                            if not path.name.startswith("libwellspace-")))

    def serve(self):
        """Starts the server there; its address."""
        command = self.root.command("wellspaced", "--listen", "127.0.0.1:0", "--data", "/var/lib/wellspace")
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        return process.stdout.readline().removeprefix("listening on ").strip()

    def test_1_tool_meshes_alone_and_by_the_server(self):
        self.root.run("wellspace", "mesh", "/work/spot.csv", "-o", "/work/alone.vtu", "--quiet")
        address = self.serve()
        self.root.run("wellspace", "mesh", "/work/spot.csv", "-o", "/work/served.vtu", "--quiet", "--server", address)
        self.root.run("wellspace", "check", "/work/served.vtu", "--cloud", "/work/spot.csv", "--rho", "2")
        self.assertEqual((self.work / "alone.vtu").read_bytes(), (self.work / "served.vtu").read_bytes())
        self.root.run("wellspace", "render", "/work/served.vtu", "-o", "/work/spot.png")

    def test_1_python_meshes_by_the_server_and_by_one_of_its_own(self):
        address = self.serve()
        for arguments in ([address], []):
            output = self.root.run("python3", "-c", PYTHON, *arguments)
            self.assertRegex(output, r"^\d{4} /usr/lib/python3/dist-packages/wellspace/__init__.py \d+\.\d+\.\d+\n$")

    def test_1_manual_pages_and_completions(self):
        self.assertEqual(self.root.run("man", "-w", "wellspace", "wellspaced").split(),
                         ["/usr/share/man/man1/wellspace.1.gz", "/usr/share/man/man8/wellspaced.8.gz"])
        for page, section in (("wellspace", 1), ("wellspaced", 8)):
            text = self.root.run("man", "--pager=cat", str(section), page)
            self.assertIn("\nSYNOPSIS\n", text)
            self.assertIn(f"{page.upper()}({section})", text)
        for path in ("bash-completion/completions/wellspace", "zsh/vendor-completions/_wellspace",
                     "fish/vendor_completions.d/wellspace.fish"):
            self.assertIn("--min-dihedral" if "fish" not in path else "-l min-dihedral",
                          (self.root.path / "usr/share" / path).read_text())

    def test_1_unit_and_its_options(self):
        unit = (self.root.path / "lib/systemd/system/wellspaced.service").read_text()
        program, *options = re.search(r"^ExecStart=(.*)$", unit, re.MULTILINE)[1].split()
        self.assertTrue((self.root.path / program.lstrip("/")).is_file(), program)
        self.assertIn("$WELLSPACED_OPTIONS", options)
        self.assertIn("EnvironmentFile=-/etc/default/wellspaced", unit)
        self.assertTrue((self.root.path / "etc/systemd/system/multi-user.target.wants/wellspaced.service").is_symlink())
        conffiles = self.root.run("dpkg-query", "--show", "--showformat=${Conffiles}", "wellspaced")
        self.assertEqual(conffiles.split()[0], "/etc/default/wellspaced")
        # The file has options that the server takes.
        self.root.run("sh", "-c", ". /etc/default/wellspaced && wellspaced $WELLSPACED_OPTIONS --help")

    def test_1_pages_and_examples(self):
        folder = self.root.path / "usr/share/doc/wellspace-doc"
        for path in ("README.md", "docs/python.md", "docs/images/ocean.png", "examples/spot.csv",
                     "examples/python/plate.py"):
            self.assertTrue((folder / path).is_file(), path)
        for page in folder.rglob("*.md"):
            for link in re.findall(r"\]\(([^)#\s:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
                target = (page.parent / link).resolve()
                if target.is_relative_to(folder / "docs"):
                    self.assertTrue(target.exists(), f"{page.name}: {link}")

    def packages_there(self):
        return self.root.run("dpkg-query", "--show", "--showformat=${Package}\\n").split()

    def test_2_the_core_is_built_against_without_grpc_and_hdf5(self):
        (package,) = self.work.glob("libwellspace-core-dev_*.deb")
        self.root.apt("install", f"/work/{package.name}", "g++", "cmake", "make", "pkg-config")
        others = [one for one in self.packages_there()
                  if re.match(r"libgrpc.*-dev|libprotobuf-dev|libhdf5|protobuf-", one)]
        self.assertEqual(others, [])
        shutil.copytree(ROOT / "tests" / "install", self.work / "core-alone")
        self.root.run("cmake", "-S", "/work/core-alone/core", "-B", "/work/alone")
        self.root.run("cmake", "--build", "/work/alone")
        self.assertIn(": OK\n", self.root.run("/work/alone/consumer"))
        self.root.run("sh", "-c", "g++ -std=c++20 /work/core-alone/core/main.cc -o /work/linked-alone "
                      "$(pkg-config --cflags --libs wellspace-core)")
        self.assertIn(": OK\n", self.root.run("/work/linked-alone"))

    def test_3_programs_are_built_by_the_libraries(self):
        (package,) = self.work.glob("libwellspace-dev_*.deb")
        self.root.apt("install", f"/work/{package.name}", "g++", "cmake", "make")
        shutil.copytree(ROOT / "tests" / "install", self.work / "programs")
        for name in ("core", "client"):
            self.root.run("cmake", "-S", f"/work/programs/{name}", "-B", f"/work/{name}")
            self.root.run("cmake", "--build", f"/work/{name}")
        self.assertIn(": OK\n", self.root.run("/work/core/consumer"))
        self.assertRegex(self.root.run("/work/client/consumer", self.serve(), "/work/spot.csv", "/work/spot.npz"),
                         r"^\d+ vertices\n$")
        self.root.run("sh", "-c", "g++ -std=c++20 /work/programs/core/main.cc -o /work/linked "
                      "$(pkg-config --cflags --libs wellspace-core)")
        self.assertIn(": OK\n", self.root.run("/work/linked"))

    def test_4_purged(self):
        installed = self.root.run("dpkg", "-L", *PACKAGES).splitlines()
        files = {path for path in installed if path.startswith("/") and (self.root.path / path.lstrip("/")).is_file()}
        self.assertGreater(len(files), 80)
        self.root.apt("purge", *PACKAGES)
        self.assertEqual([path for path in files if (self.root.path / path.lstrip("/")).exists()], [])
        for path in ("etc/default/wellspaced", "var/lib/wellspace", "usr/lib/python3/dist-packages/wellspace",
                     "etc/systemd/system/multi-user.target.wants/wellspaced.service"):
            self.assertFalse(os.path.lexists(self.root.path / path), path)


if __name__ == "__main__":
    unittest.main(verbosity=2)
