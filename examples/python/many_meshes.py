"""Several meshes at a time with asyncio, of which one is given up.

    python3 many_meshes.py
"""

import asyncio

import numpy as np

import wellspace.aio


async def main():
    clouds = [np.random.default_rng(seed).uniform(size=(2000, 3)) for seed in range(4)]
    meshes = await asyncio.gather(*(wellspace.aio.mesh(cloud) for cloud in clouds))
    for mesh in meshes:
        print(mesh)

    try:
        await asyncio.wait_for(wellspace.aio.mesh(clouds[0], size=0.006), timeout=1)
    except asyncio.TimeoutError:
        print("one would have taken too long; the server has stopped working on it")


if __name__ == "__main__":
    asyncio.run(main())
