// Names of dropped files are made safe: none is a path.
#include "client/console/mesh_upload.h"

#include <gtest/gtest.h>

#include <string>

namespace wellspace::console {
namespace {

TEST(SafeFileNameTest, NamesAreNoPaths) {
  EXPECT_EQ(SafeFileName("lake.geojson.gz"), "lake.geojson.gz");
  EXPECT_EQ(SafeFileName("/etc/passwd"), "passwd");
  EXPECT_EQ(SafeFileName("..\\..\\win.csv"), "win.csv");
  EXPECT_EQ(SafeFileName(".."), "file..");
  EXPECT_EQ(SafeFileName(""), "file");
  EXPECT_EQ(SafeFileName("a/"), "file");
  EXPECT_EQ(SafeFileName(".poly"), "file.poly");
  EXPECT_EQ(SafeFileName("-rf.csv"), "file-rf.csv");
  EXPECT_EQ(SafeFileName("<img src=x>\n.csv"), "_img_src_x__.csv");
  EXPECT_EQ(SafeFileName(std::string(300, 'x') + ".csv"), std::string(96, 'x') + ".csv");
  EXPECT_EQ(SafeFileName(std::string("a\0b.csv", 7)), "a_b.csv");
}

}  // namespace
}  // namespace wellspace::console
