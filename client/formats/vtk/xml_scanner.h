// The little of XML that the files of VTK use.
#ifndef WELLSPACE_CLIENT_FORMATS_VTK_XML_SCANNER_H_
#define WELLSPACE_CLIENT_FORMATS_VTK_XML_SCANNER_H_

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace wellspace::formats {

// The separators of attributes, and of numbers of a list.
inline constexpr std::string_view kXmlSpace = " \t\r\n";

// `text` as it stands in an element, or between quotes of an attribute.
std::string XmlText(const std::string& text);

// Reads a document piece by piece; comments, declarations and instructions are skipped, entities are left as they are.
//
// Thread safety: thread-compatible.
// Invariants: (1) every piece lies inside the document; (2) each call of Next consumes at least one byte or is the
// last.
class XmlScanner {
 public:
  enum class Piece { kStartTag, kEndTag, kText, kEnd, kError };

  // `name` is that of the file. REQUIRES: `document` outlives the scanner.
  XmlScanner(std::string_view document, std::string name) : document_(document), name_(std::move(name)) {}

  // An element without content gives kStartTag, then kEndTag.
  Piece Next();

  // Of a tag: its element. Of text: the text.
  std::string_view value() const { return value_; }
  // An attribute of the start tag that was returned last; empty when it has none of this name.
  std::string_view Attribute(std::string_view attribute) const;
  // The end of the piece that was returned last, in the document.
  size_t position() const { return position_; }
  // INVALID_ARGUMENT, at the line of the piece that was returned last.
  absl::Status Error(std::string_view message) const;
  // Why Next returned kError.
  const absl::Status& status() const { return status_; }

 private:
  Piece Fail(std::string_view message);
  Piece ReadTag();
  bool ReadAttributes(std::string_view text);

  std::string_view document_;
  std::string name_;
  size_t position_ = 0;
  size_t piece_begin_ = 0;
  bool pending_end_tag_ = false;
  std::string_view value_;
  std::vector<std::pair<std::string_view, std::string_view>> attributes_;
  absl::Status status_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_XML_SCANNER_H_
