// The nodes of an MSH file: where they are, and which has a number. Private to read_msh.cc.
#ifndef WELLSPACE_CLIENT_FORMATS_MSH_MSH_NODES_H_
#define WELLSPACE_CLIENT_FORMATS_MSH_MSH_NODES_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client/formats/io/field_reader.h"
#include "client/formats/msh/msh_numbers.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

// Nodes are numbered as the file likes: all are read, then indexed, then found by their numbers.
class MshNodes {
 public:
  // REQUIRES:   `numbers` outlives this.
  explicit MshNodes(MshNumbers& numbers) : file_(numbers) {}

  size_t count() const { return numbers_.size(); }
  uint64_t NumberOf(size_t node) const { return numbers_[node]; }
  // Rows of three coordinates, by node; none are left.
  std::vector<double> TakePoints() { return std::move(points_); }

  // Lets coordinates be not finite.
  void AllowInvalid() { may_be_invalid_ = true; }

  // Reads the number of a node, or the coordinates of the next one.
  absl::Status ReadNumber() { return file_.Size("the number of a node", kAnyNumber, numbers_.emplace_back()); }
  absl::Status ReadPoint() {
    for (const char* what : {"x of a node", "y of a node", "z of a node"}) {
      WELLSPACE_RETURN_IF_ERROR(file_.Coordinate(what, may_be_invalid_, points_.emplace_back()));
    }
    return absl::OkStatus();
  }

  // Makes nodes be found, once all are read. Nodes that are numbered from 1 on, in order, need no table.
  //
  // Complexity: O(nodes), and a sort where they are in another order.
  // Errors:     INVALID_ARGUMENT for two nodes of one number, or too many.
  absl::Status Index() {
    if (numbers_.size() > kMaxCount) {
      return file_.ValueError(absl::StrCat("expected fewer than 2^32 nodes, got ", numbers_.size()));
    }
    bool in_order = true;
    for (size_t i = 0; i < numbers_.size() && in_order; ++i) {
      in_order = numbers_[i] == i + 1;
    }
    if (in_order) {
      return absl::OkStatus();
    }
    by_number_.resize(numbers_.size());
    std::iota(by_number_.begin(), by_number_.end(), 0u);
    std::sort(by_number_.begin(), by_number_.end(),
              [this](uint32_t a, uint32_t b) { return numbers_[a] < numbers_[b]; });
    for (size_t i = 1; i < by_number_.size(); ++i) {
      if (numbers_[by_number_[i]] == numbers_[by_number_[i - 1]]) {
        return file_.ValueError(
            absl::StrCat("expected one node of every number, got two of ", numbers_[by_number_[i]]));
      }
    }
    return absl::OkStatus();
  }

  // The index of the node of this number.
  //
  // Errors:     INVALID_ARGUMENT if there is none.
  absl::Status Find(uint64_t number, uint32_t& index) const {
    if (by_number_.empty()) {
      if (number == 0 || number > numbers_.size()) {
        return file_.ValueError(absl::StrCat("expected a node from 1 to ", numbers_.size(), ", got ", number));
      }
      index = static_cast<uint32_t>(number - 1);
      return absl::OkStatus();
    }
    const auto found = std::lower_bound(by_number_.begin(), by_number_.end(), number,
                                        [this](uint32_t node, uint64_t wanted) { return numbers_[node] < wanted; });
    if (found == by_number_.end() || numbers_[*found] != number) {
      return file_.ValueError(absl::StrCat("expected the number of a node, got ", number));
    }
    index = *found;
    return absl::OkStatus();
  }

 private:
  MshNumbers& file_;
  bool may_be_invalid_ = false;
  std::vector<uint64_t> numbers_;    // by node
  std::vector<double> points_;       // nodes x 3
  std::vector<uint32_t> by_number_;  // the nodes, sorted; empty: they are numbered from 1 on
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MSH_MSH_NODES_H_
