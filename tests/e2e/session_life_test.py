"""The life of a session through the tool and the C++ library's example, with the real server."""
import json
import os
import pathlib
import random
import re
import signal
import subprocess
import tempfile
import unittest

from wellspaced import BIN, PATIENCE, ROOT, Wellspaced

COAST = pathlib.Path(os.environ["WELLSPACE_EXAMPLES_DIR"]) / "coast-110m.csv"


def csv(points):
    return "".join(",".join(map(repr, point)) + "\n" for point in points)


def uniform(count, seed):
    generator = random.Random(seed)
    return [(generator.random(), generator.random()) for _ in range(count)]


class SessionLife(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Wellspaced()
        cls.address = cls.server.address
        cls.environment = os.environ | {"WELLSPACE_SERVER": cls.address}

    @classmethod
    def tearDownClass(cls):
        cls.server.stop()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_tool(self, *arguments, exit_code=0, text="", program="wellspace"):
        done = subprocess.run([BIN / program, *map(str, arguments)], capture_output=True, text=True, input=text,
                              timeout=PATIENCE, env=self.environment, check=False)
        self.assertEqual(done.returncode, exit_code, (arguments, done.stderr, done.stdout))
        return done.stdout if exit_code == 0 else done.stderr

    def run_json(self, *arguments, **keywords):
        return json.loads(self.run_tool(*arguments, "--output", "json", **keywords))

    def create(self, *options):
        name = self.run_tool("session", "create", *options).strip()
        self.addCleanup(lambda: subprocess.run([BIN / "wellspace", "session", "delete", name], env=self.environment,
                                               stderr=subprocess.DEVNULL, check=False))
        return name

    def test_a_session_makes_the_mesh_that_one_call_makes(self):
        name = self.create("--dimension", 2, "--label", "who=e2e")
        points = COAST.read_text().splitlines()[1:]
        for part, offset in ((points[:2000], 0), (points[:3000], 0),
                             (points[3000:], None)):  # a repetition, then the rest
            self.run_tool("upload", name, "-", *(["--offset", offset] if offset is not None else []),
                          text="\n".join(part) + "\n")
        self.assertEqual(self.run_json("session", "show", name)["committed_points"], len(points))
        operation = self.run_json("refine", name)
        self.assertEqual(operation["state"], "succeeded")
        session = self.run_json("session", "show", name)
        self.assertEqual(session["state"], "ready")
        self.assertEqual(session["last_operation"], operation["name"])
        self.run_tool("download", name, "-o", self.folder / "session.npz", "--revision", operation["mesh_revision"])
        self.run_tool("mesh", COAST, "-o", self.folder / "mesh.npz")
        self.assertEqual((self.folder / "session.npz").read_bytes(), (self.folder / "mesh.npz").read_bytes())
        events = [json.loads(line)
                  for line in self.run_tool("watch", operation["name"], "--output", "json").splitlines()]
        self.assertEqual(events[-1]["state"], "succeeded")
        listed = self.run_json("session", "list", "--label", "who=e2e")
        self.assertEqual([one["name"] for one in listed], [name])
        self.run_tool("session", "delete", name)
        self.assertIn("NOT_FOUND", self.run_tool("session", "show", name, exit_code=2))

    def test_a_session_of_a_domain_makes_the_mesh_that_one_call_makes(self):
        plate = self.folder / "plate.poly"
        plate.write_text("8 2 0 0\n1 0 0\n2 4 0\n3 4 4\n4 0 4\n5 1 1\n6 3 1\n7 3 3\n8 1 3\n"
                         "10 1\n1 1 2 5\n2 2 3 5\n3 3 4 5\n4 4 1 5\n"
                         "5 5 6 9\n6 6 7 9\n7 7 8 9\n8 8 5 9\n9 1 5 0\n10 3 7 0\n"
                         "1\n1 2 2\n1\n1 0.5 2 3 0.05\n")
        land = self.folder / "land.geojson"
        land.write_text('{"type": "Polygon", "coordinates": '
                        '[[[0, 0], [9, 0], [9, 9], [0, 9]], [[2, 2], [5, 2], [5, 5], [2, 5]]]}')
        lines = self.folder / "lines.csv"
        lines.write_text("x,y\n0.1,0.1\n0.9,0.9\n\n0.1,0.8\n0.8,0.1\n")
        crossed = ("--segments", "--split-crossings")
        for domain, options in ((plate, ()), (land, ("--faces", "holes")), (lines, crossed)):
            with self.subTest(domain.name):
                name = self.create("--dimension", 2, "--size", 0.5)
                self.run_tool("upload", name, domain, *options)
                self.run_tool("upload", name, domain, *options, "--offset", 0)  # a repetition
                self.run_tool("refine", name)
                self.run_tool("download", name, "-o", self.folder / "session.msh")
                self.run_tool("mesh", domain, *options, "--size", 0.5, "-o", self.folder / "mesh.msh")
                mesh = (self.folder / "mesh.msh").read_bytes()
                self.assertEqual((self.folder / "session.msh").read_bytes(), mesh)
                self.assertIn(b"$PhysicalNames", mesh)
        refused = self.run_tool("upload", name, lines, "--segments", exit_code=7)
        self.assertIn("before the first refinement", refused)
        self.run_tool("refine", name, "--size", 0.2)
        self.run_tool("download", name, "-o", self.folder / "finer.vtu")
        self.run_tool("check", self.folder / "finer.vtu")

    def test_points_are_added_to_a_mesh(self):
        name = self.create("--domain", "0,0,1,1")
        cloud, more = uniform(300, 1), uniform(50, 2)
        self.run_tool("upload", name, "-", text=csv(cloud))
        self.run_tool("refine", name)
        added = self.run_json("add", name, "-", text=csv(more))
        self.assertEqual(len(added["vertices"]), 50)
        self.assertEqual(self.run_json("session", "show", name)["state"], "open")
        self.run_tool("refine", name, "--size", 0.05)
        self.run_tool("download", name, "-o", self.folder / "mesh.vtu")
        (self.folder / "all.csv").write_text(csv(cloud + more))
        report = self.run_json("check", self.folder / "mesh.vtu", "--rho", "1.41421357", "--size", 0.05)
        self.assertTrue(report["valid"])
        vertices = self.run_json("session", "show", name)["vertex_count"]
        self.assertEqual(report["vertices"], vertices)

        nearest = [line.split() for line in self.run_tool("cells", name, "--nearest").splitlines()]
        self.assertEqual([int(vertex) for vertex, _ in nearest], list(range(vertices)))
        cells = [json.loads(line) for line in self.run_tool("cells", name, "--output", "json").splitlines()]
        self.assertEqual(len(cells), vertices)
        neighbours = {cell["vertex"]: set(cell["neighbours"]) for cell in cells}
        for vertex, others in neighbours.items():
            for other in others:
                self.assertIn(vertex, neighbours[other])
        clipped = self.run_json("cells", name, 7, "--beta", 1.5)
        self.assertEqual(clipped["vertex"], 7)
        self.assertEqual(clipped["clip_radius"], 1.5 * float(nearest[7][1]))
        self.assertIn("OUT_OF_RANGE", self.run_tool("cells", name, vertices, exit_code=2))

    def test_ctrl_c_cancels_the_refinement_and_the_session_keeps_its_points(self):
        name = self.create("--domain", "0,0,1,1", "--size", 0.0005)
        self.run_tool("upload", name, "-", text=csv(uniform(100, 3)))
        operation = self.run_tool("refine", name, "--detach").strip()
        self.assertIn("SESSION_BUSY", self.run_tool("refine", name, "--output", "json", exit_code=7))
        self.assertIn("cancelled", self.run_tool("cancel", name))
        self.assertIn("CANCELLED", self.run_tool("watch", operation, exit_code=1))

        refine = subprocess.Popen([BIN / "wellspace", "refine", name], env=self.environment, stderr=subprocess.PIPE,
                                  text=True)
        while self.run_json("session", "show", name)["last_operation"] == operation:
            pass
        refine.send_signal(signal.SIGINT)
        _, errors = refine.communicate(timeout=PATIENCE)
        self.assertEqual(refine.returncode, 130, errors)
        self.run_tool("watch", name, exit_code=1)
        session = self.run_json("session", "show", name)
        self.assertEqual((session["state"], session["committed_points"]), ("open", 100))

    def test_an_upload_of_another_file_is_refused(self):
        name = self.create("--domain", "0,0,1,1")
        points = uniform(100, 4)
        self.run_tool("upload", name, "-", text=csv(points[:60]))
        self.run_tool("upload", name, "-", "--offset", 0, text=csv(points))
        for other, offset in ((uniform(100, 5), 0), (points[:50] + uniform(80, 6), 0), (points, 50)):
            errors = self.run_tool("upload", name, "-", "--offset", offset, "--output", "json", exit_code=7,
                                   text=csv(other))
            self.assertIn("has other points", errors)
        self.assertEqual(self.run_json("session", "show", name)["committed_points"], 100)

    def test_cancels_leave_the_next_mesh_as_it_would_have_been(self):
        meshes = []
        for cancels in range(3):
            name = self.create("--domain", "0,0,0,1,1,1", "--dimension", 3)
            generator = random.Random(7)
            points = [tuple(generator.random() for _ in range(3)) for _ in range(1500)]
            self.run_tool("upload", name, "-", text=csv(points[:1000]))
            self.run_tool("refine", name, "--quiet")
            for _ in range(cancels):
                self.run_tool("refine", name, "--size", 0.01, "--detach")
                self.run_tool("cancel", name)
                self.run_tool("watch", name, exit_code=1)
            self.run_tool("add", name, "-", text=csv(points[1000:1100]))
            self.run_tool("upload", name, "-", text=csv(points[1100:]))
            self.run_tool("refine", name, "--size", 0.1, "--quiet")
            self.run_tool("download", name, "-o", self.folder / "mesh.npz", "--quiet")
            meshes.append((self.folder / "mesh.npz").read_bytes())
        self.assertTrue(meshes[0] == meshes[1] == meshes[2])

    def test_a_detached_refinement_gets_to_its_end_when_the_server_is_stopped(self):
        with tempfile.TemporaryFile("w+") as log:
            server = Wellspaced("--grace", PATIENCE, log=log)
            self.addCleanup(server.kill)
            at = ("--server", server.address)
            name = self.run_tool("session", "create", "--domain", "0,0,1,1", "--size", 0.003, *at).strip()
            operation = self.run_tool("refine", name, "--detach", *at).strip()
            self.assertEqual(server.stop(), 0)
            log.seek(0)
            self.assertRegex(log.read(), f"event=refinement operation={operation} tenant=\\S+ code=OK")

    def test_errors_name_the_line_and_the_option(self):
        name = self.create("--domain", "0,0,1,1")
        outside = self.run_tool("upload", name, "-", text="0.5,0.5\n\n0.5,7\n", exit_code=2)
        self.assertIn("<stdin>:3: ", outside)
        self.assertIn("MESH_NOT_READY", self.run_tool("download", name, "-o", self.folder / "a.vtu", "--output", "json",
                                                      exit_code=7))
        self.assertIn("--rho: ", self.run_tool("refine", name, "--rho", 0.1, exit_code=2))
        self.assertIn("MISMATCH",
                      self.run_tool("refine", name, "--expected-revision", 99, "--output", "json", exit_code=7))

    def test_the_server_tells_about_itself(self):
        self.assertEqual(self.run_tool("server", "health"), "serving\n")
        self.assertEqual(self.run_tool("server", "health", "--service", "wellspace.v1.SessionService"), "serving\n")
        self.run_tool("server", "health", "--service", "no.such.Service", exit_code=2)
        self.assertEqual(self.run_json("server", "info")["server"], self.address)

    def test_the_commands_of_the_readme(self):
        blocks = re.findall(r"^```\n(.*?)^```", (ROOT / "README.md").read_text(), re.DOTALL | re.MULTILINE)
        blocks = [block for block in blocks if block.startswith(("wellspace mesh ", "export WELLSPACE_SERVER="))]
        self.assertEqual(len(blocks), 2)
        (self.folder / "examples").symlink_to(ROOT / "examples")
        environment = self.environment | {"PATH": f"{BIN}:{os.environ['PATH']}"}
        for block in blocks:
            script = "set -euo pipefail\n" + block.replace("127.0.0.1:7233", self.address)
            done = subprocess.run(["bash", "-c", script], cwd=self.folder, env=environment, capture_output=True,
                                  text=True, timeout=PATIENCE, check=False)
            self.assertEqual(done.returncode, 0, (block, done.stdout, done.stderr))
        for file in ("land.msh", "part.vtu", "spot.vtu", "spot-quality.png", "coast.vtu", "finer.vtu"):
            self.assertGreater((self.folder / file).stat().st_size, 1000, file)
        self.run_tool("check", self.folder / "finer.vtu", "--size", 5)
        self.assertEqual(self.run_json("session", "list", "--label", "project=coast"), [],
                         "deleted by the last command")

    def test_the_example_of_the_library(self):
        mesh = self.folder / "example.npz"
        out = self.run_tool(self.address, COAST, mesh, program="session_example")
        self.assertIn(" vertices, ", out)
        self.run_tool("check", mesh, "--rho", "1.41421357")
        self.assertEqual(self.run_json("session", "list", "--label", "made-by=session_example"), [])


if __name__ == "__main__":
    unittest.main()
