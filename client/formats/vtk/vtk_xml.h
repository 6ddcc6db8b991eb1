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
#include "client/formats/vtk/grid_points.h"
#include "client/formats/vtk/vtk_array.h"
#include "client/formats/vtk/xml_scanner.h"

namespace wellspace::formats {

// Goes through the elements of a file, and reads those of its arrays that a derived class asks for. They are in ascii,
// inline in base64, or appended to the elements, as bytes or in base64.
//
// Thread safety: thread-compatible.
class VtkXmlReader {
 public:
  virtual ~VtkXmlReader() = default;
  VtkXmlReader(const VtkXmlReader&) = delete;
  VtkXmlReader& operator=(const VtkXmlReader&) = delete;

 protected:
  // `kind` is the type of the file, as "UnstructuredGrid". REQUIRES: `document` outlives this.
  VtkXmlReader(std::string_view document, std::string name, std::string kind);

  // The element <DataArray> whose start tag was read last; `parent` is the element around it. It may read the array by
  // ReadArray or ReadAnyNumbers.
  virtual absl::Status ReadDataArray(const std::string& parent) = 0;
  // The element of the kind, around all pieces, has begun.
  virtual absl::Status StartDataset() { return absl::OkStatus(); }
  // All arrays of a piece have come, or been left out.
  virtual absl::Status EndPiece() { return absl::OkStatus(); }

  // All elements. Errors: INVALID_ARGUMENT, also if there is no piece.
  absl::Status ReadElements();

  const XmlScanner& xml() const { return xml_; }
  const std::string& name() const { return name_; }
  // Of the pieces so far, with the one that is being read; and the points of those before that. Of polygonal data,
  // cells that are vertices do not count.
  uint64_t point_count() const { return point_count_; }
  uint64_t cell_count() const { return cell_count_; }
  uint64_t first_point() const { return first_point_; }
  // The rows that data of cells of that piece have, cells that are vertices included.
  uint64_t first_cell() const { return first_cell_; }
  uint64_t end_cell() const { return end_cell_; }
  // Of the piece of a grid that is being read.
  const VtkExtent& extent() const { return extent_; }

  absl::Status FileError(std::string_view message) const {
    return absl::InvalidArgumentError(absl::StrCat(name_, ": ", absl::string_view(message.data(), message.size())));
  }

  // Coordinates of points, appended.
  absl::Status ReadPoints(std::vector<double>& coordinates);

  // Appends the array of the current element to `values`, which are finite numbers of a floating-point type, or whole
  // numbers.
  template <typename Value>
  absl::Status ReadArray(std::vector<Value>& values);

  // The same for numbers of any type; those that are not finite stay as they are, or become NaN. Of Bit, up to seven
  // more may come.
  absl::Status ReadAnyNumbers(std::vector<double>& values);

  // Data of points or of cells.
  struct DataArray {
    std::string name;
    uint64_t components = 1;
    std::vector<double> values{};  // as many of each row, for the rows of all pieces so far
  };
  // Appends the array of the current element, data of the rows `first` to `end` of all pieces, to that of its name that
  // the pieces before have begun, or begins one.
  absl::Status ReadData(uint64_t first, uint64_t end, std::vector<DataArray>& arrays);
  // Appends the components of each of `arrays`, as DataNames names them.
  //
  // Errors:     INVALID_ARGUMENT for an array of another number of values than `rows` have; `what` is their kind.
  absl::Status AddColumns(const std::vector<DataArray>& arrays, uint64_t rows, const char* what,
                          std::vector<std::string>& names, std::vector<std::vector<double>>& columns) const;

 private:
  absl::Status EndElement();
  absl::Status StartElement();
  absl::Status StartFile();
  absl::Status StartPiece();
  void AddPiece(uint64_t points, uint64_t cells, uint64_t vertex_cells);
  absl::Status TakeExtent(uint64_t& points, uint64_t& cells);

  // The text of the current element, an array; none if it has none.
  absl::Status TakeText(std::string_view& text);
  // The bytes of the current element, an array that is not in ascii.
  absl::Status TakeBytes(std::string& bytes);
  void FindAppended(std::string_view document);
  template <typename Value>
  absl::Status ParseAscii(std::string_view text, std::vector<Value>& values);
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
  bool is_at_appended_ = false;  // the end of the part that is read as elements
  bool has_appended_ = false;
  bool is_appended_base64_ = false;
  std::string_view appended_;  // behind its '_'
  uint64_t pieces_ = 0;
  uint64_t first_point_ = 0;
  uint64_t first_cell_ = 0;
  uint64_t end_cell_ = 0;
  uint64_t point_count_ = 0;
  uint64_t cell_count_ = 0;
  VtkExtent extent_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_VTK_XML_H_
