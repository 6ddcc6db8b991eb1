// Sessions of other processes that share the records.
#ifndef WELLSPACE_SERVER_SESSIONS_OTHER_OWNERS_H_
#define WELLSPACE_SERVER_SESSIONS_OTHER_OWNERS_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/jobs/background.h"
#include "server/store/records.h"

namespace wellspace::server {

// Knows where sessions are that this process does not have, and takes those over whose owner is no more, or offers them
// for work that this process has room for. The database
// is asked on a thread of its own: calls wait for that no longer than kMostWait, and not at all while it does not
// answer.
//
// Thread safety: thread-safe.
class OtherOwners {
 public:
  static constexpr absl::Duration kMostWait = absl::Seconds(1);
  // Between looks for owners that are no more.
  static constexpr absl::Duration kBetweenLooks = absl::Seconds(1);

  // From whom sessions were taken: owners that are no more, or that have offered them.
  enum class From { kDead, kBusy };

  // Takes sessions in that are this process's from now on. Returns the names of those of which it is to be tried again.
  using TakeIn = std::function<std::vector<std::string>(std::vector<StoredSession> sessions, From from)>;

  // Whether a session is here, so that it need not be taken in.
  using IsHere = std::function<bool(const std::string& name)>;

  // The work of others for which there is room now.
  using GetRoom = std::function<RoomForWork()>;

  // REQUIRES:   `records` outlive this. Where they are not shared, nothing of this does anything.
  OtherOwners(Records& records, TakeIn take_in, IsHere is_here, GetRoom get_room)
      : records_(records), take_in_(std::move(take_in)), is_here_(std::move(is_here)), get_room_(std::move(get_room)) {}

  // Begins to look for owners that are no more. To be called once, before Find.
  void Start();
  // Nothing is taken in any more when this returns.
  void Stop() {
    if (thread_.has_value()) {
      thread_->Stop();
    }
  }

  // As SessionRegistry::Others. A session that is this process's, and not in its registry, is taken in again.
  //
  // Errors:     SESSION_NOT_FOUND, SESSION_ELSEWHERE; STORE_FAILED: it is not known now.
  absl::Status Find(const std::string& tenant, const std::string& name);
  absl::StatusOr<std::set<std::string>> ListOffered();

 private:
  // The following are of thread_.
  void LookAgain();
  absl::Status LookFor(const std::string& tenant, const std::string& name);
  absl::Status TakeOrphans();
  absl::Status TakeWork();
  // Has them taken in, and those that could not be noted in left_.
  void TakeAll(std::vector<StoredSession> taken, From from);
  // A session that is this process's, and not here.
  absl::Status TakeOne(const std::string& name);
  // Has thread_ call `ask`, and waits for the answer, but no longer than kMostWait; `what` is asked about.
  //
  // Errors:     STORE_FAILED: there is none now.
  absl::Status Ask(const std::string& what, const std::function<absl::Status()>& ask);
  // Whether what thread_ does takes longer than calls may wait.
  bool IsLate() const;

  Records& records_;
  const TakeIn take_in_;
  const IsHere is_here_;
  const GetRoom get_room_;
  std::vector<std::string> left_;      // of thread_: names to be tried again
  std::atomic<int64_t> begun_at_ = 0;  // when thread_ has begun what it does, in nanoseconds since boot; 0: nothing
  std::optional<Background> thread_;   // last: its tasks use what stands above; none where nothing is shared
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_OTHER_OWNERS_H_
