// VTK's legacy format, ascii and binary, versions 1.0 to 5.1: a stream of words, with arrays between them. Private to
// this folder. https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html
#ifndef WELLSPACE_CLIENT_FORMATS_VTK_VTK_LEGACY_H_
#define WELLSPACE_CLIENT_FORMATS_VTK_VTK_LEGACY_H_

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/vtk/grid_points.h"

namespace wellspace::formats {

// Arrays with more components are not looked at.
inline constexpr uint64_t kVtkMaxComponents = 64;

// A type of numbers: how many bytes it has in binary (0: a bit), and the number that they are.
struct VtkType {
  std::string_view name;
  size_t bytes;
  double (*value)(std::string_view bytes);
};

// Goes through the sections of a file, and reads those of its arrays that a derived class asks for.
//
// Thread safety: thread-compatible.
class VtkLegacyReader {
 public:
  virtual ~VtkLegacyReader() = default;
  VtkLegacyReader(const VtkLegacyReader&) = delete;
  VtkLegacyReader& operator=(const VtkLegacyReader&) = delete;

 protected:
  // The numbers of an array, a column for each component.
  using Columns = std::vector<std::vector<double>>;

  // An array of the file: about its points, its cells, or neither.
  struct Data {
    enum class Of { kFile, kPoints, kCells };
    Of of = Of::kFile;
    std::string name;
    uint64_t components = 1;
    uint64_t rows = 0;
    bool is_whole = true;  // its type
  };

  // REQUIRES:   `reader` outlives this.
  explicit VtkLegacyReader(LineReader& reader) : reader_(reader) {}

  // Where coordinates go, of which there are three columns.
  virtual Columns& Coordinates() = 0;
  // Where the numbers of an array go; null: they are skipped.
  virtual Columns* Place(const Data& data) = 0;
  // The section `keyword` has so many cells. True: their numbers are wanted, and UseCells gets them.
  virtual bool WantsCells(std::string_view keyword, uint64_t cells) = 0;
  // `offsets` are where the vertices of each cell begin in `numbers`, and where those of the last end; without, every
  // cell is a number of vertices, then these. Of CELL_TYPES, `numbers` are the types.
  virtual absl::Status UseCells(std::string_view keyword, uint64_t cells, const std::vector<double>& offsets,
                                const std::vector<double>& numbers) = 0;
  // Whether the rest need not be looked at.
  virtual bool IsDone() const { return false; }

  // All sections. Errors: of the reader; INVALID_ARGUMENT at a line or a byte, also if there are no points.
  absl::Status ReadSections();

  uint64_t point_count() const { return point_count_; }
  bool has_points() const { return has_points_; }
  // "POLYDATA" and the like.
  const std::string& dataset() const { return dataset_; }
  LineReader& reader() const { return reader_; }

 private:
  absl::Status ReadHeader();
  absl::Status ReadSection();
  absl::Status ReadDataset();
  absl::Status ReadPoints();
  absl::Status ReadGridPart();
  absl::Status MakeGridPoints();
  absl::Status ReadCells();
  absl::Status ReadData();
  absl::Status ReadScalars(Data data);
  absl::Status ReadField();
  absl::Status SkipMetadata();
  absl::Status SkipTexts(uint64_t count);

  // The next word, in whatever line; valid until the next call. False at the end of the file.
  bool NextWord(std::string_view& word);
  bool NextKeyword();
  // Whether the next word is `keyword`, in any case; then it is taken.
  bool TakeWordIf(std::string_view keyword);
  // A word as it is; empty if there is none.
  std::string TakeName();
  absl::Status TakeCount(uint64_t limit, uint64_t& count);
  absl::Status TakeType(const VtkType*& type);

  absl::Status ReadNamed(const Data& data, const VtkType& type);
  // Reads numbers into columns that are there, or nowhere.
  absl::Status ReadArray(uint64_t components, uint64_t rows, const VtkType& type, Columns* columns);
  absl::Status ReadBits(uint64_t count, Columns* columns);
  absl::Status NextNumber(double& value);
  absl::Status EndError(uint64_t count, uint64_t taken) const;

  LineReader& reader_;
  FieldSplitter line_{"", ' '};  // the rest of the line
  std::string pending_;          // a word that was looked at, and not taken
  bool has_pending_ = false;
  bool is_ascii_ = true;
  std::string keyword_;  // of the section, in upper case; of a name as messages have it
  std::string word_;     // the same as the file has it
  std::string dataset_;
  // Of a grid whose points are told by its axes: what of it has come.
  struct Grid {
    VtkExtent extent;
    VtkImage image;
    std::array<std::vector<double>, 3> axes;
    unsigned axes_read = 0;  // a bit for each
    bool has_dimensions = false;
    bool has_origin = false;
    bool has_spacing = false;
  };
  Grid grid_;
  bool has_points_ = false;
  bool ends_early_ = false;  // the rest cannot be read
  Data::Of of_ = Data::Of::kFile;
  uint64_t point_count_ = 0;
  uint64_t data_count_ = 0;
  uint64_t components_ = 0;  // of the array that was read last
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_VTK_LEGACY_H_
