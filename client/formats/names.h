// Names of parts of the boundary and of regions, in formats that have a line of text for them. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_NAMES_H_
#define WELLSPACE_CLIENT_FORMATS_NAMES_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/boundary.h"
#include "client/formats/mesh.h"
#include "client/formats/regions.h"

namespace wellspace::formats {

// `name` with "%20" and the like in the place of the bytes that `is_plain` is false for, and of '%'.
std::string PercentEncoded(std::string_view name, bool (*is_plain)(char));
// "My%20name" as it was before.
std::string PercentDecoded(std::string_view name);

// Tells of names that could not be kept.
//
// Thread safety: thread-compatible.
class NameChanges {
 public:
  // Notes that `written` stands in the place of `name`; not if they are the same.
  void Add(std::string_view name, std::string_view written);
  // "REASON: 2 names are others, such as "a" for "b""; empty if there are none.
  std::string Note(std::string_view reason) const;

 private:
  uint64_t count_ = 0;
  std::string example_;
};

// The first `limit` bytes of `name` at most, without half a character of UTF-8.
std::string_view CutName(std::string_view name, size_t limit);

// `text` from UTF-8, and to it; a byte of no character becomes a question mark.
std::u32string ToUtf32(std::string_view text);
std::string ToUtf8(std::u32string_view text);

// Lines "part 7: deep sea" and "region 2: land", one for each name of a mesh: comments, or text of a file of VTK.
// Points in the plane without simplices have the line "dimension 2", since a third coordinate is added to them.
//
// No line has more than kMaxNameLineBytes: MMG and Triangle take the text behind 255 or 1023 bytes of a comment for
// data.
class NameLines {
 public:
  enum class Of { kParts, kRegions, kBoth };
  explicit NameLines(const MeshShape& shape, Of of = Of::kBoth);

  const std::vector<std::string>& lines() const { return lines_; }
  // All of them, each between `before` and an end of line.
  std::string Text(std::string_view before) const;
  // A note on names that were cut; empty if none was.
  std::string ChangesNote() const;

 private:
  void Add(std::string_view kind, int32_t number, std::string_view name);

  std::vector<std::string> lines_;
  NameChanges changes_;
};

inline constexpr size_t kMaxNameLineBytes = 240;

inline constexpr std::string_view kFlatLine = "dimension 2";

// Takes the name that `line` has, if it is one of NameLines; either may be null.
void TakeNameLine(std::string_view line, FacetSorter* parts, RegionCollector* regions);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_NAMES_H_
