"""-laplace(u) = f on the parts of a mesh, a part a rank: mpiexec -n 4 python3 parallel_poisson.py MESH [SOLUTION.npy]

MESH is the name of a session, "sessions/...", whose server $WELLSPACE_SERVER names: each rank downloads its part. Or it
is what `wellspace partition FILE -n 4 -o MESH.npz` was given, without its extension.
"""
import math
import sys

import numpy as np
import scipy.sparse
from mpi4py import MPI
from petsc4py import PETSc

import wellspace

ranks = MPI.COMM_WORLD


def part_of(name):
    """The part of this rank, with a layer of ghosts."""
    if not name.startswith("sessions/"):
        return wellspace.MeshPart.load(f"{name}_{ranks.rank}.npz")
    session = wellspace.Session.attach(name)
    first = session.download(part=0, parts=ranks.size) if ranks.rank == 0 else None
    # All take the mesh that rank 0 has a part of, should it be refined meanwhile.
    revision = ranks.bcast(first.revision if first else None)
    return first or session.download(part=ranks.rank, parts=ranks.size, revision=revision)


part = part_of(sys.argv[1])
own, points, simplices = part.own_vertices, part.points, part.simplices
if part.parts != ranks.size:
    raise SystemExit(f"{sys.argv[1]} has {part.parts} parts, and there are {ranks.size} ranks")
dimension = part.dimension

# All simplices at the part's own vertices are here, with one layer of ghosts: so are all rows of the matrix.
edges = points[simplices[:, 1:]] - points[simplices[:, :1]]
volume = np.linalg.det(edges) / math.factorial(dimension)
slopes = np.linalg.inv(edges)
slopes = np.concatenate([-slopes.sum(axis=2, keepdims=True), slopes], axis=2)
local = np.einsum("mki,mkj,m->mij", slopes, slopes, volume)
places = np.repeat(simplices, dimension + 1, axis=1).ravel(), np.tile(simplices, dimension + 1).ravel()
matrix = scipy.sparse.csr_matrix((local.ravel(), places), shape=(len(points), len(points)))[:own]
load = np.bincount(simplices.ravel(), np.repeat(volume / (dimension + 1), dimension + 1), len(points))[:own]

# u is 0 on the boundary: rows of the unit matrix there, and no columns.
inside = part.vertex_tags == 0
matrix = scipy.sparse.diags(inside[:own] * 1.0) @ matrix @ scipy.sparse.diags(inside * 1.0)
matrix = (matrix + scipy.sparse.eye(own, len(points), format="csr").multiply(~inside[:own, None])).tocsr()
load[~inside[:own]] = 0

rows = part.vertex_rows.astype(PETSc.IntType)  # part after part, as PETSc numbers them
sizes = ((own, None), (own, None))
a = PETSc.Mat().createAIJ(sizes, csr=(matrix.indptr.astype(PETSc.IntType), rows[matrix.indices], matrix.data))
u, b = a.createVecs()
b.setArray(load)
solver = PETSc.KSP().create()
solver.setOperators(a)
solver.setType("cg")
solver.getPC().setType("jacobi")
solver.setTolerances(rtol=1e-14, max_it=10_000)
solver.solve(b, u)

pieces = ranks.gather((part.vertex_ids[:own], u.getArray()))
if ranks.rank == 0:
    ids, values = (np.concatenate(arrays) for arrays in zip(*pieces))
    solution = np.empty(len(ids))
    solution[ids] = values
    steps = solver.getIterationNumber()
    print(f"{ranks.size} parts, {len(ids)} vertices, {steps} steps, largest u {solution.max():.12f}")
    if len(sys.argv) > 2:
        np.save(sys.argv[2], solution)
