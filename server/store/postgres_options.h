// The address of a PostgreSQL database, and the name of this process there.
#ifndef WELLSPACE_SERVER_STORE_POSTGRES_OPTIONS_H_
#define WELLSPACE_SERVER_STORE_POSTGRES_OPTIONS_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

namespace wellspace::server {

struct PostgresOptions {
  std::string address;  // as libpq has it: postgresql://USER:PASSWORD@HOST:PORT/DATABASE
  std::string owner;    // the name of this process among those that share the database
  // How long it counts as living after it was last heard of.
  absl::Duration lease = absl::Seconds(15);
  // How long the outcome of a commit is asked for whose answer got lost.
  absl::Duration look_up_for = absl::Seconds(10);
};

// The address as it may be shown: postgresql://USER@HOST:PORT/DATABASE, without a password, and without what stands
// behind a question mark. What `address` leaves out is left out.
//
// Errors:     INVALID_ARGUMENT: libpq does not understand it. The message repeats nothing of it.
absl::StatusOr<std::string> ShownPostgresAddress(const std::string& address);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_POSTGRES_OPTIONS_H_
