#include "server/services/resource_names.h"

#include <algorithm>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/status_macros.h"
#include "server/sessions/session_registry.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Longer than any name that was ever given; errors repeat names.
constexpr size_t kMaxLength = 256;

// The parts of `name` between slashes; none if one of them is empty or all are too long.
std::vector<std::string> Parts(const std::string& name) {
  std::vector<std::string> parts;
  if (name.size() <= kMaxLength) {
    parts = absl::StrSplit(name, '/');
  }
  const bool has_empty = std::any_of(parts.begin(), parts.end(), [](const std::string& part) { return part.empty(); });
  return has_empty ? std::vector<std::string>() : parts;
}

absl::Status InvalidName(const std::string& name, const std::string& field, const char* accepted) {
  return MakeError(v1::ERROR_REASON_INVALID_REQUEST,
                   absl::StrCat(field, ": \"", absl::Utf8SafeCHexEscape(name.substr(0, kMaxLength)),
                                "\" is not accepted; expected ", accepted),
                   field);
}

// `find`: absl::StatusOr<std::shared_ptr<Session>> find(const std::string& session).
template <typename Find>
absl::StatusOr<FoundOperation> FindOperationBy(const std::string& name, const Find& find) {
  const std::vector<std::string> parts = Parts(name);
  if (parts.size() != 4 || parts[0] != "sessions" || parts[2] != "operations") {
    return InvalidName(name, "name", "sessions/{session}/operations/{operation}");
  }
  FoundOperation found;
  WELLSPACE_ASSIGN_OR_RETURN(found.session, find(absl::StrCat("sessions/", parts[1])));
  WELLSPACE_ASSIGN_OR_RETURN(found.operation, found.session->FindOperation(name));
  return found;
}

}  // namespace

absl::StatusOr<std::shared_ptr<Session>> FindSession(const CallEnvironment& environment, const Caller& caller,
                                                     const std::string& name, const std::string& field) {
  const std::vector<std::string> parts = Parts(name);
  if (parts.size() != 2 || parts[0] != "sessions") {
    return InvalidName(name, field, "sessions/{session}");
  }
  return environment.sessions.Find(caller.tenant, name);
}

absl::StatusOr<FoundOperation> FindOperation(const CallEnvironment& environment, const Caller& caller,
                                             const std::string& name) {
  return FindOperationBy(name,
                         [&](const std::string& session) { return environment.sessions.Find(caller.tenant, session); });
}

absl::StatusOr<FoundOperation> FindOperationOfAnyTenant(const CallEnvironment& environment, const std::string& name) {
  return FindOperationBy(name,
                         [&](const std::string& session) { return environment.sessions.FindOfAnyTenant(session); });
}

std::string SessionOf(const std::string& name) {
  const std::vector<std::string> parts = Parts(name);
  return parts.size() == 4 ? absl::StrCat(parts[0], "/", parts[1]) : name;
}

}  // namespace wellspace::server
