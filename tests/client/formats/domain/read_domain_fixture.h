// A fixture for tests of readers of planar domains: a folder, and a domain or a refusal of a file in it.
#ifndef WELLSPACE_TESTS_CLIENT_FORMATS_DOMAIN_READ_DOMAIN_FIXTURE_H_
#define WELLSPACE_TESTS_CLIENT_FORMATS_DOMAIN_READ_DOMAIN_FIXTURE_H_

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "client/formats/domain/read_planar_domain.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {

class ReadDomainTest : public testing::Test {
 protected:
  absl::StatusOr<PlanarDomain> Read(const std::string& name, std::string_view content,
                                    const DomainOptions& options = {}) {
    return ReadPlanarDomain(folder_.Write(name, content), options);
  }

  PlanarDomain ReadGood(const std::string& name, std::string_view content, const DomainOptions& options = {}) {
    const absl::StatusOr<PlanarDomain> domain = Read(name, content, options);
    EXPECT_TRUE(domain.ok()) << domain.status();
    return domain.ok() ? *domain : PlanarDomain{};
  }

  // The message after the folder's name.
  std::string ReadBad(const std::string& name, std::string_view content, const DomainOptions& options = {}) {
    const absl::StatusOr<PlanarDomain> domain = Read(name, content, options);
    EXPECT_EQ(domain.status().code(), absl::StatusCode::kInvalidArgument) << content;
    return Without(std::string(domain.status().message()));
  }

  // `text` without the folder's name at its start.
  std::string Without(const std::string& text) const {
    const std::string path = folder_.Path("");
    return text.substr(0, path.size()) == path ? text.substr(path.size()) : text;
  }

  // A file of tests/data/domains.
  static std::string Data(const std::string& name) {
    const char* folder = std::getenv("WELLSPACE_DATA_DIR");
    return std::string(folder != nullptr ? folder : "tests/data") + "/domains/" + name;
  }

  TemporaryFolder folder_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_TESTS_CLIENT_FORMATS_DOMAIN_READ_DOMAIN_FIXTURE_H_
