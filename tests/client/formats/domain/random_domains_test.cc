// Random planar straight-line graphs, which come back from files to the bit; and points inside random polygons.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "client/formats/domain/interior_point.h"
#include "client/formats/domain/read_planar_domain.h"
#include "tests/client/formats/random_mesh.h"
#include "tests/support/planar_domain_text.h"
#include "tests/support/seeded_test.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

class RandomDomainsTest : public test::SeededTest {
 protected:
  RandomDomainsTest() : SeededTest(43) {}

  uint64_t Below(uint64_t limit) { return random_.Next() % limit; }

  // On a small grid, where points coincide, or with the bits of any finite double.
  double Coordinate(bool on_grid) {
    const double value = on_grid ? static_cast<double>(Below(4)) : std::bit_cast<double>(random_.Next());
    return std::isfinite(value) ? value : 0.1;
  }

  PlanarDomain RandomDomain() {
    PlanarDomain domain;
    const bool on_grid = Below(2) == 0;
    const uint64_t points = 1 + Below(30);
    for (uint64_t i = 0; i < 2 * points; ++i) {
      domain.points.push_back(Coordinate(on_grid));
    }
    const bool has_markers = Below(2) == 0;
    for (uint64_t i = 0; has_markers && i < points; ++i) {
      domain.point_markers.push_back(static_cast<int32_t>(random_.Next()));
    }
    for (uint64_t segments = Below(40); segments > 0; --segments) {
      domain.segments.push_back(static_cast<uint32_t>(Below(points)));
      domain.segments.push_back(static_cast<uint32_t>(Below(points)));
      domain.markers.push_back(static_cast<int32_t>(random_.Next()));
    }
    for (uint64_t holes = Below(3); holes > 0; --holes) {
      domain.seeds.push_back({.x = Coordinate(false), .y = Coordinate(false), .is_hole = true});
    }
    for (uint64_t regions = Below(3); regions > 0; --regions) {
      domain.seeds.push_back({.x = Coordinate(false),
                              .y = Coordinate(false),
                              .attribute = Coordinate(false),
                              .max_area = std::abs(Coordinate(false))});
    }
    return domain;
  }

  // `text` with blank lines, comments and another end of line strewn in.
  std::string Strewn(const std::string& text) {
    const std::string end = Below(2) == 0 ? "\n" : "\r\n";
    std::string strewn;
    for (const char c : text) {
      if (c != '\n') {
        strewn += c;
        continue;
      }
      const uint64_t kind = Below(8);
      strewn += kind == 0 ? " # 7" + end + end : kind == 1 ? end + "# 1 2 3" + end : end;
    }
    return strewn;
  }

  TemporaryFolder folder_;
};

TEST_F(RandomDomainsTest, PolyKeepsAllBits) {
  for (int round = 0; round < 300; ++round) {
    const PlanarDomain domain = RandomDomain();
    const uint64_t base = Below(2);
    std::string text = test::NodeText(domain, base);
    if (Below(3) == 0) {
      folder_.Write("a.node", Strewn(text));
      text = "0 2 0 0\n";
    }
    text += test::PolyTailText(domain, base);
    const absl::StatusOr<PlanarDomain> read = ReadPlanarDomain(folder_.Write("a.poly", Strewn(text)));
    ASSERT_TRUE(read.ok()) << read.status() << "\n" << text;
    EXPECT_EQ(Bits(read->points), Bits(domain.points));
    EXPECT_EQ(read->point_markers, domain.point_markers);
    EXPECT_EQ(read->segments, domain.segments);
    EXPECT_EQ(read->markers, domain.markers);
    EXPECT_EQ(read->seeds, domain.seeds);
  }
}

TEST_F(RandomDomainsTest, GeoJsonKeepsAllBitsOfSegments) {
  for (int round = 0; round < 300; ++round) {
    PlanarDomain domain = RandomDomain();
    std::vector<uint32_t> segments;
    for (uint64_t i = 0; i < domain.segment_count(); ++i) {
      const uint32_t a = domain.segments[2 * i];
      const uint32_t b = domain.segments[2 * i + 1];
      if (domain.points[2 * a] != domain.points[2 * b] || domain.points[2 * a + 1] != domain.points[2 * b + 1]) {
        segments.insert(segments.end(), {a, b});
      }
    }
    domain.segments = segments;
    if (segments.empty()) {
      continue;
    }
    const absl::StatusOr<PlanarDomain> read = ReadPlanarDomain(folder_.Write("a.geojson", test::GeoJsonText(domain)));
    ASSERT_TRUE(read.ok()) << read.status() << "\n" << test::GeoJsonText(domain);
    ASSERT_EQ(read->segment_count(), domain.segment_count());
    const auto ends = [](const PlanarDomain& of) {
      std::vector<double> coordinates;
      for (const uint32_t end : of.segments) {
        coordinates.insert(coordinates.end(), {of.points[2 * end], of.points[2 * end + 1]});
      }
      return Bits(coordinates);
    };
    EXPECT_EQ(ends(*read), ends(domain));
    const uint64_t last = domain.segment_count() - 1;
    EXPECT_EQ(read->SegmentOrigin(last), folder_.Path("a.geojson") + ":" + std::to_string(last + 2) + ": coordinates[" +
                                             std::to_string(last) + "][0]");
  }
}

