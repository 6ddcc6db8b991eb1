"""Periodic boxes: pairs of vertices, in one call, in sessions and in files that Gmsh reads."""

import json
import pathlib
import subprocess
import tempfile
import unittest

import gmsh
import numpy as np
from support import PATIENCE, TOOL, Case, uniform, unit_box

import wellspace
from wellspace import InvalidArgumentError

AXES = "xyz"


def on_sides(count, dimension, seed):
    """Points of which each is on a side of the unit box, some on edges and corners."""
    random = np.random.default_rng(seed)
    points = random.uniform(0.05, 0.95, (count, dimension))
    points[np.arange(count), np.arange(count) % dimension] = random.integers(0, 2, count)
    on = random.uniform(size=points.shape) < 0.2
    return np.where(on, random.integers(0, 2, points.shape), points)


class PeriodicTest(Case):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def check_pairs(self, mesh, axes):
        """The pairs are all vertices on the sides across each axis, and facets on both sides are the same."""
        for axis in axes:
            pairs = mesh.periodic_pairs(axis)
            self.assertEqual(pairs.dtype, mesh.simplices.dtype)
            low, high = pairs.T
            k = AXES.index(axis)
            np.testing.assert_array_equal(low, np.flatnonzero(mesh.points[:, k] == mesh.box[0, k]))
            np.testing.assert_array_equal(np.sort(high), np.flatnonzero(mesh.points[:, k] == mesh.box[1, k]))
            others = np.delete(mesh.points, k, axis=1)
            np.testing.assert_array_equal(others[low], others[high])
            partner = dict(pairs.tolist())
            facets = {frozenset(partner[v] for v in facet) for facet in mesh.boundary(f"{axis}min").tolist()}
            self.assertEqual(facets, {frozenset(facet) for facet in mesh.boundary(f"{axis}max").tolist()})

    def test_opposite_sides_match(self):
        for dimension in (2, 3):
            points = np.concatenate([uniform(500, dimension), on_sides(50, dimension, 3)])
            for periodic in ("x", "xy", "y,x", [1], ["x", "y"], range(dimension)):
                mesh = wellspace.mesh(points, box=unit_box(dimension), periodic=periodic)
                names = [AXES[a] if isinstance(a, int) else a for a in periodic if a != ","]
                self.check_pairs(mesh, names)
                np.testing.assert_array_equal(mesh.points[mesh.input_vertices], points)

    def test_a_box_around_the_points_may_be_periodic(self):
        mesh = wellspace.mesh(uniform(300, 3), periodic="xyz", edge_length=0.4)
        self.check_pairs(mesh, AXES)
        self.assertGreaterEqual(wellspace.estimate(uniform(300, 3), periodic="xyz").vertices, 300)

    def test_what_is_refused(self):
        points = uniform(10, 2)
        for wrong, message in (("q", "'q'"), ("xx", "axis 0 is there already"), ("z", "2 is no axis in 2-D"), (3, "3")):
            with self.fails(InvalidArgumentError, message) as caught:
                wellspace.mesh(points, periodic=wrong)
            self.assertIn("periodic", caught.exception.field)
        with self.fails(InvalidArgumentError, "periodic_axes", field="parameters.pump_weights"):
            wellspace.mesh(uniform(10, 3), periodic="x", pump_weights=True)
        with self.fails(InvalidArgumentError, "4-D"):
            wellspace.mesh(uniform(10, 4), periodic="x")
        with self.fails(InvalidArgumentError, "is not periodic"):
            wellspace.mesh([[0, 0], [1, 0], [0, 1]], segments=[[0, 1], [1, 2], [2, 0]], periodic="x")
        mesh = wellspace.mesh(uniform(100, 2), box=unit_box(2))
        with self.fails(InvalidArgumentError, "do not match", field="axis"):
            mesh.periodic_pairs("x")
        with self.fails(InvalidArgumentError, "2-D", field="axis"):
            mesh.periodic_pairs("z")
        with self.fails(InvalidArgumentError, "no place for pairs", field="periodic"):
            mesh.save(self.folder / "mesh.vtu", periodic="x")
        with self.fails(InvalidArgumentError, "do not match"):
            mesh.save(self.folder / "mesh.npz", periodic="x")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_sessions_keep_their_axes(self):
        with wellspace.Session(3, box=unit_box(3), periodic="xy") as session:
            self.assertEqual(session.info().parameters["periodic"], "xy")
            session.upload(uniform(500, 3))
            session.refine()
            self.check_pairs(session.download(), "xy")
            session.add(on_sides(20, 3, 5))
            session.refine(size=0.2)
            self.check_pairs(session.download(), "xy")
            self.assertEqual(session.info().parameters["periodic"], "xy")
            session.refine(periodic="yx", size=0.2)
            with self.fails(InvalidArgumentError, "cannot change"):
                session.refine(periodic="x")
            with self.fails(InvalidArgumentError, "periodic"):
                session.refine(pump_weights=True)

    def run_tool(self, *arguments):
        command = [str(TOOL), *map(str, arguments)]
        return subprocess.run(
            command, cwd=self.folder, capture_output=True, text=True, timeout=PATIENCE, check=False
        )

    def pairs_of_gmsh(self, name, dimension):
        """The pairs that Gmsh has read, by the letter of their axis: numbers of vertices, from 0 on."""
        gmsh.initialize()
        try:
            return self.pairs_of_opened(name, dimension)
        finally:
            gmsh.finalize()

    def pairs_of_opened(self, name, dimension):
        gmsh.option.setNumber("General.Verbosity", 1)
        gmsh.open(str(self.folder / name))
        found = {}
        for d, tag in gmsh.model.getEntities(dimension - 1):
            master, nodes, masters, affine = gmsh.model.mesh.getPeriodicNodes(d, tag, False)
            if master != tag:
                axis = AXES[(tag - 1) // 2]
                self.assertEqual((tag, master), (2 * AXES.index(axis) + 2, 2 * AXES.index(axis) + 1))
                found[axis] = sorted((int(m) - 1, int(n) - 1) for m, n in zip(masters, nodes))
                matrix = np.array(affine).reshape(4, 4)
                self.assertEqual(matrix[AXES.index(axis), 3], 1)
                np.testing.assert_array_equal(matrix[:3, :3], np.eye(3))
        return found

    def pairs_of_text(self, name):
        """The same of a file of version 2.2, of which Gmsh takes pairs only where it has the geometry as well."""
        text = (self.folder / name).read_text().partition("$Periodic\n")[2].partition("$EndPeriodic")[0]
        lines = iter(text.splitlines())
        found = {}
        for _ in range(int(next(lines))):
            dimension, tag, master = map(int, next(lines).split())
            self.assertEqual(master, tag - 1)
            affine = next(lines).split()
            self.assertEqual((affine[0], len(affine)), ("Affine", 17))
            rows = [tuple(map(int, next(lines).split())) for _ in range(int(next(lines)))]
            found[AXES[(tag - 1) // 2]] = sorted((m - 1, n - 1) for n, m in rows)
        self.assertEqual(list(lines), [])
        return found

    def test_files_of_the_tool_have_the_pairs(self):
        for dimension in (2, 3):
            points = np.concatenate([uniform(300, dimension), on_sides(40, dimension, 7)])
            np.savetxt(self.folder / "points.csv", points, delimiter=",", fmt="%.17g")
            box = ",".join(map(str, sum(unit_box(dimension), [])))
            mesh = wellspace.mesh(points, box=unit_box(dimension), periodic="xy")
            expected = {axis: mesh.periodic_pairs(axis).tolist() for axis in "xy"}
            for name, options in (("a.npz", ()), ("a.msh", ()), ("b.msh", ("--format", "msh22"))):
                done = self.run_tool(
                    "mesh", "points.csv", "-o", name, "--domain", box, "--periodic", "y,x", *options
                )
                self.assertEqual(done.returncode, 0, done.stderr)
                checked = self.run_tool("check", name, "--periodic", "x,y", "--rho", "2" if dimension == 3 else "1.415")
                self.assertEqual((checked.returncode, checked.stdout[-6:]), (0, "valid\n"), checked.stdout)
                if name.endswith(".npz"):
                    with np.load(self.folder / name) as arrays:
                        found = {key[-1]: arrays[key].tolist() for key in arrays.files if key.startswith("periodic")}
                    self.assertEqual(found, expected)
                else:
                    is_old = name == "b.msh"
                    found = self.pairs_of_text(name) if is_old else self.pairs_of_gmsh(name, dimension)
                    self.assertEqual(found, {axis: [tuple(p) for p in rows] for axis, rows in expected.items()})
            told = self.run_tool("mesh", "points.csv", "-o", "a.vtu", "--domain", box, "--periodic", "x")
            self.assertIn("no place for the pairs of vertices", told.stderr)
            refused = self.run_tool("check", "a.vtu", "--periodic", "x,y", "--output", "json")
            self.assertEqual(refused.returncode, 1)
            self.assertRegex(json.loads(refused.stdout)["violation"], "has no image on y(min|max)$")

    def test_save_writes_pairs(self):
        points = uniform(200, 3)
        mesh = wellspace.mesh(points, box=unit_box(3), periodic="xz")
        mesh.save(self.folder / "mesh.npz", periodic="xz")
        with np.load(self.folder / "mesh.npz") as arrays:
            np.testing.assert_array_equal(arrays["periodic_z"], mesh.periodic_pairs("z"))
            self.assertNotIn("periodic_y", arrays.files)
        again = wellspace.Mesh.load(self.folder / "mesh.npz")
        np.testing.assert_array_equal(again.periodic_pairs(0), mesh.periodic_pairs(0))
        mesh.save(self.folder / "mesh.msh", periodic="xz")
        pairs = self.pairs_of_gmsh("mesh.msh", 3)
        self.assertEqual(pairs["z"], [tuple(p) for p in mesh.periodic_pairs("z").tolist()])
        mesh.save(self.folder / "second.npz", periodic="xz", order=2)
        with np.load(self.folder / "second.npz") as arrays:
            low, high = arrays["periodic_x"].T
            self.assertEqual(len(low), np.count_nonzero(arrays["points"][:, 0] == 0))
            np.testing.assert_array_equal(arrays["points"][low, 1:], arrays["points"][high, 1:])

    def test_options_of_the_tool(self):
        for text in ("w", "x,,y", "xy", ""):
            done = self.run_tool("mesh", "points.csv", "-o", "a.vtu", "--periodic", text)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn("expected axes out of x, y and z", done.stderr)
        np.savetxt(self.folder / "points.csv", uniform(20, 2), delimiter=",")
        for options, message in (
            (("--periodic", "z"), "--periodic"),
            (("--periodic", "x,x"), "there already"),
        ):
            done = self.run_tool("mesh", "points.csv", "-o", "a.npz", *options)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(message, done.stderr)


if __name__ == "__main__":
    unittest.main()
