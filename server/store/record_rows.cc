#include "server/store/record_rows.h"

#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

absl::Status WriteSteps(RecordRows& rows, int64_t session, const std::vector<store::v1::StepRecord>& steps) {
  if (steps.empty()) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(int64_t number, rows.NextStep(session));
  for (const store::v1::StepRecord& step : steps) {
    WELLSPACE_RETURN_IF_ERROR(rows.InsertStep(session, number, step.step_case(), step.SerializeAsString()));
    ++number;
  }
  return absl::OkStatus();
}

absl::Status WriteOperations(RecordRows& rows, int64_t session, const SessionChange& change) {
  for (const store::v1::OperationRecord& operation : change.operations) {
    WELLSPACE_RETURN_IF_ERROR(
        rows.PutOperation(session, static_cast<int64_t>(operation.number()), operation.SerializeAsString()));
  }
  for (const uint64_t number : change.dropped_operations) {
    WELLSPACE_RETURN_IF_ERROR(rows.DropOperation(session, static_cast<int64_t>(number)));
  }
  return absl::OkStatus();
}

absl::Status WriteSizes(RecordRows& rows, int64_t session, const SessionChange& change) {
  for (const uint64_t number : change.dropped_sizes) {
    WELLSPACE_RETURN_IF_ERROR(rows.DropSizes(session, static_cast<int64_t>(number)));
  }
  if (!change.sizes.has_value()) {
    return absl::OkStatus();
  }
  const auto number = static_cast<int64_t>(change.sizes->number);
  int64_t part = 0;
  for (const store::v1::SizesRecord& sizes : change.sizes->parts) {
    WELLSPACE_RETURN_IF_ERROR(rows.InsertSizes(session, number, part, sizes.SerializeAsString()));
    ++part;
  }
  const StoredSizes::InTurn& in_turn = change.sizes->in_turn;
  for (size_t i = 0; i < in_turn.count; ++i) {
    WELLSPACE_RETURN_IF_ERROR(rows.InsertSizes(session, number, part, in_turn.make(i).SerializeAsString()));
    ++part;
  }
  return absl::OkStatus();
}

absl::Status Write(RecordRows& rows, const SessionChange& change, const RecordRows::Row& row) {
  std::optional<int64_t> id = row.id;
  if (change.state.has_value()) {
    const std::string record = change.state->SerializeAsString();
    if (id.has_value()) {
      WELLSPACE_RETURN_IF_ERROR(rows.UpdateSession(change.session, row, record));
    } else {
      WELLSPACE_ASSIGN_OR_RETURN(id, rows.InsertSession(change.session, static_cast<int64_t>(change.epoch), record));
    }
  }
  if (!id.has_value()) {
    return MakeError(v1::ERROR_REASON_INTERNAL,
                     absl::StrCat("session ", change.session, " is created without a record"));
  }
  WELLSPACE_RETURN_IF_ERROR(WriteSteps(rows, *id, change.steps));
  WELLSPACE_RETURN_IF_ERROR(WriteOperations(rows, *id, change));
  if (change.offer.has_value()) {
    WELLSPACE_RETURN_IF_ERROR(rows.SetOffer(*id, *change.offer));
  }
  return WriteSizes(rows, *id, change);
}

}  // namespace

absl::Status WriteChange(RecordRows& rows, const SessionChange& change) {
  WELLSPACE_ASSIGN_OR_RETURN(const RecordRows::Row row, rows.FindSession(change.session));
  const auto epoch = static_cast<int64_t>(change.epoch);
  const bool names_none = !change.state.has_value() && change.steps.empty() && change.operations.empty() &&
                          change.dropped_operations.empty() && !change.sizes.has_value() && !change.offer.has_value();
  if (row.id.has_value() ? row.epoch != epoch
                         : row.epoch > epoch || !(change.is_creation || change.is_deletion || names_none)) {
    return OwnedElsewhere(change.session);
  }
  if (row.id.has_value() && change.is_creation) {
    return MakeError(v1::ERROR_REASON_INTERNAL, absl::StrCat(change.session, " is there already"));
  }
  if (change.is_deletion) {
    WELLSPACE_RETURN_IF_ERROR(row.id.has_value() ? rows.DeleteSession(*row.id) : absl::OkStatus());
  } else if (!names_none || row.id.has_value()) {
    WELLSPACE_RETURN_IF_ERROR(Write(rows, change, row));
  }
  if (!change.answer.has_value()) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(const bool is_first,
                             rows.InsertAnswer(*change.answer, change.answer->SerializeAsString()));
  return is_first ? absl::OkStatus() : AnsweredBefore(change.answer->request_id());
}

absl::Status WriteUsage(RecordRows& rows, std::span<const SessionChange* const> changes) {
  std::map<std::pair<std::string, int32_t>, store::v1::UsageRecord> sums;
  for (const SessionChange* change : changes) {
    for (const store::v1::UsageRecord& usage : change->usage) {
      store::v1::UsageRecord& sum = sums[{usage.tenant(), usage.day()}];
      sum.set_tenant(usage.tenant());
      sum.set_day(usage.day());
      AddWork(usage, sum);
    }
  }
  for (const auto& [key, sum] : sums) {
    WELLSPACE_RETURN_IF_ERROR(AddUsage(rows, sum));
  }
  return absl::OkStatus();
}

absl::Status AddUsage(RecordRows& rows, const store::v1::UsageRecord& usage) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::optional<store::v1::UsageRecord> before,
                             rows.FindUsage(usage.tenant(), usage.day()));
  store::v1::UsageRecord sum = usage;
  if (before.has_value()) {
    AddWork(*before, sum);
  }
  return rows.PutUsage(sum, sum.SerializeAsString());
}

}  // namespace wellspace::server
