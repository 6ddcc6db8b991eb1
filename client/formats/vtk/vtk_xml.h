// VTK's XML files: elements, and arrays of numbers. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_VTK_VTK_XML_H_
#define WELLSPACE_CLIENT_FORMATS_VTK_VTK_XML_H_

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client/formats/vtk/vtk_array.h"
#include "client/formats/vtk/xml_scanner.h"

namespace wellspace::formats {

// Goes through the elements of a file of one piece, and reads those of its arrays that a derived class asks for.
//
// Thread safety: thread-compatible.
class VtkXmlReader {
 public:
  virtual ~VtkXmlReader() = default;
  VtkXmlReader(const VtkXmlReader&) = delete;
  VtkXmlReader& operator=(const VtkXmlReader&) = delete;

 protected:
  // `kind` is the type of the file, as "UnstructuredGrid". REQUIRES: `document` outlives this.
  VtkXmlReader(std::string_view document, std::string name, std::string kind)
      : xml_(document, name), name_(std::move(name)), kind_(std::move(kind)) {}

  // The element <DataArray> of the piece whose start tag was read last; `parent` is the element around it. It may read
  // the array by ReadArray or ReadAnyNumbers.
  virtual absl::Status ReadDataArray(const std::string& parent) = 0;

  // All elements. Errors: INVALID_ARGUMENT, also unless there is one piece.
  absl::Status ReadElements();

  const XmlScanner& xml() const { return xml_; }
  const std::string& name() const { return name_; }
  // Of the piece.
  uint64_t point_count() const { return point_count_; }
  uint64_t cell_count() const { return cell_count_; }

  absl::Status FileError(std::string_view message) const {
    return absl::InvalidArgumentError(absl::StrCat(name_, ": ", absl::string_view(message.data(), message.size())));
  }

  // Coordinates of points.
  absl::Status ReadPoints(std::vector<double>& coordinates);

  // Reads the text of the current element into `values`, which are finite numbers of a floating-point type, or whole
  // numbers.
  template <typename Value>
  absl::Status ReadArray(std::vector<Value>& values);

  // The same for numbers of any type; those that are not finite stay as they are, or become NaN.
  absl::Status ReadAnyNumbers(std::vector<double>& values);

 private:
  absl::Status EndElement();
  absl::Status StartElement();
  absl::Status StartFile();
  absl::Status StartPiece();

  // The text of the current element, an array; none if it has none.
  absl::Status TakeText(std::string_view& text);
  template <typename Value>
  absl::Status ParseAscii(std::string_view text, std::vector<Value>& values);
  absl::Status Decode(std::string_view text, std::string& bytes);
  template <typename Value>
  bool ConvertWhole(const std::string& bytes, const std::string& type, std::vector<Value>& values,
                    absl::Status& status);
  template <typename Word, typename Value>
  absl::Status ConvertWords(const std::string& bytes, std::vector<Value>& values);

  XmlScanner xml_;
  const std::string name_;
  const std::string kind_;
  std::vector<std::string> path_;  // the open elements, outermost first
  VtkEncoding encoding_;
  uint64_t pieces_ = 0;
  uint64_t point_count_ = 0;
  uint64_t cell_count_ = 0;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_VTK_XML_H_
