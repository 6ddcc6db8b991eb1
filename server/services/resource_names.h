// Finds sessions and operations by their names in requests.
#ifndef WELLSPACE_SERVER_SERVICES_RESOURCE_NAMES_H_
#define WELLSPACE_SERVER_SERVICES_RESOURCE_NAMES_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/calls/call_environment.h"
#include "server/security/authenticator.h"
#include "server/sessions/operation.h"
#include "server/sessions/session.h"

namespace wellspace::server {

// The session `name` of the caller's tenant, its lease renewed. `field` is where the request has the name.
//
// Errors:     INVALID_REQUEST, SESSION_NOT_FOUND.
absl::StatusOr<std::shared_ptr<Session>> FindSession(const CallEnvironment& environment, const Caller& caller,
                                                     const std::string& name, const std::string& field = "name");

struct FoundOperation {
  std::shared_ptr<Session> session;
  std::shared_ptr<Operation> operation;
};

// The same for an operation, of which the request has the name in `name`.
//
// Errors:     INVALID_REQUEST, SESSION_NOT_FOUND, OPERATION_NOT_FOUND.
absl::StatusOr<FoundOperation> FindOperation(const CallEnvironment& environment, const Caller& caller,
                                             const std::string& name);

// The same of any tenant's.
absl::StatusOr<FoundOperation> FindOperationOfAnyTenant(const CallEnvironment& environment, const std::string& name);

// The name of the session that `name`, of an operation, begins with; anything else as it is.
std::string SessionOf(const std::string& name);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_RESOURCE_NAMES_H_
