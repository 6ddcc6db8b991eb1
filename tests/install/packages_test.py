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

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"]).parent
TOOLS = ["debootstrap", "unshare", "lintian"]
PACKAGES = ["wellspace", "wellspaced", "libwellspace-dev", "python3-wellspace"]
# A root of its own for all that is started there, with its own /proc, which is gone with the process.
IN_ROOT = 'mount -t proc proc "$0/proc" && exec chroot "$0" "$@"'
LONG = 3000

PYTHON = """
import sys, numpy, wellspace
points = numpy.loadtxt("/work/spot.csv", delimiter=",", skiprows=1)
mesh = wellspace.mesh(points, **({"server": sys.argv[1]} if len(sys.argv) > 1 else {}))
assert (mesh.points[mesh.input_vertices] == points).all()
import importlib.metadata
print(len(mesh.points), wellspace.__file__, importlib.metadata.version("wellspace"))
"""


@unittest.skipUnless(os.geteuid() == 0 and all(map(shutil.which, TOOLS)), "wants root and " + ", ".join(TOOLS))
@unittest.skipIf(os.environ.get("WELLSPACE_SANITIZE"), "what ships has no sanitizers")
class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="wellspace-packages-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.root = cls.folder / "root"
        cls.run_here("debootstrap", "--variant=minbase", "bookworm", cls.root)
        cls.run_here(ROOT / "scripts" / "package", "--build", BUILD, cls.root / "work")
        shutil.copy(ROOT / "examples" / "spot.csv", cls.root / "work")
        # Maintainers' scripts start nothing there.
        (cls.root / "usr/sbin/policy-rc.d").write_text("#!/bin/sh\nexit 101\n")
        (cls.root / "usr/sbin/policy-rc.d").chmod(0o755)
        cls.run_there("apt-get", "update", "-q")
        cls.apt("install", "man-db", *(f"/work/{path.name}" for path in (cls.root / "work").glob("*.deb")
                                       if not path.name.startswith("libwellspace-dev")))

    @classmethod
    def run_here(cls, *command):
        done = subprocess.run(list(map(str, command)), stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=LONG, check=False)
        assert done.returncode == 0, f"{command}\n{done.stdout[-8000:]}\n{done.stderr[-8000:]}"
        return done.stdout

    @classmethod
    def there(cls, *command):
        return ["unshare", "--mount", "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "HOME=/root", "LC_ALL=C.UTF-8",
                "DEBIAN_FRONTEND=noninteractive", "sh", "-c", IN_ROOT, str(cls.root), *map(str, command)]

    @classmethod
    def run_there(cls, *command):
        return cls.run_here(*cls.there(*command))

    @classmethod
    def apt(cls, *command):
        return cls.run_there("apt-get", "-q", "-y", "--no-install-recommends", *command)

    def serve(self):
        """Starts the server there; its address."""
        process = subprocess.Popen(self.there("wellspaced", "--listen", "127.0.0.1:0", "--data", "/var/lib/wellspace"),
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        return process.stdout.readline().removeprefix("listening on ").strip()

    def test_1_tool_meshes_alone_and_by_the_server(self):
        self.run_there("wellspace", "mesh", "/work/spot.csv", "-o", "/work/alone.vtu", "--quiet")
        address = self.serve()
        self.run_there("wellspace", "mesh", "/work/spot.csv", "-o", "/work/served.vtu", "--quiet", "--server", address)
        self.run_there("wellspace", "check", "/work/served.vtu", "--cloud", "/work/spot.csv", "--rho", "2")
        self.assertEqual((self.root / "work/alone.vtu").read_bytes(), (self.root / "work/served.vtu").read_bytes())
        self.run_there("wellspace", "render", "/work/served.vtu", "-o", "/work/spot.png")

    def test_1_python_meshes_by_the_server_and_by_one_of_its_own(self):
        address = self.serve()
        for arguments in ([address], []):
            output = self.run_there("python3", "-c", PYTHON, *arguments)
            self.assertRegex(output, r"^\d{4} /usr/lib/python3/dist-packages/wellspace/__init__.py \d+\.\d+\.\d+\n$")

    def test_1_manual_pages_and_completions(self):
        self.assertEqual(self.run_there("man", "-w", "wellspace", "wellspaced").split(),
                         ["/usr/share/man/man1/wellspace.1.gz", "/usr/share/man/man8/wellspaced.8.gz"])
        for page, section in (("wellspace", 1), ("wellspaced", 8)):
            text = self.run_there("man", "--pager=cat", str(section), page)
            self.assertIn("\nSYNOPSIS\n", text)
            self.assertIn(f"{page.upper()}({section})", text)
        for path in ("bash-completion/completions/wellspace", "zsh/vendor-completions/_wellspace",
                     "fish/vendor_completions.d/wellspace.fish"):
            self.assertIn("--min-dihedral" if "fish" not in path else "-l min-dihedral",
                          (self.root / "usr/share" / path).read_text())

    def test_1_unit_and_its_options(self):
        unit = (self.root / "lib/systemd/system/wellspaced.service").read_text()
        program, *options = re.search(r"^ExecStart=(.*)$", unit, re.MULTILINE)[1].split()
        self.assertTrue((self.root / program.lstrip("/")).is_file(), program)
        self.assertIn("$WELLSPACED_OPTIONS", options)
        self.assertIn("EnvironmentFile=-/etc/default/wellspaced", unit)
        self.assertTrue((self.root / "etc/systemd/system/multi-user.target.wants/wellspaced.service").is_symlink())
        conffiles = self.run_there("dpkg-query", "--show", "--showformat=${Conffiles}", "wellspaced")
        self.assertEqual(conffiles.split()[0], "/etc/default/wellspaced")
        # The file has options that the server takes.
        self.run_there("sh", "-c", ". /etc/default/wellspaced && wellspaced $WELLSPACED_OPTIONS --help")

    def test_2_programs_are_built_by_the_libraries(self):
        (package,) = (self.root / "work").glob("libwellspace-dev_*.deb")
        self.apt("install", f"/work/{package.name}", "g++", "cmake", "make")
        shutil.copytree(ROOT / "tests" / "install", self.root / "work" / "programs")
        for name in ("core", "client"):
            self.run_there("cmake", "-S", f"/work/programs/{name}", "-B", f"/work/{name}")
            self.run_there("cmake", "--build", f"/work/{name}")
        self.assertIn(": OK\n", self.run_there("/work/core/consumer"))
        self.assertRegex(self.run_there("/work/client/consumer", self.serve(), "/work/spot.csv", "/work/spot.npz"),
                         r"^\d+ vertices\n$")
        self.run_there("sh", "-c", "g++ -std=c++20 /work/programs/core/main.cc -o /work/linked "
                       "$(pkg-config --cflags --libs wellspace-core)")
        self.assertIn(": OK\n", self.run_there("/work/linked"))

    def test_3_purged(self):
        installed = self.run_there("dpkg", "-L", *PACKAGES).splitlines()
        files = {path for path in installed if path.startswith("/") and (self.root / path.lstrip("/")).is_file()}
        self.assertGreater(len(files), 80)
        self.apt("purge", *PACKAGES)
        self.assertEqual([path for path in files if (self.root / path.lstrip("/")).exists()], [])
        for path in ("etc/default/wellspaced", "var/lib/wellspace", "usr/lib/python3/dist-packages/wellspace",
                     "etc/systemd/system/multi-user.target.wants/wellspaced.service"):
            self.assertFalse(os.path.lexists(self.root / path), path)


if __name__ == "__main__":
    unittest.main(verbosity=2)
