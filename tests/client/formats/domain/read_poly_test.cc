// Triangle's .poly: parts that may be missing, numbering, markers, holes and regions, and errors at their lines.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tests/client/formats/domain/read_domain_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

using Seed = PlanarDomain::Seed;

class ReadPolyTest : public ReadDomainTest {};

constexpr std::string_view kAll = R"(# a square with a hole and two regions
4 2 1 1          # points, dimension, attributes, markers
1  0 0  0.5  10
2  1 0  0.5  -20

3  1 1  0.5  30
4  0 1  0.5  40
# segments
4 1
1  1 2  5
2  2 3  -6
3  3 4  7
4  4 1  8
1
1  0.5 0.25
2
1  0.25 0.5  1.5  0.1
2  0.75 0.5  -2  -1
)";

TEST_F(ReadPolyTest, ReadsAllParts) {
  const PlanarDomain domain = ReadGood("a.poly", kAll);
  EXPECT_THAT(domain.points, ElementsAre(0, 0, 1, 0, 1, 1, 0, 1));
  EXPECT_THAT(domain.point_markers, ElementsAre(10, -20, 30, 40));
  EXPECT_THAT(domain.segments, ElementsAre(0, 1, 1, 2, 2, 3, 3, 0));
  EXPECT_THAT(domain.markers, ElementsAre(5, -6, 7, 8));
  EXPECT_THAT(domain.seeds, ElementsAre(Seed{0.5, 0.25, true, 0, 0}, Seed{0.25, 0.5, false, 1.5, 0.1},
                                        Seed{0.75, 0.5, false, -2, 0}));
  EXPECT_EQ(domain.faces, PlanarDomain::FaceRule::kHoles);
  EXPECT_THAT(domain.is_line, IsEmpty());
  EXPECT_THAT(domain.notes, IsEmpty());
  EXPECT_EQ(Without(domain.PointOrigin(1)), "a.poly:4");
  EXPECT_EQ(Without(domain.PointOrigin(2)), "a.poly:6");
  EXPECT_EQ(Without(domain.SegmentOrigin(3)), "a.poly:13");
  EXPECT_EQ(Without(domain.SeedOrigin(0)), "a.poly:15");
  EXPECT_EQ(Without(domain.SeedOrigin(2)), "a.poly:18");
}

TEST_F(ReadPolyTest, EveryPartAfterThePointsMayBeMissing) {
  std::string text(kAll);
  const auto cut = [&text](std::string_view from) { return text.substr(0, text.find(from)); };
  EXPECT_THAT(ReadGood("a.poly", cut("2\n1  0.25")).seeds, SizeIs(1));
  EXPECT_THAT(ReadGood("a.poly", cut("1\n1  0.5 ")).seeds, IsEmpty());
  EXPECT_THAT(ReadGood("a.poly", cut("1\n1  0.5 ")).segments, SizeIs(8));
  EXPECT_THAT(ReadGood("a.poly", cut("# segments")).segments, IsEmpty());
  const PlanarDomain empty = ReadGood("a.poly", cut("# segments") + "0 0\n0\n0\n");
  EXPECT_EQ(empty.point_count(), 4u);
  EXPECT_EQ(empty.segment_count(), 0u);
}

TEST_F(ReadPolyTest, CountsFromZeroOrOneInEveryPart) {
  // Only the points' base counts for ends; the other parts number their own lines.
  const PlanarDomain domain =
      ReadGood("a.poly", "3 2\n0 0 0\n1 1 0\n2 0 1\n2\n1 0 1\n2 1 2\n2\n0 3 3\n1 4 4\n1\n1 0.1 0.1 2 0.5\n");
  EXPECT_THAT(domain.segments, ElementsAre(0, 1, 1, 2));
  EXPECT_THAT(domain.markers, ElementsAre(0, 0));
  EXPECT_THAT(domain.point_markers, IsEmpty());
  EXPECT_THAT(domain.seeds, SizeIs(3));
}

TEST_F(ReadPolyTest, MissingMarkersAreZero) {
  const PlanarDomain domain = ReadGood("a.poly", "2 2 0 1\n1 0 0 7\n2 1 0\n2 1\n1 1 2\n2 2 1 3\n");
  EXPECT_THAT(domain.point_markers, ElementsAre(7, 0));
  EXPECT_THAT(domain.markers, ElementsAre(0, 3));
}

TEST_F(ReadPolyTest, TheOnlyNumberOfARegionIsItsAttributeAndItsLargestArea) {
  const PlanarDomain domain = ReadGood("a.poly", "1 2\n0 0 0\n0\n0\n1\n0 0.5 0.5 4\n");
  EXPECT_THAT(domain.seeds, ElementsAre(Seed{0.5, 0.5, false, 4, 4}));
  EXPECT_THAT(domain.notes,
              ElementsAre(HasSubstr("of 1 region the only number is both the attribute and the largest area")));
}

