// Operations of this process that wait for a worker, for other processes that share the records.
#ifndef WELLSPACE_SERVER_SESSIONS_WORK_OFFERS_H_
#define WELLSPACE_SERVER_SESSIONS_WORK_OFFERS_H_

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "server/calls/call_environment.h"
#include "server/sessions/session.h"

namespace wellspace::server {

// Offers sessions whose operation waits, all but those that are first in line (ServiceOptions::keep_queued), and gives
// away those that another process has taken. An offer ends with the operation's begin, end or cancel, in the same
// transaction; where fewer wait, it is withdrawn.
//
// While nothing waits and nothing is offered, the database is not asked. While something is offered it is asked once in
// kBetweenLooks, and by each call on such a session (SessionRegistry::Find).
//
// Thread safety: thread-safe.
class WorkOffers {
 public:
  static constexpr absl::Duration kBetweenLooks = absl::Seconds(1);
  // An operation waits so long before it is offered: shorter waits are not worth a change of the owner.
  static constexpr absl::Duration kPatience = absl::Seconds(1);
  // The same where another process would have to build the structure again.
  static constexpr absl::Duration kPatienceWithStructure = absl::Seconds(10);

  // REQUIRES:   the parts of `environment` outlive this; its threads end before.
  explicit WorkOffers(const CallEnvironment& environment) : environment_(environment) {}

  // Has a blocking thread look what waits, and what was taken; not while one does. To be called every kBetweenLooks.
  void Look();

  uint64_t offered() const { return offered_; }  // operations
  uint64_t given() const { return given_; }      // of these, those that another process has taken

 private:
  struct Candidate {
    std::shared_ptr<Session> session;
    Session::Waiting waiting;
  };

  // The following are of the one thread that looks.
  void LookNow();
  // Gives away those that were taken.
  absl::Status Settle(const std::vector<std::shared_ptr<Session>>& offered);
  void GiveAway(const std::shared_ptr<Session>& session, const std::string& address);
  // Offers and withdraws what `waiting` gives reason for; those first in line come first.
  void Choose(const std::vector<Candidate>& waiting);
  void Set(const std::shared_ptr<Session>& session, bool stands);

  const CallEnvironment& environment_;
  std::atomic<bool> is_looking_ = false;
  std::atomic<uint64_t> offered_ = 0;
  std::atomic<uint64_t> given_ = 0;
  // Of the thread that looks: since when operations wait here, by their names; since boot.
  std::map<std::string, absl::Duration> since_;
  std::mutex mutex_;
  std::set<std::string> asked_;  // guarded by mutex_: sessions of which an offer is being changed
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_WORK_OFFERS_H_
