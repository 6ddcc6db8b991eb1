"""Every kind of cloud, meshed by the tool as a user would: `wellspace check` and meshio accept each mesh."""
import importlib.util
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import meshio
import numpy

ROOT = pathlib.Path(__file__).resolve().parents[2]
WELLSPACE = pathlib.Path(os.environ["WELLSPACE_BIN_DIR"]) / "wellspace"

spec = importlib.util.spec_from_file_location("make_clouds", ROOT / "bench" / "make_clouds.py")
make_clouds = importlib.util.module_from_spec(spec)
spec.loader.exec_module(make_clouds)

KINDS = ["uniform", "inner", "sphere", "clusters", "skew", "moment", "grid", "lines", "annuli"]


def degenerate_clouds(d):
    """Clouds in the unit box that have no general position."""
    corner = [[(c >> i) & 1 for i in range(d)] for c in range(2**d)]
    line = [[0.1 + 0.8 * i / 40] * d for i in range(41)]
    rounded = [[round(256 * x) / 256 for x in p] for p in make_clouds.cloud("uniform", d, 300)]
    on_faces = [[0.0 if i % d == k else x for k, x in enumerate(p)]
                for i, p in enumerate(make_clouds.cloud("inner", d, 60))]
    return {
        "none": [],
        "one": [[0.3] * d],
        "one on a corner": [[0.0] * d],
        "collinear": line,
        "coplanar": [p[:-1] + [0.5] for p in make_clouds.cloud("uniform", d, 200)],
        "corners": corner,
        "on faces": on_faces,
        "8 bits": rounded,
        "duplicates": line + line[::-1] + line[:3],
    }


class EveryCloud(unittest.TestCase):
    def run_tool(self, *arguments):
        done = subprocess.run([WELLSPACE, *arguments], capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(done.returncode, 0, done.stderr + done.stdout)
        return done.stdout

    def assert_meshed(self, folder, points, d, rho):
        cloud, mesh_file, stats_file = folder / "cloud.csv", folder / "mesh.vtu", folder / "stats.json"
        cloud.write_text("".join(",".join(map(repr, p)) + "\n" for p in points))
        unit_box = ",".join(["0"] * d + ["1"] * d)
        self.run_tool("mesh", cloud, "-o", mesh_file, "--dimension", str(d), "--domain", unit_box, "--rho", str(rho),
                      "--stats", stats_file, "--quiet")
        checked = ["check", mesh_file, "--rho", str(rho)]
        self.run_tool(*checked, *(["--cloud", cloud] if points else []))

        stats = json.loads(stats_file.read_text())
        mesh = meshio.read(mesh_file)
        self.assertEqual(mesh.points.shape, (stats["vertices"], 3))
        simplices, facets = mesh.cells
        self.assertEqual((simplices.type, len(simplices.data)), ("triangle" if d == 2 else "tetra", stats["simplices"]))
        self.assertEqual(facets.type, "line" if d == 2 else "triangle")
        self.assert_tagged(mesh, d)
        distinct = list(dict.fromkeys(map(tuple, points)))
        self.assertEqual(stats["duplicates"], len(points) - len(distinct))
        numpy.testing.assert_array_equal(mesh.points[:len(distinct), :d], numpy.array(distinct).reshape(-1, d))
        edges = mesh.points[mesh.cells[0].data]
        volumes = numpy.linalg.det((edges[:, 1:] - edges[:, :1])[:, :, :d]) / (2 if d == 2 else 6)
        self.assertGreater(volumes.min(), 0)
        self.assertAlmostEqual(volumes.sum(), 1, places=12)

    def assert_tagged(self, mesh, d):
        """Each facet lies on the face that its tag stands for, and those of a face are as large as it."""
        facets, tags = mesh.cells[1].data, mesh.cell_data["boundary"][1]
        corners = mesh.points[facets][:, :, :d]
        sizes = numpy.abs(corners[:, 1] - corners[:, 0]).sum(axis=1) if d == 2 else numpy.linalg.norm(
            numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        for face in range(2 * d):
            self.assertTrue((corners[tags == face + 1][:, :, face // 2] == face % 2).all())
            self.assertAlmostEqual(sizes[tags == face + 1].sum(), 1, places=12)
        self.assertEqual(set(mesh.cell_data["region"][0]), {1})

    def test_generated(self):
        for d, rho, n in ((2, 2**0.5, 900), (2, 1.0, 400), (3, 2.0, 343)):
            for kind in KINDS:
                with self.subTest(kind=kind, dimension=d, rho=rho), tempfile.TemporaryDirectory() as folder:
                    self.assert_meshed(pathlib.Path(folder), make_clouds.cloud(kind, d, n), d, rho)

    def test_degenerate(self):
        for d, rho in ((2, 2**0.5), (3, 2.0)):
            for name, points in degenerate_clouds(d).items():
                with self.subTest(name=name, dimension=d), tempfile.TemporaryDirectory() as folder:
                    self.assert_meshed(pathlib.Path(folder), points, d, rho)

    def test_four_dimensions_by_arrays(self):
        points = numpy.array(make_clouds.cloud("inner", 4, 20))
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            numpy.save(folder / "cloud.npy", points)
            self.run_tool("mesh", folder / "cloud.npy", "-o", folder / "mesh.npz", "--domain", "0,0,0,0,1,1,1,1",
                          "--stats", folder / "stats.json", "--quiet")
            self.run_tool("check", folder / "mesh.npz", "--cloud", folder / "cloud.npy", "--rho", "2.9")
            stats = json.loads((folder / "stats.json").read_text())
            with numpy.load(folder / "mesh.npz", allow_pickle=False) as mesh:
                vertices, simplices = mesh["points"], mesh["simplices"]
        self.assertEqual(vertices.shape, (stats["vertices"], 4))
        self.assertEqual(simplices.shape, (stats["simplices"], 5))
        numpy.testing.assert_array_equal(vertices[:20], points)
        edges = vertices[simplices]
        volumes = numpy.linalg.det(edges[:, 1:] - edges[:, :1]) / 24
        self.assertGreater(volumes.min(), 0)
        self.assertAlmostEqual(volumes.sum(), 1, places=12)

    def test_examples(self):
        for name, d in (("coast-110m", 2), ("spot", 3)):
            with self.subTest(name=name), tempfile.TemporaryDirectory() as folder:
                rows = (ROOT / "examples" / f"{name}.csv").read_text().splitlines()[1:]
                points = numpy.array([list(map(float, row.split(","))) for row in rows])
                low, high = points.min(axis=0), points.max(axis=0)
                scaled = 0.5 + (points - (low + high) / 2) * (0.8 / (high - low).max())
                self.assert_meshed(pathlib.Path(folder), scaled.tolist(), d, 2**0.5 if d == 2 else 2.0)


if __name__ == "__main__":
    unittest.main()
