"""`wellspace jobs`: the work that waits or runs on a caller's sessions, by the tool at a real server."""
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

import wellspaced

LAKE = '{"type": "Polygon", "coordinates": [[[0, 0], [4, 0], [4, 3], [1, 2], [0, 0]]]}'


class JobsTest(unittest.TestCase):
    def setUp(self):
        self.server = wellspaced.Wellspaced("--ephemeral", "--workers", "1")
        self.addCleanup(self.server.kill)

    def wellspace(self, *arguments):
        done = subprocess.run([wellspaced.BIN / "wellspace", *arguments], capture_output=True, text=True, check=False,
                              env={**os.environ, "WELLSPACE_SERVER": self.server.address}, timeout=wellspaced.PATIENCE)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def jobs(self):
        return json.loads(self.wellspace("jobs", "--output", "json"))["operations"]

    def test_running_and_queued_work_is_listed_until_it_is_over(self):
        self.assertEqual(self.jobs(), [])
        with tempfile.TemporaryDirectory() as folder:
            lake = pathlib.Path(folder) / "lake.geojson"
            lake.write_text(LAKE)
            operations = []
            for _ in range(2):
                session = self.wellspace("session", "create", "--dimension", "2").strip()
                self.wellspace("upload", session, lake, "--quiet")
                operations.append(self.wellspace("refine", session, "--size", "0.0005", "--detach").strip())
        listed = {one["name"]: one["state"] for one in self.jobs()}
        self.assertEqual(set(listed), set(operations))
        self.assertLessEqual(set(listed.values()), {"running", "queued"})
        text = self.wellspace("jobs")
        heads = " +".join(["OPERATION", "STATE", "PHASE", "DONE", "VERTICES", "SINCE"])
        self.assertRegex(text, rf"^server: \d+ jobs run on 1 workers, \d+ wait\n{heads}\n")
        for name in operations:
            self.assertRegex(text, rf"\n{re.escape(name)} +(running|queued) .* \d+% ")
            self.wellspace("cancel", name)
        self.assertEqual(self.jobs(), [])


if __name__ == "__main__":
    unittest.main()