TEST_F(ReadPolyTest, PointsMayBeInTheNodeFileBeside) {
  folder_.Write("a.node", "# points\n3 2 0 1\n1 0 0 1\n2 1 0 2\n3 0 1 3\n");
  const PlanarDomain domain = ReadGood("a.poly", "0 2 0 0\n1 1\n1 3 1 9\n0\n");
  EXPECT_THAT(domain.points, ElementsAre(0, 0, 1, 0, 0, 1));
  EXPECT_THAT(domain.point_markers, ElementsAre(1, 2, 3));
  EXPECT_THAT(domain.segments, ElementsAre(2, 0));
  EXPECT_EQ(Without(domain.PointOrigin(2)), "a.node:5");
  EXPECT_EQ(Without(domain.SegmentOrigin(0)), "a.poly:3");
  EXPECT_THAT(ReadBad("a.poly", "0 2\n1 0\n1 0 1\n"), StartsWith("a.poly:3: expected a point from 1 to 3, got \"0\""));
}

TEST_F(ReadPolyTest, TheNodeFileIsToBeThereAndWhole) {
  const std::string poly = "# none here\n0 2 0 0\n0 0\n0\n";
  EXPECT_THAT(ReadBad("b.poly", poly), AllOf(StartsWith("b.poly:2: 0 points stand for those of the file "),
                                             HasSubstr("/b.node, and there is none")));
  folder_.Write("b.node", "3 2 0 0\n1 0 0\n2 1 0\n");
  EXPECT_EQ(ReadBad("b.poly", poly), "b.node:3: expected 3 points, as the header says, got 2");
  folder_.Write("b.node", "1 3 0 0\n1 0 0 0\n");
  EXPECT_THAT(ReadBad("b.poly", poly), StartsWith("b.node:1: expected dimension 2"));
  folder_.Write("b.node", "1 2 0 0\n1 0 0\n2 0 0\n");
  EXPECT_THAT(ReadBad("b.poly", poly), StartsWith("b.node:3: expected the end of the file after 1 points"));
  folder_.Write("b.node", "0 2\n");
  EXPECT_THAT(ReadBad("b.poly", poly), HasSubstr("no points; expected at least one"));
}

// gzip's bytes of `text`.
std::string Compressed(const std::string& text, const TemporaryFolder& folder) {
  const std::string path = folder.Path("compressed");
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
  gzclose(file);
  return folder.Read("compressed");
}

TEST_F(ReadPolyTest, FilesMayBeCompressed) {
  const PlanarDomain plain = ReadGood("a.poly", kAll);
  const PlanarDomain domain = ReadGood("a.poly.gz", Compressed(std::string(kAll), folder_));
  EXPECT_EQ(domain.points, plain.points);
  EXPECT_EQ(domain.segments, plain.segments);
  EXPECT_EQ(domain.seeds, plain.seeds);
  folder_.Write("b.node.gz", Compressed("2 2\n0 0 0\n1 1 0\n", folder_));
  EXPECT_EQ(ReadGood("b.poly.gz", Compressed("0 2\n1 0\n0 0 1\n", folder_)).point_count(), 2u);
  EXPECT_EQ(ReadGood("b.poly", "0 2\n1 0\n0 0 1\n").segment_count(), 1u);
  const std::string cut = Compressed(std::string(kAll), folder_);
  EXPECT_THAT(ReadBad("c.poly.gz", cut.substr(0, cut.size() - 4)), StartsWith("c.poly.gz: "));
  EXPECT_THAT(ReadBad("c.poly.gz", kAll), HasSubstr("expected a file of gzip"));
}

