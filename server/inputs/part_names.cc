#include "server/inputs/part_names.h"

#include <string>

#include "server/wire/errors.h"

namespace wellspace::server {

core::PartNames NamesFromProto(const v1::PartNames& names) {
  return {.markers = {names.markers().begin(), names.markers().end()},
          .regions = {names.regions().begin(), names.regions().end()}};
}

v1::PartNames NamesToProto(const core::PartNames& names) {
  v1::PartNames message;
  message.mutable_markers()->insert(names.markers.begin(), names.markers.end());
  message.mutable_regions()->insert(names.regions.begin(), names.regions.end());
  return message;
}

absl::Status CheckNames(const v1::PartNames& names, v1::ErrorReason reason, const char* field) {
  const absl::Status status = core::CheckPartNames(NamesFromProto(names));
  return status.ok() ? status : MakeError(reason, std::string(status.message()), field);
}

}  // namespace wellspace::server
