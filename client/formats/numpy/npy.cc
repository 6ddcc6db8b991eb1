#include "client/formats/numpy/npy.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"
#include "client/formats/names.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

static_assert(std::endian::native == std::endian::little, "values are taken and written as they are in memory");

constexpr std::string_view kMagic = "\x93NUMPY";

// That of an array of plain numbers has about a hundred bytes.
constexpr size_t kMaxHeaderBytes = 1 << 16;

// Values are read and converted this many bytes at a time.
constexpr size_t kWordsPieceBytes = 1 << 18;

// Reads the literals of a header.
class HeaderScanner {
 public:
  explicit HeaderScanner(std::string_view text) : rest_(text) {}

  // Skips `token` and the space before it, if it comes next.
  bool Skip(std::string_view token) {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
    if (rest_.substr(0, token.size()) != token) {
      return false;
    }
    rest_.remove_prefix(token.size());
    return true;
  }

  // A string in quotes of either kind, without escapes.
  bool TakeString(std::string& value) {
    const char quote = Skip("'") ? '\'' : Skip("\"") ? '"' : '\0';
    const size_t end = rest_.find_first_of("'\"\\\n");
    if (quote == '\0' || end == std::string_view::npos || rest_[end] != quote) {
      return false;
    }
    value = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return true;
  }

  bool TakeBool(bool& value) {
    value = Skip("True");
    return value || Skip("False");
  }

  // Whole numbers in parentheses, a comma after each; the last may go without it unless it is the only one.
  bool TakeTuple(std::vector<uint64_t>& values) {
    constexpr size_t kMaxValues = 64;
    values.clear();
    bool comma = true;
    if (!Skip("(")) {
      return false;
    }
    while (!Skip(")")) {
      const std::string_view digits = rest_.substr(0, rest_.find_first_not_of("0123456789"));
      uint64_t value = 0;
      if (!comma || values.size() == kMaxValues ||
          !ParseUnsigned(digits, std::numeric_limits<uint64_t>::max(), value)) {
        return false;
      }
      rest_.remove_prefix(digits.size());
      values.push_back(value);
      comma = Skip(",");
    }
    return values.size() != 1 || comma;
  }

  bool AtEnd() { return Skip("") && rest_.empty(); }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

}  // namespace

absl::StatusOr<NpyHeader> ParseNpyHeader(std::string_view text) {
  HeaderScanner scanner(text);
  NpyHeader header;
  bool has_type = false;
  bool has_order = false;
  bool has_shape = false;
  const auto take_entry = [&] {
    std::string key;
    if (!scanner.TakeString(key) || !scanner.Skip(":")) {
      return false;
    }
    if (key == "descr") {
      return !std::exchange(has_type, true) && scanner.TakeString(header.type);
    }
    if (key == "fortran_order") {
      return !std::exchange(has_order, true) && scanner.TakeBool(header.fortran_order);
    }
    return key == "shape" && !std::exchange(has_shape, true) && scanner.TakeTuple(header.shape);
  };
  bool good = scanner.Skip("{");
  for (bool comma = true; good && !scanner.Skip("}"); comma = scanner.Skip(",")) {
    good = comma && take_entry();
  }
  if (!good || !has_type || !has_order || !has_shape || !scanner.AtEnd()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "expected the header {'descr': '<type>', 'fortran_order': <bool>, 'shape': <tuple>} of an array of plain "
        "numbers, got ",
        Quote(text), ", wrong at ", scanner.rest().empty() ? "its end" : Quote(scanner.rest())));
  }
  return header;
}

std::string NpyPreamble(const std::string& type, uint64_t rows, std::optional<uint64_t> columns) {
  constexpr size_t kAlignment = 64;
  // Python writes a tuple of one as (7,).
  std::string header = absl::StrCat("{'descr': '", type, "', 'fortran_order': False, 'shape': (", rows, ",",
                                    columns.has_value() ? absl::StrCat(" ", *columns) : "", "), }");
  std::string text(kMagic);
  text.append("\x01\x00", 2);
  const size_t bare = text.size() + sizeof(uint16_t) + header.size() + 1;
  header.append((kAlignment - bare % kAlignment) % kAlignment, ' ');
  header += '\n';
  const auto length = static_cast<uint16_t>(header.size());
  text.append(reinterpret_cast<const char*>(&length), sizeof(length));
  return text + header;
}

absl::StatusOr<NpyReader> NpyReader::Open(std::string name, ByteSource source, std::optional<uint64_t> size,
                                          size_t dimensions) {
  NpyReader reader(std::move(name), std::move(source), size);
  WELLSPACE_RETURN_IF_ERROR(reader.ReadHeader(dimensions));
  return reader;
}

