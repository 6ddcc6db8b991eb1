"""THIRD_PARTY.md names the libraries linked into this build's programs, and nothing else; HDF5 only writes (ADR 28)."""

import os
import pathlib
import re
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "third_party"
NOTICES = ROOT / "THIRD_PARTY.md"
BUILD = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"]).parent
STATIC_OR_HEADERS = ["libhdf5-dev", "libcli11-dev", "nlohmann-json3-dev"]


@unittest.skipIf(os.environ.get("WELLSPACE_SANITIZE"), "a sanitizer brings libraries that do not ship")
@unittest.skipUnless((BUILD / "build.ninja").exists(), "wants a build by Ninja")
class Notices(unittest.TestCase):
    def run_script(self, notices, *options):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "notices.md"
            file.write_text(notices, encoding="utf-8")
            command = [SCRIPT, "--build", BUILD, "--notices", file, *options]
            return subprocess.run(command, capture_output=True, text=True, check=False)

    def test_are_complete(self):
        done = self.run_script(NOTICES.read_text(encoding="utf-8"))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_lack_of_a_shared_library_or_of_one_that_is_compiled_in_is_found(self):
        for package, how in [("libaec0", "linked"), ("libhdf5-dev", "compiled in"), ("libcli11-dev", "compiled in")]:
            done = self.run_script(NOTICES.read_text(encoding="utf-8").replace(f"`{package}`", ""))
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"{package} is {how}, and not named", done.stdout)

    def test_what_is_named_without_need_is_found(self):
        done = self.run_script(NOTICES.read_text(encoding="utf-8") + "| curl | `libcurl4` | shared | curl |\n")
        self.assertEqual(done.returncode, 1)
        self.assertIn("libcurl4 is named, and neither linked nor compiled in", done.stdout)

    def test_copyrights_of_what_is_compiled_in_are_copied(self):
        with tempfile.TemporaryDirectory() as folder:
            done = self.run_script(NOTICES.read_text(encoding="utf-8"), "--copy", folder)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            for package in STATIC_OR_HEADERS:
                self.assertIn("opyright", (pathlib.Path(folder) / package).read_text(encoding="utf-8"))

    def test_copyrights_of_one_program_with_its_shared_libraries(self):
        with tempfile.TemporaryDirectory() as folder:
            done = self.run_script(NOTICES.read_text(encoding="utf-8"), "--copy", folder, "--with-shared",
                                   "--program", "wellspaced")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            copied = {path.name for path in pathlib.Path(folder).iterdir()}
            self.assertLessEqual({"libgrpc29", "libstdc++6", "libcli11-dev"}, copied)
            self.assertEqual(copied & {"libc6", "libcairo2", "libhdf5-dev"}, set(), "of the system, and of the tool")


class Hdf5(unittest.TestCase):
    def test_is_given_no_file_to_read(self):
        reading = re.compile(r"\bH5(Fopen|Fis_hdf5|Fis_accessible|Dopen\d?|Dread|Aread|LTread\w*)\b")
        for folder in ["client", "server", "core", "proto"]:
            for source in (ROOT / folder).rglob("*.cc"):
                self.assertIsNone(reading.search(source.read_text(encoding="utf-8")), source)


if __name__ == "__main__":
    unittest.main()
