// Text files, line by line, in bounded memory.
#ifndef WELLSPACE_CLIENT_FORMATS_LINE_READER_H_
#define WELLSPACE_CLIENT_FORMATS_LINE_READER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/gzip_inflater.h"

namespace wellspace::formats {

// The name that stands for standard input or standard output.
inline constexpr std::string_view kStandardStream = "-";

// No line of a file of numbers is longer; a longer one means that the file is something else.
inline constexpr size_t kMaxLineBytes = 1 << 20;

// Where the comment of a line starts: at a '#' that is the first of its line or follows a blank ("1.#QNAN" has none);
// npos without one.
size_t CommentStart(std::string_view line);

// A file open for reading.
//
// Thread safety: thread-compatible.
class InputFile {
 public:
  // `path` "-" is standard input. Errors: NOT_FOUND, PERMISSION_DENIED…, naming the file; INVALID_ARGUMENT for a
  // folder.
  static absl::StatusOr<InputFile> Open(const std::string& path);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&&) = delete;
  ~InputFile();

  // From here on Read gives the bytes that are compressed, if the file starts as one of gzip does; otherwise those of
  // the file.
  //
  // REQUIRES:   nothing has been read; once only.
  // Errors:     of reading; INVALID_ARGUMENT when the file `is_expected` to be compressed and is not.
  absl::Status InflateGzip(bool is_expected);
  bool is_compressed() const { return inflater_ != nullptr; }

  // "cloud.csv" or "<stdin>", for messages.
  const std::string& name() const { return name_; }
  // Up to `size` bytes; 0 at the end of the file. Errors: of reading; INVALID_ARGUMENT for compressed data that are
  // damaged.
  absl::StatusOr<size_t> Read(char* buffer, size_t size);
  // The next `size` bytes, or all that are left if there are fewer; Read gives them again. Valid until the next call.
  absl::StatusOr<std::string_view> Peek(size_t size);
  // All that is left.
  absl::StatusOr<std::string> ReadAll();
  // How many bytes Read gives from the start; none when it is not known (of a pipe, a device, a compressed file).
  std::optional<uint64_t> size() const;
  // Up to `size` bytes from `offset` on, wherever Read is; 0 at the end of the file. REQUIRES: the file is regular.
  absl::StatusOr<size_t> ReadAt(uint64_t offset, char* buffer, size_t size) const;

 private:
  InputFile(int descriptor, std::string name) : descriptor_(descriptor), name_(std::move(name)) {}
  absl::StatusOr<size_t> ReadDescriptor(char* buffer, size_t size);
  absl::StatusOr<size_t> ReadBehindPeeked(char* buffer, size_t size);

  int descriptor_;
  std::string name_;
  std::string start_;  // bytes that InflateGzip has read, and Read has not given yet
  std::unique_ptr<GzipInflater> inflater_;
  std::string peeked_;  // bytes that Peek has read, and Read has not given yet
};

// Lines end in LF, CRLF or CR; a byte order mark at the start of the file is skipped.
//
// Thread safety: thread-compatible.
class LineReader {
 public:
  explicit LineReader(InputFile file);

  // The next line, valid until the next call. False at the end of the file and on an error, which status() tells apart.
  bool Next(std::string_view& line);
  // Like Next, but skips what is blank or a comment, and cuts the comment off, and the blanks around the line. See
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
  // Whether comment() stands behind the line that was returned last.
  bool is_comment_behind() const { return is_comment_behind_; }
  // Reads to the end of a compressed file, whose checksum comes last, and returns status().
  absl::Status Finish();

  const absl::Status& status() const { return status_; }
  const std::string& name() const { return file_.name(); }
  // Of the line that was returned last; the first is 1.
  uint64_t line_number() const { return line_number_; }
  // Bytes of the file before what Next or Take would return.
  uint64_t offset() const { return offset_ - (end_ - begin_); }
  // INVALID_ARGUMENT at the line that was returned last; of an empty file, at line 1.
  absl::Status Error(std::string_view message) const;
  // What it means that Next, NextContent or Take have brought nothing, or too little: status(), or if that is ok
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
  bool is_comment_behind_ = false;
  std::string_view whole_line_;
  absl::Status status_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_LINE_READER_H_
