"""The manual page wellspaced(8) against `wellspaced --help`."""
import os
import pathlib
import re
import shutil
import subprocess
import unittest

PAGE = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "wellspaced.8"
PROGRAM = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"]) / "wellspaced"


class Manual(unittest.TestCase):
    def test_has_every_option_and_command_and_no_other(self):
        text = subprocess.run([PROGRAM, "--help"], capture_output=True, text=True, check=True).stdout
        page = PAGE.read_text(encoding="utf-8").replace("\\-", "-")
        options = set(re.findall(r"^  (?:-\w,)?(--[\w-]+)", text, re.MULTILINE))
        self.assertIn("--max-memory", options)
        entries = "\n".join(re.findall(r"^\.TP\n(.*)", page, re.MULTILINE))
        self.assertEqual(set(re.findall(r"--[a-z-]+", entries)), options)
        for command in re.findall(r"^  ([\w-]+) ", text.partition("Subcommands:\n")[2], re.MULTILINE):
            self.assertIn(f"\\fB{command}\\fR", entries)

    @unittest.skipUnless(shutil.which("groff"), "groff is not installed")
    def test_groff_has_nothing_to_say(self):
        done = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-z", PAGE], capture_output=True, text=True,
                              check=True)
        self.assertEqual(done.stderr, "")


if __name__ == "__main__":
    unittest.main()
