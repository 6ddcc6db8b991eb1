#include "client/cli/standard_output.h"

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <iostream>
#include <string>
#include <string_view>

#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"

namespace wellspace::cli {

__attribute__((no_sanitize("address", "thread", "undefined"))) void HoldStandardDescriptors() {
  // In this order: open(2) takes the lowest number. Each is opened for the use that it never has, so that this fails.
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor) {
    // Not by the functions of these names: a sanitizer puts its own in their place, which are not ready yet.
    if (syscall(SYS_fcntl, descriptor, F_GETFD) < 0 && errno == EBADF &&
        syscall(SYS_openat, AT_FDCWD, "/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) {
      return;  // a machine without /dev/null
    }
  }
}

StandardOutput::StandardOutput()
    : file_(*formats::OutputFile::Create(std::string(formats::kStandardStream))), previous_(std::cout.rdbuf(this)) {}

StandardOutput::~StandardOutput() {
  Flush().IgnoreError();
  std::cout.rdbuf(previous_);
}

StandardOutput::int_type StandardOutput::overflow(int_type character) {
  if (!traits_type::eq_int_type(character, traits_type::eof())) {
    const char one = traits_type::to_char_type(character);
    file_.Write({&one, 1});
  }
  return file_.status().ok() ? traits_type::not_eof(character) : traits_type::eof();
}

std::streamsize StandardOutput::xsputn(const char* text, std::streamsize size) {
  file_.Write({text, static_cast<size_t>(size)});
  return file_.status().ok() ? size : 0;
}

}  // namespace wellspace::cli
