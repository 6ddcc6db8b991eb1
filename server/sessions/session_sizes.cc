// What a session does with sizes at points.
#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "server/sessions/session.h"
#include "server/sessions/size_store.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

bool AreEqual(const core::SizeSamples* a, const core::SizeSamples* b) {
  return a == b ||
         (a != nullptr && b != nullptr && a->measure == b->measure && a->sizes == b->sizes && a->points == b->points);
}

}  // namespace

std::vector<SizesInUse> Session::UnusedSizesLocked(const SessionSteps& steps, uint64_t current) const {
  std::vector<SizesInUse> had = steps_.sizes();
  if (sizes_in_use_.number != 0 && std::ranges::find(had, sizes_in_use_) == had.end()) {
    had.push_back(sizes_in_use_);
  }
  const std::vector<SizesInUse> kept = steps.sizes();
  std::erase_if(
      had, [&](const SizesInUse& set) { return set.number == current || std::ranges::find(kept, set) != kept.end(); });
  return had;
}

absl::Status Session::SetSizes(const std::shared_ptr<const core::SizeSamples>& samples, uint64_t expected_revision,
                               MemoryReservation* received) {
  return RetryWithRoom(samples == nullptr ? 0 : samples->bytes(),
                       [&] { return TryToSetSizes(samples, expected_revision, received); });
}

absl::Status Session::TryToSetSizes(const std::shared_ptr<const core::SizeSamples>& samples, uint64_t expected_revision,
                                    MemoryReservation* received) {
  std::lock_guard change_lock(change_mutex_);
  WELLSPACE_RETURN_IF_ERROR(LoadInputs());
  const uint64_t count = samples == nullptr ? 0 : samples->sizes.size();
  SizesInUse in_use;
  std::vector<SizesInUse> unused;
  uint64_t dropped = 0;
  {
    std::lock_guard lock(mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckOpenLocked());
    WELLSPACE_RETURN_IF_ERROR(CheckIdleLocked());
    const bool is_repetition = AreEqual(samples.get(), sizes_.get());
    // A client whose answer was lost repeats the call, with the revision that was right the first time.
    if (!is_repetition || sizes_revision_ == 0 || expected_revision != sizes_revision_ - 1) {
      WELLSPACE_RETURN_IF_ERROR(CheckRevisionLocked(expected_revision));
    }
    if (is_repetition) {
      return absl::OkStatus();
    }
    if (samples != nullptr) {
      WELLSPACE_RETURN_IF_ERROR(CheckSamples(BoxLocked(), dimension_, *samples));
    }
    in_use = {.number = count == 0 ? 0 : revision_ + 1, .count = count};
    unused = UnusedSizesLocked(steps_, in_use.number);
    for (const SizesInUse& set : unused) {
      dropped += set.count;
    }
    // The sets that are dropped are there until the end, beside the new one: what is reserved for it is handed over
    // only as far as the account grows.
    if (received != nullptr && samples != nullptr) {
      const uint64_t beside = samples->bytes() / count * std::min(count, dropped);
      (void)received->Split(received->bytes() - std::min(received->bytes(), beside));
    }
    WELLSPACE_RETURN_IF_ERROR(point_account_.TakeSizes(count > dropped ? count - dropped : 0));
  }
  const absl::Status status = RunGuarded([&] {
    return CommitState([&](SessionChange& change) {
      change.state->set_revision(change.state->revision() + 1);
      change.state->set_sizes(in_use.number);
      change.state->set_size_count(in_use.count);
      if (samples != nullptr) {
        change.sizes = RecordsOf(in_use.number, samples, dimension_);
      }
      for (const SizesInUse& set : unused) {
        change.dropped_sizes.push_back(set.number);
      }
    });
  });
  std::lock_guard lock(mutex_);
  if (!status.ok()) {
    point_account_.ReturnSizes(count > dropped ? count - dropped : 0);
    return status;
  }
  point_account_.ReturnSizes(dropped > count ? dropped - count : 0);
  sizes_ = samples;
  sizes_in_use_ = in_use;
  sizes_revision_ = ++revision_;
  return absl::OkStatus();
}

v1::SetSizesResponse Session::CommittedSizes() const {
  v1::SetSizesResponse message;
  std::lock_guard lock(mutex_);
  message.set_size_count(sizes_in_use_.count);
  message.set_revision(revision_);
  return message;
}

absl::Status Session::LoadSizes() {
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<StoredSizes> sets, log_.ReadSizes(name_));
  std::map<uint64_t, std::shared_ptr<const core::SizeSamples>> samples;
  for (StoredSizes& set : sets) {
    samples[set.number] = SamplesOf(std::move(set.parts));
  }
  std::lock_guard lock(mutex_);
  std::vector<SizesInUse> wanted = steps_.sizes();
  wanted.push_back(sizes_in_use_);
  for (const SizesInUse& set : wanted) {
    const auto found = samples.find(set.number);
    const uint64_t count = found == samples.end() || found->second == nullptr ? 0 : found->second->sizes.size();
    if (count != set.count) {
      return MakeError(v1::ERROR_REASON_FILE_DAMAGED,
                       absl::StrCat("set ", set.number, " of the sizes of ", name_, " has ", count,
                                    " samples, and not ", set.count, "; restore a back-up"));
    }
  }
  const auto find = [&](uint64_t number) { return samples[number]; };
  steps_.ResolveSizes(find);
  sizes_ = find(sizes_in_use_.number);
  return absl::OkStatus();
}

core::MeshParameters Session::ParametersOf(const Operation& operation) const {
  core::MeshParameters parameters = operation.parameters();
  std::lock_guard lock(mutex_);
  parameters.size_samples = sizes_;
  return parameters;
}

}  // namespace wellspace::server
