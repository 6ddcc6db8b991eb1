"""Domains in the plane: segments, markers, holes, regions and rules, in one call and in sessions."""

import unittest

import numpy as np
from support import Case, unit_box, volume

import wellspace
from wellspace import InvalidArgumentError, RegionPolygon, RegionSeed, WrongStateError

# A square of side 4 with a square hole of side 1 in its middle.
POINTS = np.array([[0, 0], [4, 0], [4, 4], [0, 4], [1.5, 1.5], [2.5, 1.5], [2.5, 2.5], [1.5, 2.5]], float)
RINGS = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4]])
MARKERS = [1, 1, 1, 1, 9, 9, 9, 9]


class DomainTest(Case):
    def test_hole_and_markers(self):
        mesh = wellspace.mesh(POINTS, segments=RINGS, markers=MARKERS, holes=[[2, 2]])
        self.assertAlmostEqual(volume(mesh) / 2, 15)
        self.assertEqual(mesh.facet_names, {1: "marker_1", 9: "marker_9"})
        edges = mesh.points[mesh.boundary("marker_9")]
        self.assertAlmostEqual(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum(), 4)
        self.assertEqual(mesh.statistics.domain.segments, 8)
        self.assertEqual(mesh.statistics.domain.min_input_angle_deg, 90)

    def test_names(self):
        walls = ["wall"] * 4 + ["inlet"] * 4
        mesh = wellspace.mesh(POINTS, segments=RINGS, markers=walls, regions=[(0.5, 0.5, "steel"), (2, 2, "air")])
        self.assertEqual(set(mesh.facet_names.values()), {"wall", "inlet"})
        self.assertEqual(set(mesh.region_names.values()), {"steel", "air"})
        edges = mesh.points[mesh.boundary("inlet")]
        self.assertAlmostEqual(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum(), 4)
        np.testing.assert_array_equal(mesh.boundary(mesh.tag("inlet")), mesh.boundary("inlet"))
        np.testing.assert_array_equal(mesh.region(2), mesh.region("air"))

        named = wellspace.mesh(POINTS, segments=RINGS, markers=MARKERS, marker_names={9: "inlet"},
                               regions=[(2, 2, 7)], region_names={7: "air"})
        self.assertEqual(named.facet_names, {1: "marker_1", 9: "inlet"})
        np.testing.assert_array_equal(named.boundary(9), named.boundary("inlet"))
        self.assertEqual(named.region_names[7], "air")
        for name in ("outlet", 5, True):
            with self.subTest(name), self.fails(InvalidArgumentError, "9: 'inlet'", field="name"):
                named.boundary(name)

    def test_numbers_that_are_taken_get_no_name(self):
        mesh = wellspace.mesh(POINTS, segments=RINGS, regions=[(0.5, 0.5, 1), (2, 2, "air")])
        self.assertEqual(mesh.region_names, {1: "region_1", 2: "air"})

    def test_names_of_sessions(self):
        with wellspace.Session(2) as session:
            session.upload(POINTS)
            session.add_segments(segments=RINGS[:4], markers=["wall"] * 4)
            session.add_segments(segments=RINGS[4:], markers=["inlet", "wall", "", "inlet"])
            session.refine()
            self.assertEqual(sorted(session.download().facet_names.values()), ["inlet", "unmarked", "wall"])

    def test_wrong_names(self):
        for given, message, field in (
            ({"marker_names": ["inlet"]}, "expected a dict", "marker_names"),
            ({"marker_names": {"a": "inlet"}}, "whole numbers", "marker_names"),
            ({"marker_names": {5: 5}}, "expected a name", "marker_names[5]"),
            ({"marker_names": {5: "a", 7: "a"}}, "names.markers[7]: it has the name of 5", "faces.names"),
            ({"region_names": {7: "domain"}}, "names.regions[7]: expected a name", "faces.names"),
            ({"markers": ["a", "b"]}, "8 whole numbers", "markers"),
        ):
            with self.subTest(given), self.fails(InvalidArgumentError, message, field=field):
                wellspace.mesh(POINTS, segments=RINGS, **given)

    def test_rules(self):
        for given, area in (
            ({}, 16),
            ({"faces": "holes", "holes": [[2, 2]]}, 15),
            ({"faces": "even-odd"}, 15),
            ({"faces": "union"}, 15),
            ({"faces": "union", "groups": [3, 3, 3, 3, 8, 8, 8, 8]}, 16),
            ({"faces": "box", "box": ([-1, -1], [5, 5])}, 36),
            ({"box": ([-1, -1], [5, 5])}, 36),
        ):
            with self.subTest(given):
                mesh = wellspace.mesh(POINTS, segments=RINGS, **given)
                self.assertAlmostEqual(volume(mesh) / 2, area)

    def test_groups_and_snap_distance_are_checked(self):
        for given, field, text in (
            ({"groups": [1, 2]}, "groups", "expected 8 whole numbers"),
            ({"groups": [0.5] * 8}, "groups", "whole numbers"),
            ({"groups": [0] * 7 + [-1]}, "groups", "groups[7] is -1"),
            ({"snap_distance": -1}, "snap_distance", "at least 0"),
            ({"snap_distance": float("nan")}, "snap_distance", "finite"),
        ):
            with self.subTest(given), self.fails(InvalidArgumentError, text, field=field):
                wellspace.mesh(POINTS, segments=RINGS, **given)
        with self.fails(InvalidArgumentError, "snap_distance", reason="INVALID_SEGMENTS"):
            wellspace.mesh(POINTS, segments=RINGS, snap_distance=0.1)

    def test_near_points(self):
        # A triangle beside the square, of which a corner is nearly one of the square and another near to its side.
        points = np.vstack([POINTS[:4], [[4.001, 4], [6, 2], [4.002, 1]]])
        segments = np.vstack([RINGS[:4], [[4, 5], [5, 6], [6, 4]]])
        arguments = {"segments": segments, "merge_distance": 0.01, "crossings": "snap", "snap_distance": 0.01}
        with wellspace.Session(2, merge_distance=0.01) as session:
            session.upload(points)
            session.add_segments(**{k: v for k, v in arguments.items() if k != "merge_distance"})
            session.refine()
            of_session = session.download()
        for mesh in (wellspace.mesh(points, **arguments), of_session):
            self.assertEqual(mesh.statistics.merged_points, 1)
            self.assertEqual(mesh.input_vertices[4], mesh.input_vertices[2])
            self.assertEqual(mesh.statistics.domain.near_points, 1)
            self.assertAlmostEqual(volume(mesh) / 2, 16 + 3 * 2 / 2, places=1)
        twins = np.vstack([POINTS[:4], [[4, np.nextafter(4, 5)], [6, 2], [5, 1]]])
        self.assertEqual(wellspace.mesh(twins, segments=segments).statistics.merged_points, 1)

    def test_seeds_outside_are_counted(self):
        mesh = wellspace.mesh(POINTS, segments=RINGS, holes=[[2, 2], [9, 9]])
        self.assertEqual(mesh.statistics.domain.unused_seeds, 1)
        self.assertEqual(mesh.statistics.domain.first_unused_seed, 1)

    def test_regions(self):
        regions = [(0.5, 0.5, 3), RegionSeed(2, 2, region=5, max_area=0.01)]
        mesh = wellspace.mesh(POINTS, segments=RINGS, regions=regions)
        self.assertEqual(set(mesh.region_names.values()), {"region_3", "region_5"})
        inner = mesh.points[mesh.region("region_5")]
        areas = np.linalg.det(inner[:, 1:] - inner[:, :1]) / 2
        self.assertAlmostEqual(areas.sum(), 1)
        self.assertLessEqual(areas.max(), 0.01)

    def test_a_polygon_that_is_cut_is_one_region(self):
        points = np.vstack([POINTS, [[0, 3], [4, 3]]])
        polygons = [RegionPolygon(0, 4, region=7), RegionPolygon(4, 4, region=8)]
        arguments = {"segments": RINGS, "open_segments": [[8, 9]], "faces": "holes", "regions": polygons}
        with wellspace.Session(2) as session:
            session.upload(points)
            session.add_segments(segments=RINGS[:4])
            session.add_segments(**arguments)  # a polygon has those of its own call, though others came before
            session.refine()
            of_session = session.download()
        for mesh in (wellspace.mesh(points, **arguments), of_session):
            for name, area in (("region_7", 15), ("region_8", 1)):
                corners = mesh.points[mesh.region(name)]
                self.assertAlmostEqual(np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 2, area)
        for polygon in (RegionPolygon(6, 4), RegionPolygon(0, 0), RegionPolygon(0, 4, region=2**31)):
            with self.subTest(polygon), self.fails(InvalidArgumentError, "regions[0]"):
                wellspace.mesh(POINTS, segments=RINGS, regions=[polygon])
        with self.fails(InvalidArgumentError, "not closed", reason="INVALID_SEGMENTS"):
            wellspace.mesh(POINTS, segments=RINGS, regions=[RegionPolygon(0, 3, region=7)])

    def test_open_segments(self):
        points = np.vstack([POINTS[:4], [[1, 2], [3, 2]]])
        mesh = wellspace.mesh(points, segments=RINGS[:4], markers=MARKERS[:4], open_segments=[[4, 5]], open_markers=[7],
                              faces="even-odd")
        self.assertAlmostEqual(volume(mesh) / 2, 16)
        edges = mesh.points[mesh.boundary("marker_7")]
        self.assertAlmostEqual(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum(), 2)
        self.assertTrue((edges[:, :, 1] == 2).all())

    def test_crossings(self):
        cross = {"segments": [[0, 2], [1, 3]], "box": unit_box(2)}
        points = np.array([[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]])
        with self.fails(InvalidArgumentError, "segments[0]", reason="INVALID_SEGMENTS"):
            wellspace.mesh(points, **cross)
        mesh = wellspace.mesh(points, crossings="split", **cross)
        self.assertEqual(mesh.statistics.domain.crossings, 1)
        self.assertTrue((mesh.points == 0.5).all(axis=1).any())

    def test_points_of_no_face(self):
        points = np.vstack([POINTS, [[10, 10]]])
        mesh = wellspace.mesh(points, segments=RINGS)
        self.assertEqual(mesh.input_vertices[8], -1)
        self.assertEqual(mesh.statistics.domain.unmeshed_points, 1)

    def test_more_segments_than_fit_into_a_request(self):
        angles = np.linspace(0, 2 * np.pi, 40_000, endpoint=False)
        points = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        ring = np.arange(40_000)
        mesh = wellspace.mesh(points, segments=np.stack([ring, np.roll(ring, -1)], axis=1), markers=ring % 2 + 1)
        self.assertAlmostEqual(volume(mesh) / 2, np.pi, places=6)
        self.assertEqual(set(mesh.facet_names), {1, 2})

    def test_estimate(self):
        estimate = wellspace.estimate(POINTS, segments=RINGS, holes=[[2, 2]], size=0.1)
        mesh = wellspace.mesh(POINTS, segments=RINGS, holes=[[2, 2]], size=0.1)
        self.assertLess(abs(np.log(estimate.vertices / len(mesh.points))), np.log(2))

    def test_wrong_input(self):
        with self.fails(InvalidArgumentError, "segments[1] names 8; expected numbers from 0, below 8",
                        field="segments[1]", argument="segments"):
            wellspace.mesh(POINTS, segments=[[0, 1], [2, 8]])
        with self.fails(InvalidArgumentError, "in 3-D", field="segments"):
            wellspace.mesh(np.zeros((3, 3)), segments=[[0, 1]])
        with self.fails(InvalidArgumentError, "", reason="INVALID_SEGMENTS"):
            wellspace.mesh(POINTS, segments=RINGS, holes=[[0, 2]])


