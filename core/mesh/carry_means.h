// Carrying::kMeans, in a dimension that is known at compile time; for CarryField.
#ifndef WELLSPACE_CORE_MESH_CARRY_MEANS_H_
#define WELLSPACE_CORE_MESH_CARRY_MEANS_H_

#include "absl/status/statusor.h"
#include "core/mesh/carry_field.h"

namespace wellspace::core {

// As CarryField has it, of values that were checked. D is 2 or 3.
template <int D>
absl::StatusOr<CarriedField> CarryMeans(const Field& field, const MeshView& from, const MeshView& onto,
                                        const CarryRun& run);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_CARRY_MEANS_H_