absl::Status NpyReader::Error(std::string_view message) const {
  return absl::InvalidArgumentError(absl::StrCat(name_, ": ", absl::string_view(message.data(), message.size())));
}

absl::Status NpyReader::Take(char* buffer, size_t size) {
  for (size_t taken = 0; taken < size;) {
    WELLSPACE_ASSIGN_OR_RETURN(const size_t got, source_(buffer + taken, size - taken));
    if (got == 0) {
      return Error(absl::StrCat("the array ends after ", taken_, " bytes, inside its ",
                                header_.shape.empty() ? "header" : "values"));
    }
    taken += got;
    taken_ += got;
  }
  return absl::OkStatus();
}

absl::Status NpyReader::ExpectEnd() {
  char byte;
  WELLSPACE_ASSIGN_OR_RETURN(const size_t got, source_(&byte, 1));
  return got == 0 ? absl::OkStatus()
                  : Error(absl::StrCat("expected the end after ", taken_, " bytes, as the header says, got more"));
}

absl::Status NpyReader::ReadHeader(size_t dimensions) {
  std::string magic(kMagic.size() + 2, '\0');
  WELLSPACE_RETURN_IF_ERROR(Take(magic.data(), magic.size()));
  if (std::string_view(magic).substr(0, kMagic.size()) != kMagic) {
    return Error(absl::StrCat("expected an array of numpy, which starts with ", Quote(kMagic), ", got ",
                              Quote(std::string_view(magic).substr(0, kMagic.size()))));
  }
  const int major = static_cast<uint8_t>(magic[kMagic.size()]);
  const int minor = static_cast<uint8_t>(magic[kMagic.size() + 1]);
  if (major < 1 || major > 3 || minor != 0) {
    return Error(absl::StrCat("expected version 1.0, 2.0 or 3.0 of the format, got ", major, ".", minor));
  }
  uint32_t length = 0;
  WELLSPACE_RETURN_IF_ERROR(Take(reinterpret_cast<char*>(&length), major == 1 ? 2 : 4));
  if (length > kMaxHeaderBytes) {
    return Error(absl::StrCat("expected a header of at most ", kMaxHeaderBytes, " bytes, got ", length));
  }
  std::string text(length, '\0');
  WELLSPACE_RETURN_IF_ERROR(Take(text.data(), text.size()));
  absl::StatusOr<NpyHeader> header = ParseNpyHeader(text);
  if (!header.ok()) {
    return Error(std::string(header.status().message()));
  }
  header_ = *std::move(header);
  if (header_.shape.size() != dimensions) {
    return Error(absl::StrCat("expected an array of ",
                              dimensions == 1 ? "1 dimension" : "2 dimensions, rows and columns", ", got one of ",
                              header_.shape.size()));
  }
  // So that no product of these overflows.
  constexpr uint64_t kMaxRows = uint64_t{1} << 48;
  constexpr uint64_t kMaxColumns = 1 << 8;
  if (rows() > kMaxRows || columns() > kMaxColumns) {
    return Error(absl::StrCat("expected at most ", kMaxRows, " rows and ", kMaxColumns, " columns, got ", rows(),
                              " and ", columns()));
  }
  return absl::OkStatus();
}

std::string NpyReader::PlaceOf(uint64_t index) const {
  const uint64_t row = header_.fortran_order ? index % rows() : index / columns();
  const uint64_t column = header_.fortran_order ? index / rows() : index % columns();
  return absl::StrCat("[", row, ", ", column, "]");
}

template <typename Word, typename Value, typename Convert>
absl::Status NpyReader::ReadWords(std::vector<Value>& values, Convert convert) {
  const uint64_t count = rows() * columns();
  if (size_.has_value()) {
    if (const uint64_t left = *size_ - std::min(*size_, taken_); count * sizeof(Word) != left) {
      return Error(absl::StrCat("expected ", count * sizeof(Word), " bytes of values for ", rows(), " rows and ",
                                columns(), " columns of type ", Quote(header_.type), ", got ", left));
    }
    values.reserve(count);
  }
  const bool is_big_endian = header_.type[0] == '>';
  std::string piece(std::min<uint64_t>(count, kWordsPieceBytes / sizeof(Word)) * sizeof(Word), '\0');
  for (uint64_t index = 0; index < count;) {
    const size_t words = std::min<uint64_t>(count - index, piece.size() / sizeof(Word));
    WELLSPACE_RETURN_IF_ERROR(Take(piece.data(), words * sizeof(Word)));
    for (size_t i = 0; i < words; ++i, ++index) {
      const Word word = LoadWord<Word>(piece, i, is_big_endian);
      Value value;
      if (!convert(word, value)) {
        // Type by type: a number of one byte is no character.
        const std::string got = std::is_signed_v<Word> ? absl::StrCat(static_cast<int64_t>(word))
                                                       : absl::StrCat(static_cast<uint64_t>(word));
        return Error(
            std::is_same_v<Value, double>
                ? absl::StrCat("expected whole numbers that a double can hold, got ", got, " at ", PlaceOf(index))
                : absl::StrCat("expected indices from 0 to below the number of points, got ", got, " at ",
                               PlaceOf(index)));
      }
      values.push_back(value);
    }
  }
  if (header_.fortran_order) {
    std::vector<Value> by_rows(values.size());
    for (uint64_t index = 0; index < count; ++index) {
      by_rows[index % rows() * columns() + index / rows()] = values[index];
    }
    values = std::move(by_rows);
  }
  return ExpectEnd();
}

