#include "core/simplex/star_rows.h"

#include "core/base/check_at.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"

namespace wellspace::core {

template <int D>
absl::Status StarRows<D>::Build(std::span<const uint32_t> simplices, uint64_t vertices, const RunContext& context) {
  rows_.Clear();
  next_.clear();
  next_.reserve(simplices.size() / (D + 1));
  first_.assign(vertices, kNone);
  for (size_t at = 0; at < simplices.size(); at += D + 1) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(at / (D + 1), context));
    Push(simplices[at]);
  }
  return absl::OkStatus();
}

template <int D>
void StarRows<D>::Push(uint32_t lowest) {
  next_.push_back(first_[lowest]);
  first_[lowest] = static_cast<uint32_t>(rows_.slots());
  rows_.Push(true);
}

template <int D>
std::vector<RowEdit> StarRows<D>::Replace(std::span<const uint32_t> dropped, std::span<const uint32_t> added,
                                          uint64_t vertices, std::span<const uint32_t> simplices) {
  for (const uint32_t slot : dropped) {
    uint32_t* link = &first_[simplices[rows_.RowOf(slot) * (D + 1)]];
    while (*link != slot) {
      link = &next_[*link];
    }
    *link = next_[slot];
  }
  std::vector<RowEdit> edits = rows_.Change(dropped, [](uint32_t) { return false; });
  first_.resize(vertices, kNone);
  for (size_t at = 0; at < added.size(); at += D + 1) {
    Push(added[at]);
  }
  AppendEdit({simplices.size() / (D + 1), 0, added.size() / (D + 1)}, edits);
  return edits;
}

#define WELLSPACE_INSTANTIATE(D) template class StarRows<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
