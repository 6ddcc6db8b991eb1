#include "tests/server/security/certificates.h"

#include <stdio.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

constexpr char kNewKey[] = " -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";

CertificateFiles FilesOf(const TemporaryFolder& folder, const std::string& name) {
  return {.certificate = folder.Path(name + ".pem"), .key = folder.Path(name + ".key")};
}

void RunOpenssl(const std::string& arguments, const std::string& result) {
  const std::string output = RunShell(absl::StrCat("openssl ", arguments));
  EXPECT_TRUE(std::filesystem::exists(result)) << "openssl " << arguments << "\n" << output;
}

}  // namespace

std::string RunShell(const std::string& line) {
  FILE* pipe = popen(absl::StrCat("{ ", line, "; } 2>&1").c_str(), "r");
  std::string output;
  char buffer[4096];
  while (const size_t count = fread(buffer, 1, sizeof(buffer), pipe)) {
    output.append(buffer, count);
  }
  pclose(pipe);
  return output;
}

Authority::Authority(const TemporaryFolder& folder, const std::string& name)
    : folder_(folder), own_(FilesOf(folder, name)) {
  RunOpenssl(
      absl::StrCat("req -x509 -days 2 -subj '/CN=", name, "' -keyout ", own_.key, " -out ", own_.certificate, kNewKey),
      own_.certificate);
}

CertificateFiles Authority::Issue(const std::string& name, const std::string& common_name, int days) const {
  const CertificateFiles files = FilesOf(folder_, name);
  const std::string request = folder_.Path(name + ".csr");
  const std::string extensions = folder_.Write(name + ".ext", "subjectAltName=DNS:localhost,IP:127.0.0.1\n");
  RunOpenssl(absl::StrCat("req -subj '/CN=", common_name, "' -keyout ", files.key, " -out ", request, kNewKey),
             request);
  RunOpenssl(absl::StrCat("x509 -req -days ", days, " -in ", request, " -CA ", own_.certificate, " -CAkey ", own_.key,
                          " -CAcreateserial -extfile ", extensions, " -out ", files.certificate),
             files.certificate);
  return files;
}

void Replace(const std::string& from, const std::string& to) {
  const std::string beside = to + ".new";
  std::filesystem::copy_file(from, beside);
  std::filesystem::rename(beside, to);
}

}  // namespace wellspace::server
