// Every reader of sizes at points, on any text.
//
// Input: a character that chooses among kExtensions, '0' the first, '1' the second and so on; the file.
#include <array>
#include <cmath>
#include <string>

#include "client/formats/read_sizes.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"

namespace wellspace::fuzz {
namespace {

constexpr std::array kExtensions = {".csv", ".asc", ".vtu", ".msh", ".npz", ".tif"};

void RequireSizes(const formats::SizedPoints& sized, int dimension) {
  Require(sized.cloud.dimension == dimension, "the dimension is the one asked for");
  Require(!sized.sizes.empty() && sized.sizes.size() == sized.cloud.size(), "every point has a size");
  for (const double x : sized.cloud.points) {
    Require(std::isfinite(x), "coordinates are finite");
  }
  for (size_t i = 0; i < sized.sizes.size(); ++i) {
    Require(sized.sizes[i] > 0 && std::isfinite(sized.sizes[i]), "sizes are finite and above 0");
    RequireClearMessage(sized.cloud.Origin(i));
  }
  for (const std::string& note : sized.cloud.notes) {
    RequireClearMessage(note);
  }
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;
  constexpr int kDimension = 2;
  fuzz::ByteReader bytes(data, size);
  const std::string extension = fuzz::kExtensions[static_cast<uint8_t>(bytes.Next() - '0') % fuzz::kExtensions.size()];
  const auto sized =
      formats::ReadSizes(fuzz::ScratchFolder::Get().Write("sizes" + extension, bytes.TakeText()), kDimension);
  if (!sized.ok()) {
    fuzz::Require(sized.status().code() == absl::StatusCode::kInvalidArgument,
                  "a bad file is an INVALID_ARGUMENT:", sized.status().ToString());
    fuzz::RequireClearMessage({sized.status().message().data(), sized.status().message().size()});
    return 0;
  }
  fuzz::RequireSizes(*sized, kDimension);
  return 0;
}
