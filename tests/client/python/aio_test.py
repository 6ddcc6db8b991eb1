"""The same calls, awaited."""

import asyncio
import inspect
import threading
import unittest

import numpy as np
from support import Case, uniform, unit_box

import wellspace.aio
from wellspace import CancelledError, CancelToken, InvalidArgumentError, NotFoundError

LONG = {"box": unit_box(3), "size": 0.004, "threads": 1}  # minutes of work


class AioTest(unittest.IsolatedAsyncioTestCase, Case):
    async def test_mesh(self):
        points = uniform(1000, 2)
        seen = []
        mesh = await wellspace.aio.mesh(points, progress=lambda event: seen.append((event, threading.current_thread())))
        np.testing.assert_array_equal(mesh.simplices, wellspace.mesh(points).simplices)
        await asyncio.sleep(0)
        self.assertEqual(seen[-1][0].phase, "done")
        self.assertEqual({thread for _, thread in seen}, {threading.main_thread()}, "told in the event loop")
        self.assertGreater((await wellspace.aio.estimate(points)).vertices, 1000)
        self.assertEqual((await wellspace.aio.info()).dimensions, (2, 3, 4, 5, 6))

    async def test_the_loop_goes_on(self):
        meshing = [asyncio.create_task(wellspace.aio.mesh(uniform(20_000, 2, seed))) for seed in range(4)]
        turns = 0
        while not all(task.done() for task in meshing):
            turns += 1
            await asyncio.sleep(0)
        self.assertGreater(turns, 10)
        for seed, task in enumerate(meshing):
            np.testing.assert_array_equal(task.result().points[:20_000], uniform(20_000, 2, seed))

    async def test_session(self):
        async with await wellspace.aio.Session.create(2, box=unit_box(2)) as session:
            await session.upload(uniform(200, 2))
            self.assertEqual(await session.sizes([0.1], [[0.5, 0.5]]), 1)
            self.assertEqual((await session.refine()).state, "succeeded")
            mesh = await session.download()
            vertices = await session.add([[0.5, 0.5]])
            left = await session.remove([0])
            self.assertEqual(left, (await session.info()).point_count)
            self.assertEqual(list(vertices), [len(mesh.points)])
            started = await session.start_refinement()
            self.assertEqual((await session.watch(started.name)).state, "succeeded")
            self.assertEqual((await session.cancel_operation()).state, "succeeded")
            self.assertEqual(len(await session.operations()), 2)
            self.assertEqual(len(await session.nearest()), (await session.info()).vertex_count)
            self.assertEqual(len(await session.cells([0, 1], beta=2)), 2)
            self.assertEqual((await session.update(labels={"a": "b"})).labels, {"a": "b"})
            again = await wellspace.aio.Session.attach(session.name)
            self.assertEqual((again.name, again.dimension), (session.name, 2))
        with self.fails(NotFoundError):
            await again.info()
        async with await wellspace.aio.Session.create(2) as session:
            await session.add_segments(segments=[[0, 1], [1, 2], [2, 0]])
            await session.upload([[0, 0], [1, 0], [0, 1]])
            await session.refine()
            await session.delete()

    async def test_a_cancelled_task_cancels_the_work(self):
        with wellspace.LocalServer() as server:
            begun = asyncio.Event()

            def on_progress(event):
                if event.phase == "refinement":
                    begun.set()

            task = asyncio.create_task(wellspace.aio.mesh(uniform(10, 3), server=server, progress=on_progress, **LONG))
            await begun.wait()
            task.cancel()
            with self.assertRaises(asyncio.CancelledError):
                await task
            while (await wellspace.aio.info(server=server)).running_jobs:
                pass
            with self.assertRaises(asyncio.TimeoutError):
                await asyncio.wait_for(wellspace.aio.mesh(uniform(10, 3), server=server, **LONG), 0.3)

    async def test_a_token(self):
        token = CancelToken()
        with self.fails(CancelledError, "by the caller"):
            await wellspace.aio.mesh(uniform(10, 3), progress=lambda event: token.cancel(), cancel=token, **LONG)

    async def test_errors(self):
        with self.fails(InvalidArgumentError, "(argument rho)"):
            await wellspace.aio.mesh(uniform(10, 2), rho=0.1)

    def test_has_all_methods(self):
        methods = {name for name in vars(wellspace.Session) if not name.startswith("_")} - {"attach"}
        for name in methods:
            awaited, model = getattr(wellspace.aio.Session, name), getattr(wellspace.Session, name)
            self.assertEqual(inspect.signature(awaited), inspect.signature(model), name)
            self.assertTrue(awaited.__doc__, name)


if __name__ == "__main__":
    unittest.main()
