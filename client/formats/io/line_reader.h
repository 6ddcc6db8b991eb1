// Text files, line by line, in bounded memory.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_LINE_READER_H_
#define WELLSPACE_CLIENT_FORMATS_IO_LINE_READER_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/io/input_file.h"

namespace wellspace::formats {

// No line of a file of numbers is longer; a longer one means that the file is something else.
inline constexpr size_t kMaxLineBytes = 1 << 20;

// Where the comment of a line starts: at a '#' that is the first of its line or follows a blank ("1.#QNAN" has none);
// npos without one.
size_t CommentStart(std::string_view line);

// Lines end in LF, CRLF or CR; a byte order mark at the start of the file is skipped.
//
// Thread safety: thread-compatible.
class LineReader {
 public:
  explicit LineReader(InputFile file);

  // The next line, valid until the next call. False at the end of the file and on an error, which status() tells apart.
  bool Next(std::string_view& line);
  // Like Next, but skips blank lines and comments, and cuts the comment off, and the blanks around the line. See
  // CommentStart.
  bool NextContent(std::string_view& line);
  // The line that NextContent returned last, with the blanks around it.
  std::string_view whole_line() const { return whole_line_; }
  // Whether the bytes that follow the line that was returned last start with `text`, which is no longer than a block.
  bool NextStartsWith(std::string_view text);
  // Takes up to `size` bytes that follow the line that was returned last, as they are, and returns how many there were:
  // fewer only at the end of the file and on an error.
  size_t Take(char* bytes, size_t size);
  // The last comment that the last NextContent skipped or cut off, without '#' and blanks around it; empty if there was
  // none.
  const std::string& comment() const { return comment_; }
  // From now on NextContent also hands every comment that it skips or cuts off to `use`.
  void OnComment(std::function<void(std::string_view)> use) { on_comment_ = std::move(use); }
  // Whether comment() stands behind the line that was returned last.
  bool is_comment_behind() const { return is_comment_behind_; }
  // Reads to the end of a compressed file, whose checksum comes last, and returns status().
  absl::Status Finish();

  const absl::Status& status() const { return status_; }
  const std::string& name() const { return file_.name(); }
  // In bytes; none when it is not known.
  std::optional<uint64_t> file_size() const { return file_.size(); }
  // Of the line that was returned last; the first is 1.
  uint64_t line_number() const { return line_number_; }
  // Bytes of the file before the line that Next or Take would return.
  uint64_t offset() const { return offset_ - (end_ - begin_); }
  // INVALID_ARGUMENT at the line that was returned last; of an empty file, at line 1.
  absl::Status Error(std::string_view message) const;
  // The error where Next, NextContent or Take have brought nothing, or too little: status(), or if that is ok
  // Error(message).
  absl::Status EndError(std::string_view message) const { return status_.ok() ? Error(message) : status_; }

 private:
  bool Fill();
  // Finds the end of the next line: its size, and the bytes that end it, 0 at the end of the file. False when there is
  // no line.
  bool FindEnd(size_t& size, size_t& terminator);

  InputFile file_;
  std::string buffer_;
  size_t begin_ = 0;  // of the bytes not yet returned
  size_t end_ = 0;
  uint64_t offset_ = 0;  // bytes of the file that were read
  bool at_end_ = false;
  bool has_returns_ = false;  // a CR is among the bytes not yet returned
  uint64_t line_number_ = 0;
  char usual_end_ = '\n';          // of lines, or '\r': which is looked for first
  bool has_lone_returns_ = false;  // the first line ends in CR, and what follows a CR is the next line even if it is LF
  std::string comment_;
  std::function<void(std::string_view)> on_comment_;
  bool is_comment_behind_ = false;
  std::string_view whole_line_;
  absl::Status status_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_LINE_READER_H_
