"""The image of the Dockerfile: built on a fresh Debian, small, no compiler, serving as nobody on a read-only root.

Wants root, debootstrap, podman and buildah (deploy/install-deps.sh container), and Debian's packages within reach;
takes some ten minutes. No engine has to run: the base is made by debootstrap, and processes are started in chroots.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"])
BASE = "docker.io/library/debian:bookworm-slim"  # as the Dockerfile calls it
IMAGE = "localhost/wellspace"
USER = 7233
MAX_BYTES_OVER_BASE = 150_000_000
TOOLS = ["debootstrap", "podman", "buildah", "unshare"]


def size_of(folder):
    """Bytes of all files, hard links once."""
    inodes = {}
    for path, _, names in os.walk(folder):
        for name in names:
            status = os.lstat(os.path.join(path, name))
            inodes[status.st_dev, status.st_ino] = status.st_size
    return sum(inodes.values())


def descendants(pid):
    # Programs in Go start processes from any of their threads.
    children = " ".join(path.read_text() for path in pathlib.Path(f"/proc/{pid}/task").glob("*/children")).split()
    return [int(child) for child in children] + [grandchild for child in children
                                                 for grandchild in descendants(int(child))]


@unittest.skipUnless(os.geteuid() == 0 and all(map(shutil.which, TOOLS)), "wants root and " + ", ".join(TOOLS))
class Image(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="wellspace-image-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.storage = ["--root", cls.folder / "storage", "--runroot", cls.folder / "run", "--storage-driver", "vfs"]
        base = cls.folder / "base"
        cls.run_tool("debootstrap", "--variant=minbase", "bookworm", base)
        shutil.rmtree(base / "var" / "cache" / "apt")  # as the slim images have it
        shutil.rmtree(base / "var" / "lib" / "apt" / "lists")
        archive = cls.folder / "base.tar"
        cls.run_tool("tar", "--create", "--file", archive, "--directory", base, ".")
        cls.base_bytes = size_of(base)
        shutil.rmtree(base)
        cls.run_tool("podman", *cls.storage, "import", archive, BASE)
        cls.run_tool("buildah", *cls.storage, "bud", "--isolation", "chroot", "--format", "docker", "--pull-never",
                     "--tag", IMAGE, ROOT)
        cls.container = cls.run_tool("buildah", *cls.storage, "from", "--pull-never", IMAGE).strip()
        cls.root = pathlib.Path(cls.run_tool("buildah", *cls.storage, "mount", cls.container).strip())
        cls.addClassCleanup(cls.run_tool, "buildah", *cls.storage, "rm", cls.container)

    @classmethod
    def run_tool(cls, *command):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{command}\n{done.stdout[-20_000:]}\n{done.stderr[-20_000:]}"
        return done.stdout

    def serve(self, *command):
        """Starts the server by `command`; its process and address."""
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        self.addCleanup(process.stdout.close)
        line = process.stdout.readline()
        self.assertTrue(line.startswith("listening on "), line)
        return process, line.removeprefix("listening on ").strip()

    def mesh_from_outside(self, address):
        mesh = self.folder / "spot.vtu"
        self.run_tool(BIN / "wellspace", "mesh", ROOT / "examples" / "spot.csv", "-o", mesh, "--quiet", "--server",
                      address)
        self.run_tool(BIN / "wellspace", "check", mesh, "--cloud", ROOT / "examples" / "spot.csv", "--rho", "2")

    def stop(self, process):
        """Asks the server below `process`, or that is `process`, to end."""
        servers = [pid for pid in [process.pid, *descendants(process.pid)]
                   if pathlib.Path(f"/proc/{pid}/comm").read_text().strip() == "wellspaced"]
        self.assertEqual(len(servers), 1)
        status = pathlib.Path(f"/proc/{servers[0]}/status").read_text()
        user_ids = next(line for line in status.splitlines() if line.startswith("Uid:")).split()[1:]
        self.assertEqual(user_ids, [str(USER)] * 4)
        os.kill(servers[0], signal.SIGTERM)
        self.assertEqual(process.wait(timeout=60), 0)

    def test_is_small(self):
        over_base = size_of(self.root) - self.base_bytes
        print(f"{over_base / 1e6:.0f} MB over the base's {self.base_bytes / 1e6:.0f} MB")
        self.assertLess(over_base, MAX_BYTES_OVER_BASE)

    def test_has_no_compiler(self):
        for name in ["cc", "c++", "gcc", "g++", "cpp", "ld", "as", "clang", "cmake", "ninja", "make", "protoc"]:
            self.assertIsNone(shutil.which(name, path=":".join(str(self.root / path)
                                                               for path in ["usr/bin", "usr/local/bin"])), name)
        self.assertEqual(list(self.root.glob("usr/lib/gcc*/*/*/cc1*")), [])

    def test_has_the_licences_of_all_that_is_linked(self):
        documents = self.root / "usr" / "share" / "doc"
        notices = (documents / "wellspace" / "THIRD_PARTY.md").read_text(encoding="utf-8")
        compiled_in = {path.name for path in (documents / "wellspace" / "third_party").iterdir()}
        self.assertIn("libhdf5-dev", compiled_in)
        rows = [line.strip("|").split("|") for line in notices.splitlines() if line.startswith("|")]
        packages = [name for cells in rows for name in re.findall(r"`([^`]+)`", cells[1])]
        self.assertIn("libaec0", packages)
        for package in packages:
            self.assertTrue(package in compiled_in or (documents / package / "copyright").is_file(), package)

    def test_says_how_it_is_run(self):
        config = json.loads(self.run_tool("buildah", *self.storage, "inspect", "--type", "image",
                                          IMAGE))["Docker"]["config"]
        self.assertEqual(config["User"], str(USER))
        self.assertEqual(config["Entrypoint"], ["wellspaced"])
        self.assertIn("7233", " ".join(config["ExposedPorts"]))
        self.assertEqual(config["StopSignal"], "SIGTERM")
        self.assertEqual(config["Healthcheck"]["Test"], ["CMD", "wellspace", "server", "health"])

    def test_serves_a_client_outside(self):
        run = ["buildah", *self.storage, "run", "--isolation", "chroot", self.container, "--"]
        process, address = self.serve(*run, "wellspaced", "--listen", "127.0.0.1:0")
        self.mesh_from_outside(address)
        self.run_tool(*run, "wellspace", "server", "health", "--server", address)
        self.stop(process)

    def test_serves_on_a_read_only_root(self):
        started = time.time()
        script = ('mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && '
                  'exec chroot --userspec="$1" "$0" wellspaced --listen 127.0.0.1:0')
        process, address = self.serve("unshare", "--mount", "sh", "-c", script, self.root, f"{USER}:{USER}")
        self.mesh_from_outside(address)
        self.stop(process)
        changed = [path for path in self.root.rglob("*") if path.lstat().st_mtime > started]
        self.assertEqual(changed, [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