// However a ring of k different corners is written, k points and k segments come of it, in its order.
TEST_F(RandomDomainsTest, RingsAreReadHoweverTheyAreWritten) {
  for (int round = 0; round < 300; ++round) {
    const uint64_t corners = 3 + Below(8);
    std::vector<double> ring;
    std::string text;
    uint64_t repeated = 0;
    const auto add = [&text](double x, double y) {
      text += text.empty() ? "[" : ",[";
      AppendNumber(x, text);
      text += ',';
      AppendNumber(y, text);
      text += ']';
    };
    for (uint64_t i = 0; i < corners; ++i) {
      ring.insert(ring.end(), {static_cast<double>(i), Coordinate(false)});
      for (uint64_t times = 1 + Below(2) * Below(3); times > 0; --times) {
        add(ring[2 * i], ring[2 * i + 1]);
        repeated += times > 1 ? 1 : 0;
      }
    }
    const uint64_t closing = Below(3);
    for (uint64_t i = 0; i < closing; ++i) {
      add(ring[0], ring[1]);
      repeated += i > 0 ? 1 : 0;
    }
    const absl::StatusOr<PlanarDomain> read =
        ReadPlanarDomain(folder_.Write("a.geojson", R"({"type":"Polygon","coordinates":[[)" + text + "]]}"));
    ASSERT_TRUE(read.ok()) << read.status() << "\n" << text;
    EXPECT_EQ(Bits(read->points), Bits(ring));
    EXPECT_EQ(read->repeated_points, repeated);
    EXPECT_EQ(read->unclosed_rings, closing == 0 ? 1u : 0u);
    std::vector<uint32_t> segments;
    for (uint32_t i = 0; i < corners; ++i) {
      segments.insert(segments.end(), {i, static_cast<uint32_t>((i + 1) % corners)});
    }
    EXPECT_EQ(read->segments, segments);
  }
}

// The winding number of a ring around a point, by the angles at it.
double Winding(const std::vector<double>& ring, double x, double y) {
  double sum = 0;
  const size_t corners = ring.size() / 2;
  for (size_t i = 0; i < corners; ++i) {
    const size_t next = (i + 1) % corners;
    const double ax = ring[2 * i] - x;
    const double ay = ring[2 * i + 1] - y;
    const double bx = ring[2 * next] - x;
    const double by = ring[2 * next + 1] - y;
    sum += std::atan2(ax * by - ay * bx, ax * bx + ay * by);
  }
  return sum / (2 * M_PI);
}

TEST_F(RandomDomainsTest, InteriorPointsAreInTheirPolygonsAndNotInHoles) {
  for (int round = 0; round < 500; ++round) {
    const double centre_x = 100 * random_.Unit() - 50;
    const double centre_y = 100 * random_.Unit() - 50;
    const auto star = [&](double low, double high) {
      std::vector<double> ring;
      const uint64_t corners = 3 + Below(20);
      for (uint64_t i = 0; i < corners; ++i) {
        const double angle = 2 * M_PI * static_cast<double>(i) / static_cast<double>(corners);
        const double radius = low + (high - low) * random_.Unit();
        ring.insert(ring.end(), {centre_x + radius * std::cos(angle), centre_y + radius * std::sin(angle)});
      }
      return ring;
    };
    // A triangle of radius 3 has a circle of radius 1.5 inside.
    const std::vector<double> outer = star(3, 10);
    const std::vector<double> hole = star(0.05, 1.4);
    std::vector<double> positions = outer;
    std::vector<size_t> starts = {0};
    const bool has_hole = Below(2) == 0;
    if (has_hole) {
      starts.push_back(outer.size() / 2);
      positions.insert(positions.end(), hole.begin(), hole.end());
    }
    const auto point = InteriorPoint(positions, starts);
    ASSERT_TRUE(point.has_value());
    EXPECT_NEAR(Winding(outer, (*point)[0], (*point)[1]), 1, 1e-6);
    EXPECT_NEAR(has_hole ? Winding(hole, (*point)[0], (*point)[1]) : 0, 0, 1e-6);
  }
}

TEST_F(RandomDomainsTest, FlatPolygonsHaveNoInteriorPoint) {
  const std::vector<double> level = {0, 0, 1, 0, 2, 0};
  const std::vector<double> steep = {0, 0, 1, 1, 2, 2};
  EXPECT_FALSE(InteriorPoint(level, {0}).has_value());
  EXPECT_FALSE(InteriorPoint(steep, {0}).has_value());
  const std::vector<double> huge = {-1e308, -1e308, 1.7e308, -1e308, 0, 1.7e308};
  EXPECT_TRUE(InteriorPoint(huge, {0}).has_value());
}

}  // namespace
}  // namespace wellspace::formats
