"""Arguments: every parameter of the service can be reached, and errors name the row."""

import inspect
import os
import unittest

import numpy as np
from support import Case, unit_box

import wellspace.aio
from wellspace import InvalidArgumentError, _api, _arrays, _client, _domain, _parameters, _plane, _surface

# Fields of MeshParameters, and the argument with a value for it.
FIELDS = {
    "rho": ("rho", 2.5, 2.5),
    "domain": ("box", ([0, 0, 0], [1, 2, 3]), _api.message("Box")(low=[0, 0, 0], high=[1, 2, 3])),
    "margin": ("margin", 0.0, 0.0),
    "max_vertices": ("max_vertices", 10**6, 10**6),
    "threads": ("threads", 3, 3),
    "criterion": ("criterion", "well-spaced", 2),
    "max_circumradius": ("size", 0.25, 0.25),
    "size_boxes": ("size_boxes", [([0, 0, 0], [1, 1, 1], 0.5)],
                   [_api.message("SizeBox")(low=[0, 0, 0], high=[1, 1, 1], max_circumradius=0.5)]),
    "edge_length": ("edge_length", 0.1, 0.1),
    "gradation": ("gradation", 0.5, 0.5),
    "min_dihedral": ("min_dihedral", 0, 0.0),
    "pump_weights": ("pump_weights", True, True),
    "merge_distance": ("merge_distance", 1e-3, 1e-3),
    "periodic_axes": ("periodic", "xz", [0, 2]),
    "keep_vertices": ("keep_vertices", True, True),
}


