// Rows of an NPY file, read in pieces, against the whole file.
#include "client/formats/numpy/npy_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <numeric>
#include <vector>

#include "client/formats/numpy/npy.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <typename T>
std::string Array(const char* type, const std::vector<T>& values, uint64_t rows, uint64_t columns) {
  std::string file = NpyPreamble(type, rows, columns);
  file.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  return file;
}

TEST(NpyRowsTest, ReadsWholeRowsFromAnywhere) {
  TemporaryFolder folder;
  std::vector<double> values(3000);
  std::iota(values.begin(), values.end(), 0.25);
  const std::vector<float> narrow(values.begin(), values.end());
  for (const std::string& path :
       {folder.Write("a.npy", Array("<f8", values, 1000, 3)), folder.Write("b.npy", Array("<f4", narrow, 1000, 3))}) {
    absl::StatusOr<NpyRows> rows = NpyRows::Open(path);
    ASSERT_TRUE(rows.ok()) << rows.status();
    EXPECT_EQ(rows->rows(), 1000u);
    EXPECT_EQ(rows->columns(), 3);
    std::vector<double> part(6);
    EXPECT_EQ(*rows->Read(998, part), 2u);
    EXPECT_THAT(part, ElementsAre(2994.25, 2995.25, 2996.25, 2997.25, 2998.25, 2999.25));
    EXPECT_EQ(*rows->Read(1, part), 2u);
    EXPECT_THAT(part, ElementsAre(3.25, 4.25, 5.25, 6.25, 7.25, 8.25));
    EXPECT_EQ(*rows->Read(999, part), 1u);
    EXPECT_EQ(part[2], 2999.25);
    EXPECT_EQ(*rows->Read(1000, part), 0u);
    EXPECT_EQ(*rows->Read(UINT64_MAX, part), 0u);
  }
}

TEST(NpyRowsTest, RefusesWhatCannotBeReadInPieces) {
  TemporaryFolder folder;
  const std::vector<double> six(6);
  const auto message = [&folder](const std::string& content) {
    const absl::StatusOr<NpyRows> rows = NpyRows::Open(folder.Write("a.npy", content));
    EXPECT_EQ(rows.status().code(), absl::StatusCode::kInvalidArgument) << rows.status();
    return std::string(rows.status().message());
  };
  std::string fortran = Array("<f8", six, 2, 3);
  const size_t at = fortran.find("False");
  fortran.replace(at, 5, "True ");
  EXPECT_THAT(message(fortran), HasSubstr("a.npy: expected an array in C order"));
  EXPECT_THAT(message(Array("<i8", six, 2, 3)), HasSubstr("got \"<i8\""));
  EXPECT_THAT(message(Array("<f8", six, 6, 1)), HasSubstr("expected 2 to 6 coordinates"));
  EXPECT_THAT(message(Array("<f8", six, 2, 2)), HasSubstr("got 48 bytes"));
  EXPECT_THAT(message(Array("<f8", six, uint64_t{1} << 61, 3)), HasSubstr("a.npy: "));
  EXPECT_THAT(message("no array"), HasSubstr("a.npy: "));
  EXPECT_EQ(NpyRows::Open(folder.Path("none.npy")).status().code(), absl::StatusCode::kNotFound);
  ASSERT_EQ(NpyRows::Open("/dev/null").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(NpyRowsTest, AFileThatBecomesShorterIsAnError) {
  TemporaryFolder folder;
  const std::string path = folder.Write("a.npy", Array("<f8", std::vector<double>(6), 2, 3));
  absl::StatusOr<NpyRows> rows = NpyRows::Open(path);
  ASSERT_TRUE(rows.ok()) << rows.status();
  ASSERT_EQ(truncate(path.c_str(), 100), 0);
  std::vector<double> values(6);
  EXPECT_THAT(std::string(rows->Read(0, values).status().message()), HasSubstr("has become shorter"));
}

}  // namespace
}  // namespace wellspace::formats
