// Wavefront's OBJ: the vertices.
#include <algorithm>
#include <array>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/number.h"

namespace wellspace::formats {
namespace {

constexpr int kObjAxes = 3;

// Lines without their comments; those that end in a backslash with the next ones.
class ObjLines {
 public:
  explicit ObjLines(LineReader& reader) : reader_(reader) {}

  // The next line that is not blank, and where it starts. False at the end of the file and on an error, which status()
  // tells apart.
  bool Next(std::string_view& line, uint64_t& number) {
    while (NextPart(line)) {
      number = reader_.line_number();
      if (!is_continued_) {
        line = TrimBlanks(line);
      } else if (!Join(line)) {
        return false;
      }
      if (!line.empty()) {
        return true;
      }
    }
    status_ = reader_.status();
    return false;
  }

  const absl::Status& status() const { return status_; }

 private:
  bool NextPart(std::string_view& part) {
    if (!reader_.Next(part)) {
      return false;
    }
    part = TrimBlanks(part.substr(0, CommentStart(part)));
    is_continued_ = !part.empty() && part.back() == '\\';
    if (is_continued_) {
      part.remove_suffix(1);
    }
    return true;
  }

  bool Join(std::string_view& line) {
    joined_.assign(line);
    while (is_continued_) {
      is_continued_ = false;
      if (!NextPart(line)) {
        break;
      }
      if (joined_.size() + line.size() > kMaxLineBytes) {
        status_ = reader_.Error(absl::StrCat("the line and those that it continues are longer than ", kMaxLineBytes,
                                             " bytes; expected a shorter one"));
        return false;
      }
      joined_.append(" ").append(line);
    }
    status_ = reader_.status();
    line = TrimBlanks(joined_);
    return status_.ok();
  }

  LineReader& reader_;
  bool is_continued_ = false;  // the part that was returned last
  std::string joined_;
  absl::Status status_;
};

}  // namespace

absl::Status ReadObj(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  ObjLines lines(reader);
  std::string_view line;
  uint64_t number = 0;
  uint64_t faces = 0;
  const auto error = [&](std::string_view message) { return LineError(cloud.name, number, message); };
  while (lines.Next(line, number)) {
    FieldSplitter fields(line, ' ');
    std::string_view field;
    fields.Next(field);
    if (!absl::ascii_isalpha(static_cast<unsigned char>(field[0]))) {
      return error(absl::StrCat("expected a word such as \"v\" or \"f\", got ", Quote(field)));
    }
    if (field == "V" || field == "vertex") {
      return error(absl::StrCat("expected \"v\" for a vertex, got ", Quote(field)));
    }
    if (field != "v") {
      faces += field == "f" ? 1 : 0;
      continue;
    }
    std::array<double, kObjAxes> point{};
    bool is_invalid = false;
    int count = 0;
    while (count < kObjAxes && fields.Next(field)) {
      if (absl::Status status = TakeCoordinate(field, options.skip_invalid, point[count], is_invalid); !status.ok()) {
        return error(absl::StrCat("coordinate ", count + 1, ": ", status.message()));
      }
      ++count;
    }
    const int expected = cloud.dimension != 0 ? cloud.dimension : options.dimension;
    if (count < kMinDimension || (expected != 0 && count != expected)) {
      return error(expected != 0 ? DimensionError(expected, count)
                                 : absl::StrCat("expected 2 or 3 coordinates, got ", count));
    }
    cloud.dimension = count;
    AddPoint({point.data(), static_cast<size_t>(count)}, is_invalid, number, cloud);
  }
  NoteFaces(faces, cloud);
  return lines.status();
}

}  // namespace wellspace::formats