TEST_F(ReadPolyTest, ErrorsNameTheLineAndWhatIsExpected) {
  const std::string points = "3 2 0 0\n0 0 0\n1 1 0\n2 0 1\n";
  const std::string segments = points + "1 1\n0 0 1 4\n";
  struct Case {
    std::string text;
    std::string message;
  };
  for (const Case& one : std::vector<Case>{
           {"", "a.poly:1: expected a header, got an empty file"},
           {"x 2\n", "a.poly:1: expected the number of points, a whole number below 2^32, got \"x\""},
           {"3\n", "a.poly:1: expected the dimension in the header, got only 1 number"},
           {"3 3 0 0\n0 0 0 0\n", "a.poly:1: expected dimension 2, since the domain is one in the plane, got 3"},
           {"3 7\n", "a.poly:1: expected a dimension from 2 to 6, got 7"},
           {"3 2\n0 0 0\n1 1 0\n", "a.poly:3: expected 3 points, as the header says, got 2"},
           {"3 2\n2 0 0\n", "a.poly:2: expected index 0 or 1, got \"2\""},
           {"3 2\n0 0 0\n2 0 0\n", "a.poly:3: expected index 1, got \"2\""},
           {"1 2\n0 0\n", "a.poly:2: expected 2 coordinates, got 1"},
           {"1 2\n0 0 nan\n", "a.poly:2: coordinate 2: expected a finite number, got \"nan\""},
           {"1 2\n0 -inf 0\n", "a.poly:2: coordinate 1: expected a finite number, got \"-inf\""},
           {"1 2\n0 1e400 0\n", "a.poly:2: coordinate 1: expected a number of magnitude below 1.8e308, got \"1e400\""},
           {"1 2\n0 0,5 0\n", "a.poly:2: coordinate 1: expected a number, got \"0,5\" (a decimal comma?"},
           {"1 2 0 1\n0 0 0 1.5\n", "a.poly:2: marker: expected a whole number from -2^31 to below 2^31, got \"1.5\""},
           {"1 2 0 0\n0 0 0 1\n", "a.poly:2: expected 2 coordinates and 0 attributes and markers"},
           {points + "x\n", "a.poly:5: expected the number of segments, a whole number below 2^32, got \"x\""},
           {points + "1 2\n", "a.poly:5: expected 0 or 1 markers of each segment, got 2"},
           {points + "1 1 1\n", "a.poly:5: expected at most 2 numbers in the header, got also \"1\""},
           {points + "2 0\n0 0 1\n", "a.poly:6: expected 2 segments, as the header says, got 1"},
           {points + "1 0\n0 0 3\n", "a.poly:6: expected a point from 0 to 2, got \"3\""},
           {points + "1 0\n0 -1 2\n", "a.poly:6: expected a point from 0 to 2, got \"-1\""},
           {points + "1 0\n0 4294967296 2\n", "a.poly:6: expected a point from 0 to 2, got \"4294967296\""},
           {points + "1 0\n0 1\n", "a.poly:6: expected an index and two points, got fewer numbers"},
           {points + "2 0\n0 0 1\n2 0 1\n", "a.poly:7: expected index 1, got \"2\""},
           {points + "1 0\n0 0 1 5\n",
            "a.poly:6: expected an index and two points, and no marker, as the header says, "
            "got also \"5\""},
           {points + "1 1\n0 0 1 5 6\n", "a.poly:6: expected an index, two points and a marker, got also \"6\""},
           {points + "1 1\n0 0 1 3000000000\n", "a.poly:6: marker: expected a whole number from -2^31 to below 2^31"},
           {segments + "h\n", "a.poly:7: expected the number of holes"},
           {segments + "2\n0 0.5 0.5\n", "a.poly:8: expected 2 holes, as the header says, got 1"},
           {segments + "1\n0 0.5\n", "a.poly:8: expected an index, x and y, got no y"},
           {segments + "1\n0 inf 0.5\n", "a.poly:8: x: expected a finite number, got \"inf\""},
           {segments + "1\n0 0 0.5 1\n", "a.poly:8: expected an index, x and y of a hole, got also \"1\""},
           {segments + "0\n1\n", "a.poly:8: expected 1 regions, as the header says, got 0"},
           {segments + "0\n1\n0 1 1\n", "a.poly:9: expected an index, x, y, an attribute and perhaps a largest area"},
           {segments + "0\n1\n0 1 1 nan\n", "a.poly:9: attribute: expected a finite number, got \"nan\""},
           {segments + "0\n1\n0 1 1 1 inf\n", "a.poly:9: largest area: expected a finite number, got \"inf\""},
           {segments + "0\n1\n0 1 1 1 1 1\n", "a.poly:9: expected an index, x, y, an attribute and a largest area"},
           {segments + "0\n0\nmore\n", "a.poly:9: expected the end of the file after 0 regions"},
       }) {
    EXPECT_THAT(ReadBad("a.poly", one.text), StartsWith(one.message)) << one.text;
  }
}

// Counts that a file announces cost nothing: these end at once, in little memory.
TEST_F(ReadPolyTest, HugeCountsAreNotBelieved) {
  EXPECT_EQ(ReadBad("a.poly", "4294967295 2 0 0\n0 0 0\n"),
            "a.poly:2: expected 4294967295 points, as the header says, got 1");
  EXPECT_EQ(ReadBad("a.poly", "1 2\n0 0 0\n4294967295 1\n"),
            "a.poly:3: expected 4294967295 segments, as the header says, got 0");
  EXPECT_EQ(ReadBad("a.poly", "1 2\n0 0 0\n0\n4294967295\n"),
            "a.poly:4: expected 4294967295 holes, as the header says, got 0");
  EXPECT_THAT(ReadBad("a.poly", "4294967296 2\n"), HasSubstr("a whole number below 2^32"));
}

