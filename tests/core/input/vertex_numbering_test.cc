// Numbers of vertices, on a structure that is made by hand.
#include "core/input/vertex_numbering.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "core/base/run_context.h"
#include "core/input/frame.h"
#include "core/input/sorted_cloud.h"
#include "core/voronoi/query_structure.h"
#include "tests/support/brute_force.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Five inputs in the plane, of which the fourth is equal to the first but for the sign of a zero.
class VertexNumberingTest : public ::testing::Test {
 protected:
  VertexNumberingTest() {
    const auto domain = Frame<2>::Of({{-1, -1}, {1, 1}});
    EXPECT_TRUE(domain.ok()) << domain.status();
    domain_ = *domain;
    auto cloud = SortCloud<2>(domain_, points_, 1, context_);
    EXPECT_TRUE(cloud.ok()) << cloud.status();
    EXPECT_TRUE(structure_.Initialize(cloud->grid, std::move(cloud->points), 1000, 1, context_).ok());
    auto names = NamePoints<2>(*std::move(cloud), context_);
    EXPECT_TRUE(names.ok()) << names.status();
    numbering_.Begin(*std::move(names), points_, {});
  }

  const std::vector<double> points_ = {-0.0, 0.5, 0.25, -0.5, -0.75, -0.0, 0.0, 0.5, 0.5, 0.75};
  RunContext context_;
  Frame<2> domain_;
  QueryStructure<2> structure_;
  VertexNumbering<2> numbering_;
};

TEST_F(VertexNumberingTest, InputsAreNumberedAsTheyFirstAppear) {
  EXPECT_THAT(numbering_.input_vertex(), ElementsAre(0, 1, 2, 0, 3));
  EXPECT_EQ(numbering_.distinct_inputs(), 4u);
}

TEST_F(VertexNumberingTest, OutsideAndInsideAreInverse) {
  std::set<uint32_t> seen;
  for (uint32_t i = 0; i < structure_.vertex_count() + 3; ++i) {
    EXPECT_EQ(numbering_.OutputIndex(numbering_.VertexOf(i)), i);
    seen.insert(Index(numbering_.VertexOf(i)));
  }
  EXPECT_EQ(seen.size(), structure_.vertex_count() + 3) << "no two are one";
  EXPECT_EQ(numbering_.VertexOf(4), VertexId{4}) << "the first corner of the box";
}

TEST_F(VertexNumberingTest, PointsHaveTheBitsOfTheFirstOfEquals) {
  const auto points = numbering_.PointsFrom(structure_, domain_, 0, context_);
  ASSERT_TRUE(points.ok()) << points.status();
  ASSERT_EQ(points->size(), 2u * structure_.vertex_count());
  const std::vector<double> first = {-0.0, 0.5, 0.25, -0.5, -0.75, -0.0, 0.5, 0.75};
  for (size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ((*points)[i], first[i]) << i;
    EXPECT_EQ(std::signbit((*points)[i]), std::signbit(first[i])) << i;
  }
}

TEST_F(VertexNumberingTest, VerticesThatAreAddedFollow) {
  const std::vector<double> added = {0.1, -0.0};
  const VertexId v = structure_.AddVertex(kNoVertex, {0.1 * domain_.scale, 0});
  numbering_.AddInputVertex(v, added, 0);
  const uint32_t number = numbering_.OutputIndex(v);
  numbering_.AppendInputs({&number, 1});
  EXPECT_EQ(number, structure_.vertex_count() - 1);
  EXPECT_THAT(numbering_.input_vertex(), ElementsAre(0, 1, 2, 0, 3, number));
  EXPECT_EQ(numbering_.distinct_inputs(), 5u);
  const auto points = numbering_.PointsFrom(structure_, domain_, number, context_);
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_THAT(*points, ElementsAre(0.1, 0.0));
  EXPECT_TRUE(std::signbit(points->back()));
  numbering_.Extend(structure_.vertex_count());
  EXPECT_EQ(numbering_.output_index().size(), structure_.vertex_count());
  EXPECT_EQ(numbering_.output_index().back(), number);
}

TEST(CheckVerticesTest, NamesTheFirstThatDoesNotExist) {
  EXPECT_TRUE(CheckVertices(std::vector<uint32_t>{0, 6}, 7).ok());
  const absl::Status status = CheckVertices(std::vector<uint32_t>{6, 7, 9}, 7);
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(status.message(), HasSubstr("vertices[1]: 7 is no vertex; there are 7"));
}

}  // namespace
}  // namespace wellspace::core
