// Names of parts as requests and records have them.
#ifndef WELLSPACE_SERVER_INPUTS_PART_NAMES_H_
#define WELLSPACE_SERVER_INPUTS_PART_NAMES_H_

#include "absl/status/status.h"
#include "core/features/part_names.h"
#include "wellspace/v1/errors.pb.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {

core::PartNames NamesFromProto(const v1::PartNames& names);
v1::PartNames NamesToProto(const core::PartNames& names);

// Errors:     those of core::CheckPartNames, with `reason` and `field`.
absl::Status CheckNames(const v1::PartNames& names, v1::ErrorReason reason, const char* field);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_INPUTS_PART_NAMES_H_
