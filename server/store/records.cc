#include "server/store/records.h"

#include "absl/strings/str_cat.h"

namespace wellspace::server {

std::vector<store::v1::PointsFile> PointsFilesOf(const store::v1::SessionRecord& record) {
  std::vector<store::v1::PointsFile> files(record.points_files().begin(), record.points_files().end());
  if (files.empty() && record.points() > 0) {
    files.emplace_back().set_number(record.points_file());
  }
  return files;
}

absl::Status AnsweredBefore(const std::string& request_id) {
  return absl::AlreadyExistsError(absl::StrCat("request ", request_id, " was answered before"));
}

absl::Status OwnedElsewhere(const std::string& session) {
  return absl::AbortedError(absl::StrCat(session, " has been taken over by another server"));
}

}  // namespace wellspace::server
