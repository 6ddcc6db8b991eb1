// The rows of a database that a change writes, whichever database it is.
#ifndef WELLSPACE_SERVER_STORE_RECORD_ROWS_H_
#define WELLSPACE_SERVER_STORE_RECORD_ROWS_H_

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/records.h"

namespace wellspace::server {

// Rows within a transaction, each of which has the bytes of a record.
//
// Thread safety: thread-compatible.
// Errors:     of all functions: those of the database.
class RecordRows {
 public:
  // Where a session is.
  struct Row {
    std::optional<int64_t> id{};  // none: it is not there
    int64_t own_epoch = 0;        // of the row
    int64_t epoch = 0;            // at which the session is; else the least to make it at
  };

  virtual ~RecordRows() = default;

  virtual absl::StatusOr<Row> FindSession(const std::string& session) = 0;
  // Returns the id of the row.
  virtual absl::StatusOr<int64_t> InsertSession(const std::string& session, int64_t epoch,
                                                const std::string& record) = 0;
  virtual absl::Status UpdateSession(const std::string& session, const Row& row, const std::string& record) = 0;
  // Where several processes own sessions at once.
  virtual absl::Status SetOffer(int64_t /*session*/, const WorkOffer& /*offer*/) { return absl::OkStatus(); }
  // With all rows that are its.
  virtual absl::Status DeleteSession(int64_t id) = 0;

  // The number of the first step behind those that there are.
  virtual absl::StatusOr<int64_t> NextStep(int64_t session) = 0;
  virtual absl::Status InsertStep(int64_t session, int64_t number, int64_t kind, const std::string& record) = 0;

  // New, or in the place of that of this number. The session is not offered any more.
  virtual absl::Status PutOperation(int64_t session, int64_t number, const std::string& record) = 0;
  virtual absl::Status DropOperation(int64_t session, int64_t number) = 0;

  virtual absl::Status InsertSizes(int64_t session, int64_t number, int64_t part, const std::string& record) = 0;
  virtual absl::Status DropSizes(int64_t session, int64_t number) = 0;

  // False: there is an answer to this request.
  virtual absl::StatusOr<bool> InsertAnswer(const store::v1::AnswerRecord& answer, const std::string& record) = 0;

  // The usage of a tenant on a day, as far as the owner of these rows has told it.
  virtual absl::StatusOr<std::optional<store::v1::UsageRecord>> FindUsage(const std::string& tenant, int32_t day) = 0;
  // New, or in the place of that.
  virtual absl::Status PutUsage(const store::v1::UsageRecord& usage, const std::string& record) = 0;
};

// Writes `change`, if the session is still at its epoch.
//
// Errors:     those of Records::Apply. INTERNAL: it creates a session that is there, or one without a record. The
//             transaction is to be rolled back then.
absl::Status WriteChange(RecordRows& rows, const SessionChange& change);

// Adds the usage of `changes`, which have been written: each tenant's row of a day is written once.
absl::Status WriteUsage(RecordRows& rows, std::span<const SessionChange* const> changes);

// Adds `usage` to what there is.
absl::Status AddUsage(RecordRows& rows, const store::v1::UsageRecord& usage);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_RECORD_ROWS_H_