// Calls `read` with a value of the type that `type` names, and returns its result; nothing for other types.
template <typename Read>
std::optional<absl::Status> NpyReader::ForWholeType(const Read& read) {
  const std::string_view type = header_.type;
  if (type.size() != 3 || std::string_view("<>|=").find(type[0]) == std::string_view::npos ||
      (type[0] == '|' && type[2] != '1')) {
    return std::nullopt;
  }
  const std::string_view kind = type.substr(1);
  return kind == "i1"   ? std::make_optional(read(int8_t{}))
         : kind == "u1" ? std::make_optional(read(uint8_t{}))
         : kind == "i2" ? std::make_optional(read(int16_t{}))
         : kind == "u2" ? std::make_optional(read(uint16_t{}))
         : kind == "i4" ? std::make_optional(read(int32_t{}))
         : kind == "u4" ? std::make_optional(read(uint32_t{}))
         : kind == "i8" ? std::make_optional(read(int64_t{}))
         : kind == "u8" ? std::make_optional(read(uint64_t{}))
                        : std::nullopt;
}

absl::Status NpyReader::ReadNumbers(std::vector<double>& values) {
  const auto widen = [](auto word, double& value) {
    value = word;
    return true;
  };
  values.clear();
  if (header_.type == "<f8" || header_.type == ">f8") {
    return ReadWords<double>(values, widen);
  }
  if (header_.type == "<f4" || header_.type == ">f4") {
    return ReadWords<float>(values, widen);
  }
  const std::optional<absl::Status> status = ForWholeType([&](auto type) {
    using Word = decltype(type);
    return ReadWords<Word>(values, [](Word word, double& value) {
      value = static_cast<double>(word);
      // Beyond 2^53 some are between two doubles; the largest of 64 bits become 2^63 or 2^64, which no Word can hold.
      constexpr double kLimit = 2.0 * static_cast<double>(uint64_t{1} << (8 * sizeof(Word) - 1));
      return value < kLimit / (std::is_signed_v<Word> ? 2 : 1) && static_cast<Word>(value) == word;
    });
  });
  return status.has_value()
             ? *status
             : Error(absl::StrCat("expected numbers of type f4, f8, i1, i2, i4, i8, u1, u2, u4 or u8, got ",
                                  Quote(header_.type)));
}

absl::Status NpyReader::ReadIndices(uint64_t limit, std::vector<uint32_t>& values) {
  values.clear();
  const std::optional<absl::Status> status = ForWholeType([&](auto type) {
    using Word = decltype(type);
    return ReadWords<Word>(values, [limit](Word word, uint32_t& value) {
      value = static_cast<uint32_t>(word);
      // A negative number is huge as an unsigned one.
      return static_cast<uint64_t>(static_cast<int64_t>(word)) < limit;
    });
  });
  return status.has_value()
             ? *status
             : Error(absl::StrCat("expected whole numbers of type i1, i2, i4, i8, u1, u2, u4 or u8, got ",
                                  Quote(header_.type)));
}

absl::Status NpyReader::ReadTexts(std::vector<std::string>& values) {
  const std::string_view type = header_.type;
  uint64_t characters = 0;
  if (type.substr(0, 2) != "<U" || !ParseUnsigned(type.substr(2), kMaxNpyCharacters, characters) || characters == 0) {
    return Error(absl::StrCat("expected texts of type <U1 to <U", kMaxNpyCharacters, ", got ", Quote(type)));
  }
  values.clear();
  std::u32string text(characters, U'\0');
  for (uint64_t row = 0; row < rows(); ++row) {
    WELLSPACE_RETURN_IF_ERROR(Take(reinterpret_cast<char*>(text.data()), characters * sizeof(char32_t)));
    values.push_back(ToUtf8(std::u32string_view(text).substr(0, text.find_last_not_of(U'\0') + 1)));
  }
  return ExpectEnd();
}

}  // namespace wellspace::formats
