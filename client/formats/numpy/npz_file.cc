#include "client/formats/numpy/npz_file.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/numpy/npy.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

absl::StatusOr<std::unique_ptr<NpzFile>> NpzFile::Create(const std::string& path, std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  if (!output.IsSeekable()) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", path, ": npz is a zip archive, which needs a regular file"));
  }
  return std::unique_ptr<NpzFile>(new NpzFile(std::move(output)));
}

void NpzFile::WriteTexts(const std::string& member, std::span<const std::string> texts) {
  size_t longest = 1;
  std::vector<std::u32string> rows;
  for (const std::string& text : texts) {
    std::u32string& row = rows.emplace_back(ToUtf32(text));
    row.resize(std::min<size_t>(row.size(), kMaxNpyCharacters));
    longest = std::max(longest, row.size());
    changes_.Add(text, ToUtf8(row));
  }
  BeginOf(member, absl::StrCat("<U", longest), rows.size(), std::nullopt, longest * sizeof(char32_t));
  for (std::u32string& row : rows) {
    row.resize(longest, U'\0');
    Write(std::span<const char32_t>(row));
  }
}

void NpzFile::WriteRepeated(int32_t value, uint64_t count) {
  constexpr uint64_t kBlock = 1 << 14;
  const std::vector<int32_t> block(std::min(count, kBlock), value);
  for (uint64_t done = 0; done < count && archive_.status().ok(); done += kBlock) {
    Write(std::span<const int32_t>(block).first(std::min(count - done, kBlock)));
  }
}

std::string NpzFile::ChangesNote() const {
  return changes_.Note(absl::StrCat("names are text of at most ", kMaxNpyCharacters, " characters"));
}

absl::Status NpzFile::Commit() {
  WELLSPACE_RETURN_IF_ERROR(archive_.Finish());
  return output_.Commit();
}

void NpzFile::BeginOf(const std::string& member, const std::string& type, uint64_t rows,
                      std::optional<uint64_t> columns, size_t value_bytes) {
  const std::string preamble = NpyPreamble(type, rows, columns);
  archive_.Begin(member, preamble.size() + rows * columns.value_or(1) * value_bytes);
  archive_.Write(preamble);
}

}  // namespace wellspace::formats
