// Methods of Session about sizes at points.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "server/inputs/size_store.h"
#include "server/sessions/session.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

bool AreEqual(const core::SizeSamples* a, const core::SizeSamples* b) {
  return a == b ||
         (a != nullptr && b != nullptr && a->measure == b->measure && a->sizes == b->sizes && a->points == b->points);
}

}  // namespace

absl::StatusOr<SizeSets> ReadSizeSets(Records& records, const std::string& session,
                                      const std::vector<SizesInUse>& wanted) {
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<StoredSizes> stored, records.ReadSizes(session));
  SizeSets sets;
  for (StoredSizes& set : stored) {
    sets[set.number] = SamplesOf(std::move(set.parts));
  }
  for (const SizesInUse& set : wanted) {
    const auto found = sets.find(set.number);
    const uint64_t count = found == sets.end() || found->second == nullptr ? 0 : found->second->sizes.size();
    if (count != set.count) {
      return MakeError(v1::ERROR_REASON_FILE_DAMAGED,
                       absl::StrCat("set ", set.number, " of the sizes of ", session, " has ", count,
                                    " samples, and not ", set.count, "; restore a back-up"));
    }
  }
  return sets;
}

absl::Status Session::SetSizes(const std::shared_ptr<const core::SizeSamples>& samples, uint64_t expected_revision,
                               MemoryReservation* received) {
  absl::MutexLock change_lock(&change_mutex_);
  WELLSPACE_RETURN_IF_ERROR(LoadInputs());
  const uint64_t count = samples == nullptr ? 0 : samples->sizes.size();
  SessionChange change = SizesChange(*state(), samples);
  uint64_t dropped = 0;
  {
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckIdle(occupancy_, *state_));
    const SizesInUse now = state_->sizes();
    const bool is_repetition = AreEqual(samples.get(), now.number == 0 ? nullptr : stores_.sizes.at(now.number).get());
    if (!is_repetition || !IsRevisionOfSizes(*state_, expected_revision)) {
      WELLSPACE_RETURN_IF_ERROR(CheckRevision(*state_, stores_.point_count(), expected_revision));
    }
    if (is_repetition) {
      return absl::OkStatus();
    }
    if (samples != nullptr) {
      WELLSPACE_RETURN_IF_ERROR(CheckSamples(BoxOf(*state_), dimension(), *samples));
    }
    for (const uint64_t number : change.dropped_sizes) {
      dropped += stores_.sizes.at(number)->sizes.size();
    }
    // The sets that are dropped are there until the end, beside the new one: its reservation is handed over
    // only as far as the account grows.
    if (received != nullptr && samples != nullptr) {
      const uint64_t beside = samples->bytes() / count * std::min(count, dropped);
      (void)received->Split(received->bytes() - std::min(received->bytes(), beside));
    }
    WELLSPACE_RETURN_IF_ERROR(account_.TakeSizes(count > dropped ? count - dropped : 0));
  }
  SizeSets unused;  // is freed without the lock
  absl::Status status = RunGuarded([&] {
    change_mutex_.AssertHeld();
    SizeSets added;
    if (samples != nullptr) {
      added[change.state->sizes()] = samples;
    }
    return Make(change, [&] {
      mutex_.AssertHeld();
      for (const uint64_t number : change.dropped_sizes) {
        unused.insert(stores_.sizes.extract(number));
      }
      stores_.sizes.merge(added);
      account_.ReturnSizes(dropped > count ? dropped - count : 0);
    });
  });
  if (!status.ok()) {
    absl::MutexLock lock(&mutex_);
    account_.ReturnSizes(count > dropped ? count - dropped : 0);
  }
  return status;
}

}  // namespace wellspace::server
