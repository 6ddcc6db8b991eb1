// Early return on error. abseil 20220623 has no such macros of its own.
#ifndef WELLSPACE_CORE_BASE_STATUS_MACROS_H_
#define WELLSPACE_CORE_BASE_STATUS_MACROS_H_

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

// Returns from the calling function when `expression`, an absl::Status, is an error.
#define WELLSPACE_RETURN_IF_ERROR(expression)                                       \
  do {                                                                              \
    if (::absl::Status wellspace_status_ = (expression); !wellspace_status_.ok()) { \
      return wellspace_status_;                                                     \
    }                                                                               \
  } while (false)

#define WELLSPACE_CONCAT_INNER_(a, b) a##b
#define WELLSPACE_CONCAT_(a, b) WELLSPACE_CONCAT_INNER_(a, b)

// Assigns the value of `expression`, an absl::StatusOr, to `target`, or returns its error.
#define WELLSPACE_ASSIGN_OR_RETURN(target, expression) \
  WELLSPACE_ASSIGN_OR_RETURN_(WELLSPACE_CONCAT_(wellspace_statusor_, __LINE__), target, expression)
#define WELLSPACE_ASSIGN_OR_RETURN_(temporary, target, expression) \
  auto temporary = (expression);                                   \
  if (!temporary.ok()) {                                           \
    return std::move(temporary).status();                          \
  }                                                                \
  target = *std::move(temporary)

#endif  // WELLSPACE_CORE_BASE_STATUS_MACROS_H_
