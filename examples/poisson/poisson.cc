// An adaptive solver, -laplace(u) = f with a sharp peak, as poisson.py: poisson HOST:PORT [2 or 3] [rounds]
#include <wellspace/client/client.h>

#include <Eigen/Dense>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

namespace {

namespace client = wellspace::client;
using Eigen::ArrayXd, Eigen::Index;

template <int D>
using Vector = Eigen::Matrix<double, D, 1>;

// The solution at x, its gradient, and f.
template <int D>
struct Exact {
  explicit Exact(const Vector<D>& x) {
    const Vector<D> away = x - Vector<D>::Constant(0.4);
    u = std::exp(-200 * away.squaredNorm());
    gradient = -400 * u * away;
    f = (400 * D - 160'000 * away.squaredNorm()) * u;
  }
  double u, f;
  Vector<D> gradient;
};

// Linear finite elements on a mesh: simplices are columns of vertices, vertices columns of coordinates.
template <int D>
struct Elements {
  explicit Elements(const client::Mesh& mesh)
      : points(mesh.points.data(), D, mesh.points.size() / D),
        simplices(mesh.simplices.data(), D + 1, mesh.simplices.size() / (D + 1)),
        volumes(simplices.cols()),
        slopes(simplices.cols()) {
    for (Index s = 0; s < simplices.cols(); ++s) {
      const Eigen::Matrix<double, D, D + 1> corners = points(Eigen::all, simplices.col(s));
      const Eigen::Matrix<double, D, D> edges = corners.template rightCols<D>().colwise() - corners.col(0);
      volumes[s] = edges.determinant() / (D == 2 ? 2 : 6);
      slopes[s] << Vector<D>::Zero(), edges.inverse().transpose();
      slopes[s].col(0) = -slopes[s].rowwise().sum();
    }
  }
  Eigen::Map<const Eigen::Matrix<double, D, Eigen::Dynamic>> points;
  Eigen::Map<const Eigen::Matrix<uint32_t, D + 1, Eigen::Dynamic>> simplices;
  ArrayXd volumes;
  std::vector<Eigen::Matrix<double, D, D + 1>> slopes;  // columns: the gradients of the barycentric coordinates
};

// The values at the vertices; those that are not inside, which have a tag, have the exact ones.
template <int D>
ArrayXd Solve(const Elements<D>& elements, const std::vector<int32_t>& tags) {
  std::vector<Index> row(tags.size(), -1);  // of the vertices inside
  const Index rows = std::count(tags.begin(), tags.end(), 0);
  for (Index v = 0, next = 0; v < elements.points.cols(); ++v) row[v] = tags[v] == 0 ? next++ : -1;
  ArrayXd u(tags.size());
  for (Index v = 0; v < u.size(); ++v) u[v] = Exact<D>(elements.points.col(v)).u;

  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd load = Eigen::VectorXd::Zero(rows);
  for (Index s = 0; s < elements.simplices.cols(); ++s) {
    const auto local = (elements.volumes[s] * elements.slopes[s].transpose() * elements.slopes[s]).eval();
    for (int i = 0; i <= D; ++i) {
      const uint32_t v = elements.simplices(i, s);
      if (tags[v] != 0) continue;
      load[row[v]] += Exact<D>(elements.points.col(v)).f * elements.volumes[s] / (D + 1);
      for (int j = 0; j <= D; ++j) {
        const uint32_t w = elements.simplices(j, s);
        if (tags[w] == 0) entries.emplace_back(row[v], row[w], local(i, j));
        if (tags[w] != 0) load[row[v]] -= local(i, j) * u[w];
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(rows, rows);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver(matrix);
  solver.setTolerance(1e-9);
  const Eigen::VectorXd inside = solver.solve(load);
  for (Index v = 0; v < u.size(); ++v) u[v] = tags[v] == 0 ? inside[row[v]] : u[v];
  return u;
}

// The error in the energy norm, and an estimate of it for each simplex: how far gradients are from smooth ones.
template <int D>
double EstimateErrors(const Elements<D>& elements, const ArrayXd& u, ArrayXd& estimates) {
  const auto gradient = [&](Index s) { return (elements.slopes[s] * u(elements.simplices.col(s)).matrix()).eval(); };
  Eigen::Matrix<double, D, Eigen::Dynamic> smooth(D, u.size());
  ArrayXd around = ArrayXd::Zero(u.size());  // the volume of the simplices at each vertex
  smooth.setZero();
  for (Index s = 0; s < elements.simplices.cols(); ++s) {
    for (const uint32_t v : elements.simplices.col(s)) {
      around[v] += elements.volumes[s];
      smooth.col(v) += elements.volumes[s] * gradient(s);
    }
  }
  double error_sq = 0;
  estimates.resize(elements.simplices.cols());
  for (Index s = 0; s < elements.simplices.cols(); ++s) {
    double square = 0;
    Vector<D> middle = Vector<D>::Zero();
    for (const uint32_t v : elements.simplices.col(s)) {
      square += (smooth.col(v) / around[v] - gradient(s)).squaredNorm() / (D + 1);
      middle += elements.points.col(v) / (D + 1);
    }
    estimates[s] = std::sqrt(elements.volumes[s] * square);
    error_sq += elements.volumes[s] * (Exact<D>(middle).gradient - gradient(s)).squaredNorm();
  }
  return std::sqrt(error_sq);
}

// For each vertex the size of twice as many simplices with the same error each: of order 1 + D / 2 in their size.
template <int D>
std::vector<double> WantedSizes(const Elements<D>& elements, const ArrayXd& estimates) {
  const double power = D / (1 + D / 2.0);
  const double target = std::pow(estimates.pow(power).sum() / (2 * estimates.size()), 1 / power);
  const ArrayXd wanted = (elements.volumes * (target / estimates).pow(power)).pow(1.0 / D);
  std::vector<double> sizes(elements.points.cols(), std::numeric_limits<double>::infinity());
  for (Index s = 0; s < elements.simplices.cols(); ++s) {
    for (const uint32_t v : elements.simplices.col(s)) sizes[v] = std::min(sizes[v], wanted[s]);
  }
  return sizes;
}

void Check(const absl::Status& status) {
  if (!status.ok()) throw absl::BadStatusOrAccess(status);
}

// All that the service has to do with it. value() throws an error; the server forgets the session in an hour.
template <int D>
void SolveAdaptively(const std::string& address, int rounds) {
  client::Client client = client::Connect(address).value();
  client::SessionOptions options;
  options.parameters.dimension = D;
  options.parameters.domain_low.assign(D, 0);
  options.parameters.domain_high.assign(D, 1);
  options.parameters.max_circumradius = 0.15;
  options.ttl = absl::Hours(1);
  const std::string session = client.CreateSession(options).value().name;
  for (int round = 0; round < rounds; ++round) {
    const client::Operation started = client.StartRefinement(session, {.restart = true}).value();
    const client::Operation ended = client.WatchOperation(started.name).value();
    Check(ended.error);
    client::MeshCollector collector;
    Check(client.DownloadMesh(session, collector, ended.mesh_revision));

    const client::Mesh& mesh = collector.mesh();
    const Elements<D> elements(mesh);
    ArrayXd estimates;
    const double error = EstimateErrors(elements, Solve(elements, mesh.vertex_tags), estimates);
    std::cout << elements.points.cols() << " vertices, error " << error << std::endl;
    client.SetVertexSizes(session, {.sizes = WantedSizes(elements, estimates), .mesh_revision = ended.mesh_revision})
        .value();
  }
  Check(client.DeleteSession(session));
}

}  // namespace

int main(int argc, char** argv) {
  const int dimension = argc > 2 ? std::atoi(argv[2]) : 2;
  if (argc < 2 || argc > 4 || (dimension != 2 && dimension != 3)) {
    std::cerr << "usage: " << argv[0] << " HOST:PORT [2 or 3] [rounds]\n";
    return 2;
  }
  try {
    (dimension == 2 ? SolveAdaptively<2> : SolveAdaptively<3>)(argv[1], argc > 3 ? std::atoi(argv[3]) : 8);
  } catch (const absl::BadStatusOrAccess& error) {
    std::cerr << error.status() << "\n";
    return 1;
  }
  return 0;
}
