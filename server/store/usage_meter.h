// Counts the work of tenants that no change of a session tells of, until it is written down.
#ifndef WELLSPACE_SERVER_STORE_USAGE_METER_H_
#define WELLSPACE_SERVER_STORE_USAGE_METER_H_

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "server/base/clock.h"
#include "server/store/session_log.h"

namespace wellspace::server {

// Gathers work in memory, and writes it down for all tenants in one change, so that no small job costs a commit. A
// process that dies loses the work since the last Flush. The work of an operation is in the change that ends it.
//
// Thread safety: thread-safe.
class UsageMeter {
 public:
  static constexpr absl::Duration kBetweenFlushes = absl::Seconds(5);

  // REQUIRES:   `log` outlives this.
  UsageMeter(Clock clock, SessionLog& log) : clock_(std::move(clock)), log_(log) {}
  // Writes down what is left.
  ~UsageMeter() { Flush().IgnoreError(); }
  UsageMeter(const UsageMeter&) = delete;
  UsageMeter& operator=(const UsageMeter&) = delete;

  void AddMesh(const std::string& tenant, uint64_t vertices);
  void AddTime(const std::string& tenant, absl::Duration processor_time);

  bool IsEmpty() const;

  // Writes down what has been gathered. May wait for the disk.
  //
  // Errors:     those of Records::Apply: all of it is gathered still.
  absl::Status Flush();

 private:
  // By tenant and day.
  using Gathered = std::map<std::pair<std::string, int32_t>, store::v1::UsageRecord>;

  void Add(const store::v1::UsageRecord& work);

  const Clock clock_;
  SessionLog& log_;
  mutable std::mutex mutex_;
  Gathered gathered_;  // guarded by mutex_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_USAGE_METER_H_