class ParametersTest(Case):
    def filled(self, dimension=3, **given):
        return _parameters.fill(_api.message("MeshParameters")(), dimension, given)

    def test_every_field_has_an_argument(self):
        descriptor = _api.message("MeshParameters").DESCRIPTOR
        self.assertEqual({field.name for field in descriptor.fields} - {"dimension", "surface"}, set(FIELDS))
        names = {name for name, _, _ in FIELDS.values()} | {"min_angle"} | set(_parameters.SURFACE_NUMBERS)
        self.assertEqual(names, set(_parameters.Parameters.__annotations__))
        for field, (name, value, expected) in FIELDS.items():
            with self.subTest(name):
                message = self.filled(**{name: value})
                found = getattr(message, field)
                self.assertEqual(list(found) if isinstance(expected, list) else found, expected)
                others = {one.name for one, _ in message.ListFields()} - {"dimension", field}
                self.assertEqual(others, set(), "nothing else is set")

    def test_what_is_asked_of_a_surface(self):
        fields = {field.name for field in _api.message("SurfaceParameters").DESCRIPTOR.fields}
        self.assertEqual(fields - set(_parameters.SURFACE_NUMBERS.values()), {"outside_rho"}, "of no use to users")
        for name, field in _parameters.SURFACE_NUMBERS.items():
            with self.subTest(name):
                message = self.filled(**{name: 0.25})
                self.assertEqual([(one.name, value) for one, value in message.surface.ListFields()], [(field, 0.25)])
                self.assertEqual(_parameters.read(message)[name], 0.25)
        self.assertFalse(self.filled(rho=2).HasField("surface"))
        message = self.filled(facet_length=0.5, tolerance=0.1)
        _parameters.fill(message, 3, {"facet_length": float("inf")})
        self.assertFalse(message.surface.HasField("edge_length"), "infinity takes it back")

    def test_parameters_read_back_are_those_given(self):
        given = {name: value for name, value, _ in FIELDS.values()}
        read = _parameters.read(self.filled(**given))
        self.assertEqual(read.pop("box"), ((0, 0, 0), (1, 2, 3)))
        self.assertEqual(read.pop("size_boxes"), [((0, 0, 0), (1, 1, 1), 0.5)])
        self.assertEqual(read, {name: value for name, value in given.items() if name in read})
        self.assertEqual(len(read), len(given) - 2)

    def test_a_criterion_of_a_newer_server_is_unknown(self):
        message = self.filled()
        for number, name in ((0, "radius-edge"), (1, "radius-edge"), (2, "well-spaced"), (1000, "unknown")):
            message.criterion = number
            self.assertEqual(_parameters.read(message)["criterion"], name)

    def test_signatures_and_docstrings_have_all(self):
        names = [*_parameters.Parameters.__annotations__]
        segments = [*_plane.PlaneArguments.__annotations__]
        triangles = [*_surface.SurfaceArguments.__annotations__]
        self.assertEqual(set(_domain.DomainArguments.__annotations__), set(segments) & set(triangles))
        for function, expected in ((wellspace.mesh, names + segments + triangles),
                                   (wellspace.estimate, names + segments + triangles),
                                   (wellspace.Client.mesh, names + segments + triangles),
                                   (wellspace.Session.__init__, names),
                                   (wellspace.Session.refine, names), (wellspace.Session.add_segments, segments),
                                   (wellspace.Session.add_triangles, triangles),
                                   (wellspace.aio.mesh, names + segments + triangles)):
            for name in expected:
                self.assertIn(name, inspect.signature(function).parameters, function)
        for document in (wellspace.mesh.__doc__, wellspace.Session.__doc__, wellspace.Session.refine.__doc__):
            for name in names:
                self.assertIn(f"\n{name} : ", inspect.cleandoc(document))
            self.assertNotIn("**arguments", document)

    def test_min_angle_is_rho(self):
        self.assertAlmostEqual(self.filled(2, min_angle=30).rho, 1)
        with self.fails(InvalidArgumentError, "2-D", field="min_angle"):
            self.filled(3, min_angle=30)
        with self.fails(InvalidArgumentError, "33.7", field="min_angle"):
            self.filled(2, min_angle=34)
        with self.fails(InvalidArgumentError, "one of them", field="min_angle"):
            self.filled(2, min_angle=20, rho=2)

    def test_wrong_parameters(self):
        for given, message, field in (
            ({"size": "small"}, "size is 'small'; expected a number", "size"),
            ({"rho": [1, 2]}, "expected a number", "rho"),
            ({"threads": -1}, "expected a whole number from 0", "threads"),
            ({"max_vertices": 1.5}, "expected a whole number", "max_vertices"),
            ({"criterion": "radius_edge"}, "expected one of 'radius-edge', 'well-spaced'", "criterion"),
            ({"box": [0, 1, 2]}, "expected (low, high)", "box"),
            ({"box": ([0, 0], [1, 1])}, "expected 3 numbers", "box.low"),
            ({"box": ([0, 0, 0], [1, np.inf, 1])}, "box.high[1] is inf", "box.high[1]"),
            ({"size_boxes": [(0, 1)]}, "expected (low, high, size)", "size_boxes[0]"),
            ({"size_boxes": [([0] * 3, [1] * 3, 1), ([0] * 3, [1] * 2, 1)]}, "3 numbers", "size_boxes[1].high"),
            ({"size_boxes": [([0] * 3, [1] * 3, "a")]}, "expected a number", "size_boxes[0].size"),
        ):
            with self.subTest(given), self.fails(InvalidArgumentError, message, field=field, reason=""):
                self.filled(**given)

    def test_unknown_names_are_as_everywhere_in_python(self):
        with self.assertRaisesRegex(TypeError, r"mesh\(\) got an unexpected keyword argument 'sise'"):
            _client._Cloud([[0, 0]], {"sise": 1}, "mesh")

    def test_threads_that_help(self):
        few, many = np.zeros((100, 3)), np.zeros((10**6, 3))
        self.assertEqual(_parameters.helpful_threads(few, {}), 1)
        self.assertEqual(_parameters.helpful_threads(many, {}), os.cpu_count())
        self.assertEqual(_parameters.helpful_threads(few, {"box": unit_box(3), "size": 1e-3}), os.cpu_count())


