// Wavefront's OBJ: vertices and the lines between them.
#include <array>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/obj_lines.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class ObjLineReader {
 public:
  explicit ObjLineReader(PlanarDomain& domain) : domain_(domain) {}

  absl::Status Read(LineReader& reader) {
    ObjLines lines(reader);
    FieldSplitter fields("", ' ');
    for (std::string_view word; lines.NextWord(word, fields, line_);) {
      absl::Status status;
      if (word == "v") {
        status = ReadVertex(fields);
      } else if (word == "l") {
        status = ReadLine(fields);
      } else {
        faces_ += word == "f" ? 1 : 0;
      }
      if (!status.ok()) {
        return status;
      }
    }
    if (!lines.status().ok()) {
      return lines.status();
    }
    if (faces_ > 0) {
      domain_.notes.push_back(absl::StrCat(domain_.name, ": ", faces_, faces_ == 1 ? " face is" : " faces are",
                                           " not used, only vertices and lines"));
    }
    domain_.markers.resize(domain_.segment_count());
    return reader.Finish();
  }

 private:
  absl::Status Error(std::string_view message) const { return LineError(domain_.name, line_, message); }
  absl::Status ReadVertex(FieldSplitter& fields);
  absl::Status ReadLine(FieldSplitter& fields);

  PlanarDomain& domain_;
  uint64_t line_ = 0;  // the one that is read
  uint64_t faces_ = 0;
  std::optional<double> z_;  // of all vertices
  uint64_t z_line_ = 0;      // where it was read
};

absl::Status ObjLineReader::ReadVertex(FieldSplitter& fields) {
  constexpr int kAxes = 3;
  std::array<double, kAxes> point{};
  std::string_view field;
  int count = 0;
  while (count < kAxes && fields.Next(field)) {
    if (absl::Status status = TakeFinite(field, point[count]); !status.ok()) {
      return Error(absl::StrCat("coordinate ", count + 1, ": ", status.message()));
    }
    ++count;
  }
  if (count < 2) {
    return Error(absl::StrCat("expected 2 or 3 coordinates, got ", count));
  }
  if (domain_.point_count() == kMaxCount) {
    return Error(absl::StrCat("expected at most ", kMaxCount, " vertices, got more"));
  }
  if (!z_) {
    z_ = point[2];
    z_line_ = line_;
  } else if (*z_ != point[2]) {
    std::string first;
    std::string here;
    AppendNumber(*z_, first);
    AppendNumber(point[2], here);
    return Error(absl::StrCat("expected z to be ", first, ", as in line ", z_line_,
                              ", since a domain in the plane has one z, got ", here));
  }
  domain_.points.insert(domain_.points.end(), {point[0], point[1]});
  domain_.point_lines.Add(line_);
  return absl::OkStatus();
}

absl::Status ObjLineReader::ReadLine(FieldSplitter& fields) {
  uint32_t last = 0;
  uint64_t count = 0;
  for (std::string_view field; fields.Next(field); ++count) {
    uint32_t vertex = 0;
    if (absl::Status status = TakeObjVertex(field, domain_.point_count(), "line", vertex); !status.ok()) {
      return Error(std::string(status.message()));
    }
    if (count > 0) {
      domain_.segments.insert(domain_.segments.end(), {last, vertex});
      domain_.segment_lines.Add(line_);
    }
    last = vertex;
  }
  return count < 2 ? Error(absl::StrCat("expected a line of at least 2 vertices, got ", count)) : absl::OkStatus();
}

}  // namespace

absl::Status ReadObjLines(InputFile& file, PlanarDomain& domain) {
  LineReader reader(std::move(file));
  return ObjLineReader(domain).Read(reader);
}

}  // namespace wellspace::formats
