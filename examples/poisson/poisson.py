"""An adaptive solver, -laplace(u) = f with a sharp peak: python3 poisson.py [2 or 3] [rounds]"""
import math
import sys

import numpy as np
import scipy.sparse.linalg

import wellspace

d, rounds = (int(argument) for argument in (sys.argv[1:] + ["2", "8"][len(sys.argv) - 1:]))


def exact(x):  # the solution, its gradient, and f
    r2 = ((x - 0.4) ** 2).sum(axis=-1)
    u = np.exp(-200 * r2)
    return u, -400 * u[..., None] * (x - 0.4), (400 * d - 160_000 * r2) * u


def solve(mesh):  # linear finite elements: the error in the energy norm, and an estimate of it for each simplex
    p, t = mesh.points, mesh.simplices
    to_points = scipy.sparse.csr_matrix((np.ones(t.size), (t.ravel(), np.repeat(np.arange(len(t)), d + 1))))
    edges = p[t[:, 1:]] - p[t[:, :1]]
    volume = np.linalg.det(edges) / math.factorial(d)
    slopes = np.linalg.inv(edges)  # columns: the gradients of the barycentric coordinates but the first
    slopes = np.concatenate([-slopes.sum(axis=2, keepdims=True), slopes], axis=2)
    local = np.einsum("mki,mkj,m->mij", slopes, slopes, volume)
    places = np.repeat(t, d + 1, axis=1).ravel(), np.tile(t, d + 1).ravel()
    matrix = scipy.sparse.csr_matrix((local.ravel(), places))
    fixed = mesh.boundary_vertices()
    free = np.setdiff1d(np.arange(len(p)), fixed)
    u, _, f = exact(p)
    load = f * (to_points @ volume) / (d + 1) - matrix[:, fixed] @ u[fixed]
    u[free] = scipy.sparse.linalg.cg(matrix[free][:, free], load[free], tol=1e-9)[0]
    gradient = np.einsum("mki,mi->mk", slopes, u[t])
    smooth = (to_points @ (volume[:, None] * gradient)) / (to_points @ volume)[:, None]
    estimate = np.sqrt(volume * ((smooth[t] - gradient[:, None]) ** 2).sum(axis=2).mean(axis=1))
    return math.sqrt(volume @ ((exact(p[t].mean(axis=1))[1] - gradient) ** 2).sum(axis=1)), estimate, volume


with wellspace.Session(d, box=([0] * d, [1] * d), size=0.15) as session:
    for round in range(rounds):
        session.refine(restart=True)
        mesh = session.download()
        error, estimate, volume = solve(mesh)
        print(f"{len(mesh.points):8} vertices, error {error:.2e}", flush=True)
        # Twice as many simplices, with the same error each: of order 1 + d / 2 in their size.
        power = d / (1 + d / 2)
        target = ((estimate**power).sum() / (2 * len(estimate))) ** (1 / power)
        wanted = (volume * (target / estimate) ** power) ** (1 / d)
        sizes = np.full(len(mesh.points), np.inf)
        np.minimum.at(sizes, mesh.simplices, wanted[:, None])
        session.sizes(sizes, mesh_revision=mesh.revision)
