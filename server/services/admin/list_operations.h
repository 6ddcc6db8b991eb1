// The operations of all tenants, page by page.
#ifndef WELLSPACE_SERVER_SERVICES_ADMIN_LIST_OPERATIONS_H_
#define WELLSPACE_SERVER_SERVICES_ADMIN_LIST_OPERATIONS_H_

#include "absl/status/status.h"
#include "server/calls/call_environment.h"
#include "wellspace/v1/admin.pb.h"

namespace wellspace::server {

// Makes the page of `request`: of the records where several servers share them, else of the sessions here. May wait for
// the database.
//
// Complexity: O(sessions) without shared records; else a bounded number of rows, so that pages may have fewer than was
//             asked for.
// Errors:     INVALID_REQUEST, STORE_FAILED.
absl::Status ListAllOperations(const CallEnvironment& environment, const v1::ListAllOperationsRequest& request,
                               v1::ListAllOperationsResponse& response);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_ADMIN_LIST_OPERATIONS_H_
