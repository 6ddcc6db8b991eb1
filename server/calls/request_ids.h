// Answers of calls that carried a request_id, for calls that repeat them.
#ifndef WELLSPACE_SERVER_CALLS_REQUEST_IDS_H_
#define WELLSPACE_SERVER_CALLS_REQUEST_IDS_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "google/protobuf/message.h"
#include "server/store/records.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// A request with a request_id, for the change that it makes: its answer is written down with the change.
struct IdentifiedRequest {
  std::string tenant;
  std::string request_id;  // empty: it has none
  std::string content;     // SHA-256 of the request

  // The record to be written down when `response` answers it; nothing without a request_id.
  std::optional<store::v1::AnswerRecord> Answer(const google::protobuf::Message& response) const;
};

// Has calls that carry the same request_id done once. That is decided where the change is committed: the records refuse
// a second answer to a request (Records::Apply), and the change with it. Here are the calls of this process that wait
// for one that is under way, and the answers that it knows. Work that fails has perhaps been done by another process:
// so the records are asked before the error is given.
//
// An answer is kept for kKeptFor; of a tenant with more than kMaxPerTenant of them, or more than kMaxBytesPerTenant in
// them, the oldest go earlier. Errors are not kept: a failed call may be tried again.
//
// Thread safety: thread-safe. Functions that it is given run without any lock held.
class RequestIds {
 public:
  static constexpr absl::Duration kKeptFor = absl::Minutes(10);
  static constexpr size_t kMaxPerTenant = 10'000;
  static constexpr size_t kMaxBytesPerTenant = size_t{16} << 20;
  static constexpr size_t kMaxLength = 128;  // of a request_id

  // The end of a call; `response` is its answer, serialized, if it succeeded.
  struct Answer {
    absl::Status status;
    std::string response;
  };
  using Done = std::function<void(const Answer&)>;

  // `records` have the answers, too: they are told which to forget.
  //
  // REQUIRES:   `records` outlive this.
  RequestIds(std::function<absl::Duration()> since_boot, Records& records)
      : since_boot_(std::move(since_boot)), records_(records) {}

  // Takes the answers that were written down before the server was started. They are kept from now on as new ones are.
  // To be called first.
  void Restore(std::vector<store::v1::AnswerRecord> answers);

  // Has `done` called with the answer to `request`, once. The first time it has `work` call it, now or later, in any
  // way exactly once; a call that repeats another gets that one's answer as soon as it is there. An empty id is none:
  // always the first time.
  //
  // Errors, as answers: INVALID_REQUEST (the id is too long), REQUEST_ID_REUSED.
  void Once(const std::string& tenant, const std::string& request_id, const google::protobuf::Message& request,
            const std::function<void(const IdentifiedRequest&, Done)>& work, Done done);

 private:
  struct Entry {
    std::string request_id;
    std::string content;  // SHA-256 of the request
    absl::Duration time;  // since boot
    bool is_answered = false;
    Answer answer;
    std::vector<Done> waiting;  // for the answer
  };
  // The entries of one tenant, the oldest first.
  struct Tenant {
    std::list<Entry> entries;
    std::unordered_map<std::string, std::list<Entry>::iterator> by_id;
    size_t bytes = 0;  // of answers
  };

  void Finish(const IdentifiedRequest& request, const Answer& answer);
  // The answer that any process has given to `request`; none: none has, or it is not known now.
  std::optional<Answer> AnswerOfAnother(const IdentifiedRequest& request);

  // The following want mutex_ to be held.
  Entry& Add(Tenant& tenant, std::string request_id, std::string content);
  void Erase(Tenant& tenant, std::list<Entry>::iterator entry);
  // Drops answers that are too old, or too many. Requests that are not answered yet stay.
  void Trim(const std::string& tenant_name, Tenant& tenant);

  const std::function<absl::Duration()> since_boot_;
  Records& records_;
  std::mutex mutex_;
  std::map<std::string, Tenant> tenants_;  // guarded by mutex_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_REQUEST_IDS_H_
