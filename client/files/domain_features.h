// Domains of files as segments and faces for a server.
#ifndef WELLSPACE_CLIENT_FILES_DOMAIN_FEATURES_H_
#define WELLSPACE_CLIENT_FILES_DOMAIN_FEATURES_H_

#include <optional>
#include <string>
#include <vector>

#include "client/formats/domain/planar_domain.h"
#include "client/types.h"

namespace wellspace::client {

// The statements of the file on faces and segments. `faces`: which are meshed; none: as the file has it. Attributes of
// regions that are no whole numbers of 32 bits become regions by numbers of their own, which is added to `notes`.
// Crossings are refused.
//
// Complexity: O(n log n) for n segments and seeds.
// Errors:     none.
Features FeaturesOf(const formats::PlanarDomain& domain, const std::optional<FaceRule>& faces,
                    std::vector<std::string>& notes);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_FILES_DOMAIN_FEATURES_H_
