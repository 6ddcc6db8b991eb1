// Lines of Wavefront's OBJ. Private to the readers of such files.
#ifndef WELLSPACE_CLIENT_FORMATS_OBJ_LINES_H_
#define WELLSPACE_CLIENT_FORMATS_OBJ_LINES_H_

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {

// Lines without their comments; a line that ends in a backslash comes with the next one.
//
// Thread safety: thread-compatible.
class ObjLines {
 public:
  // REQUIRES:   `reader` outlives this.
  explicit ObjLines(LineReader& reader) : reader_(reader) {}

  // The next line that is not blank, valid until the next call, and where it starts. False at the end of the file and
  // on an error, which status() tells apart.
  bool Next(std::string_view& line, uint64_t& number);
  // As Next, but the first field of the line, a word such as "v" or "f", comes apart, and `fields` gives the others.
  bool NextWord(std::string_view& word, FieldSplitter& fields, uint64_t& number);

  const absl::Status& status() const { return status_; }

 private:
  bool NextPart(std::string_view& part);
  bool Join(std::string_view& line);

  LineReader& reader_;
  bool is_continued_ = false;  // the part that was returned last
  std::string joined_;
  absl::Status status_;
};

// Reads the vertex that a line or a face has, of the `count` above: "7", "-1" from the last one back, or "7/3/2" with
// those of textures and normals, which are not looked at. `what` has the vertex, for messages: "line".
//
// Errors:     INVALID_ARGUMENT, a message without a location.
absl::Status TakeObjVertex(std::string_view field, uint64_t count, std::string_view what, uint32_t& vertex);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_OBJ_LINES_H_