class ArraysTest(Case):
    def test_good_arrays_are_not_copied(self):
        points = np.random.default_rng(1).uniform(size=(10, 3))
        self.assertIs(_arrays.coordinates(points, "points"), points)

    def test_what_can_be_converted_is(self):
        for points in ([[0, 1], [2, 3]], ((0.0, 1), (2, 3)), np.array([[0, 1], [2, 3]], np.float32),
                       np.array([[0, 2], [1, 3]], np.int16).T, np.ma.masked_array([[0.0, 1], [2, 3]], mask=False)):
            found = _arrays.coordinates(points, "points")
            np.testing.assert_array_equal(found, [[0, 1], [2, 3]])
            self.assertTrue(found.flags.c_contiguous and found.dtype == np.float64)

    def test_whole_numbers_that_doubles_are_stay(self):
        large = np.array([[0, 2**53], [2**60, -(2**62)]])
        np.testing.assert_array_equal(_arrays.coordinates(large, "points"), large)

    def test_wrong_points(self):
        nan = np.zeros((5, 3))
        nan[3, 1] = np.nan
        for points, message, field in (
            ([1.0, 2.0, 3.0], "shape (3,); expected (n, d)", "points"),
            (np.zeros((2, 7)), "shape (2, 7), which looks transposed; expected (n, d): a row for each point, "
             "with at most 6 coordinates", "points"),
            (np.zeros((3, 1000)), "points.T has them", "points"),
            (np.zeros((2, 2, 2)), "shape (2, 2, 2)", "points"),
            (nan, "points[3] coordinate 1 is nan", "points[3]"),
            ([[0, 1], [2, -np.inf]], "points[1] coordinate 1 is -inf", "points[1]"),
            ([[0, 1], [2, 3], [4]], "points[2] is [4]", "points[2]"),
            ([[0, 1], ["2", 3]], "points[1] is ['2', 3]", "points[1]"),
            ([[0, 1], [None, 3]], "points[1] is [None, 3]", "points[1]"),
            ([[0j, 1]], "points[0] is", "points[0]"),
            ("points.csv", "expected numbers", "points"),
            (np.ma.masked_array([[0.0, 1], [2, 3]], mask=[[0, 0], [0, 1]]), "points[1] is masked", "points[1]"),
            (np.array([[0, 1], [2**53 + 1, 3]]), "points[1] has 9007199254740993, which no double is", "points[1]"),
            (np.array([[0, 1], [2, 2**64 - 1]], np.uint64), "points[1] has 18446744073709551615", "points[1]"),
        ):
            with self.subTest(points), self.fails(InvalidArgumentError, message, field=field):
                _arrays.coordinates(points, "points")
        with self.fails(InvalidArgumentError, "3 coordinates; expected 2", field="points"):
            _arrays.coordinates(np.zeros((5, 3)), "points", 2)
        with self.fails(InvalidArgumentError, "shape (2, 5), which looks transposed", field="holes"):
            _arrays.coordinates(np.zeros((2, 5)), "holes", 2)

    def test_small_arrays_are_not_called_transposed(self):
        for shape in ((2, 2), (2, 3), (3, 2), (6, 6), (7, 2), (1, 2), (0, 3)):
            self.assertEqual(_arrays.coordinates(np.zeros(shape), "points").shape, shape)
        with self.fails(InvalidArgumentError, "points of 7 coordinates; expected 2"):
            _arrays.coordinates(np.zeros((3, 7)), "points", 2)

    def test_wrong_indices(self):
        for values, message, field in (
            ([[0, 5]], "segments[0] names 5; expected numbers from 0, below 5", "segments[0]"),
            ([[0, 1], [-1, 2]], "segments[1] names -1", "segments[1]"),
            ([0, 1], "expected (n, 2)", "segments"),
            ([[0, 1, 2]], "expected (n, 2)", "segments"),
            ([[0.0, 1.0]], "float64; expected whole numbers", "segments"),
            ([[0, 1, 2], [1, 2, 0]], "shape (2, 3), which looks transposed; expected (n, 2)", "segments"),
        ):
            with self.subTest(values), self.fails(InvalidArgumentError, message, field=field):
                _arrays.indices(values, "segments", 2, 5)

    def test_wrong_domains(self):
        for given, message, field in (
            ({"segments": [[0, 1]], "markers": [1, 2]}, "expected 1 whole numbers", "markers"),
            ({"segments": [[0, 1]], "markers": [2**31]}, "markers[0] is 2147483648", "markers[0]"),
            ({"open_segments": [[0, 1]], "open_markers": [0.5]}, "expected 1 whole numbers", "open_markers"),
            ({"holes": [0.5, 0.5]}, "expected (n, d)", "holes"),
            ({"holes": [[0.5, 0.5, 0.5]]}, "expected 2", "holes"),
            ({"regions": [(1,)]}, "expected (x, y, region, max_area)", "regions[0]"),
            ({"regions": [(1, 1, 1), (1, 1, 0.5)]}, "region 0.5; expected a whole number", "regions[1]"),
            ({"regions": [(1, 1, 1, 0)]}, "max_area 0; expected a number above 0, or nothing", "regions[0]"),
            ({"regions": [(1, 1, 1, -1.0)]}, "max_area -1.0", "regions[0]"),
            ({"regions": [(1, np.nan)]}, "nan", "regions[0][0]"),
            ({"faces": "even_odd"}, "'box', 'holes', 'even-odd', 'union'", "faces"),
            ({"crossings": "ignore"}, "'refuse', 'split'", "crossings"),
        ):
            with self.subTest(given), self.fails(InvalidArgumentError, message, field=field):
                _plane.make_plane(given, 5)


if __name__ == "__main__":
    unittest.main()
