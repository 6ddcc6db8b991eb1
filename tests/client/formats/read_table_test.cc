// Tables of points as people have them: headers, columns that are no coordinates, numbers as other programs and other
// countries write them, points without coordinates, line ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/table_columns.h"
#include "tests/client/formats/read_cloud_fixture.h"

namespace wellspace::formats {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class ReadTableTest : public ReadCloudTest {};

// A first row that is no row is an error at its field, whatever it is; it was taken for a header.
TEST_F(ReadTableTest, AFirstRowThatDoesNotParseIsNoHeader) {
  struct Case {
    const char* row;
    const char* message;
  };
  for (const Case& one : {
           Case{"0,5;1,5", "field 1: expected a number, got \"0,5\" (a decimal comma?"},
           {"0,6251\t0,8972\t0,7757", "field 1: expected a number, got \"0,6251\" (a decimal comma?"},
           {"0,5 1,5", "field 2: expected a number, got \"5 1\" (decimal commas"},
           {"\"0,7777\",\"1,2\"", "field 1: expected a number, got \"0,7777\" (a decimal comma?"},
           {"\"1,234.5\",\"2,000.25\"", "field 1: expected a number, got \"1,234.5\" (commas between thousands?"},
           {"1,234;2,000", "field 1: expected a number, got \"1,234\" (a decimal comma, or one between thousands?"},
           {"1'234.5;2'000", "field 1: expected a number, got \"1\\'234.5\" (a mark between thousands?"},
           {"1\xC2\xA0"
            "234.5;1",
            "(a mark between thousands?"},
           {"********,********", "field 1: expected a number, got \"********\" (a number too wide for its field"},
           {"\xE2\x88\x92"
            "1.5,\xE2\x88\x92"
            "2",
            "(a dash or a minus sign that is not ASCII? expected -)"},
           {"1.5m,2.5m", "field 1: expected a number, got \"1.5m\""},
           {"NA,NA", "field 1: expected a number, got \"NA\"; --skip-invalid leaves such points out"},
           {"nan,nan", "field 1: expected a finite number, got \"nan\"; --skip-invalid leaves such points out"},
           {"+a,-b,*,/", "field 1: expected a number, got \"+a\""},
           {"ncols 4", "a grid of heights?"},
           {"x,\x01", "field 1: expected a number"},
           {"x\xff,y", "is it a text file?"},
           {"word", "field 1: expected a number, got \"word\""},
       }) {
    for (const char* name : {"cloud.csv", "cloud.xyz", "cloud.asc", "cloud.pts", "cloud.txt"}) {
      for (const int dimension : {0, 2}) {
        const std::string message =
            ReadBad(name, std::string(one.row) + "\n1,2\n", {.format = "", .dimension = dimension});
        const bool is_about_dimension = dimension == 2 && message.find("expected 2 coordinates") != std::string::npos;
        EXPECT_THAT(message, StartsWith(std::string(name) + ":1: ")) << one.row;
        EXPECT_TRUE(is_about_dimension || message.find(one.message) != std::string::npos) << one.row << ": " << message;
      }
    }
  }
}

TEST_F(ReadTableTest, BinaryFilesAreNoEmptyClouds) {
  const CloudOptions space = {.format = "", .dimension = 3};
  EXPECT_THAT(ReadBad("a.csv", std::string(20000, 'y'), space), HasSubstr("a.csv:1: "));
  EXPECT_THAT(ReadBad("a.csv", std::string(300, 'y') + "," + std::string(300, 'z') + "\n", space),
              HasSubstr("a.csv:1: "));
  EXPECT_THAT(ReadBad("a.csv", std::string_view("\xFF\xFE"
                                                "1\0,\0002\0\n\0",
                                                10)),
              HasSubstr("the file is in UTF-16"));
  EXPECT_THAT(ReadBad("a.csv", std::string_view("PK\x03\x04,a\n", 8), space), HasSubstr("(is it a text file?)"));
}

TEST_F(ReadTableTest, FortranExponentsAreNumbers) {
  for (const char* row :
       {" -0.1D+01  0.25d-02\n", "-1.0D0,2.5D-3\n", "-.1q+1;0.25Q-2\n", "-1. 2.5-003\n", "-0.1D+01\t+0.25D-002\n"}) {
    EXPECT_THAT(ReadGood("a.dat", row).points, ElementsAre(-1, 0.0025)) << row;
  }
  EXPECT_THAT(ReadGood("a.node", "1 2 0 0\n1 1.0D+00 2.0D+00\n").points, ElementsAre(1, 2));
  EXPECT_THAT(ReadGood("a.obj", "v 1.0D+00 2.0D+00\n").points, ElementsAre(1, 2));
  EXPECT_THAT(ReadGood("a.off", "OFF\n1 0 0\n1.0D+00 2.0D+00 1.5-100\n").points, ElementsAre(1, 2, 1.5e-100));
  for (const char* text : {"1.5-20", "15-200", "1.5-2000", "D5", "1D", "1D5D5", ".-200", "e.-200"}) {
    double value = 0;
    EXPECT_EQ(ReadCoordinate(text, value), CoordinateKind::kNone) << text;
  }
  EXPECT_THAT(ReadBad("a.dat", "1.0D+999 2\n"), HasSubstr("field 1: expected a number, got \"1.0D+999\""));
}

TEST_F(ReadTableTest, NamesChooseColumns) {
  struct Case {
    const char* header;
    std::vector<double> point;  // of the row 1,2,3,4
  };
  for (const Case& one : std::vector<Case>{
           {"id,lon,lat,pop", {2, 3}},
           {"fid,LAT,Longitude,Altitude", {3, 2, 4}},
           {"n,e,id,elev", {2, 1, 4}},
           {"Northing,Easting,h,id", {2, 1, 3}},
           {"OBJECTID,POINT_X,POINT_Y,POINT_Z", {2, 3, 4}},
           {"Points:0,Points:1,Points:2,Normals:0", {1, 2, 3}},
           {"RTData,Points_0,Points_1,Points_2", {2, 3, 4}},
           {"\"Normals:2\",\"Points:2\",\"Points:0\",\"Points:1\"", {3, 4, 2}},
           {"xcoord,ycoord,zcoord,t", {1, 2, 3}},
           {"X [m],Y [m],Z [m],R", {1, 2, 3}},
           {"pos_x,pos_y,vel_x,vel_y", {1, 2}},
           {"coordX,coordY,1st,2nd", {1, 2}},
           {"x,y,lat,lon", {1, 2}},
           {"a,b,c,d", {1, 2, 3, 4}},
           {"//X,Y,Z,R", {1, 2, 3}},
           {"# id,x,y,z", {2, 3, 4}},
       }) {
    const PointCloud cloud = ReadGood("a.csv", std::string(one.header) + "\n1,2,3,4\n");
    EXPECT_EQ(cloud.points, one.point) << one.header;
    EXPECT_EQ(cloud.notes.size(), 1u) << one.header;
  }
}

TEST_F(ReadTableTest, NamesThatDoNotSayWhichColumnsAreCoordinatesAreAnError) {
  for (const char* header : {"id,a,b", "a,b,name", "x,u,v", "lon,a,b", "point id,u,v", "easting,z,t"}) {
    EXPECT_THAT(ReadBad("a.csv", std::string(header) + "\n1,2,3\n"),
                AllOf(StartsWith("a.csv:1: "), HasSubstr("--columns")))
        << header;
  }
}

TEST_F(ReadTableTest, SaysWhichColumnsWereTaken) {
  const auto note = [this](const char* name, const char* content, const CloudOptions& options = {}) {
    const PointCloud cloud = ReadGood(name, content, options);
    return cloud.notes.empty() ? "" : cloud.notes[0].substr(folder_.Path("").size());
  };
  EXPECT_EQ(note("a.csv", "id,lon,lat\n1,2,3\n"),
            "a.csv: columns 2 \"lon\", 3 \"lat\" are taken as coordinates, and column 1 \"id\" is not; --columns takes "
            "others");
  EXPECT_EQ(note("a.xyz", "1 2 3 4 5\n"),
            "a.xyz: columns 1, 2, 3 are taken as coordinates, and columns 4, 5 are not; --columns takes others");
  EXPECT_EQ(note("a.csv", "lat,lon\n1,2\n"),
            "a.csv: columns 2 \"lon\", 1 \"lat\" are taken as coordinates; --columns takes others");
  EXPECT_EQ(note("a.csv", "1,2,3\n"), "");
  EXPECT_EQ(note("a.csv", "x,y,z\n1,2,3\n"), "");
  EXPECT_EQ(note("a.csv", "1,2,3,4\n", {.format = "", .dimension = 4}), "");
  EXPECT_EQ(note("a.csv", "id,lon,lat\n1,2,3\n", {.format = "", .dimension = 0, .columns = {"lon", "lat"}}), "");
}

TEST_F(ReadTableTest, ColumnsByNameAndNumber) {
  const auto with = [](std::vector<std::string> columns, int dimension = 0) {
    return CloudOptions{.format = "", .dimension = dimension, .columns = std::move(columns)};
  };
  const char* named = "id;East;b;North\n1;2;3;4\n5;6;7;8\n";
  EXPECT_THAT(ReadGood("a.csv", named, with({"east", "NORTH"})).points, ElementsAre(2, 4, 6, 8));
  EXPECT_THAT(ReadGood("a.csv", named, with({"4", "b", "2"}, 3)).points, ElementsAre(4, 3, 2, 8, 7, 6));
  EXPECT_THAT(ReadGood("a.csv", "x,y,z\n1,2,0\n3,4,0\n", with({"1", "2"}, 2)).points, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(ReadGood("a.xyz", "a 1 2 3 4\n", with({"4", "5"})).points, ElementsAre(3, 4));
  EXPECT_THAT(ReadGood("a.csv", "1,2,3,4,5,6,7,8,9,10\n", with({"1", "2", "10"})).points, ElementsAre(1, 2, 10));
  EXPECT_THAT(ReadGood("a.pts", "2\n1 2 3 9\n4 5 6 9\n", with({"3", "1"})).points, ElementsAre(3, 1, 6, 4));
  EXPECT_THAT(ReadGood("a.xyz", "1\nwater\n8 0.5 0.25 1 7\n", with({"2", "3", "4"})).points, ElementsAre(0.5, 0.25, 1));
  EXPECT_THAT(ReadGood("a.node", "1 3 0 0\n1 1 2 3\n", with({"3", "x"}, 2)).points, ElementsAre(3, 1));
  EXPECT_THAT(ReadGood("a.obj", "v 1 2 3\n", with({"1", "2"}, 2)).points, ElementsAre(1, 2));
  EXPECT_THAT(ReadGood("a.off", "OFF\n1 0 0\n1 2 3\n", with({"z", "y"})).points, ElementsAre(3, 2));
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float u\nproperty float v\nproperty list uchar int l\n"
      "property float W\nend_header\n1 2 1 7 3\n";
  EXPECT_THAT(ReadGood("a.ply", ply, with({"w", "U"})).points, ElementsAre(3, 1));
  EXPECT_THAT(ReadBad("a.ply", ply, with({"u", "l"})), HasSubstr("\"l\" is a list"));

  EXPECT_THAT(
      ReadBad("a.csv", named, with({"east", "up"})),
      HasSubstr("--columns: there is no column \"up\"; expected numbers from 1 to 4, or names of \"id\", \"East\""));
  EXPECT_THAT(ReadBad("a.csv", "1,2\n", with({"x", "y"})), HasSubstr("(the columns have no names)"));
  for (const char* number : {"0", "5", "99999999999999999999", "-1", "1.5"}) {
    EXPECT_THAT(ReadBad("a.csv", named, with({"1", number})), HasSubstr("--columns: there is no column")) << number;
  }
  EXPECT_THAT(ReadBad("a.csv", named, with({"2", "east"})), HasSubstr("is given twice"));
  EXPECT_THAT(ReadBad("a.csv", "x,x\n1,2\n", with({"x", "2"})), HasSubstr("two columns are called \"x\""));
  EXPECT_THAT(ReadBad("a.csv", named, with({"2"})), HasSubstr("--columns: expected 2 to 6 columns"));
  EXPECT_THAT(ReadBad("a.csv", named, with({"2", "3"}, 3)), HasSubstr("--columns: expected 3 columns"));
}

TEST_F(ReadTableTest, MoreColumnsThanDimensionsNameTheOption) {
  const CloudOptions plane = {.format = "", .dimension = 2};
  EXPECT_EQ(
      ReadBad("a.csv", "x,y,z\n1,2,0\n", plane),
      "a.csv:2: expected 2 coordinates, got 3 (columns 1 \"x\", 2 \"y\", 3 \"z\"); --columns 1,2 takes 2 of them");
  EXPECT_THAT(ReadBad("a.csv", "1,2,3,4\n", {.format = "", .dimension = 3}), HasSubstr("--columns 1,2,3 takes 3"));
  EXPECT_THAT(ReadBad("a.csv", "1,2,3,4,5,6,7,8,9,10\n"), HasSubstr("--columns 1,2,3 takes three"));
  EXPECT_THAT(ReadBad("a.csv", "a\tb\tc\td\te\tf\tg\n1\t2\t3\t4\t5\t6\t7\n"),
              HasSubstr("(fields are separated by \"\\t\")"));
  EXPECT_EQ(ReadBad("a.csv", "1,2,3,4\n"),
            "a.csv:1: 4 columns without names of coordinates: expected --columns 1,2 or --columns 1,2,3 or others that "
            "are, or --dimension 4 if all are");
  EXPECT_THAT(ReadBad("a.csv", "# made by hand\n1 2 3 4 5 6\n"), HasSubstr("or --dimension 6 if all are"));
  EXPECT_THAT(ReadBad("a.xyz", "1 2 3\n", plane), HasSubstr("--columns 1,2"));
  EXPECT_THAT(ReadBad("a.node", "1 3 0 0\n1 1 2 3\n", plane), HasSubstr("--columns 1,2"));
  EXPECT_THAT(ReadBad("a.obj", "v 1 2 3\n", plane), HasSubstr("--columns 1,2"));
  EXPECT_THAT(ReadBad("a.off", "OFF\n1 0 0\n1 2 3\n", plane), HasSubstr("--columns 1,2"));
  EXPECT_THAT(ReadBad("a.xyz", "1\nwater\n8 0 0 1\n"), HasSubstr("--columns"));
}

// A row that has another number of fields might have its coordinates elsewhere.
TEST_F(ReadTableTest, RowsHaveAsManyFieldsAsTheFirst) {
  EXPECT_EQ(ReadBad("a.csv", "name x y\nfoo 1 2\nArea 51 1 2\n"), "a.csv:3: expected 3 fields, as line 1 has, got 4");
  EXPECT_EQ(ReadBad("a.xyz", "1 2 3 9\n4 5 6\n"), "a.xyz:2: expected 4 fields, as line 1 has, got 3");
  EXPECT_EQ(ReadBad("a.csv", "x,y,name\n1,2,a,b\n"), "a.csv:2: expected 3 fields, as line 1 has, got 4");
  EXPECT_THAT(ReadGood("a.csv", "x,y,name\n1,2\n3,4,\n5,6,\"a, b\"\n7,8,,,\n").points,
              ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(
      ReadGood("a.csv", "\"a \"\"b\"\", c\",1,2\n\"d\",3,4\n", {.format = "", .dimension = 0, .columns = {"2", "3"}})
          .points,
      ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(ReadGood("a.tsv", "point name\tx\ty\tnote\n\t1\t2\t\nb c\t3\t4\tlast\n").points, ElementsAre(1, 2, 3, 4));
}

TEST_F(ReadTableTest, XyzIsAsTolerantAsCsv) {
  for (const char* name : {"a.xyz", "a.asc", "a.pts", "a.csv", "a.txt", "a.tsv", "a.dat"}) {
    for (const char* content : {"1,2,3\n4,5,6\n", "1;2;3\n4;5;6\n", "1\t2\t3\n4\t5\t6\n", "  1  2   3\n4 5 6\n",
                                "1, 2, 3\n4, 5, 6\n", "x y z\n1 2 3\n4 5 6\n", "X,Y,Z,R\n1,2,3,9\n4,5,6,9\n",
                                "//X Y Z R G B\n1 2 3 7 8 9\n4 5 6 7 8 9\n", "//X,Y,Z\n2\n1,2,3\n4,5,6\n"}) {
      EXPECT_THAT(ReadGood(name, content).points, ElementsAre(1, 2, 3, 4, 5, 6)) << name << ": " << content;
    }
  }
  EXPECT_THAT(ReadBad("a.txt", "//X Y Z\n3\n1 2 3\n4 5 6\n"),
              HasSubstr("a.txt:4: expected 3 points up to here, as line 2 says, got 2"));
}

TEST_F(ReadTableTest, AscTakesTheFirstThree) {
  EXPECT_THAT(ReadGood("a.asc", "0 0 0 1 2 3\n1 0 0 1 2 3\n").points, ElementsAre(0, 0, 0, 1, 0, 0));
}

TEST_F(ReadTableTest, PtsCountsItsPoints) {
  const char* content = "2\n1 2 3 -1484 115 115 115\n4 5 6 -1484 115 115 115\n1\n7 8 9 -1 1 2 3\n";
  const PointCloud cloud = ReadGood("a.pts", content);
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(cloud.Origin(2), EndsWith("a.pts:5"));
  EXPECT_THAT(ReadBad("a.pts", "3\n1 2 3\n4 5 6\n"),
              HasSubstr("a.pts:3: expected 3 points up to here, as line 1 says, got 2"));
  EXPECT_THAT(ReadBad("a.pts", "1\n1 2 3\n4 5 6\n"), HasSubstr("a.pts:3: expected the number of points that follow"));
  EXPECT_THAT(ReadBad("a.pts", "3\n1 2 3\n1\n4 5 6\n"),
              HasSubstr("expected 3 points up to here, as line 1 says, got 1"));
  EXPECT_THAT(ReadBad("a.xyz", "2\n1 2 3\n4 5 6\n"), HasSubstr("--input-format pts"));
  EXPECT_THAT(ReadBad("a.pts", "1 2 3\n2\n"), HasSubstr("a.pts:2: expected 3 coordinates, got 1"));
}

// Lines of text end in CR alone on old machines of Apple's, and in some exports still.
TEST_F(ReadTableTest, LinesEndAnyhow) {
  for (const std::string& end : {std::string("\n"), std::string("\r\n"), std::string("\r")}) {
    for (const std::string& last : {end, std::string()}) {
      const std::string content = absl::StrCat("# c", end, "x,y", end, "0,1", end, end, "2,3", last);
      const PointCloud cloud = ReadGood("a.csv", content);
      EXPECT_THAT(cloud.points, ElementsAre(0, 1, 2, 3)) << testing::PrintToString(end);
      EXPECT_THAT(cloud.Origin(1), EndsWith("a.csv:5"));
    }
  }
  // Whatever they are mixed of, no row is hidden in another, or in a comment.
  EXPECT_THAT(ReadGood("a.csv", "0,1\n# c\r2,3\r4,5\r\n6,7\r8,9").points, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(ReadGood("a.csv", "0,1\r# c\n2,3\r\n4,5\n6,7\r").points, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  std::string many;
  for (int i = 0; i < 200'000; ++i) {
    many += std::to_string(i) + ",1\r";
  }
  const PointCloud cloud = ReadGood("a.csv", many);
  ASSERT_EQ(cloud.size(), 200'000u);
  EXPECT_EQ(cloud.points[2 * 199'999], 199'999);
  EXPECT_THAT(ReadBad("a.csv", many + "x"), HasSubstr("a.csv:200001: "));
}

TEST_F(ReadTableTest, CrlfAcrossBuffersIsOneLineEnd) {
  for (const size_t padding : {(1u << 18) - 4, (1u << 18) - 3, (1u << 18) - 2}) {
    const PointCloud cloud = ReadGood("a.csv", absl::StrCat("#", std::string(padding, '-'), "\r\n1,2\r\n3,4\r\n"));
    EXPECT_THAT(cloud.points, ElementsAre(1, 2, 3, 4));
    EXPECT_THAT(cloud.Origin(1), EndsWith("a.csv:3"));
  }
}

// A value of Microsoft's C library is no number followed by a comment.
TEST_F(ReadTableTest, AHashInsideAValueStartsNoComment) {
  EXPECT_THAT(ReadBad("a.csv", "5.5,1.5,1.#QNAN\n"),
              HasSubstr("field 3: expected a number, got \"1.#QNAN\"; --skip-invalid"));
  EXPECT_THAT(ReadBad("a.csv", "1,2,3\n5.5,1.5,2#c\n"), HasSubstr("a.csv:2: field 3"));
  EXPECT_THAT(ReadBad("a.obj", "v 1 2 1.#INF\n"), HasSubstr("coordinate 3: expected a number, got \"1.#INF\""));
  EXPECT_THAT(ReadGood("a.csv", "1,2\t# c\n#3,4\n").points, ElementsAre(1, 2));
}

TEST_F(ReadTableTest, SkipsAndCountsPointsWithoutCoordinates) {
  const CloudOptions skip = {.format = "", .dimension = 0, .columns = {}, .skip_invalid = true};
  const PointCloud cloud = ReadGood(
      "a.csv", "x,y,n\n1,2,NA\nNA,2,1\n,3,1\n4,nan,1\n5,-inf,1\nn/a,null,1\n1e999,1,1\n#N/A,1,1\n1.#IND,1,1\n7,8,\n",
      skip);
  EXPECT_THAT(cloud.points, ElementsAre(1, 2, 7, 8));
  EXPECT_EQ(cloud.skipped, 7u);
  EXPECT_THAT(cloud.Origin(1), EndsWith("a.csv:11"));
  EXPECT_THAT(cloud.notes.back(), HasSubstr("7 points are left out"));
  EXPECT_THAT(ReadGood("a.csv", "NA,NA\n1,2\n", skip).points, ElementsAre(1, 2));
  EXPECT_EQ(ReadBad("a.csv", "1,2\nNA,x\n", skip), "a.csv:2: field 2: expected a number, got \"x\"");
  EXPECT_EQ(ReadBad("a.csv", "1,2\nNA\n", skip), "a.csv:2: expected 2 coordinates, got 1");
  EXPECT_EQ(ReadGood("a.pts", "3\nnan nan nan 0\n1 2 3 0\n4 5 6 0\n", skip).skipped, 1u);
  EXPECT_EQ(ReadGood("a.xyz", "2\n\nO 0 0 nan\nH 1 2 3\n", skip).skipped, 1u);
  EXPECT_EQ(ReadGood("a.node", "2 2 0 0\n1 nan 0\n2 1 2\n", skip).skipped, 1u);
  EXPECT_EQ(ReadGood("a.off", "OFF\n2 0 0\nnan 0 0\n1 2 3\n", skip).skipped, 1u);
  EXPECT_EQ(ReadGood("a.obj", "v nan 0 0\nv 1 2 3\n", skip).skipped, 1u);
  EXPECT_THAT(ReadBad("a.csv", "nan,nan\n", {.format = "", .dimension = 2}), HasSubstr("--skip-invalid"));
}

TEST_F(ReadTableTest, ASymbolOfChemistryIsAWord) {
  EXPECT_THAT(ReadBad("a.xyz", "1\nwater\n******* 1 2 0.5\n"), HasSubstr("a.xyz:3: "));
  EXPECT_THAT(ReadBad("a.xyz", "1\nwater\n0,5 1 2 0.5\n"), HasSubstr("a.xyz:3: "));
}

TEST_F(ReadTableTest, FormatsThatAreNotReadAreNamed) {
  for (const char* name : {"cloud.rcp", "cube.step", "a.e57", "a.gz", "a.e57.gz"}) {
    EXPECT_THAT(ReadBad(name, "1 2 3\n"),
                AllOf(HasSubstr("no format is known by the extension"), HasSubstr(".csv, .tsv, .txt, .dat, .xyz"),
                      HasSubstr(".asc, .pts"), HasSubstr(".gz")))
        << name;
  }
}

TEST_F(ReadTableTest, FacesAreNotUsed) {
  const auto note = [this](const char* name, const char* content) {
    const PointCloud cloud = ReadGood(name, content);
    return cloud.notes.empty() ? "" : cloud.notes[0].substr(folder_.Path("").size());
  };
  EXPECT_EQ(note("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n"),
            "a.obj: 2 faces are not used, only the points");
  EXPECT_EQ(note("a.off", "OFF\n1 1 0\n0 0 0\n1 0\n"), "a.off: 1 face is not used, only the points");
  const std::string ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nelement face ";
  EXPECT_EQ(note("a.ply", (ply + "7\nproperty list uchar int i\nend_header\n1 2\n").c_str()),
            "a.ply: 7 faces are not used, only the points");
  EXPECT_EQ(note("a.ply", (ply + "0\nproperty list uchar int i\nend_header\n1 2\n").c_str()), "");
  EXPECT_THAT(ReadBad("a.obj", "V 1 2 3\n"), HasSubstr("expected \"v\" for a vertex"));
}

TEST(IsColumnNameTest, IsAWord) {
  for (const char* name :
       {"x", "X [m]", "Points:0", "_id", "L\xC3\xA4nge", "\xE7\xB5\x8C\xE5\xBA\xA6", "e", "-x", "$x"}) {
    EXPECT_TRUE(IsColumnName(name)) << name;
  }
  for (const char* name : {"", "1", "1.5m", "-1x", ".5x", "--", "***", "NA", "nan", "inf", "1.0D+00", "\xE2\x88\x92",
                           "\xE2\x88\x92"
                           "1",
                           "\x01x", "\xffx", "\xEF\xBC\x91", "$5"}) {
    EXPECT_FALSE(IsColumnName(name)) << name;
  }
}

}  // namespace
}  // namespace wellspace::formats
