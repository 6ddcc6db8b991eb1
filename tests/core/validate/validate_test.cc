// The validators accept good meshes and find each fault that is planted in one.
#include "core/validate/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "tests/support/clouds.h"
#include "tests/support/meshes.h"

namespace wellspace::core {
namespace {

using test::Bipyramid;
using test::BothTriangulations;
using test::ConeOverUnitBox;
using test::KuhnGrid;
using test::Quadrilateral;
using test::TestMesh;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

MATCHER_P2(Fails, code, message, "") {
  *result_listener << arg;
  return arg.code() == code && ::testing::ExplainMatchResult(message, std::string(arg.message()), result_listener);
}

template <typename Message>
auto Violates(const Message& message) {
  return Fails(absl::StatusCode::kFailedPrecondition, message);
}

auto Refuses(const std::string& message) { return Fails(absl::StatusCode::kInvalidArgument, HasSubstr(message)); }

using Check = std::function<absl::Status(const MeshView&)>;

const std::vector<Check>& AllChecks() {
  static const auto* const checks =
      new std::vector<Check>{ValidateIndices,
                             ValidateOrientation,
                             ValidateTopology,
                             ValidateVolume,
                             ValidateDelaunay,
                             [](const MeshView& mesh) { return ValidateRadiusEdge(mesh, 2); },
                             [](const MeshView& mesh) { return ValidateWellSpaced(mesh, 2); },
                             [](const MeshView& mesh) { return ValidateSizing(mesh, {.max_circumradius = 1000}); },
                             ValidateCircumcentres,
                             [](const MeshView& mesh) { return ValidateCloud(mesh, mesh.points); },
                             [](const MeshView& mesh) { return ValidateMesh(mesh, {}); }};
  return *checks;
}

class ValidateTest : public ::testing::TestWithParam<int> {
 protected:
  int D() const { return GetParam(); }
  uint32_t Cells() const { return D() <= 3 ? 3 : D() == 4 ? 2 : 1; }
  TestMesh Grid() const { return KuhnGrid(D(), Cells()); }
  // Of volume 1 / D! each.
  double SimplexVolume() const { return 1 / std::tgamma(D() + 1.0); }
  // With vertices inside; CentralVertex is one.
  uint32_t InteriorCells() const { return std::max(Cells(), 2u); }
  TestMesh InteriorGrid() const { return KuhnGrid(D(), InteriorCells()); }
  size_t CentralVertex() const {
    size_t vertex = 0;
    for (int k = 0; k < D(); ++k) {
      vertex = vertex * (InteriorCells() + 1) + 1;
    }
    return vertex;
  }
};

INSTANTIATE_TEST_SUITE_P(Dimensions, ValidateTest, ::testing::Range(2, 7));

TEST_P(ValidateTest, AcceptsGridsAtEveryScale) {
  struct Frame {
    double low;
    double spacing;
  };
  // Exact ones: the cells are cospherical to the last bit, at both ends of the doubles, and in 1e-9 steps far from the
  // origin.
  for (const Frame frame : {Frame{0, 1}, Frame{0, 0x1p-500}, Frame{0, 0x1p500}, Frame{-0x1p998, 0x1p997},
                            Frame{0x1p20, 0x1p-30}, Frame{-1, 0x1p-52}, Frame{0, 0x1p-1074}}) {
    const TestMesh mesh = KuhnGrid(D(), Cells(), frame.low, frame.spacing);
    for (const Criterion criterion : {Criterion::kRadiusEdge, Criterion::kWellSpaced}) {
      const absl::Status status =
          ValidateMesh(mesh.View(), {.rho = std::sqrt(D() / 4.0),
                                     .criterion = criterion,
                                     .max_circumradius = std::max(frame.spacing * std::sqrt(D() / 4.0), 0x1p-1000),
                                     .size_boxes = {},
                                     .cloud = mesh.points});
      EXPECT_TRUE(status.ok()) << frame.low << " + " << frame.spacing << ": " << status;
    }
  }
}

TEST_P(ValidateTest, EveryCheckAcceptsAGrid) {
  const TestMesh mesh = Grid();
  for (const Check& check : AllChecks()) {
    EXPECT_TRUE(check(mesh.View()).ok()) << check(mesh.View());
  }
}

TEST_P(ValidateTest, RefusesWhatIsNoMeshAtAll) {
  for (const Check& check : AllChecks()) {
    TestMesh mesh = Grid();
    mesh.dimension = 7;
    EXPECT_THAT(check(mesh.View()), Refuses("dimension is 7; 2 to 6 are supported"));
    mesh.dimension = 1;
    EXPECT_THAT(check(mesh.View()), Refuses("dimension is 1; 2 to 6 are supported"));
    mesh.dimension = 0;
    EXPECT_THAT(check(mesh.View()), Refuses("dimension is 0"));
    mesh.dimension = -1;
    EXPECT_THAT(check(mesh.View()), Refuses("dimension is -1"));

    mesh = Grid();
    mesh.points.push_back(0);
    EXPECT_THAT(check(mesh.View()), Refuses("coordinates of points are no multiple of the dimension"));
    mesh = Grid();
    mesh.simplices.pop_back();
    EXPECT_THAT(check(mesh.View()), Refuses("indices of simplices are no multiple of"));

    mesh = Grid();
    mesh.simplices.clear();
    EXPECT_THAT(check(mesh.View()), Violates(HasSubstr("0 simplices")));
    mesh.points.clear();
    EXPECT_THAT(check(mesh.View()), Violates(HasSubstr("0 vertices")));
  }
}

TEST_P(ValidateTest, EveryCheckFindsIndicesAndCoordinatesOutOfRange) {
  for (const Check& check : AllChecks()) {
    TestMesh mesh = Grid();
    mesh.Corners(3)[1] = static_cast<uint32_t>(mesh.VertexCount());
    EXPECT_THAT(check(mesh.View()), Violates(HasSubstr("simplex 3: index 1 is " + std::to_string(mesh.VertexCount()))));
    mesh.Corners(3)[1] = std::numeric_limits<uint32_t>::max();
    EXPECT_THAT(check(mesh.View()), Violates(HasSubstr("simplex 3: index 1 is 4294967295")));

    mesh = Grid();
    mesh.Vertex(5)[1] = kNaN;
    EXPECT_THAT(check(mesh.View()), Violates(HasSubstr("vertex 5: coordinate 1 is nan")));
    mesh.Vertex(5)[1] = -kInfinity;
    EXPECT_THAT(check(mesh.View()), Violates(HasSubstr("vertex 5: coordinate 1 is -inf")));
    mesh.Vertex(5)[1] = 1e302;
    EXPECT_THAT(check(mesh.View()), Violates(HasSubstr("vertex 5: coordinate 1 is 1.0000000000000001e+302")));
  }
}

TEST_P(ValidateTest, IndicesFindsRepeatedUnusedAndEqualVertices) {
  TestMesh mesh = Grid();
  mesh.Corners(2)[0] = mesh.Corners(2)[2];
  EXPECT_THAT(ValidateIndices(mesh.View()), Violates(HasSubstr("simplex 2 has vertex")));

  mesh = Grid();
  mesh.points.insert(mesh.points.end(), D(), 0.5);
  EXPECT_THAT(ValidateIndices(mesh.View()),
              Violates("vertex " + std::to_string(mesh.VertexCount() - 1) + " belongs to no simplex"));

  mesh = Grid();
  std::copy_n(mesh.Vertex(0), D(), mesh.Vertex(1));
  EXPECT_THAT(ValidateIndices(mesh.View()), Violates(HasSubstr("vertices 0 and 1 are equal: (0, 0")));
  mesh.Vertex(1)[0] = -0.0;
  EXPECT_THAT(ValidateIndices(mesh.View()), Violates(HasSubstr("vertices 0 and 1 are equal")));
}

TEST_P(ValidateTest, OrientationFindsMirroredAndFlatSimplices) {
  TestMesh mesh = Grid();
  std::swap(mesh.Corners(4)[0], mesh.Corners(4)[1]);
  EXPECT_THAT(ValidateOrientation(mesh.View()),
              Violates(AllOf(HasSubstr("simplex 4 ("), HasSubstr("has negative orientation"))));

  // A corner of simplex 0 is moved to the middle of an edge of the opposite facet.
  mesh = Grid();
  const uint32_t* const corners = mesh.Corners(0);
  for (int k = 0; k < D(); ++k) {
    mesh.Vertex(corners[D()])[k] = (mesh.Vertex(corners[0])[k] + mesh.Vertex(corners[1])[k]) / 2;
  }
  EXPECT_THAT(ValidateOrientation(mesh.View()), Violates(AllOf(HasSubstr("simplex 0 ("), HasSubstr("is flat"))));
}

TEST_P(ValidateTest, MovedVertexIsFound) {
  // Inside its star a vertex may move: the simplices still decompose the box, but they are not Delaunay any more.
  TestMesh mesh = InteriorGrid();
  mesh.Vertex(CentralVertex())[0] += 0.25;
  EXPECT_TRUE(ValidateOrientation(mesh.View()).ok());
  EXPECT_TRUE(ValidateTopology(mesh.View()).ok());
  EXPECT_TRUE(ValidateVolume(mesh.View()).ok());
  EXPECT_THAT(ValidateDelaunay(mesh.View()), Violates(HasSubstr("lies inside the circumsphere of simplex")));
  EXPECT_THAT(ValidateMesh(mesh.View(), {}), Violates(HasSubstr("lies inside the circumsphere of simplex")));

  // Out of its star it turns simplices around; the sum of signed volumes cannot tell.
  mesh.Vertex(CentralVertex())[0] = 1.75;
  mesh.Vertex(CentralVertex())[1] = 0.25;
  EXPECT_THAT(ValidateOrientation(mesh.View()), Violates(HasSubstr("orientation")));
  EXPECT_THAT(ValidateTopology(mesh.View()), Violates(HasSubstr("on the same side of their facet")));
  EXPECT_TRUE(ValidateVolume(mesh.View()).ok());
}

TEST_P(ValidateTest, VolumeIsExactToTheLastBit) {
  // A vertex on a face, not at its corner, moves inward by one ulp.
  TestMesh mesh = Grid();
  size_t on_face = CentralVertex() + Cells() - 1;
  if (Cells() == 1) {
    on_face = mesh.VertexCount() - 1;  // a corner; there are others on all of its faces
  }
  ASSERT_EQ(mesh.Vertex(on_face)[D() - 1], Cells());
  mesh.Vertex(on_face)[D() - 1] = std::nextafter(Cells(), 0.0);
  EXPECT_THAT(ValidateVolume(mesh.View()), Violates(HasSubstr("the volumes of the simplices exceed that of the box")));
  EXPECT_THAT(ValidateTopology(mesh.View()), Violates(HasSubstr("lies on no face of the box")));
}

TEST_P(ValidateTest, DroppedSimplexIsFound) {
  TestMesh mesh = Grid();
  mesh.simplices.erase(mesh.simplices.begin() + 4 * (D() + 1), mesh.simplices.begin() + 5 * (D() + 1));
  EXPECT_THAT(ValidateTopology(mesh.View()), Violates(HasSubstr("alone, but lies on no face of the box")));
  EXPECT_THAT(ValidateVolume(mesh.View()), Violates(HasSubstr(absl::StrFormat("by %.17g", -SimplexVolume()))));
}

TEST_P(ValidateTest, DuplicatedSimplexIsFound) {
  TestMesh mesh = Grid();
  const std::vector<uint32_t> corners(mesh.Corners(4), mesh.Corners(5));
  mesh.simplices.insert(mesh.simplices.end(), corners.begin(), corners.end());
  EXPECT_THAT(ValidateTopology(mesh.View()),
              Violates(AnyOf(HasSubstr("belongs to 3 simplices: "), HasSubstr("on the same side of their facet"))));
  EXPECT_THAT(ValidateVolume(mesh.View()), Violates(HasSubstr(absl::StrFormat("by %.17g", SimplexVolume()))));
}

TEST_P(ValidateTest, DoubleCoverIsFound) {
  // Every facet of the second copy pairs up within it, so only the volume tells that the box is covered twice.
  TestMesh mesh = Grid();
  const std::vector<double> points = mesh.points;
  const std::vector<uint32_t> simplices = mesh.simplices;
  const auto first = static_cast<uint32_t>(mesh.VertexCount());
  mesh.points.insert(mesh.points.end(), points.begin(), points.end());
  for (const uint32_t v : simplices) {
    mesh.simplices.push_back(v + first);
  }
  EXPECT_TRUE(ValidateTopology(mesh.View()).ok());
  EXPECT_THAT(ValidateVolume(mesh.View()), Violates(HasSubstr(absl::StrFormat("by %g;", std::pow(Cells(), D())))));
  EXPECT_THAT(ValidateIndices(mesh.View()), Violates(HasSubstr("are equal")));
}

TEST_P(ValidateTest, FlippedSimplicesAreFound) {
  const BothTriangulations flat = test::TwoApexes(D(), 0.5);
  const BothTriangulations tall = test::TwoApexes(D(), 2);
  for (const TestMesh& mesh : {flat.first, flat.second, tall.first, tall.second}) {
    ASSERT_TRUE(ValidateOrientation(mesh.View()).ok()) << ValidateOrientation(mesh.View());
  }
  EXPECT_THAT(ValidateDelaunay(flat.first.View()), Violates(HasSubstr("lies inside the circumsphere of simplex")));
  EXPECT_TRUE(ValidateDelaunay(flat.second.View()).ok()) << ValidateDelaunay(flat.second.View());
  EXPECT_TRUE(ValidateDelaunay(tall.first.View()).ok()) << ValidateDelaunay(tall.first.View());
  EXPECT_THAT(ValidateDelaunay(tall.second.View()), Violates(HasSubstr("lies inside the circumsphere of simplex")));
}

class ValidateCosphericalTest : public ValidateTest {};
INSTANTIATE_TEST_SUITE_P(Dimensions, ValidateCosphericalTest, ::testing::Values(2, 3));

TEST_P(ValidateCosphericalTest, BothTriangulationsAreDelaunay) {
  // Exactly cospherical; then one vertex moves one ulp in or out, and exactly one of the two is right.
  const std::vector<double> circle = {3, 4, -4, 3, -5, 0, 0, -5};
  const std::vector<double> sphere = {3, 4, 0, -4, 3, 0, 0, -5, 0, 0, 0, 5, 0, 0, -5};
  const auto triangulate = [this](const std::vector<double>& points) {
    return D() == 2 ? Quadrilateral(points) : Bipyramid(points);
  };
  std::vector<double> points = D() == 2 ? circle : sphere;
  BothTriangulations both = triangulate(points);
  for (const TestMesh& mesh : {both.first, both.second}) {
    EXPECT_TRUE(ValidateOrientation(mesh.View()).ok());
    EXPECT_TRUE(ValidateDelaunay(mesh.View()).ok()) << ValidateDelaunay(mesh.View());
  }
  for (const double outward : {10.0, 0.0}) {
    // Vertex 0 = (3, 4): further out, the simplices of `first` next to it have larger spheres, which then hold the far
    // vertex.
    std::vector<double> moved = points;
    moved[0] = std::nextafter(3.0, outward);
    both = triangulate(moved);
    const bool first_ok = ValidateDelaunay(both.first.View()).ok();
    const bool second_ok = ValidateDelaunay(both.second.View()).ok();
    EXPECT_NE(first_ok, second_ok) << "outward " << outward;
    EXPECT_EQ(first_ok, outward == 0) << "outward " << outward;
  }
}

TEST_P(ValidateTest, RadiusEdge) {
  const TestMesh mesh = Grid();
  const double ratio = std::sqrt(D() / 4.0);
  EXPECT_TRUE(ValidateRadiusEdge(mesh.View(), ratio).ok());
  EXPECT_TRUE(ValidateRadiusEdge(mesh.View(), ratio * (1 - 0.9e-9)).ok());
  EXPECT_THAT(ValidateRadiusEdge(mesh.View(), ratio * (1 - 1.1e-9)),
              Violates(AllOf(HasSubstr("simplex 0 ("), HasSubstr("circumradius / shortest edge = "))));
  EXPECT_THAT(ValidateMesh(mesh.View(), {.rho = 0.5, .cloud = {}}),
              Violates(HasSubstr("circumradius / shortest edge = ")));
  for (const double rho : {0.0, -1.0, kNaN, kInfinity}) {
    EXPECT_THAT(ValidateRadiusEdge(mesh.View(), rho), Refuses("rho is "));
  }
  EXPECT_THAT(ValidateMesh(mesh.View(), {.rho = kNaN, .cloud = {}}), Refuses("rho is nan"));
}

TEST_P(ValidateTest, WellSpaced) {
  // In the large cell simplices have edges of at least 2 and circumradius sqrt(D), but the vertex in the middle of the
  // mesh has a neighbour at 1. The ratio of a single simplex is largest where one side is 1: sqrt(4 D - 3) / 2, which
  // is less.
  const TestMesh mesh = test::KuhnGridOn(D(), {0, 2, 3});
  const double ratio = std::sqrt(D());
  EXPECT_TRUE(ValidateWellSpaced(mesh.View(), ratio).ok()) << ValidateWellSpaced(mesh.View(), ratio);
  EXPECT_TRUE(ValidateWellSpaced(mesh.View(), ratio * (1 - 0.9e-9)).ok());
  const auto too_large = Violates(AllOf(HasSubstr("vertex "), HasSubstr("more than rho * shortest edge = ")));
  EXPECT_THAT(ValidateWellSpaced(mesh.View(), ratio * (1 - 1.1e-9)), too_large);
  EXPECT_TRUE(ValidateRadiusEdge(mesh.View(), ratio * (1 - 1e-3)).ok());
  const ValidationOptions well_spaced = {.rho = ratio * (1 - 1e-3), .criterion = Criterion::kWellSpaced};
  if (D() < 6) {
    EXPECT_THAT(ValidateMesh(mesh.View(), well_spaced), too_large);
    EXPECT_TRUE(ValidateMesh(mesh.View(), {.rho = well_spaced.rho}).ok());
  }
  for (const double rho : {0.0, -1.0, kNaN, kInfinity}) {
    EXPECT_THAT(ValidateWellSpaced(mesh.View(), rho), Refuses("rho is "));
  }
}

TEST_P(ValidateTest, SizingEverywhere) {
  const TestMesh mesh = Grid();
  const double radius = std::sqrt(D()) / 2;
  EXPECT_TRUE(ValidateSizing(mesh.View(), {.max_circumradius = 0}).ok());
  EXPECT_TRUE(ValidateSizing(mesh.View(), {.max_circumradius = radius * (1 - 0.9e-9)}).ok());
  const auto too_large = Violates(AllOf(HasSubstr("simplex 0 ("), HasSubstr("has circumradius ")));
  EXPECT_THAT(ValidateSizing(mesh.View(), {.max_circumradius = radius * (1 - 1.1e-9)}), too_large);
  EXPECT_THAT(ValidateMesh(mesh.View(), {.max_circumradius = radius * 0.99}), too_large);
  for (const double bad : {-1.0, kNaN, kInfinity}) {
    EXPECT_THAT(ValidateSizing(mesh.View(), {.max_circumradius = bad}), Refuses("max_circumradius is "));
  }
}

TEST_P(ValidateTest, SizingInBoxes) {
  // All circumcentres are middles of cells; their balls reach sqrt(D) / 2 far.
  const TestMesh mesh = Grid();
  const double radius = std::sqrt(D()) / 2;
  SizeBox box;
  box.low.assign(static_cast<size_t>(D()), 0.25);
  box.high.assign(static_cast<size_t>(D()), 0.75);
  box.max_circumradius = radius * (1 - 0.9e-9);
  EXPECT_TRUE(ValidateSizing(mesh.View(), {.boxes = {&box, 1}}).ok());
  box.max_circumradius = radius * (1 - 1.1e-9);
  const auto too_large =
      Violates(AllOf(HasSubstr("simplex 0 ("), HasSubstr("of size box 1, at a distance of 0 from it")));
  SizeBox harmless = box;
  harmless.max_circumradius = 100;
  const std::vector<SizeBox> boxes = {harmless, box};
  EXPECT_THAT(ValidateSizing(mesh.View(), {.boxes = boxes}), too_large);
  EXPECT_THAT(ValidateMesh(mesh.View(), {.size_boxes = boxes}), too_large);

  // A box outside the mesh, far along the first axis, that the balls of the nearest cells just do not, or do, meet.
  const double middle = Cells() - 0.5;
  SizeBox outside;
  outside.low.assign(static_cast<size_t>(D()), -1);
  outside.high.assign(static_cast<size_t>(D()), 10);
  outside.max_circumradius = 1e-3;
  outside.high[0] = 100;
  outside.low[0] = middle + radius * (1 - 0.9e-9);
  EXPECT_TRUE(ValidateSizing(mesh.View(), {.boxes = {&outside, 1}}).ok())
      << ValidateSizing(mesh.View(), {.boxes = {&outside, 1}});
  outside.low[0] = middle + radius * (1 - 1.1e-9);
  EXPECT_THAT(ValidateSizing(mesh.View(), {.boxes = {&outside, 1}}),
              Violates(HasSubstr("of size box 0, at a distance of ")));
}

TEST_P(ValidateTest, SizeBoxesThatAreNone) {
  const TestMesh mesh = Grid();
  SizeBox good;
  good.low.assign(static_cast<size_t>(D()), 0);
  good.high.assign(static_cast<size_t>(D()), 1);
  good.max_circumradius = 100;
  EXPECT_TRUE(ValidateSizing(mesh.View(), {.boxes = {&good, 1}}).ok());
  SizeBox bad = good;
  bad.high.pop_back();
  EXPECT_THAT(ValidateSizing(mesh.View(), {.boxes = {&bad, 1}}), Refuses("size box 0 has corners of "));
  bad = good;
  bad.low[1] = 2;
  EXPECT_THAT(ValidateSizing(mesh.View(), {.boxes = {&bad, 1}}), Refuses("size box 0 reaches from 2 to 1 on axis 1"));
  bad.low[1] = kNaN;
  EXPECT_THAT(ValidateSizing(mesh.View(), {.boxes = {&bad, 1}}), Refuses("size box 0 reaches from nan to 1 on axis 1"));
  for (const double bound : {0.0, -1.0, kNaN, kInfinity}) {
    bad = good;
    bad.max_circumradius = bound;
    EXPECT_THAT(ValidateSizing(mesh.View(), {.boxes = {&bad, 1}}), Refuses("size box 0: max_circumradius is "));
  }
}

TEST_P(ValidateTest, CircumcentreOutsideIsFound) {
  // The apex comes so near to a face that the circumcentre of the simplices below it passes through the face.
  std::vector<double> apex(D(), 0.5);
  apex[D() - 1] = 0.25;
  const TestMesh cone = ConeOverUnitBox(apex);
  EXPECT_TRUE(ValidateTopology(cone.View()).ok());
  EXPECT_TRUE(ValidateDelaunay(cone.View()).ok()) << ValidateDelaunay(cone.View());
  const auto outside = Violates(AllOf(HasSubstr("of its circumcentre is "), HasSubstr("outside the box from 0 to 1")));
  EXPECT_THAT(ValidateCircumcentres(cone.View()), outside);
  EXPECT_THAT(ValidateMesh(cone.View(), {}), outside);
}

TEST(ValidateCircumcentresTest, ToleranceIsRelativeToTheLongestSide) {
  // With the apex at height 1/2 - t the lower triangle's circumcentre has height -t (1 + O(t)).
  EXPECT_TRUE(ValidateCircumcentres(ConeOverUnitBox({0.5, 0.5}).View()).ok());
  EXPECT_TRUE(ValidateCircumcentres(ConeOverUnitBox({0.5, 0.5 - 0.9e-9}).View()).ok());
  EXPECT_FALSE(ValidateCircumcentres(ConeOverUnitBox({0.5, 0.5 - 1.1e-9}).View()).ok());
  for (const int exponent : {-500, 500}) {
    for (const double t : {0.9e-9, 1.1e-9}) {
      TestMesh cone = ConeOverUnitBox({0.5, 0.5 - t});
      for (double& x : cone.points) {
        x = std::scalbn(x, exponent);
      }
      EXPECT_EQ(ValidateCircumcentres(cone.View()).ok(), t < 1e-9) << "2^" << exponent;
    }
  }
}

TEST_P(ValidateTest, CloudIsFoundInItsOrder) {
  const TestMesh mesh = Grid();
  const size_t d = static_cast<size_t>(D());
  std::vector<double> cloud(mesh.points.begin(), mesh.points.begin() + static_cast<std::ptrdiff_t>(5 * d));
  EXPECT_TRUE(ValidateCloud(mesh.View(), cloud).ok());
  EXPECT_TRUE(ValidateCloud(mesh.View(), {}).ok());

  std::vector<double> swapped = cloud;
  std::swap_ranges(swapped.begin(), swapped.begin() + D(), swapped.begin() + D());
  EXPECT_THAT(ValidateCloud(mesh.View(), swapped), Violates(HasSubstr("point 0 of the cloud, (0, ")));
  EXPECT_THAT(ValidateMesh(mesh.View(), {.rho = 0, .cloud = swapped}), Violates(HasSubstr("point 0 of the cloud")));

  std::vector<double> repeated = cloud;
  repeated.insert(repeated.begin() + D(), cloud.begin(), cloud.begin() + D());
  repeated.insert(repeated.end(), cloud.begin(), cloud.end());
  EXPECT_TRUE(ValidateCloud(mesh.View(), repeated).ok()) << ValidateCloud(mesh.View(), repeated);

  std::vector<double> moved = cloud;
  moved.back() = std::nextafter(moved.back(), 10.0);
  EXPECT_THAT(ValidateCloud(mesh.View(), moved), Violates(HasSubstr("point 4 of the cloud")));

  std::vector<double> negative_zero = cloud;
  negative_zero[0] = -0.0;
  EXPECT_THAT(ValidateCloud(mesh.View(), negative_zero), Violates(HasSubstr("point 0 of the cloud, (-0, ")));

  std::vector<double> larger = mesh.points;
  larger.insert(larger.end(), d, 0.5);
  EXPECT_THAT(ValidateCloud(mesh.View(), larger), Violates(HasSubstr("but that is missing")));
}

// The corners of the grid are kept; others may be near them, and nowhere else.
TEST_P(ValidateTest, CloudWithPointsMerged) {
  const TestMesh mesh = Grid();
  const size_t d = static_cast<size_t>(D());
  std::vector<double> cloud(mesh.points.begin(), mesh.points.begin() + static_cast<std::ptrdiff_t>(5 * d));
  std::vector<double> near(cloud.begin(), cloud.begin() + D());
  near[0] -= 1e-6;
  cloud.insert(cloud.begin(), near.begin(), near.end());
  EXPECT_THAT(ValidateCloud(mesh.View(), cloud), Violates(HasSubstr("point 0 of the cloud")));
  EXPECT_TRUE(ValidateCloud(mesh.View(), cloud, 1e-6).ok()) << ValidateCloud(mesh.View(), cloud, 1e-6);
  EXPECT_TRUE(ValidateMesh(mesh.View(), {.cloud = cloud, .merge_distance = 1e-6}).ok());
  EXPECT_THAT(ValidateCloud(mesh.View(), cloud, 0.99e-6), Violates(HasSubstr("none is within 9.9e-07 of it")));
  // A vertex that no point of the cloud is does not count.
  std::vector<double> last(mesh.points.end() - D(), mesh.points.end());
  EXPECT_THAT(ValidateCloud(mesh.View(), last, 1e-6), Violates(HasSubstr("point 0 of the cloud")));
  EXPECT_THAT(ValidateCloud(mesh.View(), cloud, -1), Refuses("merge_distance is -1"));
  EXPECT_THAT(ValidateCloud(mesh.View(), cloud, kNaN), Refuses("merge_distance is nan"));
}

TEST_P(ValidateTest, CloudThatIsNone) {
  const TestMesh mesh = Grid();
  std::vector<double> cloud = mesh.points;
  cloud.pop_back();
  EXPECT_THAT(ValidateCloud(mesh.View(), cloud), Refuses("coordinates of the cloud are no multiple"));
  cloud = mesh.points;
  cloud[static_cast<size_t>(D()) + 1] = kNaN;
  EXPECT_THAT(ValidateCloud(mesh.View(), cloud), Refuses("point 1 of the cloud: coordinate 1 is nan"));
}

// Random numbers in every place: no check may crash, and none may accept.
TEST_P(ValidateTest, NoiseIsRefused) {
  const uint64_t seed = test::Seed(8);
  SCOPED_TRACE(seed);
  test::SplitMix64 random(seed);
  for (int round = 0; round < (D() <= 3 ? 200 : 7 - D()); ++round) {
    TestMesh mesh = D() <= 3 ? Grid() : KuhnGrid(D(), 1);
    for (uint32_t& v : mesh.simplices) {
      v = static_cast<uint32_t>(random.Below(mesh.VertexCount()));
    }
    for (double& x : mesh.points) {
      x = std::scalbn(random.Unit() - 0.5, static_cast<int>(random.Below(2000)) - 1000);
    }
    for (const Check& check : AllChecks()) {
      const absl::Status status = check(mesh.View());
      EXPECT_TRUE(status.ok() || status.code() == absl::StatusCode::kFailedPrecondition) << status;
    }
    EXPECT_FALSE(ValidateMesh(mesh.View(), {}).ok());
  }
}

}  // namespace
}  // namespace wellspace::core
