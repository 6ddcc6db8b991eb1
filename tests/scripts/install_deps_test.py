"""deploy/install-deps.sh asks for missing packages, only for these, and leaves the network alone when nothing is."""

import os
import pathlib
import subprocess
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "install-deps.sh"


class InstallDepsTest(unittest.TestCase):
    def run_script(self, *groups, absent=()):
        """Runs the script as root of a machine that lacks `absent`; returns the process and the apt-get calls."""
        with tempfile.TemporaryDirectory() as folder:
            bin_dir = pathlib.Path(folder)
            calls = bin_dir / "calls"
            calls.touch()
            lacking = " ".join(f"*:{package}:*" for package in absent).replace(" ", "|") or "none"
            fakes = {
                "dpkg-query": f'case ":${{@: -1}}:" in {lacking}) exit 1 ;; *) printf installed ;; esac',
                "apt-get": f'echo "$@" >> {calls}',
                "id": "echo 0",
            }
            for name, body in fakes.items():
                (bin_dir / name).write_text(f"#!/bin/bash\n{body}\n", encoding="utf-8")
                (bin_dir / name).chmod(0o755)
            environment = {**os.environ, "PATH": f"{bin_dir}:{os.environ['PATH']}"}
            result = subprocess.run([SCRIPT, *groups], env=environment, capture_output=True, text=True, check=False)
            return result, calls.read_text(encoding="utf-8").splitlines()

    def test_does_nothing_when_all_is_there(self):
        result, calls = self.run_script("build", "test", "lint")
        self.assertEqual((result.returncode, result.stderr, calls), (0, "", []))

    def test_installs_only_what_is_missing(self):
        result, calls = self.run_script("build", absent=["ninja-build", "g++"])
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(len(calls), 2, calls)
        self.assertTrue(calls[0].endswith(" update"), calls[0])
        self.assertTrue(calls[1].endswith(" install g++ ninja-build"), calls[1])
        self.assertIn("--no-install-recommends", calls[1])

    def test_default_is_build_and_test(self):
        _, calls = self.run_script(absent=["cmake", "libgtest-dev", "clang-format-14"])
        self.assertTrue(calls[1].endswith(" install cmake libgtest-dev"), calls)

    def test_refuses_an_unknown_group(self):
        result, calls = self.run_script("biuld")
        self.assertEqual((result.returncode, calls), (2, []))
        self.assertIn("unknown group 'biuld'", result.stderr)


if __name__ == "__main__":
    unittest.main()
