// A fixture for tests of readers of clouds: a folder, and a cloud or a refusal of a file in it.
#ifndef WELLSPACE_TESTS_CLIENT_FORMATS_READ_CLOUD_FIXTURE_H_
#define WELLSPACE_TESTS_CLIENT_FORMATS_READ_CLOUD_FIXTURE_H_

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "client/formats/read_cloud.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {

class ReadCloudTest : public testing::Test {
 protected:
  absl::StatusOr<PointCloud> Read(const std::string& name, std::string_view content, const CloudOptions& options = {}) {
    return ReadCloud(folder_.Write(name, content), options);
  }

  PointCloud ReadGood(const std::string& name, std::string_view content, const CloudOptions& options = {}) {
    const absl::StatusOr<PointCloud> cloud = Read(name, content, options);
    EXPECT_TRUE(cloud.ok()) << cloud.status();
    return cloud.ok() ? *cloud : PointCloud{};
  }

  // The message after the folder's name.
  std::string ReadBad(const std::string& name, std::string_view content, const CloudOptions& options = {}) {
    const absl::StatusOr<PointCloud> cloud = Read(name, content, options);
    EXPECT_EQ(cloud.status().code(), absl::StatusCode::kInvalidArgument);
    const std::string message(cloud.status().message());
    const std::string path = folder_.Path("");
    return message.substr(0, path.size()) == path ? message.substr(path.size()) : message;
  }

  TemporaryFolder folder_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_TESTS_CLIENT_FORMATS_READ_CLOUD_FIXTURE_H_
