// Certificates for a test, made by the program openssl.
#ifndef WELLSPACE_TESTS_SERVER_SECURITY_CERTIFICATES_H_
#define WELLSPACE_TESTS_SERVER_SECURITY_CERTIFICATES_H_

#include <string>

#include "tests/support/temporary_folder.h"

namespace wellspace::server {

// Runs a line of the shell, and returns its output, of both kinds.
std::string RunShell(const std::string& line);

// Paths of PEM files.
struct CertificateFiles {
  std::string certificate;
  std::string key;
};

// One that signs certificates. Its files and theirs are in a folder of the test.
class Authority {
 public:
  // REQUIRES:   `folder` outlives this; no other authority or certificate there has `name`.
  Authority(const TemporaryFolder& folder, const std::string& name);

  const std::string& certificate() const { return own_.certificate; }

  // For `common_name`, on the hosts localhost and 127.0.0.1, valid for `days` (-1: until yesterday).
  CertificateFiles Issue(const std::string& name, const std::string& common_name = "localhost", int days = 2) const;

 private:
  const TemporaryFolder& folder_;
  const CertificateFiles own_;
};

// Puts the content of `from` in the place of `to`, at once.
void Replace(const std::string& from, const std::string& to);

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_SECURITY_CERTIFICATES_H_