class SessionTest(Case):
    def test_segments_in_pieces(self):
        with wellspace.Session(2) as session:
            session.add_segments(segments=RINGS[:4], markers=MARKERS[:4])
            session.upload(POINTS)
            session.add_segments(segments=RINGS[4:], markers=MARKERS[4:], holes=[[2, 2]])
            info = session.info()
            self.assertEqual((info.point_count, info.segment_count, info.seed_count), (8, 8, 1))
            session.add_segments(segments=RINGS[4:], markers=MARKERS[4:], holes=[[2, 2]], offset=(4, 0))
            self.assertEqual(session.info().segment_count, 8, "a repetition")
            session.refine()
            mesh = session.download()
            one = wellspace.mesh(POINTS, segments=RINGS, markers=MARKERS, holes=[[2, 2]])
            np.testing.assert_array_equal(mesh.simplices, one.simplices)
            self.assertEqual(mesh.facet_names, one.facet_names)
            with self.fails(WrongStateError, "", reason="DOMAIN_FIXED"):
                session.add_segments(segments=[[0, 2]])
            vertices = session.add([[0.5, 0.5]])
            session.refine()
            np.testing.assert_array_equal(session.download().points[vertices], [[0.5, 0.5]])

    def test_wrong_input(self):
        with wellspace.Session(3) as session, self.fails(InvalidArgumentError, "in 3-D", field="segments"):
            session.add_segments(segments=[[0, 1]])
        with wellspace.Session(2) as session:
            session.upload(POINTS)
            with self.fails(WrongStateError, "", reason="UPLOAD_MISMATCH"):
                session.add_segments(segments=RINGS)
                session.add_segments(segments=RINGS[::-1], offset=(0, 0))


if __name__ == "__main__":
    unittest.main()
