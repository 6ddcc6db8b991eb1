// The characters of a file of JSON for a parser that wants iterators, and which line they are on. Private to this
// folder.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_JSON_SOURCE_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_JSON_SOURCE_H_

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>

#include "absl/status/status.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"

namespace wellspace::formats {

// Thread safety: thread-compatible.
class JsonSource {
 public:
  // An input iterator; all of them stand where the source does. That without a source is the end.
  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = char;
    using difference_type = std::ptrdiff_t;
    using pointer = const char*;
    using reference = char;

    Iterator() = default;
    explicit Iterator(JsonSource* source) : source_(source) {}
    char operator*() const { return *source_->at_; }
    Iterator& operator++() {
      source_->Advance();
      return *this;
    }
    Iterator operator++(int) { return ++*this; }
    // Whether characters are left. REQUIRES: `end` is the end.
    bool operator!=([[maybe_unused]] const Iterator& end) const { return !(*this == end); }
    bool operator==([[maybe_unused]] const Iterator& end) const { return source_->IsAtEnd(); }

   private:
    JsonSource* source_ = nullptr;
  };

  // REQUIRES:   `file` outlives this.
  explicit JsonSource(InputFile& file) : file_(file) {}

  Iterator begin() { return Iterator(this); }
  Iterator end() { return Iterator(); }
  // Whether the file has ended, or could not be read further, which status() tells apart.
  bool IsAtEnd() { return at_ == end_ && !Fill(); }
  // Of the character that was passed last, from 1.
  uint64_t line() const { return line_; }
  const absl::Status& status() const { return status_; }

 private:
  void Advance() {
    const char passed = *at_++;
    // The line of a line's end is that which it ends: parsers look at one character after a number.
    if (last_ == '\n' || (last_ == '\r' && passed != '\n')) {
      ++line_;
    }
    last_ = passed;
  }
  bool Fill();

  static constexpr size_t kBytes = 1 << 18;

  InputFile& file_;
  const std::unique_ptr<char[]> buffer_ = std::make_unique<char[]>(kBytes);
  const char* at_ = buffer_.get();
  const char* end_ = buffer_.get();
  char last_ = '\0';  // that was passed
  uint64_t line_ = 1;
  absl::Status status_;
};

inline bool JsonSource::Fill() {
  if (!status_.ok()) {
    return false;
  }
  const absl::StatusOr<size_t> got = file_.Read(buffer_.get(), kBytes);
  if (!got.ok()) {
    status_ = got.status();
    return false;
  }
  at_ = buffer_.get();
  end_ = at_ + *got;
  return *got > 0;
}

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_JSON_SOURCE_H_
