"""The rows of bench/compare: programs and clouds, the values read off them, and the targets."""
import collections

import clouds

# A run of one program on one cloud: `arguments` follow the file of points.
Run = collections.namedtuple("Run", "program cloud arguments")

# A row of the table.
#   value(ours, peers) -> float: from the reports of one repetition, ours by number of threads
#   better: ">=" or "<=": how the value is compared with the targets
#   targets: by number of threads; none for values that are measured only to be known
#   ours: {threads: Run}; peers: [Run]
Row = collections.namedtuple("Row", "name what value better targets ours peers quick")

THREADS = (1, 2)
SQRT2 = clouds.SQRT2


def mesh_runs(cloud, rho, min_dihedral=0, threads=THREADS):
    """Wellspace meshes `cloud`, by number of threads."""
    dimension = dimension_of(cloud)
    shape = ("--dimension", dimension, "--rho", repr(rho), "--min-dihedral", min_dihedral)
    return {t: Run("wellspace_mesh", cloud, (*shape, "--threads", t)) for t in threads}


def dimension_of(cloud):
    parts = cloud.split("-")
    return int(parts[1]) if len(parts) == 3 else 3 if cloud == "spot" else 2


def times_faster(ours, peers):
    return peers[0]["seconds"] / ours["seconds"]


def times_smaller(ours, peers):
    return peers[0]["memory_bytes"] / ours["memory_bytes"]


def per_vertex(ours, peers):
    """Time per output vertex against the peer's time per inserted vertex."""
    return ours["seconds"] / ours["vertices"] / (peers[0]["seconds"] / peers[0]["vertices"])


def growth(ours, peers):
    """Time per output vertex against that of the small cloud."""
    return per_vertex(ours, peers)


def bytes_per_vertex(ours, _):
    return ours["memory_bytes"] / ours["vertices"]


def memory_growth(ours, peers):
    return bytes_per_vertex(ours, peers) / bytes_per_vertex(peers[0], ours)


def create_over_sort(ours, _):
    return ours["create_seconds"] / ours["sort_seconds"]


def cell_times_faster(ours, peers):
    return peers[0]["seconds"] / peers[0]["cells"] / (ours["seconds"] / ours["cells"])


def delaunay(cloud, targets=(), quick=False):
    """Wellspace per output vertex against CGAL's plain Delaunay triangulation per inserted vertex."""
    dimension = dimension_of(cloud)
    rho = SQRT2 if dimension == 2 else 2.0
    return Row(f"delaunay/{cloud}", f"time per vertex / CGAL Delaunay_{dimension}'s", per_vertex, "<=",
               targets, mesh_runs(cloud, rho), [Run("cgal_delaunay", cloud, (dimension,))], quick)


def mesh_2(cloud, targets=(), quick=False):
    """Against CGAL's Mesh_2 with the shape bound 0.125, the smallest angle of rho = sqrt(2)."""
    return Row(f"mesh_2/{cloud}", "x faster than CGAL Mesh_2", times_faster, ">=", targets,
               mesh_runs(cloud, SQRT2), [Run("cgal_mesh_2", cloud, (0.125,))], quick)


def domain(cloud, targets=(), quick=False):
    """All of the unit box with segments in it, whose ends `cloud` has in pairs. CGAL's edges of segments need not have
    empty discs."""
    return Row(f"domain/{cloud}", "x faster than CGAL Mesh_2; segments", times_faster, ">=", targets,
               with_segments(mesh_runs(cloud, SQRT2)), [Run("cgal_mesh_2", cloud, (0.125, "--segments"))], quick)


def domain_memory(cloud, like, target):
    """Against a cloud whose mesh has about as many vertices."""
    return Row(f"memory/{cloud}", f"memory a vertex / that of {like}", memory_growth, "<=", (target,),
               with_segments(mesh_runs(cloud, SQRT2, threads=(1,))), [mesh_runs(like, SQRT2)[1]], False)


def with_segments(runs):
    return {t: run._replace(arguments=(*run.arguments, "--segments")) for t, run in runs.items()}


def tetgen(cloud, targets=(), rho=2.0, quick=False):
    """Against TetGen without its optimisation and without a bound on dihedral angles."""
    name = f"tetgen/{cloud}" if rho == 2.0 else f"tetgen/{cloud}/rho={rho:g}"
    return Row(name, "x faster than TetGen", times_faster, ">=", targets, mesh_runs(cloud, rho),
               [Run("tetgen_mesh", cloud, (f"zpq{rho:g}/0O0/0NEF",))], quick)


def dihedral(cloud, degrees, quick=False):
    """Both keep a bound on dihedral angles; 12 degrees is Wellspace's default."""
    return Row(f"dihedral/{cloud}/{degrees}", f"x faster than TetGen -q2/{degrees}", times_faster, ">=", (),
               mesh_runs(cloud, 2.0, degrees), [Run("tetgen_mesh", cloud, (f"zpq2/{degrees}NEF",))], quick)


def memory_against_tetgen(cloud, target):
    return tetgen(cloud)._replace(name=f"memory/{cloud}", what="x less memory than TetGen", value=times_smaller,
                                  targets=(target,), ours=mesh_runs(cloud, 2.0, threads=(1,)))