// Whatever is cut off, the file is refused, or one of its parts is missing as a whole.
TEST_F(ReadPolyTest, CutFilesAreRefusedOrLackWholeParts) {
  const std::string text(kAll);
  std::set<std::string> ends;
  for (size_t size = 0; size < text.size(); ++size) {
    const absl::StatusOr<PlanarDomain> domain = Read("a.poly", text.substr(0, size));
    if (domain.ok()) {
      EXPECT_EQ(domain->point_count(), 4u) << size;
      EXPECT_TRUE(domain->segment_count() == 0 || domain->segment_count() == 4) << size;
      ends.insert(std::to_string(domain->segment_count()) + " " + std::to_string(domain->seeds.size()));
    } else {
      EXPECT_EQ(domain.status().code(), absl::StatusCode::kInvalidArgument) << size;
      EXPECT_THAT(domain.status().message(), HasSubstr("a.poly:")) << size;
    }
  }
  EXPECT_THAT(ends, ElementsAre("0 0", "4 0", "4 1", "4 3"));
}

// Cleaning is not the reader's: every file is read as it is, but the one that speaks of a point that is not there.
TEST_F(ReadPolyTest, DirtyDomainsAreRead) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(Data("dirty"))) {
    ++files;
    const absl::StatusOr<PlanarDomain> domain = ReadPlanarDomain(entry.path());
    if (entry.path().filename() == "bad_index.poly") {
      EXPECT_THAT(domain.status().message(), HasSubstr("bad_index.poly:8: expected a point from 0 to 2, got \"7\""));
      continue;
    }
    ASSERT_TRUE(domain.ok()) << domain.status();
    EXPECT_GE(domain->segment_count(), 2u) << entry.path();
  }
  EXPECT_EQ(files, 11);
  EXPECT_EQ(ReadPlanarDomain(Data("lake.poly"))->seeds.size(), 7u);
}

// A file in the place of standard input, as long as this lives.
class StandardInput {
 public:
  explicit StandardInput(const std::string& path) : before_(dup(STDIN_FILENO)) {
    const int file = open(path.c_str(), O_RDONLY);
    dup2(file, STDIN_FILENO);
    close(file);
  }
  ~StandardInput() {
    dup2(before_, STDIN_FILENO);
    close(before_);
  }

 private:
  const int before_;
};

TEST_F(ReadPolyTest, StandardInputIsToldItsFormatAndHasNoFileBeside) {
  EXPECT_THAT(std::string(ReadPlanarDomain("-").status().message()),
              StartsWith("<stdin>: expected to be told the format: one of poly, geojson"));
  {
    const StandardInput input(folder_.Write("a.poly", kAll));
    const absl::StatusOr<PlanarDomain> domain = ReadPlanarDomain("-", {.format = "poly"});
    ASSERT_TRUE(domain.ok()) << domain.status();
    EXPECT_EQ(domain->SegmentOrigin(0), "<stdin>:10");
  }
  const StandardInput input(folder_.Write("b.poly", "0 2\n"));
  EXPECT_THAT(std::string(ReadPlanarDomain("-", {.format = "poly"}).status().message()),
              StartsWith("<stdin>:1: 0 points stand for those of the .node file beside this one"));
}

TEST_F(ReadPolyTest, OptionsOfOtherFormatsAreRefused) {
  EXPECT_THAT(ReadBad("a.poly", kAll, {.region_property = "a"}),
              HasSubstr("--region-property is of the format geojson"));
  EXPECT_THAT(ReadBad("a.poly", kAll, {.marker_property = "a"}),
              HasSubstr("--marker-property is of the format geojson"));
  EXPECT_THAT(ReadBad("a.poly", kAll, {.columns = {"1", "2"}}), HasSubstr("--columns is of the format csv"));
  EXPECT_THAT(ReadBad("a.poly", kAll, {.id_column = "1"}), HasSubstr("--id-column is of the format csv"));
  EXPECT_THAT(ReadBad("a.dxf", kAll), HasSubstr("expected one of .poly, .geojson, .json, .geojsonl, "));
  EXPECT_EQ(ReadGood("a.dxf", kAll, {.format = "poly"}).point_count(), 4u);
  EXPECT_TRUE(IsDomainPath("a/b.poly.gz") && IsDomainPath("c.GeoJSON"));
  EXPECT_TRUE(IsDomainPath("a.wkt") && IsDomainPath("a.shp.gz") && IsDomainPath("a.ndjson"));
  EXPECT_FALSE(IsDomainPath("a.csv") || IsDomainPath("a.json") || IsDomainPath("fort.14") || IsDomainPath("a.obj.gz") ||
               IsDomainPath("poly"));
}

}  // namespace
}  // namespace wellspace::formats
