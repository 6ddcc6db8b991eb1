// Standard output, every write of which is checked.
#ifndef WELLSPACE_CLIENT_CLI_STANDARD_OUTPUT_H_
#define WELLSPACE_CLIENT_CLI_STANDARD_OUTPUT_H_

#include <streambuf>

#include "absl/status/status.h"
#include "client/formats/io/output_file.h"

namespace wellspace::cli {

// Occupies the numbers of standard input, output and error where the caller has closed them, so that no file gets them:
// printed text would go into it. Reading such an input and writing such an output still fail. To be called before
// anything is opened, also before the constructors of libraries: it uses nothing that wants to be initialised.
void HoldStandardDescriptors();

// While it lives, std::cout writes through it, and the first error is kept. std::cout is bad from then on, so that work
// whose results are lost may end.
//
// Thread safety: thread-compatible. REQUIRES: one at a time.
class StandardOutput final : public std::streambuf {
 public:
  StandardOutput();
  ~StandardOutput() override;
  StandardOutput(const StandardOutput&) = delete;
  StandardOutput& operator=(const StandardOutput&) = delete;

  // Writes the buffer. Returns the first error of all writes so far, RESOURCE_EXHAUSTED.
  absl::Status Flush() { return file_.Flush(); }

 private:
  int_type overflow(int_type character) override;
  std::streamsize xsputn(const char* text, std::streamsize size) override;
  int sync() override { return Flush().ok() ? 0 : -1; }

  formats::OutputFile file_;
  std::streambuf* const previous_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_STANDARD_OUTPUT_H_
