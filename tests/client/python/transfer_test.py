"""Fields that a server carries from mesh to mesh of a session."""

import asyncio
import dataclasses
import time
import unittest

import numpy as np
from support import Case, uniform, unit_box, volumes

import wellspace
import wellspace.aio
from wellspace import ConflictError, InvalidArgumentError, WrongStateError


class TransferTest(Case):
    def refined(self, session, size):
        session.refine(size=size)
        return session.download()

    def test_linear_functions_are_carried_exactly(self):
        for dimension in (2, 3, 4):
            with wellspace.Session(dimension, box=unit_box(dimension), min_dihedral=0) as session:
                session.upload(uniform(50, dimension))
                session.refine()
                before = session.download()
                session.add(uniform(10, dimension, seed=2))
                session.refine()
                after = session.download(since=before)
                carried = session.transfer(before.points, before, revision=after.revision)
                np.testing.assert_allclose(carried, after.points, atol=1e-13)
                kept = len(before.points)
                still = np.setdiff1d(np.arange(kept), after.moved_vertices)
                np.testing.assert_array_equal(carried[still], before.points[still])
                # By its revision, and as scalars.
                carried = session.transfer(before.points.sum(axis=1), before.revision)
                np.testing.assert_allclose(carried, after.points.sum(axis=1), atol=1e-13)

    def test_a_slanted_domain_has_vertices_beside_it_by_rounding(self):
        corners = np.array([[0, 0.1], [0.9, 0], [1, 0.8], [0.3, 1.1]])
        ring = [[0, 1], [1, 2], [2, 3], [3, 0]]
        with wellspace.Session(2, size=0.3) as session:
            session.upload(corners)
            session.add_segments(segments=ring)
            before = self.refined(session, 0.3)
            after = self.refined(session, 0.02)
            np.testing.assert_allclose(session.transfer(before.points, before), after.points, atol=1e-13)

    def test_the_integral_is_kept(self):
        for dimension in (2, 3):
            with wellspace.Session(dimension, box=unit_box(dimension)) as session:
                session.upload(uniform(50, dimension))
                before = self.refined(session, 0.2)
                session.refine(size=0.15, restart=True)
                after = session.download()
                values = np.random.default_rng(1).normal(size=(len(before.simplices), 3))
                carried = session.transfer(values, before, place="simplices", conservative=True)
                self.assertEqual(carried.shape, (len(after.simplices), 3))
                size = volumes(before) @ np.abs(values)
                np.testing.assert_array_less(np.abs(volumes(after) @ carried - volumes(before) @ values), 1e-12 * size)
                plain = session.transfer(values, before, place="simplices")
                self.assertTrue(np.isin(plain, values).all())

    def test_the_shape_is_that_of_the_values(self):
        with wellspace.Session(2, box=unit_box(2)) as session:
            before = self.refined(session, 0.3)
            after = self.refined(session, 0.2)
            n = len(before.points)
            self.assertEqual(session.transfer(np.ones((n, 2, 3)), before).shape, (len(after.points), 2, 3))
            self.assertEqual(session.transfer(np.arange(n), before).dtype, np.float64)
            self.assertEqual(session.transfer(np.ones((n, 64)), before).shape, (len(after.points), 64))

    def test_errors_name_their_cause(self):
        with wellspace.Session(2, box=unit_box(2)) as session:
            with self.fails(WrongStateError, "no mesh yet", reason="MESH_NOT_READY"):
                session.transfer([1.0], 1)
            first = self.refined(session, 0.4)
            second = self.refined(session, 0.3)
            third = self.refined(session, 0.2)
            n = len(second.points)
            with self.fails(WrongStateError, f"revision {first.revision} is not kept", reason="MESH_NOT_KEPT"):
                session.transfer(np.ones(len(first.points)), first)
            with self.fails(InvalidArgumentError, f"expected {n} rows", field="values"):
                session.transfer(np.ones(n + 1), second)
            with self.fails(InvalidArgumentError, f"expected {n}: the mesh of revision"):
                session.transfer(np.ones(n - 1), second.revision)
            wrong = np.ones(n)
            wrong[7] = np.nan
            with self.fails(InvalidArgumentError, "values[7] is nan"):
                session.transfer(wrong, second)
            with self.fails(InvalidArgumentError, "with 65 numbers in a row", field="values"):
                session.transfer(np.ones((n, 65)), second)
            with self.fails(InvalidArgumentError, "with 0 numbers in a row", field="values"):
                session.transfer(np.ones((n, 0)), second)
            with self.fails(InvalidArgumentError, "'vertices', 'simplices'", field="place"):
                session.transfer(np.ones(n), second, place="edges")
            with self.fails(InvalidArgumentError, "start.conservative"):
                session.transfer(np.ones(n), second, conservative=True)
            with self.fails(ConflictError, "", reason="REVISION_MISMATCH"):
                session.transfer(np.ones(n), second, revision=third.revision + 1)
            with self.fails(InvalidArgumentError, "from_mesh is 0", field="from_mesh"):
                session.transfer(np.ones(n), dataclasses.replace(second, revision=0))
            with self.fails(InvalidArgumentError, "from_mesh is None", field="from_mesh"):
                session.transfer(np.ones(n), None)
            np.testing.assert_array_equal(session.transfer(third.points, third), third.points)

    def test_points_are_located_in_the_earlier_mesh(self):
        with wellspace.Session(2, box=unit_box(2)) as session:
            before = self.refined(session, 0.3)
            after = self.refined(session, 0.1)
            located = session.locate(after.points, revision=before.revision)
            self.assertEqual((located.revision, located.vertex_count), (before.revision, len(before.points)))
            np.testing.assert_allclose(located.interpolate(before.points), after.points, atol=1e-14)
            self.assertEqual(session.locate([[0.5, 0.5]]).revision, after.revision)

    def test_asyncio(self):
        async def run():
            async with await wellspace.aio.Session.create(2, box=unit_box(2)) as session:
                await session.refine(size=0.3)
                before = await session.download()
                await session.refine(size=0.2)
                after = await session.download()
                carried = await session.transfer(before.points, before)
                np.testing.assert_allclose(carried, after.points, atol=1e-14)

        asyncio.run(run())

    def test_many_values_take_little_time(self):
        """The bound is one that noise does not reach."""
        with wellspace.Session(2, box=unit_box(2)) as session:
            before = self.refined(session, 0.005)
            session.add(uniform(1000, 2))
            session.refine()
            start = time.monotonic()
            carried = session.transfer(before.points, before)
            self.assertLess(time.monotonic() - start, 20)
            self.assertGreater(len(carried), 20_000)


if __name__ == "__main__":
    unittest.main()