def memory(cloud, target):
    rho = SQRT2 if dimension_of(cloud) == 2 else 2.0
    return Row(f"memory/{cloud}", "B a vertex, simplices included", bytes_per_vertex, "<=", (target,),
               mesh_runs(cloud, rho, threads=(1,)), [], False)


def grows(small, large):
    rho = SQRT2 if dimension_of(small) == 2 else 2.0
    return Row(f"growth/{large}", f"time per vertex / that of {small}", growth, "<=", (1.5,),
               mesh_runs(large, rho, threads=(1,)), [mesh_runs(small, rho)[1]], False)


def initialize(cloud, targets, quick=False):
    rho = SQRT2 if dimension_of(cloud) == 2 else 2.0
    return Row(f"initialize/{cloud}", "Initialize / radix sort of the keys", create_over_sort, "<=", targets,
               mesh_runs(cloud, rho, threads=(1,)), [], quick)


# Cells are clipped at this times the distance to the nearest neighbour.
BETA = 4


def cells(cloud, targets=(), quick=False):
    return Row(f"cell/{cloud}", f"x faster than voro++ a cell; clipped, beta = {BETA}", cell_times_faster, ">=",
               targets, {1: Run("wellspace_cells", cloud, ("--beta", BETA))}, [Run("voro_cells", cloud, ())], quick)


# The same, but each cell is asked for on its own.
def cells_alone(cloud, quick=False):
    return Row(f"cell-alone/{cloud}", f"x faster than voro++ a cell; clipped, beta = {BETA}, each on its own",
               cell_times_faster, ">=", (), {1: Run("wellspace_cells", cloud, ("--beta", BETA, "--alone"))},
               [Run("voro_cells", cloud, ())], quick)


def whole_cells(cloud, quick=False):
    return Row(f"whole-cell/{cloud}", "x faster than voro++ a cell; whole", cell_times_faster, ">=", (),
               {1: Run("wellspace_cells", cloud, ())}, [Run("voro_cells", cloud, ())], quick)


ROWS = [
    delaunay("uniform-2-1000000", (3.3, 1.9)),
    mesh_2("uniform-2-100000", (2.5, 4), quick=True),
    mesh_2("uniform-2-1000000", (5, 9)),
    tetgen("uniform-3-10000", (1.5, 2.5), quick=True),
    tetgen("uniform-3-100000", (3, 5)),
    tetgen("clusters-3-100000", (2, 3.5)),
    tetgen("sphere-3-100000", (4, 7)),
    tetgen("grid-3-64000", (2, 3)),
    tetgen("skew-3-20000", (100, 170)),
    memory_against_tetgen("skew-3-20000", 150),
    grows("uniform-2-10000", "uniform-2-1000000"),
    grows("uniform-3-10000", "uniform-3-1000000"),
    memory("uniform-2-1000000", 170),
    memory("uniform-3-1000000", 450),
    cells("uniform-3-1000000", (3,)),
    initialize("uniform-2-1000000", (4,)),
    initialize("uniform-3-1000000", (8,)),
    domain("segments-2-200000", (2, 3.2), quick=True),
    domain("land-110m", (2, 3.2), quick=True),
    domain_memory("segments-2-200000", "uniform-2-300000", 1.3),
    # Yardsticks, and the other clouds.
    delaunay("uniform-2-100000", quick=True),
    delaunay("uniform-3-100000"),
    delaunay("uniform-3-1000000"),
    mesh_2("uniform-2-10000"),
    mesh_2("inner-2-10000"),
    mesh_2("clusters-2-100000"),
    mesh_2("lines-2-100000"),
    mesh_2("annuli-2-100000"),
    mesh_2("grid-2-90000"),
    mesh_2("coast-110m", quick=True),
    mesh_2("coast-50m"),
    tetgen("uniform-3-1000000"),
    tetgen("inner-3-10000"),
    tetgen("inner-3-3000", rho=1.2),
    tetgen("sphere-3-10000"),
    tetgen("annuli-3-100000"),
    tetgen("skew-3-2000", quick=True),
    tetgen("moment-3-2000", quick=True),
    tetgen("moment-3-10000"),
    tetgen("spot", quick=True),
    dihedral("uniform-3-10000", 12, quick=True),
    dihedral("uniform-3-10000", 15),
    dihedral("uniform-3-100000", 12),
    dihedral("uniform-3-100000", 15),
    dihedral("sphere-3-100000", 12),
    cells("uniform-3-100000", quick=True),
    whole_cells("uniform-3-100000", quick=True),
    whole_cells("uniform-3-1000000"),
    cells_alone("uniform-3-1000000"),
]


def shrunk(row, most):
    """The row on synthetic clouds of at most `most` points, which has no targets."""

    def shrink(run):
        parts = run.cloud.split("-")
        if len(parts) != 3 or int(parts[2]) <= most:
            return run
        return run._replace(cloud=f"{parts[0]}-{parts[1]}-{most}")

    return row._replace(targets=(), ours={t: shrink(run) for t, run in row.ours.items()},
                        peers=[shrink(run) for run in row.peers])


def passes(row, threads, value):
    """Whether the target is met; None where there is none."""
    if threads > len(row.targets):
        return None
    target = row.targets[threads - 1]
    return value >= target if row.better == ">=" else value <= target
