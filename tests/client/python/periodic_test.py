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


def unit_cell(markers=()):
    """The unit square with a disc about a point of its left side, which comes back at the right one."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, 17)
    arc = 0.5 + 0.25 * np.column_stack([np.cos(angles), np.sin(angles)]) - [0.5, 0]
    arc[[0, -1]] = [[0, 0.25], [0, 0.75]]
    other = arc[::-1] * [-1, 1] + [1, 0]
    corners = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    points = np.concatenate([corners, arc, other])
    left, right = [0, 4, 20, 3], [1, 37, 21, 2]
    chains = [[0, 1], right, [2, 3], left, list(range(4, 21)), list(range(21, 38))]
    segments = [pair for chain in chains for pair in zip(chain, chain[1:])]
    tags = [tag for chain, tag in zip(chains, markers) for _ in chain[1:]]
    return points, {"segments": segments, **({"markers": tags} if tags else {}), "faces": "holes",
                    "regions": [(0.01, 0.5, 1), (0.99, 0.5, 1), (0.5, 0.1, 2)]}


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
        with self.fails(InvalidArgumentError, "no image on the side", field="segments.ends"):
            wellspace.mesh([[0, 0], [1, 0], [0, 1]], segments=[[0, 1], [1, 2], [2, 0]], faces="holes", periodic="x")
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

    def check_sides(self, mesh, axes):
        """The pairs are all vertices on the sides of a domain's bounding rectangle."""
        for axis in axes:
            k = AXES.index(axis)
            low, high = mesh.periodic_pairs(axis).T
            np.testing.assert_array_equal(low, np.flatnonzero(mesh.points[:, k] == 0))
            np.testing.assert_array_equal(np.sort(high), np.flatnonzero(mesh.points[:, k] == 1))
            np.testing.assert_array_equal(mesh.points[low, 1 - k], mesh.points[high, 1 - k])

    def test_domains_in_the_plane(self):
        points, features = unit_cell()
        plain = wellspace.mesh(points, **features, size=0.02)
        for periodic in ("x", "xy"):
            mesh = wellspace.mesh(points, **features, size=0.02, periodic=periodic)
            self.check_sides(mesh, periodic)
            self.assertLess(len(mesh.points), 1.03 * len(plain.points))
            mesh.save(self.folder / "cell.npz", periodic=periodic)
            checked = self.run_tool("check", "cell.npz", "--periodic", ",".join(periodic), "--rho", "1.415")
            self.assertEqual((checked.returncode, checked.stdout[-6:]), (0, "valid\n"), checked.stdout)
        # A fault that the check has to find: a vertex on one side a little farther along.
        with np.load(self.folder / "cell.npz") as arrays:
            changed = {name: arrays[name].copy() for name in arrays.files if not name.startswith("periodic")}
        on = np.flatnonzero((changed["points"][:, 0] == 1) & (abs(changed["points"][:, 1] - 0.9) < 0.05))
        changed["points"][on[0], 1] += 1e-9
        np.savez(self.folder / "changed.npz", **changed)
        refused = self.run_tool("check", "changed.npz", "--periodic", "x", "--output", "json")
        self.assertEqual(refused.returncode, 1)
        self.assertRegex(json.loads(refused.stdout)["violation"], "has no image on x(min|max)$")
        with self.fails(InvalidArgumentError, "points[20] at (0, 0.75), on the side x = 0", field="segments.ends"):
            moved = points.copy()
            moved[21, 1] += 1e-16 + 1e-15
            wellspace.mesh(moved, **features, periodic="x")

    def test_sessions_of_domains(self):
        points, features = unit_cell()
        with wellspace.Session(2, periodic="xy") as session:
            session.upload(points)
            session.add_segments(**features)
            session.refine(size=0.1)
            self.check_sides(session.download(), "xy")
            session.add([[0, 0.1], [0.3, 1], [0.5, 0.5]])
            session.refine(size=0.05)
            mesh = session.download()
            self.check_sides(mesh, "xy")
            for place in ([0, 0.1], [1, 0.1], [0.3, 0], [0.3, 1]):
                self.assertTrue((mesh.points == place).all(axis=1).any(), place)

    def test_msh_of_a_domain_wants_a_part_on_each_side(self):
        points, features = unit_cell(markers=(1, 2, 3, 4, 5, 5))
        mesh = wellspace.mesh(points, **features, periodic="xy")
        mesh.save(self.folder / "cell.msh", periodic="xy")
        gmsh.initialize()
        self.addCleanup(gmsh.finalize)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(self.folder / "cell.msh"))
        found = {}
        for _, tag in gmsh.model.getEntities(1):
            master, nodes, masters, _ = gmsh.model.mesh.getPeriodicNodes(1, tag, False)
            if master != tag:
                found[tag, master] = sorted((int(m) - 1, int(n) - 1) for m, n in zip(masters, nodes))
        expected = [[tuple(pair) for pair in mesh.periodic_pairs(axis).tolist()] for axis in "xy"]
        self.assertEqual(sorted(found.values()), sorted(expected))
        points, features = unit_cell()
        with self.fails(InvalidArgumentError, "expected one part on each of the two sides"):
            wellspace.mesh(points, **features, periodic="x").save(self.folder / "cell.msh", periodic="x")

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
