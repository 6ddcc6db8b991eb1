// The records of servers that share a PostgreSQL database: each owns sessions of its own. docs/adr/0045
#ifndef WELLSPACE_SERVER_STORE_POSTGRES_RECORDS_H_
#define WELLSPACE_SERVER_STORE_POSTGRES_RECORDS_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/store/change_queue.h"
#include "server/store/data_folder.h"
#include "server/store/postgres.h"
#include "server/store/postgres_lease.h"
#include "server/store/postgres_options.h"
#include "server/store/records.h"
#include "server/store/store_health.h"

namespace wellspace::server {

// Applies changes in groups, as SqliteRecords does. A process that begins takes over the sessions of owners whose lease
// is out, and no others; TakeOrphans does so from then on. While the database is not there, changes end with
// STORE_FAILED, and nothing has changed.
//
// Thread safety: that of Records.
// Invariants: (1) a change that was acknowledged outlives what Survives says; (2) where it cannot be found out whether
//             a change was made, `health` fails, and nothing is acknowledged any more.
class PostgresRecords final : public Records {
 public:
  // Makes the tables where there are none. `folder`, which may be null, has the files that the records name: the two
  // are of one another (DataFolder::Pair). Where an owner of this name has ended without a word, its lease is waited
  // for.
  //
  // Errors:     STORE_FAILED: the database is not there. PERMISSION_DENIED: the role may not make, or use, the tables.
  //             FAILED_PRECONDITION: they are of a newer program, PostgreSQL is older than 13, an owner of this name
  //             lives, or the folder is another's. INVALID_ARGUMENT: of the address.
  static absl::StatusOr<std::unique_ptr<PostgresRecords>> Open(const PostgresOptions& options,
                                                               std::shared_ptr<DataFolder> folder,
                                                               std::shared_ptr<StoreHealth> health);

  bool is_durable() const override { return true; }
  uint64_t epoch() const override { return lease_.epoch(); }
  absl::StatusOr<StoredSessions> Load() override;
  absl::StatusOr<std::optional<StoredSession>> Take(const std::string& session) override;
  absl::Status Apply(const SessionChange& change, Survives survives) override { return queue_.Apply(change, survives); }
  absl::StatusOr<std::optional<store::v1::AnswerRecord>> FindAnswer(const AnswerKey& request) override;
  void Forget(std::span<const AnswerKey> answers) override { queue_.Forget(answers); }
  absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& session) override;
  absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& session) override;
  absl::StatusOr<UsageByTenant> ReadUsage(const UsageRange& range) override;
  absl::StatusOr<std::optional<store::v1::SessionRecord>> ReadRecord(const std::string& session) override;
  absl::StatusOr<Census> ReadCensus() override;

  bool is_shared() const override { return true; }
  absl::Status Announce(const std::string& address) override { return lease_.Announce(address); }
  absl::Status CheckOwnership() const override { return lease_.Check(); }
  absl::StatusOr<std::optional<SessionOwner>> FindOwner(const std::string& session) override;
  absl::StatusOr<std::vector<StoredSession>> TakeOrphans() override;
  absl::StatusOr<std::vector<StoredSession>> TakeOffered(const RoomForWork& room) override;
  absl::StatusOr<std::vector<std::string>> ListOffered() override;
  absl::StatusOr<std::vector<StoredOperation>> ListOperations(const OperationPlace& after, size_t count) override;

 private:
  PostgresRecords(const PostgresOptions& options, std::shared_ptr<StoreHealth> health);
  absl::Status ApplyTogether(std::span<const SessionChange* const> changes, std::span<const AnswerKey> forgotten,
                             Survives survives);
  // Notes a failure after which it is not known what the database has.
  absl::Status NoteFailure(const absl::Status& status);
  // Runs `work` in a transaction that takes sessions. A damaged row of theirs is no failure of the store: they stay
  // with their owner.
  absl::Status ChangeOwners(PostgresLink& link, const PostgresLink::Work& work);

  const std::shared_ptr<StoreHealth> health_;
  // One connection each: short work does not wait for long work.
  PostgresLink writing_;
  PostgresLink reading_;
  PostgresLink owning_;  // the lease, and who has which session
  PostgresLease lease_;
  ChangeQueue queue_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_POSTGRES_RECORDS_H_
